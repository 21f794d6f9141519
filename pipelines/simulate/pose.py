"""Where something is in space, as rotation and origin, and where a sensor sits on the robot."""

from dataclasses import dataclass

import numpy as np

from ...formats.events import Array, Mount
from ..engine.params import Field, Params


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A pose of something in the world: maps its coordinates to the world's.

    Attributes:
        rotation: (3, 3) world_R_body.
        position: (3,) its origin in the world [m].
    """

    rotation: Array
    position: Array

    def __matmul__(self, other: "View") -> "View":
        """Chain two poses: ``world_T_body @ body_T_sensor``."""
        return View(self.rotation @ other.rotation, self.rotation @ other.position + self.position)


def rpy(roll: float, pitch: float, yaw: float) -> Array:
    """Return the rotation ``Rz(yaw) Ry(pitch) Rx(roll)``, (3, 3) [rad]."""
    cr, sr, cp, sp = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch)
    cy, sy = np.cos(yaw), np.sin(yaw)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def quaternion(rotation: Array) -> Array:
    """Return the quaternion x, y, z, w (w >= 0) of a rotation matrix (3, 3), by its largest component."""
    r = rotation
    four = np.array(
        [
            [r[2, 1] - r[1, 2], 1 + r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]],
            [r[0, 2] - r[2, 0], r[0, 1] + r[1, 0], 1 - r[0, 0] + r[1, 1] - r[2, 2], r[1, 2] + r[2, 1]],
            [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], 1 - r[0, 0] - r[1, 1] + r[2, 2]],
            [1 + np.trace(r), r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
        ]
    ).T  # row k is 4 q_k (w, x, y, z)[k] times (x, y, z, w)
    best = four[int(np.argmax(np.linalg.norm(four, axis=1)))]
    return np.asarray(best / np.copysign(np.linalg.norm(best), best[3]))


def place(view: View) -> Mount:
    """Return base_T_sensor as the log tells it."""
    return Mount(translation=view.position, rotation=quaternion(view.rotation))


class MountParams(Params):
    """Where a sensor sits on the robot (``base_link``: on the floor, x forward, y left, z up)."""

    x_m: float = Field(0.0, description="forward of the robot's centre [m]")
    y_m: float = Field(0.0, description="left of the robot's centre [m]")
    z_m: float = Field(0.0, ge=0, description="above the floor [m]")
    roll_deg: float = Field(0.0, ge=-180, le=180, description="turn about the robot's x axis [deg]")
    pitch_deg: float = Field(0.0, ge=-90, le=90, description="turn about the robot's y axis [deg]")
    yaw_deg: float = Field(0.0, ge=-180, le=180, description="turn about the robot's z axis [deg]")

    @property
    def view(self) -> View:
        """base_T_sensor."""
        turn = rpy(np.radians(self.roll_deg), np.radians(self.pitch_deg), np.radians(self.yaw_deg))
        return View(turn, np.array([self.x_m, self.y_m, self.z_m]))
