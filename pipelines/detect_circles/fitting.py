"""From a first circle to a measured one: a robust fit to its edge points, and what is left over.

1. The edge points are mapped to the plane in which the object is a circle: the ceiling, or without a calibration the
   image itself.
2. ``_ellipse``: there they are fitted by |A (p - c)| = 1, A near I/R. One Gauss-Newton step solves, for each point with
   n = A (p - c) / |A (p - c)| = (cos a, sin a),
       R (|A (p - c)| - 1) = R (A n) . dc - R (e0 + e1 cos 2a + e2 sin 2a),    then c += dc, A = (I + E) A,
   weighted by how well the point agreed before (iteratively reweighted least squares); c is the true centre.
3. ``_judge``: what is left over, which tells a circle from a square (4th harmonic of the residual), a hexagon (6th), a
   rectangle (no long run of agreeing rays); ``is_circle``: the gates.

Compiled by numba; imported where it is used.
"""

import numpy as np
import numpy.typing as npt
from numba import types

from ..engine.compiled import F32_3D_IN, F64_1D, F64_1D_IN, F64_2D, U8_2D, compiled, floats
from .edges import MAX_RAYS, cast, median
from .plane import to_pixel, to_plane

Array = npt.NDArray[np.float64]
Bytes = npt.NDArray[np.uint8]
Rays = npt.NDArray[np.float32]

# Columns of what ``method.find`` returns.
U, V, RADIUS, UU, UV, VU, VV, SCORE, ARC, IS_CUT, X, Y, XX, XY, YX, YY = range(16)
RMS, H3, H4, H6, AGREE, RUN, CONTRAST, ASPECT = range(16, 24)
N_COLUMNS = 24

MAX_STEPS = 7


@compiled(types.boolean(F64_2D, F64_1D))
def _solve(a: Array, b: Array) -> bool:
    """Solve a x = b for symmetric positive a (5, 5) in place: a becomes its inverse, b the solution."""
    n = 5
    for k in range(n):  # Gauss-Jordan without pivoting: a is positive definite
        pivot = a[k, k]
        if not pivot > 1e-12:
            return False
        a[k, k] = 1.0
        for j in range(n):
            a[k, j] /= pivot
        b[k] /= pivot
        for i in range(n):
            if i == k:
                continue
            factor = a[i, k]
            a[i, k] = 0.0
            for j in range(n):
                a[i, j] -= factor * a[k, j]
            b[i] -= factor * b[k]
    return True


@compiled(floats(2)(F64_2D, types.int64, F64_1D, types.float64, F64_2D, F64_1D), any_order=True)
def _normal_equations(work: Array, n: int, fit: Array, scale: float, matrix: Array, rhs: Array) -> tuple[float, float]:
    """Set up one step of ``_ellipse``; return the sums of the weights and of the weighted squared residuals.

    Args:
        work: (9, n) points x, y; filled with the five derivatives, the residual and its weight.
        n: number of points.
        fit: see ``_ellipse``.
        scale: residual at which a point counts a quarter.
        matrix: (5, 5) filled.
        rhs: (5,) filled.
    """
    x, y, radius, a11, a12, a21, a22 = fit[0], fit[1], fit[2], fit[3], fit[4], fit[5], fit[6]
    px, py, error, weight = work[0], work[1], work[7], work[8]
    r0, r1, r2, r3, r4 = work[2], work[3], work[4], work[5], work[6]
    for k in range(n):
        dx, dy = (px[k] - x) / radius, (py[k] - y) / radius
        qx, qy = a11 * dx + a12 * dy, a21 * dx + a22 * dy
        rho = np.sqrt(qx * qx + qy * qy)
        nx, ny = qx / rho, qy / rho
        error[k] = radius * (rho - 1.0)
        w = 1.0 / (1.0 + (error[k] / scale) * (error[k] / scale))
        weight[k] = w * w
        r0[k], r1[k] = a11 * nx + a21 * ny, a12 * nx + a22 * ny
        r2[k], r3[k], r4[k] = -rho, -rho * (nx * nx - ny * ny), -rho * 2.0 * nx * ny
    w_sum = w_errors = 0.0
    for k in range(n):
        w_sum += weight[k]
        w_errors += weight[k] * error[k] * error[k]
    for i in range(5):
        a = work[2 + i]
        total = 0.0
        for k in range(n):
            total += weight[k] * a[k] * error[k]
        rhs[i] = total
        for j in range(i + 1):
            b = work[2 + j]
            total = 0.0
            for k in range(n):
                total += weight[k] * a[k] * b[k]
            matrix[i, j] = total
            matrix[j, i] = total
    return w_sum, w_errors


