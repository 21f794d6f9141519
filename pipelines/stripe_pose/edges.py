"""Edges of one image row to a few hundredths of a pixel, and edges followed from row to row.

An edge is an extremum of the row convolved with the derivative of a Gaussian (Canny's edge detector in one dimension).
Blurred by lens, pixel and filter, a step has a response that is a Gaussian to a good approximation, and the logarithm
of a Gaussian is a parabola: through the logarithms of three samples it gives the extremum without the bias of a
parabola through the samples themselves, which for an upright mark is the same on every row and would not average out::

    x = u + (ln g- - ln g+) / (2 (ln g- - 2 ln g0 + ln g+))                                (1)

``follow`` grows the edges of a mark from one row upwards and downwards as long as each of them lasts: all rows that
cross the mark are used. Rows are not smoothed, so their errors are independent.

Compiled by numba; imported where it is used, because numba takes a third of a second to load.
"""

import math
from functools import cache

import numpy as np
import numpy.typing as npt
from numba import types

from ..engine.compiled import F32_1D, F64_1D, F64_1D_IN, F64_2D, I64_1D_IN, U8_2D, compiled, floats

Array = npt.NDArray[np.float64]
Bytes = npt.NDArray[np.uint8]
Floats = npt.NDArray[np.float32]
Ints = npt.NDArray[np.int64]


SIGMA_PX, N_TAPS = 1.2, 5
"""Standard deviation of the filter, and its taps to either side: below it pixels show, above it neighbours blend."""
WIDE_SIGMA_PX, WIDE_GAP_PX = 2.4, 13.0
"""Where the edges of a mark are so far apart, a wider filter is better: it halves the noise of a blurred edge."""
LOST_ROWS = 2
"""An edge that is not found on so many rows on end has ended."""
WINDOW_PX = 2
"""How far from where it is expected an edge is looked for."""
WEAKEST = 0.4
"""An edge has ended where its response has fallen to this part of what it was."""
MAX_EDGES = 512


@cache
def filter_taps(sigma: float = SIGMA_PX) -> Array:
    """Return the taps 1, 2, ... of the derivative filter (``N_TAPS`` of the narrow one).

    A ramp of one grey level a pixel has a response of 1.
    """
    k = np.arange(1.0, math.ceil(3.4 * sigma) + 1.0)
    taps = k * np.exp(-0.5 * (k / sigma) ** 2)
    taps /= 2.0 * np.sum(k * taps)
    taps.setflags(write=False)
    return np.asarray(taps)


@compiled(types.void(U8_2D, types.int64, F64_1D_IN, F32_1D, F32_1D), any_order=True)
def respond(pixels: Bytes, row: int, taps: Array, grey: Floats, response: Floats) -> None:
    """Filter one row into ``response`` (W,) [grey levels per pixel]; its ends, which the filter does not fit, are 0."""
    width = pixels.shape[1]
    for u in range(width):
        grey[u] = pixels[row, u]
    response[:N_TAPS] = 0.0
    response[width - N_TAPS :] = 0.0
    a, b, c = np.float32(taps[0]), np.float32(taps[1]), np.float32(taps[2])
    d, e = np.float32(taps[3]), np.float32(taps[4])
    for u in range(N_TAPS, width - N_TAPS):
        response[u] = (
            a * (grey[u + 1] - grey[u - 1])
            + b * (grey[u + 2] - grey[u - 2])
            + c * (grey[u + 3] - grey[u - 3])
            + d * (grey[u + 4] - grey[u - 4])
            + e * (grey[u + 5] - grey[u - 5])
        )


@compiled(types.float64(types.float64, types.float64, types.float64))
def peak(before: float, here: float, after: float) -> float:
    """Return how far from the middle sample a Gaussian through three positive samples has its peak, by eq. (1)."""
    if before <= 0.0 or after <= 0.0:
        curvature = before - 2.0 * here + after
        return 0.5 * (before - after) / curvature if curvature < 0.0 else 0.0
    a, b, c = math.log(before), math.log(here), math.log(after)
    curvature = a - 2.0 * b + c
    return 0.5 * (a - c) / curvature if curvature < 0.0 else 0.0


