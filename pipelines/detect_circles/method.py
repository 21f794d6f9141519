"""The method of the default detector from the pixels to the list of circles (its steps are in ``detect``).

1. ``_locate``: a seed becomes a first circle through the edges on a few coarse rays, if it stands out of a ring around
   it, most of these edges lie on one circle, and what is left over is not a square's.
2. ``fitting.refine``: many fine rays and a robust fit, for those few.
3. ``fitting.is_circle``: the gates.

Compiled by numba; imported where it is used.
"""

import numpy as np
import numpy.typing as npt
from numba import types

from ..engine.compiled import F32_1D_IN, F32_3D_IN, F64_1D, F64_1D_IN, F64_2D, U8_2D, compiled, floats
from .edges import MAX_RAYS, cast, first_circle, stands_out
from .fitting import N_COLUMNS, RADIUS, U, V, is_circle, refine
from .kernels import find_seeds, local_contrast, shrink

Array = npt.NDArray[np.float64]
Bytes = npt.NDArray[np.uint8]
Floats = npt.NDArray[np.float32]
Rays = npt.NDArray[np.float32]

FIRST_RAYS = 18
FIRST_AGREE = 0.76  # share of a lamp's first edge points that lie on one circle; 0.83 is the least seen
FIRST_SQUARE, FIRST_SQUARE_PX = 0.03, 0.6  # amplitude of its 4th harmonic; two thirds of this is the most seen


@compiled(types.boolean(U8_2D, types.float64, F64_1D, floats(2), F64_1D, F64_2D, F64_1D, F64_2D))
def _locate(
    grey: Bytes, sign: float, seed: Array, radii: tuple[float, float], start: Array, points: Array, slopes: Array,
    scratch: Array,
) -> bool:  # fmt: skip
    """Turn a seed into a first circle, left in ``start`` (see ``cast``); False where the edge is not round."""
    if not stands_out(grey, sign, seed):
        return False
    start[0], start[1], start[2], start[3], start[4] = seed[0], seed[1], seed[2] ** -2.0, 0.0, seed[2] ** -2.0
    for reach in (0.55, 0.4):
        if cast(grey, sign, start, reach, FIRST_RAYS, True, points, slopes, scratch) < 8:
            return False
        x, y, r, agreed, square = first_circle(points, slopes, FIRST_RAYS, start, scratch[0])
        before = 1.0 / np.sqrt(start[2])
        moved = (np.hypot(x - start[0], y - start[1]) + abs(r - before)) / before
        if not (0.6 * radii[0] < r < 1.6 * radii[1] and moved < 1.0 and agreed > FIRST_AGREE):
            return False
        start[0], start[1], start[2], start[4] = x, y, r**-2.0, r**-2.0
        if moved < 0.2:
            break
    return bool(square < FIRST_SQUARE * r + FIRST_SQUARE_PX)


@compiled(types.boolean(F64_2D, types.int64, types.float64, types.float64, types.float64, types.float64))
def _is_listed(circles: Array, n: int, u: float, v: float, radius: float, share: float) -> bool:
    """Tell whether a circle lies among the first n, to a share of its radius."""
    limit = share * radius
    for k in range(n):
        if abs(radius - circles[k, 2]) < limit and (u - circles[k, 0]) ** 2 + (v - circles[k, 1]) ** 2 < limit * limit:
            return True
    return False