@compiled(types.boolean(F64_2D, F64_1D, types.int64, types.float64, F64_1D, F64_1D, F64_2D))
def _ellipse(  # noqa: C901, PLR0912
    points: Array, slopes: Array, n_rays: int, flattening: float, fit: Array, residuals: Array, cov: Array
) -> bool:
    """Fit |A (p - c)| = 1 by reweighted Gauss-Newton, started from ``fit``.

    Args:
        points: (n_rays, 2) edge points in the plane.
        slopes: (n_rays,) greater than 0 where there is a point.
        n_rays: number of rays.
        flattening: standard deviation expected of the second harmonic (0 for a known circle), relative to R.
        fit: x, y, R, a11, a12, a21, a22 of R A; changed to the result.
        residuals: (n_rays,) filled with R (|A (p - c)| - 1).
        cov: (5, 5) filled with the covariance of x, y and of R E (radius, 2nd harmonic).

    Returns:
        Whether there was a solution.
    """
    n = 0
    work, errors = np.empty((9, n_rays)), np.empty(n_rays)
    for k in range(n_rays):
        if slopes[k] > 0.0:
            work[0, n], work[1, n] = points[k, 0], points[k, 1]
            n += 1
    if n < 8:
        return False
    rhs = np.zeros(5)
    x, y, radius, a11, a12, a21, a22 = fit[0], fit[1], fit[2], fit[3], fit[4], fit[5], fit[6]
    e1 = e2 = 0.0
    scale, sigma = 0.08 * radius + 1.0, 0.3
    for iteration in range(MAX_STEPS):
        fit[0], fit[1], fit[2], fit[3], fit[4], fit[5], fit[6] = x, y, radius, a11, a12, a21, a22
        w_sum, w_errors = _normal_equations(work, n, fit, scale, cov, rhs)
        if w_sum < 5.0:
            return False
        sigma = max(0.05, np.sqrt(w_errors / w_sum * n / max(n - 5.0, 1.0)))
        tie = (sigma / (flattening * radius)) ** 2
        cov[3, 3] += tie
        cov[4, 4] += tie
        rhs[3] -= tie * e1
        rhs[4] -= tie * e2
        if not _solve(cov, rhs):
            return False
        step = max(abs(rhs[0]), abs(rhs[1]), abs(rhs[2]))
        if not step < radius:
            return False
        x += rhs[0]
        y += rhs[1]
        g0, g1, g2 = rhs[2] / radius, rhs[3] / radius, rhs[4] / radius
        e1 += rhs[3]
        e2 += rhs[4]
        a11, a21 = a11 + (g0 + g1) * a11 + g2 * a21, a21 + g2 * a11 + (g0 - g1) * a21
        a12, a22 = a12 + (g0 + g1) * a12 + g2 * a22, a22 + g2 * a12 + (g0 - g1) * a22
        grow = np.sqrt(abs(a11 * a22 - a12 * a21))
        if not 0.3 < grow < 3.0:
            return False
        radius /= grow
        a11, a12, a21, a22 = a11 / grow, a12 / grow, a21 / grow, a22 / grow
        for k in range(n):
            errors[k] = abs(work[7, k])
        scale = max(2.0 * 1.48 * median(errors, n), 0.25)
        if iteration >= 2 and step < 1e-2:
            break
    for i in range(5):
        for j in range(5):
            cov[i, j] *= sigma * sigma
    fit[0], fit[1], fit[2], fit[3], fit[4], fit[5], fit[6] = x, y, radius, a11, a12, a21, a22
    n = 0
    for k in range(n_rays):
        if slopes[k] > 0.0:
            residuals[k] = work[7, n]  # of the last step but one; the last moved less than matters
            n += 1
    return True


