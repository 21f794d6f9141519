"""Which edges of one mark could be taken for which edges of another: left to right, and by polarity.

A mark is recognised although some neighbouring edges are hidden, and although up to two edges between them belong to
something else. So edges of a mark that is seen can be taken for those of another one in as many ways as there are such
choices on both sides whose polarities agree.
"""

from collections.abc import Sequence
from functools import lru_cache
from itertools import combinations
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from .plausible import FEWEST_OF_PART

Ints: TypeAlias = npt.NDArray[np.int64]

MAX_SKIPPED = 2
"""Edges between those of a mark that belong to something else."""
FEWEST = 4
"""Three edges fit any mark; a fourth is the first that tells."""


class Pairing(NamedTuple):
    """Ways to take edges of the mark that is seen for edges of another, n ways of k pairs.

    Attributes:
        seen: (n, k) edges of the mark that is seen, increasing.
        taken: (n, k) edges of the mark they are taken for, increasing.
    """

    seen: Ints
    taken: Ints


@lru_cache(maxsize=256)
def whole(seen: tuple[int, ...], taken: tuple[int, ...], *, is_same: bool) -> tuple[Pairing, ...]:
    """Return the ways in which all edges of a mark are found, with others between them.

    Args:
        seen: (n,) polarities of the mark that is seen.
        taken: (m,) polarities of the mark it is taken for.
        is_same: the two are one mark, and each edge taken for itself is no mistake.
    """
    if len(taken) < FEWEST:
        return ()
    return _pairings(seen, taken, [tuple(range(len(taken)))], is_same=is_same)


@lru_cache(maxsize=256)
def hidden(seen: tuple[int, ...], taken: tuple[int, ...], most: int, *, is_same: bool) -> tuple[Pairing, ...]:
    """Return the ways in which neighbouring edges of a mark, ``most`` at most, are not found; see ``whole``."""
    n, pairings = len(taken), list[Pairing]()
    for k in range(max(n - most, FEWEST_OF_PART), n):
        parts = [(*range(first), *range(first + n - k, n)) for first in range(k + 1)]
        pairings += _pairings(seen, taken, parts, is_same=is_same)
    return tuple(pairings)


def _pairings(
    seen: tuple[int, ...], taken: tuple[int, ...], parts: Sequence[tuple[int, ...]], *, is_same: bool
) -> tuple[Pairing, ...]:
    """Return the ways to take edges that lie near each other for one of these parts, which are of one size."""
    k = len(parts[0])
    choices: dict[tuple[int, ...], list[tuple[int, ...]]] = {}
    for chosen in parts:
        choices.setdefault(tuple(taken[i] for i in chosen), []).append(chosen)
    pairs = []
    for first in range(len(seen) - k + 1):
        last = min(len(seen), first + k + MAX_SKIPPED)
        for rest in combinations(range(first + 1, last), k - 1):
            mine = (first, *rest)
            pairs += [
                (mine, other)
                for other in choices.get(tuple(seen[i] for i in mine), ())
                if not (is_same and mine == other)
            ]
    return (Pairing(*_columns(pairs)),) if pairs else ()


def _columns(pairs: Sequence[tuple[Sequence[int], Sequence[int]]]) -> tuple[Ints, Ints]:
    table = np.array([[list(a), list(b)] for a, b in pairs], dtype=np.int64)
    return table[:, 0], table[:, 1]
