"""Rotations in space, SO(3): quaternions x, y, z, w and matrices, vectorised over all leading axes.

A rotation is kept as a unit quaternion (..., 4); q and -q are the same rotation. ``map_q_body`` turns body vectors into
map vectors, so that ``compose(map_q_body, body_q_camera)`` is ``map_q_camera``. The properties that hold for every
group, and are tested for it: ``exp(log(q)) = q``, ``compose(q, inverse(q)) = identity``, ``compose`` is associative,
``as_matrix`` turns products into products, and ``apply`` is ``as_matrix @ v``.

exp and log divide by the angle; below 1e-4 rad their Taylor series are used, whose error is under 1e-16 there.
"""

import numpy as np

from .angles import Array

_SMALL = 1e-4


def identity() -> Array:
    """Return the quaternion (4,) of no rotation."""
    return np.array([0.0, 0.0, 0.0, 1.0])


def normalize(q: Array) -> Array:
    """Return quaternions (..., 4) of length 1 with w >= 0.

    Raises:
        ValueError: a quaternion of length 0, or one that is not finite.
    """
    length = np.linalg.norm(q, axis=-1, keepdims=True)
    if not (np.isfinite(length).all() and (length > 0).all()):
        raise ValueError("a quaternion has no direction (length 0, or not finite)")
    return np.asarray(np.where(q[..., 3:] < 0, -q, q) / length, dtype=np.float64)


def compose(a: Array, b: Array) -> Array:
    """Return the product a b (..., 4): first b, then a."""
    ax, ay, az, aw = np.moveaxis(np.asarray(a), -1, 0)
    bx, by, bz, bw = np.moveaxis(np.asarray(b), -1, 0)
    return np.stack(
        [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ],
        axis=-1,
    )


def inverse(q: Array) -> Array:
    """Return the inverse rotation (..., 4) of unit quaternions."""
    return np.asarray(q * np.array([-1.0, -1.0, -1.0, 1.0]))


def apply(q: Array, v: Array) -> Array:
    """Turn vectors (..., 3) by unit quaternions (..., 4)."""
    q, v = np.asarray(q), np.asarray(v)
    t = 2.0 * np.cross(q[..., :3], v)
    return np.asarray(v + q[..., 3:] * t + np.cross(q[..., :3], t))


def exp(rotvec: Array) -> Array:
    """Return the quaternions (..., 4) of rotation vectors (..., 3): axis times angle [rad]."""
    rotvec = np.asarray(rotvec, dtype=np.float64)
    angle = np.linalg.norm(rotvec, axis=-1, keepdims=True)
    is_small = angle < _SMALL
    safe = np.where(is_small, 1.0, angle)
    # sin(a/2)/a = 1/2 - a^2/48 + O(a^4)
    factor = np.where(is_small, 0.5 - angle**2 / 48.0, np.sin(0.5 * safe) / safe)
    return np.concatenate([factor * rotvec, np.cos(0.5 * angle)], axis=-1)


def log(q: Array) -> Array:
    """Return the rotation vectors (..., 3) of unit quaternions, of length 0..pi [rad]."""
    q = np.asarray(q, dtype=np.float64)
    q = np.where(q[..., 3:] < 0, -q, q)
    sine = np.linalg.norm(q[..., :3], axis=-1, keepdims=True)
    is_small = sine < _SMALL
    safe = np.where(is_small, 1.0, sine)
    w = q[..., 3:]
    # a/sin(a/2) with s = sin(a/2): 2 asin(s)/s = 2 + s^2/3 + O(s^4); the second branch keeps its digits near pi.
    factor = np.where(is_small, 2.0 + sine**2 / 3.0, 2.0 * np.arctan2(safe, w) / safe)
    return np.asarray(factor * q[..., :3])


def angle(q: Array) -> Array:
    """Return the angles (...) of rotation of unit quaternions, 0..pi [rad]; exact also near 0 and near pi."""
    q = np.asarray(q, dtype=np.float64)
    return np.asarray(2.0 * np.arctan2(np.linalg.norm(q[..., :3], axis=-1), np.abs(q[..., 3])))


def as_matrix(q: Array) -> Array:
    """Return the rotation matrices (..., 3, 3) of quaternions of any length but 0."""
    q = np.asarray(q, dtype=np.float64)
    x, y, z, w = np.moveaxis(q, -1, 0)
    s = 2.0 / np.sum(q * q, axis=-1)
    rows = [
        [1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
        [s * (x * y + z * w), 1.0 - s * (x * x + z * z), s * (y * z - x * w)],
        [s * (x * z - y * w), s * (y * z + x * w), 1.0 - s * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def from_matrix(matrix: Array) -> Array:
    """Return the unit quaternions (..., 4), w >= 0, of rotation matrices (..., 3, 3).

    Of the four ways to divide, the one by the largest component is taken, so that no digits are lost.

    Source: S. W. Shepperd, "Quaternion from rotation matrix", Journal of Guidance and Control 1(3), 1978.
    """
    m = np.asarray(matrix, dtype=np.float64)
    m00, m11, m22 = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    yz, zx, xy = m[..., 2, 1], m[..., 0, 2], m[..., 1, 0]
    zy, xz, yx = m[..., 1, 2], m[..., 2, 0], m[..., 0, 1]
    # Row i is 4 q_i q: four parallel vectors.
    candidates = np.stack(
        [
            np.stack([1 + m00 - m11 - m22, xy + yx, zx + xz, yz - zy], axis=-1),
            np.stack([xy + yx, 1 - m00 + m11 - m22, yz + zy, zx - xz], axis=-1),
            np.stack([zx + xz, yz + zy, 1 - m00 - m11 + m22, xy - yx], axis=-1),
            np.stack([yz - zy, zx - xz, xy - yx, 1 + m00 + m11 + m22], axis=-1),
        ],
        axis=-2,
    )
    best = np.argmax(np.diagonal(candidates, axis1=-2, axis2=-1), axis=-1)
    return normalize(np.take_along_axis(candidates, best[..., None, None], axis=-2)[..., 0, :])