@compiled(types.void(F64_2D, F64_1D, F64_1D, F64_1D, F64_1D, types.int64))
def _judge(points: Array, slopes: Array, residuals: Array, fit: Array, row: Array, n_rays: int) -> None:
    """Fill the columns of ``row`` that tell a circle from what only looks like one."""
    x, y, radius, a11, a12, a21, a22 = fit[0], fit[1], fit[2], fit[3], fit[4], fit[5], fit[6]
    allowed = 0.05 * radius + 0.6
    squares = slope = 0.0
    h = np.zeros(6)
    n_found = n_good = run = longest = 0
    for k in range(2 * n_rays):  # twice around, for runs over the start
        i = k if k < n_rays else k - n_rays
        is_good = slopes[i] > 0.0 and abs(residuals[i]) < allowed
        run = run + 1 if is_good else 0
        longest = max(longest, min(run, n_rays))
        if k >= n_rays or slopes[i] <= 0.0:
            continue
        dx, dy = points[i, 0] - x, points[i, 1] - y
        qx, qy = a11 * dx + a12 * dy, a21 * dx + a22 * dy
        rho = max(np.sqrt(qx * qx + qy * qy), 1e-12)
        c, d = qx / rho, qy / rho
        c2, d2 = c * c - d * d, 2.0 * c * d  # cos and sin of twice, three, four, six times the angle
        c3, d3 = c2 * c - d2 * d, c2 * d + d2 * c
        e = min(max(residuals[i], -allowed), allowed)  # one neighbour is no harmonic
        h[0] += e * c3
        h[1] += e * d3
        h[2] += e * (c2 * c2 - d2 * d2)
        h[3] += e * 2.0 * c2 * d2
        h[4] += e * (c3 * c3 - d3 * d3)
        h[5] += e * 2.0 * c3 * d3
        n_found += 1
        if is_good:
            n_good += 1
            squares += e * e
            slope += slopes[i]
    spread = np.sqrt(0.25 * (a11 * a11 + a21 * a21 - a12 * a12 - a22 * a22) ** 2 + (a11 * a12 + a21 * a22) ** 2)
    mean = 0.5 * (a11 * a11 + a21 * a21 + a12 * a12 + a22 * a22)
    row[RMS] = np.sqrt(squares / max(n_good, 1))
    row[H3] = 2.0 * np.hypot(h[0], h[1]) / max(n_found, 1)
    row[H4] = 2.0 * np.hypot(h[2], h[3]) / max(n_found, 1)
    row[H6] = 2.0 * np.hypot(h[4], h[5]) / max(n_found, 1)
    row[ARC] = n_good / n_rays
    row[RUN] = longest / n_rays
    row[CONTRAST] = slope / max(n_good, 1) / 0.35  # a sharp edge of height 1 has the slope 0.37
    row[ASPECT] = np.sqrt(max(mean - spread, 0.0) / (mean + spread))


