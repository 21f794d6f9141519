"""How sensors stand on the robot (x ahead, y left, z up), and what their attitude is in a level frame.

The optical frame of a camera has x to the right, y down, z along the view. Tilt is the angle of the optical axis above
the horizon, roll the turn about it, clockwise as seen from behind.
"""

import numpy as np

from .angles import Array
from .so3 import as_matrix

AHEAD = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Optical frame of a camera that looks straight ahead, on the robot."""

UP = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""Optical frame of a camera that looks up, the top of its image forward, on the robot."""

OPTICAL = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Camera frame (right, ahead, up) from optical frame (right, down, ahead)."""


def upward(yaw: float) -> Array:
    """Return the optical frame (3, 3) of an upward camera turned by ``yaw`` [rad] about the robot's z."""
    c, s = np.cos(yaw), np.sin(yaw)
    return np.asarray(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ UP)


def pan_tilt_roll(level_R_optical: Array) -> tuple[float, float, float]:
    """Return pan, tilt and roll [rad] of a camera from its optical frame in a level frame (x ahead, y left, z up).

    Pan is counter-clockwise from x; 0, 0, 0 looks along x with the image top up.
    """
    R = level_R_optical @ OPTICAL.T  # V_level = Rz(pan - 90 deg) Q' V_camera, Q = R_y(-roll) R_x(-tilt)
    ahead = R[:, 1]
    pan = float(np.arctan2(ahead[1], ahead[0]))
    tilt = float(np.arcsin(np.clip(ahead[2], -1.0, 1.0)))
    # The last row of Rz Q' is that of Q': (-sin r cos t, sin t, cos r cos t).
    roll = float(np.arctan2(-R[2, 0], R[2, 2]))
    return pan, tilt, roll


def robot_tilt(orientation: Array, mount: Array | None) -> Array:
    """Return the robot's rotation against a level one of the same heading, (3, 3).

    Args:
        orientation: (4,) of the inertial unit in the world.
        mount: (4,) of the unit on the robot; straight if None.
    """
    world_R_robot = as_matrix(orientation)
    if mount is not None:
        world_R_robot = world_R_robot @ as_matrix(mount).T
    heading = np.arctan2(world_R_robot[1, 0], world_R_robot[0, 0])
    c, s = np.cos(heading), np.sin(heading)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ world_R_robot
