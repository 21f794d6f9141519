"""Which landmark a sighting is: candidates in reach, one draw per particle, one vote of the cloud.

Each particle draws its answer with the probabilities that the likelihood gives (Rao-Blackwellised
association): where one landmark explains the sighting, all draw the same; where two do, the cloud keeps both
until later sightings decide. Within an image a particle never uses a landmark twice. The cloud reports a
landmark that holds more than half of the weight; as each particle's answers are one-to-one, so are the
reported ones.
"""

import math
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from ..estimation.gaussian import largest_variance

Array: TypeAlias = npt.NDArray[np.float64]
Indices: TypeAlias = npt.NDArray[np.intp]

CLUTTER = -1
"""Index of 'no landmark of the map'."""

_GATE = 6.0
"""Candidates farther than this many standard deviations are worth less than 1e-7 of a match."""


def candidates(seen: Array, landmarks: Array, S: Array) -> Indices:
    """Return indices of landmarks that any particle could mean.

    Args:
        seen: (N, 2) where each particle sees the sighting, in the map [m].
        landmarks: (L, 2) [m].
        S: (2, 2) covariance of the innovation [m^2].
    """
    reach = _GATE * math.sqrt(largest_variance(S))
    centre = seen.mean(axis=0)
    spread = math.sqrt(float(np.max(np.square(seen - centre).sum(axis=1))))
    square = (landmarks[:, 0] - centre[0]) ** 2 + (landmarks[:, 1] - centre[1]) ** 2
    return np.flatnonzero(square <= (reach + spread) ** 2)


def draw(log_p: Array, options: Indices, rng: np.random.Generator) -> Indices:
    """Draw one option per particle.

    Args:
        log_p: (N, K) logarithms of probabilities up to a factor per row; -inf is never drawn.
        options: (K,) what the columns stand for.
        rng: source of randomness.

    Returns:
        (N,) drawn entries of ``options``.
    """
    p = np.exp(log_p - log_p.max(axis=1, keepdims=True))
    cumulated = np.cumsum(p, axis=1)
    mark = rng.random(len(p)) * cumulated[:, -1]
    column = np.sum(cumulated <= mark[:, None], axis=1)
    return np.asarray(options[np.minimum(column, len(options) - 1)])


def forbid_used(log_p: Array, options: Indices, used: Indices) -> None:
    """Set to -inf what a particle has already used in this image.

    Args:
        log_p: (N, K), changed in place.
        options: (K,) what the columns stand for.
        used: (N, m) answers of each particle to the image's earlier sightings.
    """
    for answers in used.T:
        log_p[(answers[:, None] == options[None, :]) & (options[None, :] != CLUTTER)] = -np.inf


def vote(answers: Indices, w: Array) -> int:
    """Return the landmark that holds more than half of the weight, or CLUTTER.

    Args:
        answers: (N,) landmark indices or CLUTTER.
        w: (N,) weights, sum one.
    """
    tally = np.bincount(answers + 1, weights=w)
    best = int(np.argmax(tally))
    return best - 1 if tally[best] > 0.5 else CLUTTER
