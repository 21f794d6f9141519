"""The pose of a camera from vertical lines that cross one image row, in closed form.

A point at abscissa X of the mark stands at (cos phi X + D_x, sin phi X + D_y) in the level camera frame, to the right
and ahead. A vertical line through it is seen at the bearing u, right over ahead, whatever its height::

    u = (cos phi X + D_x) / (sin phi X + D_y) = (a X + c) / (b X + 1)                      (1)
    a X - b u X + c = u,        (a, b, c) = (cos phi, sin phi, D_x) / D_y                  (2)
    phi = atan2(b, a),   D_y = 1 / hypot(a, b),   D_x = c D_y                              (3)

(1) is a projectivity between two lines; three lines fix its three numbers, and more are fitted. (2) is linear and has
no singular point: neither phi = 0 nor a line on the optical axis is special, as they are in the paper's own forms
(``paper.py``), which give the same numbers elsewhere. It degenerates when two lines coincide in the image, that is when
the mark is edge-on or far away. The mark is ahead if b X + 1 > 0 on all lines, and seen from its front if a - b c > 0.

Source: J. Kim and H. S. Cho, fast algorithm for location determination of a mobile robot from vertical lines, ca. 1991,
section II.B, eqs. (9) to (18), solved without their divisions by X_p1 and X_m1.
"""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]

PHI, DX, DY, TILT, ROLL, DZ = range(6)
"""Where the unknowns of a mark's pose stand among its values."""
MAX_CONDITION = 1e8
"""Above this condition number of the scaled system (2) its solution is not to be trusted."""


def bearings(pose: Array, X: Array) -> Array:
    """Return the bearings (..., n) of lines, by eq. (1).

    Args:
        pose: (..., 3) phi, D_x, D_y [rad, m, m].
        X: (n,) abscissae on the mark [m].
    """
    phi, dx, dy = pose[..., 0:1], pose[..., 1:2], pose[..., 2:3]
    return np.asarray((np.cos(phi) * X + dx) / (np.sin(phi) * X + dy))


def bearing_jacobian(pose: Array, X: Array) -> Array:
    """Return d(u)/d(phi, D_x, D_y), (n, 3), of one pose (3,) and lines (n,)."""
    c, s = np.cos(pose[0]), np.sin(pose[0])
    right, ahead = c * X + pose[1], s * X + pose[2]
    J = np.empty((len(X), 3))
    J[:, 0] = (-s * X * ahead - c * X * right) / ahead**2
    J[:, 1] = 1.0 / ahead
    J[:, 2] = -right / ahead**2
    return J


def homography(X: Array, u: Array) -> Array:
    """Solve eq. (2) for (a, b, c), exactly for three lines and by linear least squares for more.

    Args:
        X: (n,) abscissae on the mark, distinct, n >= 3 [m].
        u: (..., n) bearings.

    Returns:
        (..., 3): a [1/m], b [1/m], c; infinite or nan where lines coincide.

    Raises:
        ValueError: fewer than three lines.
    """
    A, scale = _system(X, u)
    if len(X) == 3:
        solution = _cramer(A, u)
    else:
        q, r = np.linalg.qr(A)
        solution = np.linalg.solve(r, np.swapaxes(q, -1, -2) @ u[..., None])[..., 0]
    return np.asarray(solution / np.array([scale, scale, 1.0]))


def condition(X: Array, u: Array) -> float:
    """Return the condition number of system (2) with X scaled to [-1, 1]; large means a degenerate view."""
    A, _ = _system(X, u)
    return float(np.linalg.cond(A))


def pose_of(abc: Array) -> Array:
    """Return the pose (..., 3) of a projectivity (..., 3), by eq. (3)."""
    a, b, c = abc[..., 0], abc[..., 1], abc[..., 2]
    dy = 1.0 / np.hypot(a, b)
    return np.stack([np.arctan2(b, a), c * dy, dy], axis=-1)


def level_pose(X: Array, u: Array) -> Array:
    """Return the pose (..., 3) phi, D_x, D_y [rad, m, m] of a mark from level bearings; see ``homography``."""
    return pose_of(homography(X, u))


def is_ahead(pose: Array, X: Array) -> npt.NDArray[np.bool_]:
    """Tell whether all lines lie ahead of the lens, (...)."""
    return np.asarray(np.all(np.sin(pose[..., 0:1]) * X + pose[..., 2:3] > 0, axis=-1))


def plane_distance(pose: Array) -> Array:
    """Return the distance of the lens from the mark's plane [m]; negative behind it, zero edge-on."""
    return np.asarray(pose[..., 2] * np.cos(pose[..., 0]) - pose[..., 1] * np.sin(pose[..., 0]))


def pose_covariance(pose: Array, X: Array, sigma_u: float | Array) -> Array:
    """Return the covariance (3, 3) of a pose whose bearings have independent errors: the Cramer-Rao bound.

    Args:
        pose: (3,).
        X: (n,) abscissae [m].
        sigma_u: standard deviation of the bearings, one or (n,): that of the columns over the focal length.
    """
    J = bearing_jacobian(pose, X) / np.broadcast_to(np.asarray(sigma_u, dtype=np.float64), (len(X),))[:, None]
    # Columns differ by orders of magnitude: scaled first, the normal equations keep their digits.
    scale = np.linalg.norm(J, axis=0)
    return np.asarray(np.linalg.inv((J / scale).T @ (J / scale)) / np.outer(scale, scale))


def _system(X: Array, u: Array) -> tuple[Array, float]:
    """Return the matrix (..., n, 3) of eq. (2) for X / scale, and the scale [m]."""
    if len(X) < 3:
        raise ValueError(f"{len(X)} lines; a pose needs at least three")
    scale = float(np.max(np.abs(X)))
    x = np.broadcast_to(X / scale, np.shape(u))
    return np.stack([x, -u * x, np.ones_like(x)], axis=-1), scale


def _cramer(A: Array, u: Array) -> Array:
    """Solve the 3 x 3 systems by differences of their rows: no division by a line's own place."""
    first, second = A[..., 1, :] - A[..., 0, :], A[..., 2, :] - A[..., 0, :]
    p, q = u[..., 1] - u[..., 0], u[..., 2] - u[..., 0]
    det = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        a = (p * second[..., 1] - q * first[..., 1]) / det
        b = (first[..., 0] * q - second[..., 0] * p) / det
    return np.stack([a, b, u[..., 0] - A[..., 0, 0] * a - A[..., 0, 1] * b], axis=-1)
