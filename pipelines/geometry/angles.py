"""Angles on the circle: wrapping, and the mean and spread of directions."""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]


def wrap(angle: npt.ArrayLike) -> Array:
    """Bring angles into (-pi, pi].

    Args:
        angle: any shape [rad].

    Returns:
        The same angles [rad]; exact where they already lie in (-pi, pi].
    """
    a = np.asarray(angle, dtype=np.float64)
    inside = (a > -np.pi) & (a <= np.pi)
    if inside.all():
        return a.copy()
    return np.where(inside, a, np.pi - np.mod(np.pi - a, 2.0 * np.pi))


def difference(a: npt.ArrayLike, b: npt.ArrayLike) -> Array:
    """Return ``a - b`` [rad] the short way round, in (-pi, pi]."""
    return wrap(np.asarray(a, dtype=np.float64) - np.asarray(b, dtype=np.float64))


def circular_mean(angles: Array, weights: Array | None = None) -> float:
    """Return the direction of the mean of the unit vectors.

    Args:
        angles: (N,) [rad].
        weights: (N,) not negative, not all zero; equal if not given.

    Returns:
        Mean direction in (-pi, pi] [rad].
    """
    w = np.ones(len(angles)) if weights is None else weights
    return float(np.arctan2(w @ np.sin(angles), w @ np.cos(angles)))


def yaw_from_quaternion(q: Array) -> float:
    """Return the heading [rad] of a quaternion (4,) x, y, z, w of any length but zero."""
    x, y, z, w = (float(value) for value in q)
    return float(np.arctan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z))


def quaternion_from_yaw(yaw: float) -> Array:
    """Return the quaternion (4,) x, y, z, w with w >= 0 of a rotation by ``yaw`` [rad] about z."""
    half = 0.5 * float(wrap(yaw))
    return np.array([0.0, 0.0, np.sin(half), np.cos(half)])
