"""Upper and lower ends of bars, where they are wide enough to have one.

The inside of a bar is averaged across its width over the rows around the end, along the line on which all ends of the
mark lie: an end of a turned mark above or below the lens runs obliquely, and averaged along the rows it would be
flat. The end is where that changes most, found like an edge of a row (``edges.py``).

Compiled by numba; imported where it is used.
"""

import math

import numpy as np
import numpy.typing as npt
from numba import types

from ..engine.compiled import F64_1D, F64_1D_IN, F64_2D, F64_2D_IN, F64_3D_IN, I64_1D_IN, U8_2D, compiled, floats
from .edges import peak
from .lines import undistorted
from .matching import fitted

Array = npt.NDArray[np.float64]
Bytes = npt.NDArray[np.uint8]
Ints = npt.NDArray[np.int64]

LEAST_WIDTH_PX = 6.0
"""A bar that is narrower has no end to be trusted: nothing of it is free of the blur of its sides."""
SIDE_PX = 2.5
"""So much is left out at either side of a bar."""
REACH = 5
"""The end is looked for so many rows above and below where the edges ended."""
WEAKEST = 0.4
"""An end has at least this part of the response of its bar's side."""


@compiled(types.float64(F64_1D, types.int64, F64_1D_IN))
def _response(values: Array, at: int, taps: Array) -> float:
    total = 0.0
    for k in range(1, taps.size + 1):
        total += taps[k - 1] * (values[at + k] - values[at - k])
    return total


@compiled(
    floats(3)(U8_2D, types.float64, types.float64, types.float64, types.float64, types.float64, types.int64, F64_1D_IN,
              F64_1D)
)  # fmt: skip
def find_end(
    pixels: Bytes, left: float, right: float, slope: float, lie: float, row: float, sign: int, taps: Array, scratch:
    Array
) -> tuple[float, float, float]:  # fmt: skip
    """Find the end of a bar.

    Args:
        pixels: (H, W) image.
        left: column of the bar's left side at ``row`` [px].
        right: of its right side.
        slope: change of the columns per row.
        lie: rows that the end runs down per column.
        row: where the end is expected [px].
        sign: 1 for an upper end (bright below), -1 for a lower one.
        taps: of the filter, see ``edges.filter_taps``.
        scratch: (2 (REACH + len(taps)) + 3,) at least.

    Returns:
        Row of the end in the middle of the bar [px], nan if there is none; the response there [grey levels per pixel];
        the middle's column [px].
    """
    reach = REACH + 1 + taps.size
    middle = round(row)
    half = 0.5 * (right - left) - SIDE_PX
    columns = math.floor(2.0 * half) + 1
    for k in range(-reach, reach + 1):
        centre = 0.5 * (left + right) + slope * (middle + k - row)
        first = round(centre - half)
        total = 0.0
        for u in range(first, first + columns):
            v = middle + k + lie * (u - centre)
            above = math.floor(v)
            if above < 0 or above + 1 >= pixels.shape[0] or u < 0 or u >= pixels.shape[1]:
                return np.nan, 0.0, 0.0
            t = v - above
            total += (1.0 - t) * pixels[above, u] + t * pixels[above + 1, u]
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
    return end, best, 0.5 * (left + right) + slope * (end - row)


@compiled(types.float64(F64_1D, F64_1D))
def _lie(rows: Array, columns: Array) -> float:
    """Return how many rows the ends run down per column: the median of all pairs that are not neighbours."""
    n, count = rows.size, 0
    slopes = np.zeros(n * n)
    for i in range(n):
        for j in range(i + 2, n):
            slopes[count] = (rows[j] - rows[i]) / (columns[j] - columns[i])
            count += 1
    return float(np.median(slopes[:count])) if count > 0 else 0.0


@compiled(
    types.int64(
        U8_2D, F64_3D_IN, I64_1D_IN, F64_2D_IN, F64_2D_IN, types.float64, types.float64, floats(3), F64_1D_IN, F64_2D
    )
)  # fmt: skip
def find_ends(
    pixels: Bytes, rays: Array, members: Ints, lines: Array, rows: Array, middle: float, half: float,
    camera: tuple[float, float, float], taps: Array, ends: Array,
) -> int:  # fmt: skip
    """Find the ends of all bars of a mark that are wide enough.

    Args:
        pixels: (H, W) image.
        rays: (H, W, 2) of all pixels.
        members: (n,) which edge of the mark each line is; even ones are left sides of bars.
        lines: (n, 8) X [m], x, slope, z [1], column at ``middle`` [px], its change per row, response, variance of x.
        rows: (n, 2) first and last row of each line.
        middle: row.
        half: half the height of the bars [m].
        camera: focal lengths fx, fy [px], and the part of the error of an end that does not average out [px].
        taps: of the filter.
        ends: (2 n, 5) filled with X [m], half [m] with its sign, x, z [1] and the variance of z [1].

    Returns:
        How many there are.
    """
    n, count = members.size, 0
    fx, fy, floor = camera[0], camera[1], camera[2]
    scratch = np.empty(2 * (REACH + taps.size) + 3)
    X, u, columns, spread = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    for i in range(n):
        X[i] = lines[i, 0]
        # How much an edge of unit response scatters on one row [px grey levels per pixel].
        spread[i] = math.sqrt(lines[i, 7] * max(rows[i, 1] - rows[i, 0], 1.0)) * lines[i, 6] * fx
    scatter = float(np.median(spread))
    for which in range(2):
        sign = 1 - 2 * which
        own = rows[:, which].copy()
        for i in range(n):
            columns[i] = lines[i, 4] + lines[i, 5] * (own[i] - middle)
        lie = _lie(own, columns)
        for i in range(n - 1):
            if members[i] % 2 != 0 or members[i + 1] != members[i] + 1:  # not the two sides of one bright bar
                continue
            row = 0.5 * (own[i] + own[i + 1]) - 0.5 * sign
            left = lines[i, 4] + lines[i, 5] * (row - middle)
            right = lines[i + 1, 4] + lines[i + 1, 5] * (row - middle)
            if right - left < LEAST_WIDTH_PX:
                continue
            slope = 0.5 * (lines[i, 5] + lines[i + 1, 5])
            end, strength, centre = find_end(pixels, left, right, slope, lie, row, sign, taps, scratch)
            if not np.isfinite(end) or strength < WEAKEST * lines[i, 6]:
                continue
            below = math.floor(end)
            t = end - below
            x, z = undistorted(rays, centre, below)
            x_next, z_next = undistorted(rays, centre, below + 1)
            x, z = x + t * (x_next - x), z + t * (z_next - z)
            # Which abscissa the middle of the bar in the image is, by the projectivity of the lines at this height.
            for j in range(n):
                u[j] = lines[j, 1] + lines[j, 2] * (z - lines[j, 3])
            a, b, c = fitted(X, u, n)
            noise = scatter / strength / math.sqrt(right - left - 2.0 * SIDE_PX)
            ends[count, 0], ends[count, 1] = (x - c) / (a - b * x), sign * half
            ends[count, 2], ends[count, 3] = x, z
            ends[count, 4] = (noise * noise + floor * floor) / (fy * fy)
            count += 1
    return count
