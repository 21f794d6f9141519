"""Drawing particles with probability proportional to their weights.

``roulette`` draws each one independently, as the ceiling paper does: a particle of weight w appears N w times
on average with a binomial spread. ``systematic`` puts a comb of N equal teeth at one random offset over the
cumulated weights: it appears floor(N w) or ceil(N w) times, one random number is needed, and the order of
particles is kept.
"""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]
Indices: TypeAlias = npt.NDArray[np.intp]


def _pick(w: Array, positions: Array) -> Indices:
    """Return for every position in [0, 1) the particle in whose share of the cumulated weights it falls."""
    cumulated = np.cumsum(w)
    cumulated /= cumulated[-1]  # so that rounding cannot leave a position beyond the last
    return np.searchsorted(cumulated, positions, side="right")


def systematic(w: Array, rng: np.random.Generator) -> Indices:
    """Draw N = len(w) particles with a comb; weights (N,) are not negative and not all zero."""
    n = len(w)
    return _pick(w, (np.arange(n) + rng.random()) / n)


def roulette(w: Array, rng: np.random.Generator) -> Indices:
    """Draw N = len(w) particles independently; weights (N,) are not negative and not all zero."""
    return _pick(w, rng.random(len(w)))
