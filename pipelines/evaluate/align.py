"""The motion that lays an estimate onto its reference, from pairs of positions.

``se2`` (turn about z, shift in x and y), ``se3`` and ``sim3`` (also a scale) minimise the sum of squared distances in
closed form; ``origin`` lays the first pose onto the first pose.

Source: S. Umeyama, "Least-squares estimation of transformation parameters between two point patterns", IEEE
Transactions on Pattern Analysis and Machine Intelligence 13(4), 1991, eqs. (34) to (43).
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..geometry.angles import Array
from .associate import Track

Method = Literal["none", "origin", "se2", "se3", "sim3"]


@dataclass(frozen=True, slots=True)
class Alignment:
    """Maps p to scale * rotation p + translation.

    Attributes:
        rotation: (3, 3).
        translation: (3,) [m].
        scale: positive.
    """

    rotation: Array
    translation: Array
    scale: float = 1.0

    def apply(self, track: Track) -> Track:
        """Return the moved trajectory; covariances are left out, they would have to be moved too."""
        positions = self.scale * (track.positions @ self.rotation.T) + self.translation
        return Track(track.stamps, positions, self.rotation @ track.rotations)


def align(reference: Track, estimate: Track, method: Method) -> Alignment:
    """Return the motion of ``estimate`` onto ``reference``, both of the same length >= 1.

    Raises:
        ValueError: the positions do not fix the motion: too few, or all in one point or on one line.
    """
    if method == "none":
        return Alignment(np.eye(3), np.zeros(3))
    if method == "origin":
        rotation = reference.rotations[0] @ estimate.rotations[0].T
        return Alignment(rotation, reference.positions[0] - rotation @ estimate.positions[0])
    if method == "se2":
        planar = umeyama(estimate.positions[:, :2], reference.positions[:, :2], with_scale=False)
        rotation, translation = np.eye(3), np.zeros(3)
        rotation[:2, :2], translation[:2] = planar.rotation, planar.translation
        return Alignment(rotation, translation)
    return umeyama(estimate.positions, reference.positions, with_scale=method == "sim3")


def umeyama(x: Array, y: Array, *, with_scale: bool) -> Alignment:
    """Return the similarity from points x to points y, both (N, m), m = 2 or 3, in the least squares sense.

    Raises:
        ValueError: the points do not fix it.
    """
    n, m = x.shape
    mean_x, mean_y = x.mean(axis=0), y.mean(axis=0)  # eqs. (34), (35)
    variance_x = np.sum((x - mean_x) ** 2) / n  # eq. (36)
    covariance = (y - mean_y).T @ (x - mean_x) / n  # eq. (38)
    u, d, vt = np.linalg.svd(covariance)
    if np.count_nonzero(d > np.finfo(np.float64).eps * max(d[0], 1.0)) < m - 1:
        raise ValueError(f"{n} poses do not fix an alignment (too few, or on one line)")
    s = np.ones(m)
    if np.linalg.det(u) * np.linalg.det(vt) < 0:
        s[-1] = -1.0  # eq. (43)
    rotation = u @ np.diag(s) @ vt  # eq. (40)
    scale = float(d @ s / variance_x) if with_scale else 1.0  # eq. (42)
    return Alignment(rotation, mean_y - scale * rotation @ mean_x, scale)  # eq. (41)
