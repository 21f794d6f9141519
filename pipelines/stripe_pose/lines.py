"""Straight lines through the edges of all rows that cross a mark, in undistorted coordinates.

The edges of one bar lie on a straight line (the paper's eq. (9)), once each of them has been taken through the lens:
x right and z up in the camera frame, at y = 1. It is fitted robustly and given at the height where the errors of its
place and slope are independent; at the row through the principal point (the paper's eq. (10)) it stands at x - slope z.

How far the edges scatter about their line says how uncertain it is. Noise moves an edge the more, the weaker it is,
so the scatter of all edges of a mark is pooled as scatter times strength.

Compiled by numba; imported where it is used.
"""

import math

import numpy as np
import numpy.typing as npt
from numba import types

from ..engine.compiled import F64_1D, F64_1D_IN, F64_2D, F64_3D_IN, compiled, floats
from .matching import fitted

Array = npt.NDArray[np.float64]


N_COLUMNS = 9
X, SLOPE, Z, VAR_X, VAR_SLOPE, FIRST, LAST, ROWS, STRENGTH = range(N_COLUMNS)
"""Columns of a table of lines: place x at height z [1], slope dx/dz [1], z [1], their variances, first and last image
row [px], number of rows, and mean response [grey levels per pixel]. A line that was not found has 0 rows."""

END_ROWS = 2
"""Rows at either end of an edge that are left out: the end of the bar rounds it."""
HUBER = 1.5
"""Residuals beyond so many standard deviations count less ..."""
OUTSIDE = 4.5
"""... and beyond so many not at all: the row is of something above or below the mark."""


@compiled(floats(2)(F64_3D_IN, types.float64, types.int64))
def undistorted(rays: Array, column: float, row: int) -> tuple[float, float]:
    """Return x, z of the ray through a column [px] of a row, between the two pixels beside it.

    Args:
        rays: (H, W, 2) of all pixels, as ``ray_table`` makes it.
        column: in the image.
        row: likewise.
    """
    left = min(max(math.floor(column), 0), rays.shape[1] - 2)
    t = column - left
    x = rays[row, left, 0] + t * (rays[row, left + 1, 0] - rays[row, left, 0])
    z = rays[row, left, 1] + t * (rays[row, left + 1, 1] - rays[row, left, 1])
    return x, z


@compiled(floats(5)(F64_1D, F64_1D, F64_1D, types.int64))
def _weighted_line(x: Array, z: Array, w: Array, n: int) -> tuple[float, float, float, float, float]:
    """Return x and slope at the weighted mean height, that height, the sum of weights and of their squared heights."""
    sw = swz = swx = 0.0
    for k in range(n):
        sw += w[k]
        swz += w[k] * z[k]
        swx += w[k] * x[k]
    middle, mean = swz / sw, swx / sw
    szz = szx = 0.0
    for k in range(n):
        dz = z[k] - middle
        szz += w[k] * dz * dz
        szx += w[k] * dz * (x[k] - mean)
    return mean, szx / szz, middle, sw, szz


@compiled(types.void(F64_2D, F64_2D, F64_3D_IN, types.int64, types.float64, F64_2D))
def fit_lines(  # noqa: C901, PLR0912  # one pass per line, written out for speed
    found: Array, size: Array, rays: Array, least_rows: int, floor: float, lines: Array
) -> None:
    """Fit a line to each edge that ``edges.follow`` found.

    Args:
        found: (m, H) column of each edge on each row [px], nan where it has none.
        size: (m, H) responses.
        rays: (H, W, 2) of all pixels.
        least_rows: a line has at least so many rows.
        floor: part of the error of an edge that no single row shows, of the place of a line [1].
        lines: (m, N_COLUMNS) filled with the lines.
    """
    m, height = found.shape
    x, z, w = np.empty(height), np.empty(height), np.empty(height)
    away, rows = np.empty(height), np.empty(height, np.int64)
    scatter, n_scatter = 0.0, 0
    for i in range(m):
        lines[i, :] = 0.0
        n, first, last, strength = 0, -1, -1, 0.0
        for row in range(height):
            if np.isfinite(found[i, row]):
                first = row if first < 0 else first
                last = row
        for row in range(first + END_ROWS, last + 1 - END_ROWS):
            if first >= 0 and np.isfinite(found[i, row]):
                x[n], z[n] = undistorted(rays, found[i, row], row)
                w[n] = 1.0
                rows[n] = row
                strength += size[i, row]
                n += 1
        if n < least_rows:
            continue
        place, slope, middle, sw, szz = _weighted_line(x, z, w, n)
        for _ in range(3):
            for k in range(n):
                away[k] = abs(x[k] - place - slope * (z[k] - middle))
            spread = 1.4826 * np.median(away[:n]) + 1e-12
            for k in range(n):
                w[k] = 1.0 if away[k] < HUBER * spread else HUBER * spread / away[k]
                if away[k] > OUTSIDE * spread:
                    w[k] = 0.0
            place, slope, middle, sw, szz = _weighted_line(x, z, w, n)
        squares, used = 0.0, 0
        first, last = height, -1
        for k in range(n):
            if w[k] > 0.0:
                used += 1
                first, last = min(first, rows[k]), max(last, rows[k])
            r = x[k] - place - slope * (z[k] - middle)
            squares += w[k] * r * r
        if used < least_rows:
            continue
        strength /= n
        scatter += squares * strength * strength
        n_scatter += used - 2
        lines[i, X], lines[i, SLOPE], lines[i, Z], lines[i, ROWS] = place, slope, middle, used
        lines[i, VAR_X], lines[i, VAR_SLOPE] = 1.0 / sw, 1.0 / szz
        lines[i, FIRST], lines[i, LAST], lines[i, STRENGTH] = first - END_ROWS, last + END_ROWS, strength
    if n_scatter == 0:
        return
    for i in range(m):
        if lines[i, ROWS] > 0:
            variance = scatter / n_scatter / lines[i, STRENGTH] ** 2
            lines[i, VAR_X] = variance * lines[i, VAR_X] + floor * floor
            lines[i, VAR_SLOPE] = variance * lines[i, VAR_SLOPE]


@compiled(types.float64(F64_2D, F64_1D_IN))
def misfit(lines: Array, X: Array) -> float:
    """Return how far lines are from those of any mark with these abscissae, root mean square [1].

    Whatever the tilt and roll, the lines of a mark obey a projectivity on every row (``pose.py``, eq. (1)).

    Args:
        lines: (n, N_COLUMNS), n >= 3.
        X: (n,) abscissae [m].
    """
    n, z = X.size, 0.0
    for i in range(n):
        z += lines[i, Z] / n
    at_X, u = np.empty(n), np.empty(n)
    for i in range(n):
        at_X[i], u[i] = X[i], lines[i, 0] + lines[i, SLOPE] * (z - lines[i, Z])
    a, b, c = fitted(at_X, u, n)
    squares = 0.0
    for i in range(n):
        squares += ((a * X[i] + c) / (b * X[i] + 1.0) - u[i]) ** 2
    return math.sqrt(squares / n)
