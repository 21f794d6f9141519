"""Rigid motions in space, SE(3): a translation and a quaternion, vectorised over all leading axes.

A pose is a pair ``(t, q)``: t (..., 3) [m] and q (..., 4) unit quaternion x, y, z, w. ``map_T_body`` maps body
coordinates to map coordinates, ``p_map = q p_body + t``, so that ``compose(map_T_body, body_T_camera)`` is
``map_T_camera``. Tangent vectors are (..., 6): rho [m] first, then the rotation vector phi [rad].

exp is ``(V(phi) rho, exp(phi))`` with V = I + (1 - cos a)/a^2 [phi]x + (a - sin a)/a^3 [phi]x^2, a = |phi|; below
0.01 rad the Taylor series of the three factors are used, whose error is under 1e-16 there.

Source: J. Sola, J. Deray, D. Atchuthan, "A micro Lie theory for state estimation in robotics", 2018, appendix D.
"""

from typing import TypeAlias

import numpy as np

from . import so3
from .angles import Array

SE3: TypeAlias = tuple[Array, Array]

_SMALL = 1e-2


def identity() -> SE3:
    """Return the motion that moves nothing."""
    return np.zeros(3), so3.identity()


def compose(a: SE3, b: SE3) -> SE3:
    """Return the product a b: first b, then a."""
    return np.asarray(a[0] + so3.apply(a[1], b[0])), so3.compose(a[1], b[1])


def inverse(a: SE3) -> SE3:
    """Return the inverse motion."""
    q = so3.inverse(a[1])
    return -so3.apply(q, a[0]), q


def between(a: SE3, b: SE3) -> SE3:
    """Return ``a^-1 b``: b as it is seen from a."""
    return compose(inverse(a), b)


def apply(a: SE3, points: Array) -> Array:
    """Map points (..., 3)."""
    return np.asarray(so3.apply(a[1], points) + a[0])


def exp(tangent: Array) -> SE3:
    """Return the motions of tangent vectors (..., 6)."""
    tangent = np.asarray(tangent, dtype=np.float64)
    rho, phi = tangent[..., :3], tangent[..., 3:]
    a2 = np.sum(phi * phi, axis=-1, keepdims=True)
    a = np.sqrt(a2)
    is_small = a < _SMALL
    safe = np.where(is_small, 1.0, a)
    first = np.where(is_small, 0.5 - a2 / 24 + a2**2 / 720 - a2**3 / 40320, 2.0 * (np.sin(0.5 * safe) / safe) ** 2)
    second = np.where(is_small, 1 / 6 - a2 / 120 + a2**2 / 5040 - a2**3 / 362880, (safe - np.sin(safe)) / safe**3)
    turned = np.cross(phi, rho)
    return np.asarray(rho + first * turned + second * np.cross(phi, turned)), so3.exp(phi)


def log(a: SE3) -> Array:
    """Return the tangent vectors (..., 6) of motions, their rotation part of length 0..pi."""
    phi = so3.log(a[1])
    a2 = np.sum(phi * phi, axis=-1, keepdims=True)
    angle = np.sqrt(a2)
    is_small = angle < _SMALL
    safe = np.where(is_small, 1.0, angle)
    # V^-1 = I - [phi]x / 2 + (1 - (a/2) cot(a/2)) / a^2 [phi]x^2
    half = 0.5 * safe
    factor = np.where(is_small, 1 / 12 + a2 / 720 + a2**2 / 30240, (1.0 - half * np.cos(half) / np.sin(half)) / safe**2)
    turned = np.cross(phi, a[0])
    rho = a[0] - 0.5 * turned + factor * np.cross(phi, turned)
    return np.concatenate([rho, phi], axis=-1)


def as_matrix(a: SE3) -> Array:
    """Return the homogeneous matrices (..., 4, 4)."""
    t, q = np.asarray(a[0]), np.asarray(a[1])
    matrix: Array = np.zeros((*np.broadcast_shapes(t.shape[:-1], q.shape[:-1]), 4, 4))
    matrix[..., :3, :3] = so3.as_matrix(q)
    matrix[..., :3, 3] = t
    matrix[..., 3, 3] = 1.0
    return matrix


def from_matrix(matrix: Array) -> SE3:
    """Return the motions of homogeneous matrices (..., 4, 4)."""
    matrix = np.asarray(matrix, dtype=np.float64)
    return matrix[..., :3, 3], so3.from_matrix(matrix[..., :3, :3])
