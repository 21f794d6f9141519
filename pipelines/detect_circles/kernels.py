"""Where lamps may be: the image made small, compared with its surroundings, and cut into blobs at several levels.

1. ``shrink``: means over s x s pixels, so that noise falls by s and the work by s^2.
2. ``local_contrast``: how much brighter than the mean of the box around it each small pixel is, as the number of
   levels that it reaches.
3. ``find_seeds``: every connected region of every level (a region of a higher level lies in one of the level below)
   proposes circles: a round region its own centre; one at the border of the image the circle through its edge; any
   other the deepest points inside it, which separates lamps that touch.

From 2 on the small image is flat with a frame of one pixel around it, whose value OUTSIDE belongs to every region and
is never entered: so a region that the image border cuts has no edge there, and no loop asks for bounds.

Compiled by numba; imported where it is used, because numba takes a third of a second to load.
"""

import numpy as np
import numpy.typing as npt
from numba import types

from ..engine.compiled import F32_1D_IN, F64_1D, F64_2D, I32_1D, I32_2D, U8_1D, U8_2D, U16_2D, compiled, floats

Array = npt.NDArray[np.float64]
Bytes = npt.NDArray[np.uint8]
Ints = npt.NDArray[np.int32]
Sums = npt.NDArray[np.uint16]
Floats = npt.NDArray[np.float32]

ROUND_ASPECT = 1.5
ROUND_FILL = 0.86
LONG_ASPECT = 1.7
LONG_FILL = 0.93
MAX_PICKS = 8
OUTSIDE = 255


@compiled(U16_2D(U8_2D, types.int64, types.boolean))
def shrink(grey: Bytes, scale: int, is_dark: bool) -> Sums:  # noqa: C901
    """Sum blocks of scale x scale pixels; of 255 - grey where dark circles are looked for.

    Args:
        grey: (H, W) image.
        scale: side of the blocks [px], 1..16.
        is_dark: invert the image.

    Returns:
        (H // scale, W // scale) sums, at most 255 scale^2.
    """
    height, width = grey.shape[0] // scale, grey.shape[1] // scale
    small = np.empty((height, width), np.uint16)
    column = np.empty(width * scale, np.uint16)
    for i in range(height):
        for j in range(width * scale):
            column[j] = grey[scale * i, j]
        for k in range(1, scale):
            row = grey[scale * i + k]
            for j in range(width * scale):
                column[j] += np.uint16(row[j])
        if scale == 4:  # the usual one, written out so that it is vectorised
            for j in range(width):
                small[i, j] = column[4 * j] + column[4 * j + 1] + column[4 * j + 2] + column[4 * j + 3]
        else:
            for j in range(width):
                total = 0
                for k in range(scale):
                    total += column[scale * j + k]
                small[i, j] = total
        if is_dark:
            for j in range(width):
                small[i, j] = np.uint16(255 * scale * scale - small[i, j])
    return small


