"""Where an edge is along a ray, to a fraction of a pixel, and a first circle through such points.

1. ``cast``: along rays from the centre, where does the brightness fall most steeply? The slope is taken with an
   antisymmetric kernel and its peak with a parabola through the logarithms, which is exact for a Gaussian peak.
2. ``first_circle``: a circle through the edge points, robust enough for a seed that is off the centre.

Compiled by numba; imported where it is used.
"""

import numpy as np
import numpy.typing as npt
from numba import types

from ..engine.compiled import F64_1D, F64_1D_IN, F64_2D, U8_2D, compiled, floats

Array = npt.NDArray[np.float64]
Bytes = npt.NDArray[np.uint8]

HALF = 3  # half width of the slope kernel [px]
MAX_RAYS = 64
MIN_SLOPE = 2.5  # least fall of brightness [grey values per px] that counts as an edge


N_RING = 16
RING_C, RING_S = float(np.cos(2.0 * np.pi / N_RING)), float(np.sin(2.0 * np.pi / N_RING))
MIN_STEP = 5.0  # least fall [grey values] from the middle of a seed to the ring around it


@compiled(types.float64(F64_1D, types.int64))
def median(values: Array, n: int) -> float:
    """Return the median (the upper one of two) of the first n values, which are left in another order."""
    low, high, middle = 0, n - 1, n // 2
    while low < high:  # Hoare's selection: nothing is allocated, nothing sorted that need not be
        pivot = values[(low + high) // 2]
        i, j = low, high
        while i <= j:
            while values[i] < pivot:
                i += 1
            while values[j] > pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            break
    return float(values[middle])


@compiled(floats(2)(types.float64, types.float64, types.float64))
def _inside(start: float, direction: float, limit: float) -> tuple[float, float]:
    """Return for which t the coordinate start + t direction lies in [0, limit)."""
    if abs(direction) < 1e-12:
        return (-1e9, 1e9) if 0.0 <= start < limit else (1e9, -1e9)
    a, b = -start / direction, (limit - start) / direction
    return (a, b) if a < b else (b, a)


@compiled(floats(2)(F64_1D, F64_1D, types.int64, types.int64, types.float64, types.float64))
def _steepest(profile: Array, slope: Array, begin: int, end: int, middle: float, width: float) -> tuple[float, float]:
    """Return where the profile falls most steeply between two samples, and how steeply; -1 where it does not.

    The slope is weighted by a parabola around ``middle`` that is 1 - 0.5 at ``width`` from it.
    """
    first, last = np.uint64(begin + HALF), np.uint64(end - HALF)
    one, two, three = np.uint64(1), np.uint64(2), np.uint64(3)
    for k in range(first, last):
        slope[k] = (
            0.175 * (profile[k - one] - profile[k + one])
            + 0.145 * (profile[k - two] - profile[k + two])
            + 0.05 * (profile[k - three] - profile[k + three])
        )
    best, at = 0.0, -1
    factor = 0.5 / (width * width)
    for k in range(begin + HALF, end - HALF):
        weighted = slope[k] * (1.0 - factor * (k - middle) * (k - middle))
        if weighted > best:
            best, at = weighted, k
    if at <= begin + HALF or at >= end - HALF - 1:  # no fall, or its top lies beyond what was looked at
        return -1.0, 0.0
    before, here, after = slope[at - 1], slope[at], slope[at + 1]
    if before <= 0.0 or after <= 0.0 or here < before or here < after:
        return float(at), here
    curvature = np.log(before * after / (here * here))
    return (at + 0.5 * np.log(before / after) / curvature if curvature < -1e-9 else float(at)), here


@compiled(types.boolean(U8_2D, types.float64, F64_1D))
def stands_out(grey: Bytes, sign: float, seed: Array) -> bool:
    """Tell cheaply whether the middle of a seed (u, v, radius) differs from most of a ring around it."""
    height, width = grey.shape
    u, v, radius = seed[0], seed[1], seed[2]
    dx, dy = 1.0, 0.0
    inner = 0.0
    n_inner = n_lower = n_seen = 0
    for k in range(2 * N_RING):
        r = 0.3 * radius if k < N_RING else 1.4 * radius
        x, y = u + r * dx + 0.5, v + r * dy + 0.5
        dx, dy = dx * RING_C - dy * RING_S, dx * RING_S + dy * RING_C
        if not (0.0 <= x < width and 0.0 <= y < height):
            continue
        value = sign * grey[np.int32(y), np.int32(x)]
        if k < N_RING:
            inner += value
            n_inner += 1
        elif n_inner > 0:
            n_seen += 1
            n_lower += value < inner / n_inner - MIN_STEP
    return n_inner == 0 or n_lower >= 0.55 * n_seen


@compiled(
    types.int64(U8_2D, types.float64, F64_1D_IN, types.float64, types.int64, types.boolean, F64_2D, F64_1D, F64_2D)
)
def cast(
    grey: Bytes, sign: float, start: Array, reach: float, n_rays: int, is_coarse: bool, points: Array, slopes: Array,
    scratch: Array,
) -> int:  # fmt: skip
    """Look for an edge along each ray; return how many rays could see one.

    Args:
        grey: (H, W) image.
        sign: 1 for bright circles, -1 for dark ones.
        start: centre u, v, then the symmetric matrix of an ellipse: 1 / r^2 = m0 dx^2 + 2 m1 dx dy + m2 dy^2.
        reach: the edge is looked for at r (1 -+ reach), at least 4 px either way.
        n_rays: number of rays.
        is_coarse: take the nearest pixels instead of interpolating.
        points: (MAX_RAYS, 2) filled with edge points [px].
        slopes: (MAX_RAYS,) filled with slopes; 0 in view but no edge; -1 out of view.
        scratch: (2, n) for a profile and its slope.
    """
    height, width = grey.shape
    flat = grey.reshape(-1)
    stride, one = np.uint64(width), np.uint64(1)
    profile, slope = scratch[0], scratch[1]
    turn_c, turn_s = np.cos(2.0 * np.pi / n_rays), np.sin(2.0 * np.pi / n_rays)
    dx, dy = np.cos(np.pi / n_rays), np.sin(np.pi / n_rays)
    n_seen = 0
    for k in range(n_rays):
        radius = 1.0 / np.sqrt(start[2] * dx * dx + 2.0 * start[3] * dx * dy + start[4] * dy * dy)
        span = max(radius * reach, 4.0)
        first = max(radius - span, 1.0) - HALF
        middle = radius - first
        n = int(radius + span + HALF - first) + 2
        xa, xb = _inside(start[0] + first * dx, dx, width - 1 - 1e-6)
        ya, yb = _inside(start[1] + first * dy, dy, height - 1 - 1e-6)
        begin = int(np.ceil(max(xa, ya, 0.0)))
        end = int(np.ceil(min(xb, yb, float(n))))
        slopes[k] = -1.0
        if begin <= middle - HALF - 1 and end >= middle + HALF + 1:
            x, y = start[0] + (first + begin) * dx, start[1] + (first + begin) * dy
            if is_coarse:
                for s in range(begin, end):
                    profile[s] = sign * flat[np.uint64(np.int32(y + 0.5) * width + np.int32(x + 0.5))]
                    x += dx
                    y += dy
            else:
                for s in range(begin, end):
                    j, i = np.int32(x), np.int32(y)
                    a, b = x - j, y - i
                    p = np.uint64(i * width + j)
                    q = p + stride
                    top = flat[p] + a * (np.float64(flat[p + one]) - flat[p])
                    bottom = flat[q] + a * (np.float64(flat[q + one]) - flat[q])
                    profile[s] = sign * (top + b * (bottom - top))
                    x += dx
                    y += dy
            n_seen += 1
            at, fall = _steepest(profile, slope, begin, end, middle, span)
            slopes[k] = 0.0
            if at >= 0.0 and fall > MIN_SLOPE:
                slopes[k] = fall
                points[k, 0], points[k, 1] = start[0] + (first + at) * dx, start[1] + (first + at) * dy
        dx, dy = dx * turn_c - dy * turn_s, dx * turn_s + dy * turn_c
    return n_seen


@compiled(floats(5)(F64_2D, F64_1D, types.int64, F64_1D_IN, F64_1D))
def first_circle(  # noqa: C901
    points: Array, slopes: Array, n_rays: int, start: Array, scratch: Array
) -> tuple[float, float, float, float, float]:
    """Fit a first circle to the edge points; radius 0 if that fails.

    Returns:
        u, v, radius, share of the points that agree, amplitude of the 4th harmonic of what is left over (a square's).
    """
    x0, y0 = start[0], start[1]
    n = 0
    for k in range(n_rays):
        if slopes[k] > 0.0:
            scratch[n] = slopes[k]
            n += 1
    if n < 8:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    weakest = 0.35 * median(scratch, n)
    n = 0
    for k in range(n_rays):
        if slopes[k] > weakest:
            scratch[n] = np.sqrt((points[k, 0] - x0) ** 2 + (points[k, 1] - y0) ** 2)
            n += 1
    x, y, radius = 0.0, 0.0, median(scratch, n)
    scale = 0.35 * radius
    for _ in range(4):
        w_sum = sx = sy = sxx = sxy = syy = sz = sxz = syz = 0.0
        for k in range(n_rays):
            if slopes[k] <= weakest:
                continue
            a, b = points[k, 0] - x0, points[k, 1] - y0
            e = (np.sqrt((a - x) * (a - x) + (b - y) * (b - y)) - radius) / scale
            w = 1.0 / (1.0 + e * e)
            w *= w
            z = a * a + b * b
            w_sum += w
            sx += w * a
            sy += w * b
            sxx += w * a * a
            sxy += w * a * b
            syy += w * b * b
            sz += w * z
            sxz += w * a * z
            syz += w * b * z
        if w_sum < 3.0:
            return 0.0, 0.0, 0.0, 0.0, 0.0
        xx, xy, yy = sxx - sx * sx / w_sum, sxy - sx * sy / w_sum, syy - sy * sy / w_sum
        xz, yz = sxz - sx * sz / w_sum, syz - sy * sz / w_sum
        determinant = xx * yy - xy * xy
        if determinant < 1e-4 * (xx + yy) ** 2:
            return 0.0, 0.0, 0.0, 0.0, 0.0
        x, y = 0.5 * (xz * yy - yz * xy) / determinant, 0.5 * (yz * xx - xz * xy) / determinant
        radius = np.sqrt(max(1e-6, (sz - 2.0 * (x * sx + y * sy)) / w_sum + x * x + y * y))
        scale = max(0.5 * scale, 0.06 * radius + 0.5)
    n_agreed = 0
    c4 = s4 = 0.0
    for k in range(n_rays):
        if slopes[k] > weakest:
            a, b = points[k, 0] - x0 - x, points[k, 1] - y0 - y
            rr = max(a * a + b * b, 1e-9)
            e = np.sqrt(rr) - radius
            n_agreed += abs(e) < 0.08 * radius + 1.0
            e = min(max(e, -0.15 * radius - 1.0), 0.15 * radius + 1.0)  # one stray point is no harmonic
            c2, s2 = (a * a - b * b) / rr, 2.0 * a * b / rr
            c4 += e * (c2 * c2 - s2 * s2)
            s4 += e * 2.0 * c2 * s2
    return x + x0, y + y0, radius, n_agreed / n, 2.0 * np.sqrt(c4 * c4 + s4 * s4) / n
