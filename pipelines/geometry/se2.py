"""Poses in the plane as arrays (..., 3) of x [m], y [m], heading [rad]; every function works on whole batches.

``compose(map_T_a, a_T_b)`` is ``map_T_b``. Headings of results lie in (-pi, pi]. ``exp`` maps a constant
twist (v_x, v_y, omega) times one second to the pose reached; ``log`` is its inverse. ``adjoint`` moves a
small right-hand error through a pose: ``exp(xi) @ T == T @ exp(adjoint(inverse(T)) xi)``.
"""

import numpy as np
import numpy.typing as npt

from .angles import Array, wrap

_SMALL = 1e-4
"""Below this heading [rad] the Taylor terms kept here are exact to double precision."""


def _pose(x: Array, y: Array, heading: Array) -> Array:
    """Return (..., 3) of three arrays of one shape."""
    pose = np.empty((*np.shape(x), 3))
    pose[..., 0], pose[..., 1], pose[..., 2] = x, y, wrap(heading)
    return pose


def identity() -> Array:
    """Return the pose that moves nothing."""
    return np.zeros(3)


def compose(a: Array, b: Array) -> Array:
    """Return ``a @ b``: the pose ``b``, given in the frame ``a``, in the frame in which ``a`` is given."""
    c, s = np.cos(a[..., 2]), np.sin(a[..., 2])
    x = a[..., 0] + c * b[..., 0] - s * b[..., 1]
    y = a[..., 1] + s * b[..., 0] + c * b[..., 1]
    return _pose(x, y, a[..., 2] + b[..., 2])


def inverse(a: Array) -> Array:
    """Return the pose that undoes ``a``."""
    c, s = np.cos(a[..., 2]), np.sin(a[..., 2])
    x = -c * a[..., 0] - s * a[..., 1]
    y = s * a[..., 0] - c * a[..., 1]
    return _pose(x, y, -a[..., 2])


def between(a: Array, b: Array) -> Array:
    """Return ``inverse(a) @ b``: the pose ``b`` as seen from ``a``."""
    return compose(inverse(a), b)


def transform(a: Array, points: Array) -> Array:
    """Map points (..., 2) from the frame ``a`` (..., 3) into the frame in which ``a`` is given."""
    c, s = np.cos(a[..., 2]), np.sin(a[..., 2])
    x = a[..., 0] + c * points[..., 0] - s * points[..., 1]
    y = a[..., 1] + s * points[..., 0] + c * points[..., 1]
    return np.stack([x, y], axis=-1)


def _sinc_and_versine(w: Array) -> tuple[Array, Array]:
    """Return sin(w)/w and (1 - cos(w))/w, by their series near zero."""
    small = np.abs(w) < _SMALL
    safe = np.where(small, 1.0, w)
    sinc = np.where(small, 1.0 - w * w / 6.0, np.sin(safe) / safe)
    versine = np.where(small, 0.5 * w - w**3 / 24.0, (1.0 - np.cos(safe)) / safe)
    return sinc, versine


def exp(xi: Array) -> Array:
    """Return the pose reached by the constant twist ``xi`` (..., 3) [m, m, rad] in unit time."""
    a, b = _sinc_and_versine(xi[..., 2])
    x = a * xi[..., 0] - b * xi[..., 1]
    y = b * xi[..., 0] + a * xi[..., 1]
    return _pose(x, y, xi[..., 2])


def log(pose: Array) -> Array:
    """Return the constant twist (..., 3) that reaches ``pose`` in unit time, turning by less than pi."""
    w = wrap(pose[..., 2])
    a, b = _sinc_and_versine(w)
    d = a * a + b * b
    x = (a * pose[..., 0] + b * pose[..., 1]) / d
    y = (-b * pose[..., 0] + a * pose[..., 1]) / d
    return np.stack([x, y, w], axis=-1)


def adjoint(pose: Array) -> Array:
    """Return the (3, 3) matrix with ``T @ exp(xi) == exp(adjoint(T) xi) @ T`` for one pose (3,)."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return np.array([[c, -s, pose[1]], [s, c, -pose[0]], [0.0, 0.0, 1.0]])


def rotation(heading: npt.ArrayLike) -> Array:
    """Return the (..., 2, 2) matrix that turns vectors by ``heading`` [rad]."""
    c, s = np.cos(heading), np.sin(heading)
    return np.stack([np.stack([c, -s], axis=-1), np.stack([s, c], axis=-1)], axis=-2)


def in_map(heading: npt.ArrayLike) -> Array:
    """Return the matrices (..., 3, 3) that turn errors of poses from the robot's frame into the map."""
    turn = np.zeros((*np.shape(heading), 3, 3))
    turn[..., :2, :2] = rotation(heading)
    turn[..., 2, 2] = 1.0
    return turn
