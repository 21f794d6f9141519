"""Series over time, made fit to be drawn: summed up where they are long, broken where nothing is said."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from ...formats.events import Array

STRETCHES = 240
"""Longer series are summed up in this many stretches of time."""

EXTREMES = 500
"""Longer lines of errors are drawn through the extremes of this many stretches of time."""


def stretches(t: Array, values: Array, n: int = STRETCHES) -> tuple[Array, Array, Array, Array]:
    """Sum up a series in n equal stretches of time: middles, means, least and largest values.

    Empty stretches are left out.

    Args:
        t: (N,) non-decreasing times; N >= 1.
        values: (N,) finite.
        n: stretches over the whole time.
    """
    span = max(float(t[-1] - t[0]), 1e-12)
    index = np.minimum(((t - t[0]) / span * n).astype(np.int64), n - 1)
    starts = np.flatnonzero(np.diff(index, prepend=-1))
    sizes = np.diff(np.append(starts, len(t)))
    middle = t[0] + (index[starts] + 0.5) * span / n
    mean = np.add.reduceat(values, starts) / sizes
    return middle, mean, np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)


def extremes(t: Array, values: Array, n: int = EXTREMES) -> npt.NDArray[np.int64]:
    """Choose what is drawn of a long series: the least and the largest value of each of n stretches of time, in order.

    A line through them looks like the line through all; nan is kept only where a whole stretch is nan.
    """
    if len(t) <= 2 * n:
        return np.arange(len(t))
    span = max(float(t[-1] - t[0]), 1e-12)
    index = np.minimum(((t - t[0]) / span * n).astype(np.int64), n - 1)
    starts = np.flatnonzero(np.diff(index, prepend=-1))
    chosen: set[int] = set()
    for start, end in pairwise([*starts.tolist(), len(t)]):
        part = values[start:end]
        if np.isnan(part).all():
            chosen.add(start)
        else:
            chosen |= {start + int(np.nanargmin(part)), start + int(np.nanargmax(part))}
    return np.array(sorted(chosen), dtype=np.int64)


def with_pauses(t: Array, longest: float, *values: Array) -> tuple[Array, ...]:
    """Put nan between values that are farther apart in time than a line may be drawn.

    Args:
        t: (N,) non-decreasing times.
        longest: time that a line may bridge.
        values: (N,) each.

    Returns:
        The times and all values, longer by the number of pauses.
    """
    at = np.flatnonzero(np.diff(t) > longest) + 1
    return (np.insert(t, at, t[at - 1]), *(np.insert(value, at, np.nan) for value in values))


def runs(is_in: npt.NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """Yield first and last index of each unbroken run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], is_in, [False]]).astype(np.int8)))
    for start, end in edges.reshape(-1, 2).tolist():
        yield start, end - 1


def longest_run(is_in: npt.NDArray[np.bool_]) -> int:
    """Return the length of the longest unbroken run of true values."""
    return max((last - first + 1 for first, last in runs(is_in)), default=0)