@compiled(types.int64(F32_1D, types.float64, F64_1D, F64_1D))
def extrema(response: Floats, threshold: float, columns: Array, strengths: Array) -> int:
    """List the extrema of a row's response beyond a threshold, left to right.

    Args:
        response: (W,) as ``respond`` leaves it.
        threshold: least size [grey levels per pixel].
        columns: (MAX_EDGES,) filled with the columns [px].
        strengths: (MAX_EDGES,) filled with the responses, positive from dark to bright [grey levels per pixel].

    Returns:
        How many there are.
    """
    n, least = 0, np.float32(threshold)
    for u in range(1, response.size - 1):
        if abs(response[u]) < least or n == columns.size:
            continue
        here = float(response[u])
        size = abs(here)
        sign = 1.0 if here > 0.0 else -1.0
        before, after = sign * float(response[u - 1]), sign * float(response[u + 1])
        if size >= before and size > after:
            columns[n] = u + peak(before, size, after)
            strengths[n] = here
            n += 1
    return n


@compiled(types.float64(U8_2D, types.int64, types.int64, F64_1D_IN))
def response_at(pixels: Bytes, row: int, column: int, taps: Array) -> float:
    """Return the response at one pixel, 0 where the filter does not fit [grey levels per pixel]."""
    reach = taps.size
    if column < reach or column >= pixels.shape[1] - reach:
        return 0.0
    total = 0.0
    for k in range(1, reach + 1):
        total += taps[k - 1] * (float(pixels[row, column + k]) - float(pixels[row, column - k]))
    return total


@compiled(floats(2)(U8_2D, types.int64, types.float64, types.int64, F64_1D_IN))
def edge_near(pixels: Bytes, row: int, column: float, polarity: int, taps: Array) -> tuple[float, float]:
    """Find the strongest edge within ``WINDOW_PX`` of a column.

    Args:
        pixels: (H, W) image.
        row: of the image.
        column: where it is expected [px].
        polarity: 1 from dark to bright, -1 from bright to dark, 0 either.
        taps: of the filter.

    Returns:
        Its column [px], nan if there is none, and the size of its response [grey levels per pixel].
    """
    middle = round(column)
    best, at = 0.0, -1
    for u in range(middle - WINDOW_PX, middle + WINDOW_PX + 1):
        value = response_at(pixels, row, u, taps)
        size = abs(value) if polarity == 0 else polarity * value
        if size > best:
            best, at = size, u
    if at < 0:
        return np.nan, 0.0
    sign = float(polarity)
    if polarity == 0:
        sign = 1.0 if response_at(pixels, row, at, taps) > 0.0 else -1.0
    before, after = sign * response_at(pixels, row, at - 1, taps), sign * response_at(pixels, row, at + 1, taps)
    if before > best or after > best:  # the flank of an edge further away
        return np.nan, 0.0
    return at + peak(before, best, after), best


@compiled(types.void(U8_2D, types.int64, types.int64, F64_1D_IN, I64_1D_IN, F64_1D_IN, types.float64, F64_2D, F64_2D))
def follow(
    pixels: Bytes, start: int, reach: int, columns: Array, polarity: Ints, taps: Array, threshold: float,
    found: Array, size: Array,
) -> None:  # fmt: skip
    """Follow the edges of a mark from one row to all that it crosses.

    Args:
        pixels: (H, W) image.
        start: row on which the edges were found.
        reach: no further than so many rows above and below it.
        columns: (m,) where [px]; nan for an edge that was not.
        polarity: (m,) of each, see ``edge_near``.
        taps: of the filter.
        threshold: least response of an edge [grey levels per pixel].
        found: (m, H) filled with the column of each edge on each row [px], nan where it has none.
        size: (m, H) filled with the responses.
    """
    for i in range(columns.size):
        found[i, :] = np.nan
        size[i, :] = 0.0
        if not np.isfinite(columns[i]):
            continue
        first, response = edge_near(pixels, start, columns[i], polarity[i], taps)
        if not np.isfinite(first):
            continue
        found[i, start], size[i, start] = first, response
        for step in (-1, 1):
            at, slope, usual, lost = first, 0.0, response, 0
            since, row = 1, start + step
            while 0 <= row < pixels.shape[0] and lost < LOST_ROWS and abs(row - start) <= reach:
                expected = at + step * slope * since
                column, response = edge_near(pixels, row, expected, polarity[i], taps)
                if not np.isfinite(column) or response < threshold or response < WEAKEST * usual:
                    lost += 1
                    since += 1
                else:
                    slope += 0.25 * (step * (column - at) / since - slope)
                    at, usual, lost, since = column, 0.9 * usual + 0.1 * response, 0, 1
                    found[i, row], size[i, row] = column, response
                row += step
