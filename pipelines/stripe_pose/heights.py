"""Upper and lower ends of bars, where they are wide enough to have one.

The inside of a bar is averaged across its width, along its own slope, over the rows around the end; the end is where
that changes most, found like an edge of a row (``edges.py``). The window is symmetric about the middle of the bar, so
that an end that runs obliquely in the image (a turned mark above or below the lens) is blurred and not shifted.

Compiled by numba; imported where it is used.
"""

import math

import numpy as np
import numpy.typing as npt
from numba import types

from ..engine.compiled import F64_1D, F64_1D_IN, U8_2D, compiled, floats
from .edges import peak

Array = npt.NDArray[np.float64]
Bytes = npt.NDArray[np.uint8]

LEAST_WIDTH_PX = 8.0
"""A bar that is narrower has no end to be trusted: nothing of it is free of the blur of its sides."""
SIDE_PX = 2.5
"""So much is left out at either side of a bar."""
REACH = 5
"""The end is looked for so many rows above and below where the edges ended."""


@compiled(types.float64(F64_1D, types.int64, F64_1D_IN))
def _response(values: Array, at: int, taps: Array) -> float:
    total = 0.0
    for k in range(1, taps.size + 1):
        total += taps[k - 1] * (values[at + k] - values[at - k])
    return total


@compiled(floats(3)(U8_2D, types.float64, types.float64, types.float64, types.float64, types.int64, F64_1D_IN, F64_1D))
def find_end(
    pixels: Bytes, left: float, right: float, slope: float, row: float, sign: int, taps: Array, scratch: Array
) -> tuple[float, float, float]:
    """Find the end of a bar.

    Args:
        pixels: (H, W) image.
        left: column of the bar's left side at ``row`` [px].
        right: of its right side.
        slope: change of the columns per row.
        row: where the end is expected [px].
        sign: 1 for an upper end (bright below), -1 for a lower one.
        taps: of the filter, see ``edges.filter_taps``.
        scratch: (2 (REACH + len(taps)) + 3,) at least.

    Returns:
        Row of the end [px], nan if there is none; the response there [grey levels per pixel]; middle column of the
        window at the end [px].
    """
    reach = REACH + 1 + taps.size
    middle = round(row)
    if middle - reach < 0 or middle + reach >= pixels.shape[0]:
        return np.nan, 0.0, 0.0
    half = 0.5 * (right - left) - SIDE_PX
    columns = math.floor(2.0 * half) + 1
    for k in range(-reach, reach + 1):
        centre = 0.5 * (left + right) + slope * (middle + k - row)
        first = round(centre - half)
        if first < 0 or first + columns > pixels.shape[1]:
            return np.nan, 0.0, 0.0
        total = 0.0
        for u in range(first, first + columns):
            total += pixels[middle + k, u]
        scratch[k + reach] = total / columns
    best, at = 0.0, 0
    for k in range(-REACH, REACH + 1):
        value = sign * _response(scratch, k + reach, taps)
        if value > best:
            best, at = value, k
    if abs(at) == REACH or best <= 0.0:
        return np.nan, 0.0, 0.0
    before = sign * _response(scratch, at - 1 + reach, taps)
    after = sign * _response(scratch, at + 1 + reach, taps)
    end = middle + at + peak(before, best, after)
    # Windows are whole columns: where theirs is the middle, not where the bar's is.
    shift = slope * (end - row)
    return end, best, round(0.5 * (left + right) + shift - half) + 0.5 * (columns - 1)
