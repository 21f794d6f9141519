"""Where marks may be: every k-th row is searched for each mark, and proposes the places where its edges would be.

Compiled by numba; imported where it is used.
"""

import numpy as np
import numpy.typing as npt
from numba import types

from ..engine.compiled import F64_1D, F64_1D_IN, F64_2D, F64_3D_IN, I64_1D, I64_1D_IN, U8_2D, compiled, ints
from .edges import MAX_EDGES, extrema, respond
from .lines import undistorted
from .matching import NONE, match_part, match_row

Array = npt.NDArray[np.float64]
Bytes = npt.NDArray[np.uint8]
Ints = npt.NDArray[np.int64]

MARK, ROW, ERROR, MEMBERS, COLUMNS = range(5)
"""Columns of a table of proposals: index of the mark, row, error [1], number of edges, then the column of each edge
[px]."""
MOST = 512
PER_ROW = 16

FAINTEST = 0.027
"""Least response of an edge as part of the row's range: a tenth of the range, blurred by 1.5 px."""


@compiled(types.float64(U8_2D, F64_1D_IN))
def noise_level(pixels: Bytes, taps: Array) -> float:
    """Return the standard deviation of the response where there are no edges, from the median of 8 rows."""
    height, width = pixels.shape
    grey, response = np.empty(width, np.float32), np.empty(width, np.float32)
    n_rows = min(8, height)
    sample = np.empty(n_rows * (width // 6 + 1))
    n = 0
    for k in range(n_rows):
        respond(pixels, (2 * k + 1) * height // (2 * n_rows), taps, grey, response)
        for u in range(taps.size, width - taps.size, 6):
            sample[n] = abs(response[u])
            n += 1
    return float(np.median(sample[:n]) / 0.6745) if n > 0 else 0.0


@compiled(types.void(F64_1D, I64_1D, types.int64, F64_1D))
def _fill(proposal: Array, matched: Ints, n: int, columns: Array) -> None:
    """Write into a proposal where the first n edges of a mark are seen, nan for hidden ones, and how many are."""
    proposal[MEMBERS] = 0
    for q in range(n):
        is_seen = matched[q] != NONE
        proposal[COLUMNS + q] = columns[matched[q]] if is_seen else np.nan
        proposal[MEMBERS] += is_seen


@compiled(
    types.int64(
        U8_2D, F64_3D_IN, ints(3), F64_1D_IN, types.float64, F64_1D_IN, I64_1D_IN, I64_1D_IN,
        ints(2), types.float64, F64_1D_IN, F64_2D,
    )
)  # fmt: skip
def propose(  # noqa: C901  # a loop over rows and marks
    pixels: Bytes, rays: Array, rows: tuple[int, int, int], taps: Array, noise: float, X: Array, polarity: Ints,
    starts: Ints, how: tuple[int, int], tolerance: float, gates: Array, table: Array,
) -> int:  # fmt: skip
    """Search rows for marks.

    Args:
        pixels: (H, W) image.
        rays: (H, W, 2) of all pixels.
        rows: first row, end, and step.
        taps: of the filter.
        noise: see ``noise_level``.
        X: abscissae of the edges of all marks behind one another [m].
        polarity: of the same edges.
        starts: (K + 1,) where each mark begins in them.
        how: edges that may be skipped within a mark; or -1 and the least number of edges of a partly hidden mark.
        tolerance: see ``matching``.
        gates: likewise.
        table: (MOST, COLUMNS + edges of the largest mark) filled with the proposals; nan columns are hidden edges.

    Returns:
        Number of proposals.
    """
    width = pixels.shape[1]
    grey, response = np.empty(width, np.float32), np.empty(width, np.float32)
    columns, strengths, u = np.empty(MAX_EDGES), np.empty(MAX_EDGES), np.empty(MAX_EDGES)
    longest = 0
    for k in range(starts.size - 1):
        longest = max(longest, starts[k + 1] - starts[k])
    matches, errors = np.empty((PER_ROW, longest), np.int64), np.empty(PER_ROW)
    best, trial = np.empty(longest, np.int64), np.empty(longest, np.int64)
    only, only_strengths, place = np.empty(MAX_EDGES), np.empty(MAX_EDGES), np.empty(MAX_EDGES)
    count = 0
    for row in range(rows[0], rows[1], rows[2]):
        respond(pixels, row, taps, grey, response)
        low, high = grey[0], grey[0]
        for c in range(width):
            low, high = min(low, grey[c]), max(high, grey[c])
        n = extrema(response, max(6.0 * noise, FAINTEST * (high - low), 1.0), columns, strengths)
        for c in range(n):
            u[c] = undistorted(rays, columns[c], row)[0]
        for k in range(starts.size - 1):
            m = starts[k + 1] - starts[k]
            own_X, own_polarity = X[starts[k] : starts[k + 1]], polarity[starts[k] : starts[k + 1]]
            is_rising_only = True
            for q in range(m):
                is_rising_only &= own_polarity[q] > 0
            n_used = 0
            for c in range(n):
                if strengths[c] > 0.0 or not is_rising_only:
                    only[n_used], only_strengths[n_used], place[n_used] = u[c], strengths[c], columns[c]
                    n_used += 1
            if how[0] >= 0:
                found = match_row(
                    only, only_strengths, n_used, own_X, own_polarity, how[0], tolerance, gates, matches[:, :m], errors
                )
            else:
                members = match_part(
                    only, only_strengths, n_used, own_X, own_polarity, how[1], tolerance, gates, best[:m], trial[:m]
                )
                found = 1 if members > 0 else 0
                matches[0, :m], errors[0] = best[:m], tolerance / max(members, 1)
            for j in range(found):
                if count == table.shape[0]:
                    return count
                table[count, MARK], table[count, ROW], table[count, ERROR] = k, row, errors[j]
                _fill(table[count], matches[j], m, place)
                count += 1
    return count
