"""Absolute and relative errors of paired trajectories, and their statistics.

Absolute (ATE): the distance of the positions, and the angle of R_ref^T R_est, pose by pose.

Relative (RPE): with Q the reference, P the estimate, and pairs of poses (i, j) one step apart ::

    E = (Q_i^-1 Q_j)^-1 (P_i^-1 P_j)

the length of its translation and the angle of its rotation. The step is a number of frames, or metres of the path of
the estimate; the pairs follow one another without overlap, as evo pairs them.

Source: J. Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012.
Differs from it in: the statistics of the rotation are given too, in radians.
"""

import re
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..geometry import so3
from ..geometry.angles import Array
from .associate import Track

Indices = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Delta:
    """The step of a relative error.

    Attributes:
        value: number of frames, or metres of path.
        is_metres: which of them.
    """

    value: float
    is_metres: bool

    @classmethod
    def parse(cls, text: str) -> "Delta":
        """Read ``1f`` (frames) or ``10m`` (metres).

        Raises:
            ValueError: it is neither, or not positive.
        """
        match = re.fullmatch(r"\s*([0-9]+(?:\.[0-9]*)?|\.[0-9]+)\s*(f|m)\s*", text)
        if match is None or float(match[1]) <= 0 or (match[2] == "f" and not float(match[1]).is_integer()):
            raise ValueError(f"the step {text!r} is neither frames, like '1f', nor metres, like '10m'")
        return cls(float(match[1]), match[2] == "m")


def translation_errors(reference: Track, estimate: Track) -> Array:
    """Return the distances (N,) of paired positions [m]."""
    return np.asarray(np.linalg.norm(estimate.positions - reference.positions, axis=1))


def rotation_errors(reference: Track, estimate: Track) -> Array:
    """Return the angles (N,) between paired orientations, 0..pi [rad]."""
    return _angle(np.swapaxes(reference.rotations, 1, 2) @ estimate.rotations)


def relative_errors(reference: Track, estimate: Track, delta: Delta) -> tuple[Array, Array]:
    """Return translations (M,) [m] and angles (M,) [rad] of the relative error; M is 0 if no step fits."""
    i, j = steps(estimate, delta)
    ref_t, ref_R = _relative(reference, i, j)
    est_t, est_R = _relative(estimate, i, j)
    back = np.swapaxes(ref_R, 1, 2)
    translation = np.einsum("nij,nj->ni", back, est_t - ref_t)
    return np.asarray(np.linalg.norm(translation, axis=1)), _angle(back @ est_R)


def steps(track: Track, delta: Delta) -> tuple[Indices, Indices]:
    """Return the first and last indices of consecutive steps along a trajectory."""
    if not delta.is_metres:
        ends = np.arange(0, len(track.stamps), int(delta.value))
        return ends[:-1], ends[1:]
    lengths = np.linalg.norm(np.diff(track.positions, axis=0), axis=1).tolist()
    found, path = [0], 0.0
    for k, length in enumerate(lengths, 1):
        path += length
        if path >= delta.value:
            found.append(k)
            path = 0.0
    ends = np.array(found, dtype=np.int64)
    return ends[:-1], ends[1:]


def statistics(values: Array, unit: str) -> dict[str, float | None]:
    """Return rmse, mean, median, std (1/N), min, max, sse; the unit ends the keys. None for no values."""
    if len(values) == 0:
        numbers: list[float | None] = [None] * 7
    else:
        square = float(values @ values)
        numbers = [
            float(np.sqrt(square / len(values))),
            float(values.mean()),
            float(np.median(values)),
            float(values.std()),
            float(values.min()),
            float(values.max()),
            square,
        ]
    names = [f"{name}_{unit}" for name in ("rmse", "mean", "median", "std", "min", "max")]
    return dict(zip([*names, f"sse_{unit}2"], numbers, strict=True))


def longest_loss(stamps: npt.NDArray[np.int64], errors: Array, threshold: float) -> float:
    """Return the longest time [s] without a break over which the error exceeds the threshold.

    From the first pose that exceeds it to the first that does not, or to the last pose.
    """
    is_lost = errors > threshold
    longest, begin = 0, None
    for stamp, lost in zip(stamps.tolist(), is_lost.tolist(), strict=True):
        if lost and begin is None:
            begin = stamp
        if begin is not None:
            longest = max(longest, stamp - begin)
        if not lost:
            begin = None
    return longest / 1e9


def _angle(matrices: Array) -> Array:
    """Return the angles (N,) of the rotations nearest to matrices (N, 3, 3) that are rounded rotations."""
    u, _, vt = np.linalg.svd(matrices)
    return so3.angle(so3.from_matrix(u @ vt))


def _relative(track: Track, i: Indices, j: Indices) -> tuple[Array, Array]:
    back = np.swapaxes(track.rotations[i], 1, 2)
    return np.einsum("nij,nj->ni", back, track.positions[j] - track.positions[i]), back @ track.rotations[j]
