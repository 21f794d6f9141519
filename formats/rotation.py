"""Rotation matrices of files to quaternions and back; the algebra of rotations is ``pipelines/geometry``."""

import numpy as np

from .events import Array


def quaternion_from_rotation(matrix: Array) -> Array:
    """Return the quaternion (4,) x, y, z, w, qw >= 0, of a rotation matrix (3, 3).

    The dominant eigenvector of a symmetric 4 x 4 matrix: for a matrix that is slightly off a rotation
    (printed with few digits) the nearest rotation in the least squares sense.

    Source: I. Y. Bar-Itzhack, "New method for extracting the quaternion from a rotation matrix", Journal of
    Guidance, Control and Dynamics 23(6), 2000.
    """
    m = matrix
    k = np.array(
        [
            [m[0, 0] - m[1, 1] - m[2, 2], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0], m[2, 1] - m[1, 2]],
            [m[0, 1] + m[1, 0], m[1, 1] - m[0, 0] - m[2, 2], m[1, 2] + m[2, 1], m[0, 2] - m[2, 0]],
            [m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], m[2, 2] - m[0, 0] - m[1, 1], m[1, 0] - m[0, 1]],
            [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], m[0, 0] + m[1, 1] + m[2, 2]],
        ]
    )
    q: Array = np.linalg.eigh(k)[1][:, 3]
    return -q if q[3] < 0 else q


def rotation_from_quaternion(quaternion: Array) -> Array:
    """Return the rotation matrix (3, 3) of a quaternion (4,) x, y, z, w of any length but 0."""
    x, y, z, w = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