@compiled(
    F64_2D(U8_2D, types.boolean, F64_2D, F32_3D_IN, types.float64, floats(2), types.float64, F64_1D_IN)
)  # fmt: skip
def _measure(
    grey: Bytes, is_dark: bool, seeds: Array, rays: Rays, step: float, radii: tuple[float, float],
    flattening: float, gates: Array,
) -> Array:  # fmt: skip
    """Measure every seed and keep the circles: (N, N_COLUMNS).

    Args:
        grey: (H, W) image.
        is_dark: look for dark circles.
        seeds: (M, 3) u, v, radius [px], the best last.
        rays: (h, w, 2) table of the plane (see ``detect.Plane``), or (0, 0, 2) to fit ellipses in the image.
        step: distance of its nodes [px].
        radii: least and greatest radius [px].
        flattening: see ``fitting``.
        gates: see ``fitting.is_circle``; the last is a variance [px^2] added to the centre's.
    """
    kept, n = np.empty((seeds.shape[0], N_COLUMNS)), 0
    tried, refused = np.empty((seeds.shape[0], 3)), np.empty((seeds.shape[0], 3))
    points, slopes = np.empty((MAX_RAYS, 2)), np.empty(MAX_RAYS)
    scratch = np.empty((2, int(8.0 * radii[1]) + 128))
    start, row = np.empty(5), np.empty(N_COLUMNS)
    sign = -1.0 if is_dark else 1.0
    n_tried = n_refused = 0
    for s in range(seeds.shape[0] - 1, -1, -1):
        u, v, radius = seeds[s, 0], seeds[s, 1], seeds[s, 2]
        is_known = False
        for k in range(n):
            is_known |= np.hypot(u - kept[k, U], v - kept[k, V]) < 0.6 * kept[k, RADIUS]
        is_known |= _is_listed(tried, n_tried, u, v, radius, 0.3)
        is_known |= _is_listed(refused, n_refused, u, v, radius, 0.3)
        if is_known:
            continue
        tried[n_tried, 0], tried[n_tried, 1], tried[n_tried, 2] = u, v, radius
        n_tried += 1
        is_good = _locate(grey, sign, seeds[s], radii, start, points, slopes, scratch)
        u, v, radius = start[0], start[1], 1.0 / np.sqrt(start[2])
        is_good = is_good and not _is_listed(refused, n_refused, u, v, radius, 0.1)
        if not is_good:
            continue
        is_good = refine(grey, sign, rays, step, flattening, gates[9], start, points, slopes, scratch, row)
        if is_good and np.hypot(row[U] - u, row[V] - v) > 0.05 * radius + 0.3:
            is_good = refine(grey, sign, rays, step, flattening, gates[9], start, points, slopes, scratch, row)
        if not (is_good and is_circle(row, gates, radii[0], radii[1])):
            refused[n_refused, 0], refused[n_refused, 1], refused[n_refused, 2] = u, v, radius
            n_refused += 1
            continue
        for k in range(n):
            is_good &= np.hypot(row[U] - kept[k, U], row[V] - kept[k, V]) > 0.6 * kept[k, RADIUS]
        if is_good:
            k = n  # sorted by v
            while k > 0 and kept[k - 1, V] > row[V]:
                kept[k] = kept[k - 1]
                k -= 1
            kept[k] = row
            n += 1
    return kept[:n]


@compiled(
    F64_2D(
        U8_2D, types.boolean, types.int64, types.int64, F32_1D_IN, floats(2), F32_3D_IN, types.float64, types.float64,
        F64_1D_IN,
    )
)  # fmt: skip
def find(
    grey: Bytes, is_dark: bool, scale: int, reach: int, levels: Floats, radii: tuple[float, float], rays: Rays,
    step: float, flattening: float, gates: Array,
) -> Array:  # fmt: skip
    """Find the circles of an image: (N, N_COLUMNS), sorted by v.

    Args:
        grey: (H, W) image.
        is_dark: look for dark circles.
        scale: how many times smaller the image is in which they are proposed.
        reach: half the side of the box around a pixel that it is compared with [px of the small image].
        levels: rising contrasts at which the small image is cut into regions [grey values].
        radii: least and greatest radius [px].
        rays: table of the plane, see ``_measure``.
        step: distance of its nodes [px].
        flattening: see ``fitting``.
        gates: see ``fitting.is_circle``; the last is a variance [px^2] added to the centre's.
    """
    small = shrink(grey, scale, is_dark)
    reached = local_contrast(small, reach, scale, levels)
    seeds = find_seeds(reached, small.shape[0], small.shape[1], levels.size, radii[0], radii[1], scale)
    return _measure(grey, is_dark, seeds, rays, step, radii, flattening, gates)
