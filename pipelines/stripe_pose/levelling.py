"""Tilt and roll of a camera taken out of its rays, and how vertical lines slope when they are left in.

In the camera frame x points right, y ahead along the optical axis, z up; the level frame has the same azimuth, and z
vertical. With tilt t (the optical axis above the horizon) and roll r (about the optical axis)::

    Q = R_y(-r) R_x(-t),     V_camera = Q V_level,     l = Q' (x, 1, z)',     u = l_x / l_y               (1)

for a ray (x, 1, z): the bearing u of any point of a vertical line is the same, on whatever row it is seen. All points
of one line fulfil (q_x - u q_y) . (x, 1, z) = 0 with the columns q_x, q_y of Q, so in the image it runs as ::

    x = -(n_y + n_z z) / n_x,        n = q_x - u q_y                                                      (2)

and its slope -n_z / n_x tells of tilt and roll: what a level camera would see upright, a rolled one sees leaning, and a
tilted one sees leaning the more, the further it is from the middle.

The paper's own model (its eq. (6), ``tilt_model: paper``) turns the mark instead of the camera: a level camera looks at
a mark that leans about its own X axis. The two agree only where sin phi = 0.

Source: the stripe paper, eqs. (6) and (10); the levelling of a camera on a pan-tilt head is not in the paper.
"""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from .pose import homography

Array: TypeAlias = npt.NDArray[np.float64]

MAX_ANGLE = np.radians(45.0)
"""A camera that is tilted or rolled by more does not look at a wall."""


def levelling_matrix(tilt: float, roll: float) -> Array:
    """Return Q (3, 3) of eq. (1), which maps the level frame to the camera frame [rad]."""
    ct, st, cr, sr = np.cos(tilt), np.sin(tilt), np.cos(roll), np.sin(roll)
    turn = np.array([[cr, 0.0, -sr], [0.0, 1.0, 0.0], [sr, 0.0, cr]])
    lean = np.array([[1.0, 0.0, 0.0], [0.0, ct, st], [0.0, -st, ct]])
    return np.asarray(turn @ lean)


def level_bearings(rays: Array, tilt: float, roll: float) -> Array:
    """Return the level bearings u (...) of rays (..., 2) x, z in the camera frame (y = 1), by eq. (1)."""
    Q = levelling_matrix(tilt, roll)
    level = rays[..., 0:1] * Q[0] + Q[1] + rays[..., 1:2] * Q[2]
    return np.asarray(level[..., 0] / level[..., 1])


def line_of_bearing(u: Array, tilt: float, roll: float, z: float = 0.0) -> tuple[Array, Array]:
    """Return x (n,) at height ``z`` of the image and dx/dz (n,) of vertical lines at bearings u (n,), by eq. (2)."""
    Q = levelling_matrix(tilt, roll)
    n = Q[:, 0] - u[:, None] * Q[:, 1]
    slope = -n[:, 2] / n[:, 0]
    return -n[:, 1] / n[:, 0] + slope * z, slope


def leaning_pose(X: Array, u: Array, phi_x: float, phi_y: float) -> Array:
    """Return phi_z, D_x, D_y, D_z of the paper's model (6) for three or more lines on the middle row."""
    abc = homography(X, u)
    sx, cx, sy, cy = np.sin(phi_x), np.cos(phi_x), np.sin(phi_y), np.cos(phi_y)
    rho = np.hypot(cx, sx * sy)
    phi = np.arctan2(sx * sy, cx) + np.arctan2(abc[1], abc[0])
    r = rho / np.hypot(abc[0], abc[1])
    p = abc[2] * r
    s, c = np.sin(phi), np.cos(phi)
    B = cx * sy * c + sx * s
    C = cx * sy * s - sx * c
    dz = -(B * p + C * r)
    return np.array([phi, (p + B * dz) / (cx * cy), (r + C * dz) / (cx * cy), dz])