@compiled(U8_1D(U16_2D, types.int64, types.int64, F32_1D_IN))
def local_contrast(small: Sums, reach: int, scale: int, levels: Floats) -> Bytes:  # noqa: C901, PLR0912
    """Count the levels by which each small pixel exceeds the mean of the box around it.

    Args:
        small: (h, w) block sums.
        reach: the box covers 2 reach + 1 small pixels each way, less at the borders.
        scale: side of the blocks [px].
        levels: rising contrasts [grey values].

    Returns:
        Flat (h + 2) (w + 2) number of levels reached, 0..len(levels); OUTSIDE in the frame and up to a whole word.
    """
    height, width = small.shape
    stride = width + 2
    result = np.full(-(-(height + 2) * stride // 8) * 8, np.uint8(OUTSIDE))
    columns = np.zeros(width, np.int32)
    total = np.zeros(width + 2 * reach + 2, np.int32)  # running sum, held constant outside the row
    share = np.empty(width, np.float32)
    excess = np.empty(width, np.float32)
    for j in range(width):
        share[j] = 1.0 / (scale * scale * (min(width, j + reach + 1) - max(0, j - reach)))
    for i in range(min(reach, height)):
        for j in range(width):
            columns[j] += np.int32(small[i, j])
    unit = np.float32(1.0 / (scale * scale))
    for i in range(height):
        if i + reach < height:
            for j in range(width):
                columns[j] += np.int32(small[i + reach, j])
        if i - reach - 1 >= 0:
            for j in range(width):
                columns[j] -= np.int32(small[i - reach - 1, j])
        rows = np.float32(1.0 / (min(height, i + reach + 1) - max(0, i - reach)))
        running = np.int32(0)
        for j in range(width):
            running += columns[j]
            total[reach + 1 + j] = running
        for j in range(reach + 1 + width, total.size):
            total[j] = running
        above, below = total[2 * reach + 1 :], total[:width]
        for j in range(width):
            mean = np.float32(above[j] - below[j]) * share[j] * rows
            excess[j] = np.float32(small[i, j]) * unit - mean
        row = result[(i + 1) * stride + 1 : (i + 2) * stride - 1]
        lowest = levels[0]
        for j in range(width):
            row[j] = np.uint8(excess[j] > lowest)
        for k in range(1, levels.size):
            level = levels[k]
            for j in range(width):
                row[j] += np.uint8(excess[j] > level)
    return result


@compiled(types.int64(U8_1D, types.int64, I32_2D, types.int64, I32_2D))
def _runs(reached: Bytes, level: int, below: Ints, n_below: int, runs: Ints) -> int:
    """Cut the runs (first, stop) of the level below into those of this level; return their number."""
    words, n = reached.view(np.uint64), 0
    for k in range(n_below):
        at, stop = below[0, k], below[1, k]
        while at < stop:
            while at < stop and reached[at] < level:
                at += 8 if at % 8 == 0 and words[at // 8] == 0 else 1  # the frame ends every word of zeros
            if at >= stop:
                break
            runs[0, n] = at
            while at < stop and reached[at] >= level:
                at += 1
            runs[1, n] = at
            n += 1
    return n


@compiled(types.void(I32_2D, types.int64, types.int64))
def _connect(runs: Ints, n: int, stride: int) -> None:
    """Write into row 2 the first run of the region that each run belongs to (union-find over adjacent rows)."""
    parent = runs[2]
    above = 0
    for k in range(n):
        parent[k] = k
        low, high = runs[0, k] - stride, runs[1, k] - stride
        while runs[1, above] <= low:
            above += 1
        other = above
        while other < k and runs[0, other] < high:
            a, b = other, k
            while parent[a] != a:
                parent[a] = parent[parent[a]]
                a = parent[a]
            while parent[b] != b:
                parent[b] = parent[parent[b]]
                b = parent[b]
            parent[max(a, b)] = min(a, b)
            other += 1
    for k in range(n):
        parent[k] = parent[parent[k]]  # a parent comes first, so it is final here


@compiled(types.void(I32_2D, types.int64, types.int64, types.int64, types.int64, F64_2D))
def _sum_up(runs: Ints, n: int, stride: int, height: int, width: int, sums: Array) -> None:
    """Add up, for each region's first run, count, x, y, xx, xy, yy, and whether it meets the image border.

    Rows 3 and 4 of ``runs`` become a list: the next run of the same region, -1 at its end; and the last.
    """
    for k in range(n):
        root = runs[2, k]
        runs[3, k] = -1
        if root == k:
            sums[k] = 0.0
        else:
            runs[3, runs[4, root]] = k
        runs[4, root] = k
        y = runs[0, k] // stride
        first, stop = float(runs[0, k] - y * stride), float(runs[1, k] - y * stride)
        m = stop - first
        x = 0.5 * m * (first + stop - 1.0)
        sums[root, 0] += m
        sums[root, 1] += x
        sums[root, 2] += m * y
        sums[root, 3] += ((stop - 1) * stop * (2 * stop - 1) - (first - 1) * first * (2 * first - 1)) / 6.0
        sums[root, 4] += x * y
        sums[root, 5] += m * y * y
        if min(y, first) == 1 or y == height or stop == width + 1:
            sums[root, 6] = 1.0


@compiled(floats(4)(F64_1D))
def _shape(sums: Array) -> tuple[float, float, float, float]:
    """Return centroid x, y, aspect and fill (1 for any ellipse) of a region."""
    n = sums[0]
    x, y = sums[1] / n, sums[2] / n
    xx = sums[3] / n - x * x + 1.0 / 12.0  # a pixel is a square, not a point
    yy = sums[5] / n - y * y + 1.0 / 12.0
    xy = sums[4] / n - x * y
    mean, spread = 0.5 * (xx + yy), np.sqrt(0.25 * (xx - yy) ** 2 + xy * xy)
    minor = max(mean - spread, 1e-9)
    aspect = np.sqrt((mean + spread) / minor)
    fill = n / (4.0 * np.pi * np.sqrt((mean + spread) * minor))  # an ellipse's area is 4 pi sqrt(l1 l2)
    return x, y, aspect, fill


@compiled(floats(3)(U8_1D, types.int64, types.int64, I32_1D))
def _edge_circle(reached: Bytes, stride: int, level: int, region: Ints) -> tuple[float, float, float]:
    """Fit a circle (algebraic) to the region's edge inside the image; radius 0 when there is none."""
    y0 = region[0] // stride
    x0 = region[0] - y0 * stride
    n = sx = sy = sxx = sxy = syy = sz = sxz = syz = 0.0
    for at in region:
        if min(reached[at - 1], reached[at + 1], reached[at - stride], reached[at + stride]) >= level:
            continue  # inside
        i = at // stride
        j = at - i * stride
        for d in range(4):
            dx, dy = (d == 1) - (d == 0), (d == 3) - (d == 2)
            if reached[at + dx + dy * stride] < level:
                x, y = j - x0 + 0.5 * dx, i - y0 + 0.5 * dy
                z = x * x + y * y
                n += 1.0
                sx += x
                sy += y
                sxx += x * x
                sxy += x * y
                syy += y * y
                sz += z
                sxz += x * z
                syz += y * z
    if n < 5.0:
        return 0.0, 0.0, 0.0
    xx, xy, yy = sxx - sx * sx / n, sxy - sx * sy / n, syy - sy * sy / n
    xz, yz = sxz - sx * sz / n, syz - sy * sz / n
    determinant = xx * yy - xy * xy
    if determinant < 1e-6 * (xx + yy) ** 2:
        return 0.0, 0.0, 0.0
    x = 0.5 * (xz * yy - yz * xy) / determinant
    y = 0.5 * (yz * xx - xz * xy) / determinant
    radius = np.sqrt(max(0.0, (sz - 2.0 * (x * sx + y * sy)) / n + x * x + y * y))
    return x + x0, y + y0, radius


@compiled(types.int64(U8_1D, types.int64, types.int64, I32_1D, I32_1D, I32_1D))
def _depths(reached: Bytes, stride: int, level: int, region: Ints, depth: Ints, order: Ints) -> int:
    """Write into ``depth`` how many steps each pixel of the region is from its edge, into ``order`` the pixels by it.

    Returns:
        The number of pixels in ``order``; 0 for a region without an edge.
    """
    tail = 0
    for at in region:
        is_edge = (reached[at - 1] < level) | (reached[at + 1] < level)
        is_edge |= (reached[at - stride] < level) | (reached[at + stride] < level)
        depth[at] = is_edge
        order[tail] = at
        tail += is_edge
    head = 0
    while head < tail:
        at = order[head]
        head += 1
        for near in (at - 1, at + 1, at - stride, at + stride):
            if level <= reached[near] < OUTSIDE and depth[near] == 0:
                depth[near] = depth[at] + 1
                order[tail] = near
                tail += 1
    return tail


@compiled(types.int64(I32_1D, types.int64, I32_1D, types.float64, types.float64, F64_2D, types.int64))
def _pick(order: Ints, stride: int, depth: Ints, least: float, most: float, seeds: Array, n: int) -> int:
    """Append the deepest points of a region, each farther from the ones before than 1.2 times their depth."""
    picked, n_picked = np.empty((MAX_PICKS, 3)), 0
    for k in range(order.size - 1, -1, -1):  # ``order`` rises with the depth
        best = depth[order[k]]
        if best - 0.5 < least or n_picked == MAX_PICKS:
            break
        i = order[k] // stride
        j = order[k] - i * stride
        is_covered = False
        for m in range(n_picked):
            is_covered |= (picked[m, 0] - j) ** 2 + (picked[m, 1] - i) ** 2 < 1.44 * picked[m, 2] ** 2
        if is_covered:
            continue
        picked[n_picked, 0], picked[n_picked, 1], picked[n_picked, 2] = j, i, best
        n_picked += 1
        if best <= most:
            seeds[n, 0], seeds[n, 1], seeds[n, 2] = j, i, best - 0.5
            n += 1
    return n


@compiled(
    types.int64(
        U8_1D, types.int64, types.int64, I32_2D, types.int64, F64_1D, floats(2), I32_2D, F64_2D,
        types.int64,
    )
)  # fmt: skip
def _propose(
    reached: Bytes, stride: int, level: int, runs: Ints, root: int, sums: Array, radii: tuple[float, float],
    scratch: Ints, seeds: Array, n: int,
) -> int:  # fmt: skip
    """Append the circles that one region proposes to ``seeds`` and return their new number."""
    least, most = radii
    x, y, aspect, fill = _shape(sums)
    radius, is_at_border = np.sqrt(sums[0] / np.pi), sums[6] > 0.0
    if not is_at_border and aspect < ROUND_ASPECT and fill > ROUND_FILL:
        if least <= radius <= most:
            seeds[n, 0], seeds[n, 1], seeds[n, 2] = x, y, radius
            n += 1
        return n
    if not is_at_border and aspect > LONG_ASPECT and fill > LONG_FILL:
        return n  # a panel or a stripe; lamps that touch leave notches
    size, run = 0, root
    while run >= 0:
        for at in range(runs[0, run], runs[1, run]):
            scratch[0, size] = at
            size += 1
        run = runs[3, run]
    region = scratch[0, :size]
    if is_at_border:
        x, y, radius = _edge_circle(reached, stride, level, region)
        if least <= radius <= most:
            seeds[n, 0], seeds[n, 1], seeds[n, 2] = x, y, radius
            n += 1
    n_ordered = _depths(reached, stride, level, region, scratch[1], scratch[2])
    return _pick(scratch[2, :n_ordered], stride, scratch[1], least, most, seeds, n)


@compiled(F64_2D(U8_1D, types.int64, types.int64, types.int64, types.float64, types.float64, types.int64))
def find_seeds(
    reached: Bytes, height: int, width: int, n_levels: int, min_radius: float, max_radius: float, scale: int
) -> Array:
    """Propose circles: (M, 3) centre u, v and radius [px], those of the highest level last.

    Args:
        reached: from ``local_contrast``.
        height: of the small image.
        width: of the small image.
        n_levels: number of levels.
        min_radius: of the circles looked for [px].
        max_radius: of the circles looked for [px].
        scale: side of a small pixel [px].
    """
    stride = width + 2
    most_runs = height * (width // 2 + 1)
    runs, below = np.empty((5, most_runs), np.int32), np.empty((5, most_runs), np.int32)
    sums, scratch = np.empty((most_runs, 7)), np.empty((3, reached.size), np.int32)
    seeds, n = np.empty((64, 3)), 0
    radii = (0.6 * min_radius / scale, 1.5 * max_radius / scale)
    for i in range(height):
        below[0, i], below[1, i] = (i + 1) * stride + 1, (i + 2) * stride - 1
    n_runs = height
    for level in range(1, n_levels + 1):
        n_runs = _runs(reached, level, below, n_runs, runs)
        _connect(runs, n_runs, stride)
        _sum_up(runs, n_runs, stride, height, width, sums)
        for k in range(n_runs):
            if runs[2, k] != k or sums[k, 0] < 2.0 * radii[0] ** 2:  # not even two thirds of the smallest circle
                continue
            if n + MAX_PICKS + 1 > seeds.shape[0]:
                grown = np.empty((2 * seeds.shape[0], 3))
                grown[:n] = seeds[:n]
                seeds = grown
            n = _propose(reached, stride, level, runs, k, sums[k], radii, scratch, seeds, n)
        runs, below = below, runs
    for k in range(n):  # to pixels of the image; the frame is one pixel wide
        seeds[k, 0] = (seeds[k, 0] - 0.5) * scale - 0.5
        seeds[k, 1] = (seeds[k, 1] - 0.5) * scale - 0.5
        seeds[k, 2] *= scale
    return seeds[:n]
