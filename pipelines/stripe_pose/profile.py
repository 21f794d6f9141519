"""Edges so close that they bias one another, taken apart: the brightness across a mark fitted as a whole.

A filter that is as wide as a bar sees two edges as one. The brightness itself does not: with black B, white B + A,
and a blur sigma that all edges share, every pixel of every row of the mark is ::

    I(u, row) = B + B' t + (A + A' t) sum_i s_i Phi((u - x_i(row) - d_i) / sigma),   t = u - middle        (1)

with s_i = 1 from dark to bright and -1 from bright to dark. The lines x_i(row) are those of the first fit; the d_i
are what they were off, and come with a full covariance: neighbours that blend are told apart the worse, the closer
they are.

Compiled by numba; imported where it is used.
"""

import math

import numpy as np
import numpy.typing as npt
from numba import types

from ..engine.compiled import F64_1D, F64_2D, F64_2D_IN, I64_1D_IN, U8_2D, compiled, ints

Array = npt.NDArray[np.float64]
Bytes = npt.NDArray[np.uint8]
Ints = npt.NDArray[np.int64]


MARGIN_PX = 2.5
"""So much of the dark ground beside the outermost edges is fitted with them [px]."""
BLUR, BLACK, BLACK_RAMP, WHITE, WHITE_RAMP = range(5)
"""The unknowns behind the m offsets."""
N_SHARED = 5
FIRST_BLUR_PX = 0.9


@compiled(types.float64(types.float64, types.float64))
def passed(d: float, bell: float) -> float:
    """Return Phi(d), given exp(-d^2 / 2), to 1e-7: a ten-thousandth of the rounding of a grey level.

    Source: Abramowitz and Stegun, Handbook of Mathematical Functions, 7.1.26.
    """
    t = 1.0 / (1.0 + 0.3275911 * abs(d) / math.sqrt(2.0))
    tail = t * (0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429))))
    half = 0.5 * tail * bell
    return 1.0 - half if d > 0.0 else half


@compiled(types.float64(U8_2D, ints(2), F64_2D_IN, I64_1D_IN, F64_1D, F64_2D, F64_1D))
def _accumulate(  # noqa: C901  # sums, written out for speed
    pixels: Bytes, rows: tuple[int, int], columns: Array, polarity: Ints, values: Array, normal: Array, right: Array,
) -> float:  # fmt: skip
    """Sum the normal equations of eq. (1) over the rows from the first to the last; return the sum of squares."""
    m = columns.shape[1]
    blur = values[m + BLUR]
    n = m + N_SHARED
    row_of_J = np.empty(n)
    normal[:, :] = 0.0
    right[:] = 0.0
    squares = 0.0
    middle = (rows[1] - rows[0]) // 2
    centre = 0.5 * (columns[middle, 0] + columns[middle, m - 1])
    for row in range(rows[0], rows[1] + 1):
        h = row - rows[0]
        left = max(math.ceil(columns[h, 0] - MARGIN_PX), 0)
        last = min(math.floor(columns[h, m - 1] + MARGIN_PX), pixels.shape[1] - 1)
        for u in range(left, last + 1):
            t = u - centre
            amplitude = values[m + WHITE] + values[m + WHITE_RAMP] * t
            share, spread = 0.0, 0.0
            first_near, last_near = m, -1
            for i in range(m):
                d = (u - columns[h, i] - values[i]) / blur
                if d > 4.0:  # well to the right of this edge: it is wholly passed
                    share += polarity[i]
                    continue
                if d < -4.0:
                    break
                first_near = min(first_near, i)
                last_near = i
                bell = math.exp(-0.5 * d * d)
                share += polarity[i] * passed(d, bell)
                density = polarity[i] * bell / math.sqrt(2.0 * math.pi) / blur
                row_of_J[i] = -amplitude * density
                spread -= amplitude * density * d
            residual = pixels[row, u] - (values[m + BLACK] + values[m + BLACK_RAMP] * t + amplitude * share)
            squares += residual * residual
            row_of_J[m + BLUR] = spread
            row_of_J[m + BLACK], row_of_J[m + BLACK_RAMP] = 1.0, t
            row_of_J[m + WHITE], row_of_J[m + WHITE_RAMP] = share, t * share
            for i in range(first_near, n):
                if last_near < i < m:
                    continue
                right[i] += row_of_J[i] * residual
                for j in range(first_near, i + 1):
                    if last_near < j < m:
                        continue
                    normal[i, j] += row_of_J[i] * row_of_J[j]
    for i in range(n):
        for j in range(i):
            normal[j, i] = normal[i, j]
    return squares


@compiled(types.int64(U8_2D, ints(2), F64_2D_IN, I64_1D_IN, F64_1D, F64_2D))
def separate(pixels: Bytes, rows: tuple[int, int], columns: Array, polarity: Ints, values: Array, cov: Array) -> int:
    """Fit eq. (1) to the rows of a mark.

    Args:
        pixels: (H, W) image.
        rows: first and last row that all edges cross.
        columns: (rows, m) where the edges are on each of these rows, increasing [px].
        polarity: (m,) 1 from dark to bright, -1 from bright to dark.
        values: (m + 5,) filled with the offsets d_i and the blur [px], B, B', A, A' [grey levels].
        cov: (m + 5, m + 5) filled with their covariance.

    Returns:
        Number of pixels that were fitted; 0 if there is no fit.
    """
    m = columns.shape[1]
    n = m + N_SHARED
    values[:] = 0.0
    values[m + BLUR] = FIRST_BLUR_PX
    # Black and white to start from: extremes of the middle row.
    middle = (rows[1] - rows[0]) // 2
    row = rows[0] + middle
    low, high = 255.0, 0.0
    for u in range(max(int(columns[middle, 0]) - 2, 0), min(int(columns[middle, m - 1]) + 3, pixels.shape[1])):
        low, high = min(low, float(pixels[row, u])), max(high, float(pixels[row, u]))
    values[m + BLACK], values[m + WHITE] = low, high - low
    normal, right = np.empty((n, n)), np.empty(n)
    squares = 0.0
    for _ in range(8):
        squares = _accumulate(pixels, rows, columns, polarity, values, normal, right)
        for i in range(n):
            normal[i, i] *= 1.0 + 1e-9
            if not normal[i, i] > 0.0:
                return 0
        step = np.linalg.solve(normal, right)
        largest = 0.0
        for i in range(n):
            if i < m:
                step[i] = min(max(step[i], -0.5), 0.5)
                largest = max(largest, abs(step[i]))
            values[i] += step[i]
        values[m + BLUR] = min(max(values[m + BLUR], 0.25), 4.0)
        if largest < 3e-3:  # the next step is its square
            break
    count = 0
    for h in range(rows[1] - rows[0] + 1):
        left = max(math.ceil(columns[h, 0] - MARGIN_PX), 0)
        count += min(math.floor(columns[h, m - 1] + MARGIN_PX), pixels.shape[1] - 1) - left + 1
    if count <= n:
        return 0
    cov[:, :] = np.linalg.inv(normal) * (squares / (count - n))
    return count