@compiled(
    types.boolean(
        U8_2D, types.float64, F32_3D_IN, types.float64, types.float64, types.float64, F64_1D, F64_2D, F64_1D, F64_2D,
        F64_1D,
    )
)  # fmt: skip
def refine(
    grey: Bytes, sign: float, rays: Rays, step: float, flattening: float, variance: float, start: Array, points: Array,
    slopes: Array, scratch: Array, row: Array,
) -> bool:  # fmt: skip
    """Measure one circle from ``start`` (see ``cast``), leave it in ``row``, and the better start in ``start``."""
    radius = 1.0 / np.sqrt(np.sqrt(start[2] * start[4] - start[3] * start[3]))
    n_rays = min(max(int(2.0 * np.pi * radius / 1.3), 24), MAX_RAYS)
    n_seen = cast(grey, sign, start, 0.35, n_rays, False, points, slopes, scratch)
    x, y, xu, xv, yu, yv = to_plane(rays, step, start[0], start[1])
    fit, cov, residuals = np.empty(7), np.empty((5, 5)), np.zeros(n_rays)
    fit[0], fit[1], fit[2] = x, y, radius * np.sqrt(abs(xu * yv - xv * yu))
    fit[3], fit[4], fit[5], fit[6] = 1.0, 0.0, 0.0, 1.0
    for k in range(n_rays):
        if slopes[k] > 0.0:
            points[k, 0], points[k, 1], _, _, _, _ = to_plane(rays, step, points[k, 0], points[k, 1])
    if not _ellipse(points, slopes, n_rays, flattening, fit, residuals, cov):
        return False
    x, y, radius, a11, a12, a21, a22 = fit[0], fit[1], fit[2], fit[3], fit[4], fit[5], fit[6]
    u, v, ux, uy, vx, vy = to_pixel(rays, step, x, y, start[0], start[1])
    if not (-0.5 <= u <= grey.shape[1] - 0.5 and -0.5 <= v <= grey.shape[0] - 0.5):
        return False
    _judge(points, slopes, residuals, fit, row, n_rays)
    zoom = np.sqrt(abs(ux * vy - uy * vx))
    crowding = max(1.0, n_rays * 1.3 / (2.0 * np.pi * radius * zoom))  # rays closer than a pixel say the same
    row[U], row[V], row[RADIUS] = u, v, radius * zoom
    xx, xy, yy = cov[0, 0] * crowding, cov[0, 1] * crowding, cov[1, 1] * crowding
    row[UU] = ux * ux * xx + 2.0 * ux * uy * xy + uy * uy * yy + variance
    row[UV] = ux * vx * xx + (ux * vy + uy * vx) * xy + uy * vy * yy
    row[VV] = vx * vx * xx + 2.0 * vx * vy * xy + vy * vy * yy + variance
    row[VU] = row[UV]
    row[IS_CUT] = 1.0 if min(u, v, grey.shape[1] - 1 - u, grey.shape[0] - 1 - v) < row[RADIUS] else 0.0
    row[AGREE] = row[ARC] * n_rays / max(n_seen, 1)
    fit_quality = np.exp(-0.5 * (row[RMS] / (0.033 * radius + 0.3)) ** 2)
    row[SCORE] = min(1.0, row[ARC] * row[AGREE] * fit_quality * row[CONTRAST] / (row[CONTRAST] + 5.0))
    _, _, xu, xv, yu, yv = to_plane(rays, step, u, v)
    row[X], row[Y] = x, y
    row[XX], row[YY] = xx + variance * (xu * xu + xv * xv), yy + variance * (yu * yu + yv * yv)
    row[XY] = row[YX] = xy + variance * (xu * yu + xv * yv)
    b11, b12 = (a11 * xu + a12 * yu) / radius, (a11 * xv + a12 * yv) / radius
    b21, b22 = (a21 * xu + a22 * yu) / radius, (a21 * xv + a22 * yv) / radius
    start[0], start[1] = u, v
    start[2], start[3], start[4] = b11 * b11 + b21 * b21, b11 * b12 + b21 * b22, b12 * b12 + b22 * b22
    return True


@compiled(types.boolean(F64_1D, F64_1D_IN, types.float64, types.float64))
def is_circle(row: Array, gates: Array, min_radius: float, max_radius: float) -> bool:
    """Decide: right size, round, an edge all around as far as it is in view."""
    radius = row[RADIUS]
    harmonic = gates[2] * radius + gates[3]
    return bool(
        min_radius <= radius <= max_radius
        and row[RMS] <= gates[0] * radius + gates[1]
        and row[H3] <= harmonic
        and row[H4] <= harmonic
        and row[H6] <= harmonic
        and row[ARC] >= gates[4]
        and row[AGREE] >= gates[5]
        and row[RUN] >= gates[6]
        and row[ASPECT] >= gates[7]
        and row[CONTRAST] >= gates[8]
    )
