"""Where the robot is, from where it sees a mark: the paper's eq. (1) in the plane.

With the mark's map pose (x_M, y_M, psi), psi the direction of its X axis, the pose (phi, D_x, D_y) that the camera has
of it, and the camera's place (c_x, c_y) and pan on the robot::

    theta = psi - phi - pan + 90 deg                                                       (1)
    lens  = (x_M, y_M) - R(psi - phi) (D_x, D_y)                                           (2)
    robot = lens - R(theta) ((c_x, c_y) + L (dt, dr))                                      (3)

The paper's robot stands level. One that a floor tilts leans about the place where it stands, and its lens, at height h,
moves: half a degree at half a metre is 4 mm, more than the mark's own error. The lines say how much the camera is
tilted and rolled beyond its mount (dt, dr), so L = h (-ahead, right) takes that out, with ahead and right of the
camera in the frame of the robot.
"""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]


def robot_pose(mark: Array, pose: Array, mount: Array, leaning: Array) -> Array:
    """Return x, y, heading of the robot (3,) [m, m, rad], heading in (-pi, pi].

    Args:
        mark: (3,) x, y, direction of the X axis of the mark in the map [m, m, rad].
        pose: (3,) phi, D_x, D_y [rad, m, m].
        mount: x, y, height, pan of the camera on the robot, pan counter-clockwise from ahead [m, m, m, rad], and
            whatever else.
        leaning: (2,) how much the camera is tilted and rolled beyond its mount [rad].
    """
    heading = mark[2] - pose[0] - mount[3] + 0.5 * np.pi
    lens = mark[:2] - _turn(mark[2] - pose[0]) @ pose[1:3]
    robot = lens - _turn(heading) @ (mount[:2] + _lever(mount) @ leaning)
    return np.array([robot[0], robot[1], np.pi - (np.pi - heading) % (2.0 * np.pi)])


def robot_covariance(mark: Array, pose: Array, mount: Array, leaning: Array, cov: Array) -> Array:
    """Return the covariance (3, 3) of ``robot_pose`` from that (5, 5) of phi, D_x, D_y, tilt and roll."""
    across = mark[2] - pose[0]
    heading = across - mount[3] + 0.5 * np.pi
    J = np.zeros((3, 5))
    # Both turns grow with psi - phi, so their derivative by phi is the negative one by angle.
    J[:2, 0] = _turn_rate(across) @ pose[1:3] + _turn_rate(heading) @ (mount[:2] + _lever(mount) @ leaning)
    J[:2, 1:3] = -_turn(across)
    J[:2, 3:] = -_turn(heading) @ _lever(mount)
    J[2, 0] = -1.0
    return J @ cov @ J.T


def without_height(mount: Array) -> Array:
    """Return a mount whose lens a leaning robot does not move."""
    return np.asarray(mount * np.array([1.0, 1.0, 0.0, 1.0, 1.0, 1.0]))


def _lever(mount: Array) -> Array:
    """Return how the lens moves on the robot (2, 2) [m/rad] as the robot leans back and to the right under it."""
    c, s = np.cos(mount[3]), np.sin(mount[3])
    return np.asarray(mount[2] * np.array([[-c, s], [-s, -c]]))


def _turn(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def _turn_rate(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[-s, -c], [c, -s]])
