"""The renderer's inner loops, compiled: which patch a pixel sees, and what it sees there.

``raster`` fills an inverse-depth buffer and an id buffer; ``shade`` then visits each pixel once. An edge of a shape is
the share of the pixel's own area that lies inside it: the edge is a straight line across one pixel, the pixel's
footprint on the patch is a parallelogram, so the share is the integral of a trapezoid, in closed form (``_share``).
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numpy as np
import numpy.typing as npt
from numba import njit

from ...formats.events import Array, Bytes
from .shapes import DISC, HEXAGON, RECTANGLE, BarNumbers, CellTables, Ints

F = TypeVar("F", bound=Callable[..., Any])
Indices = npt.NDArray[np.int32]
Floats = npt.NDArray[np.float32]

Level = tuple[Bytes, int, int, int, float, bool, float]
Surface = tuple[Level, BarNumbers, CellTables, Array, Array, Array]


def _compiled(function: F) -> F:
    try:
        made: object = njit(cache=True, nogil=True, error_model="numpy")(function)
    except RuntimeError:  # no folder for the cache can be written to
        made = njit(nogil=True, error_model="numpy")(function)
    return cast("F", made)


@_compiled
def raster(rays: Array, plane: Array, entry: tuple[int, float, Ints], depth: Array, ids: Indices) -> None:
    """Enter one patch into the buffers where it is nearer than what is there.

    Args:
        rays: (H + 2, W + 2, 2) of ``camera.ray_table``.
        plane: (3, 3) rows g, s, t: inverse depth g.r, and patch coordinates s.r / g.r and t.r / g.r, in 0..1.
        entry: the id to enter, the nearest depth that is seen [m], and the first and last column and row to look at.
        depth: (H, W) inverse depth [1/m], 0 where nothing is seen; changed.
        ids: (H, W) id of the nearest patch, -1 where nothing is seen; changed.
    """
    index, near, box = entry
    g0, g1, g2 = plane[0]
    s0, s1, s2 = plane[1]
    t0, t1, t2 = plane[2]
    for v in range(box[2], box[3] + 1):
        for u in range(box[0], box[1] + 1):
            x, y = rays[v + 1, u + 1, 0], rays[v + 1, u + 1, 1]
            iz = g0 * x + g1 * y + g2
            if iz > depth[v, u] and iz * near <= 1.0:
                a = s0 * x + s1 * y + s2
                b = t0 * x + t1 * y + t2
                if a >= 0.0 and a <= iz and b >= 0.0 and b <= iz:
                    depth[v, u] = iz
                    ids[v, u] = index


@_compiled
def _share(distance: float, p: float, q: float) -> float:
    """Share of a unit square where ``distance + p x + q y < 0``, for x and y in -0.5..0.5."""
    p, q = abs(p), abs(q)
    if p < q:
        p, q = q, p
    t = -distance
    outer, inner = 0.5 * (p + q), 0.5 * (p - q)
    if t >= outer:
        return 1.0
    if t <= -outer:
        return 0.0
    if abs(t) <= inner:
        return 0.5 + t / p
    if t > 0.0:
        return 1.0 - (outer - t) ** 2 / (2.0 * p * q)
    return (outer + t) ** 2 / (2.0 * p * q)


@_compiled
def _strip(d: float, half: float, p: float, q: float) -> float:
    """Share of the pixel where ``|d + p x + q y| < half``."""
    return _share(d - half, p, q) - _share(d + half, p, q)


@_compiled
def _covered(shape: Array, a: float, b: float, step: Array) -> float:
    """Share of a pixel that a shape covers; the pixel's centre is (a, b), its sides are ``step`` (2, 2) [m].

    ``shape`` is kind, x, y, cos, sin, half length, half width, corner radius (a disc's radius is its half length).
    """
    dx, dy, c, s = a - shape[1], b - shape[2], shape[3], shape[4]
    x, y = c * dx + s * dy, c * dy - s * dx
    kind = int(shape[0])
    if kind == DISC:
        r = np.sqrt(x * x + y * y)
        if r < 1e-9:
            return 1.0
        nx, ny = dx / r, dy / r
        p, q = nx * step[0, 0] + ny * step[0, 1], nx * step[1, 0] + ny * step[1, 1]
        # The arc leaves its tangent by t^2 / (2 R) at t along it, on average over the pixel by 1/12 of its side
        # squared.
        tangent = (ny * step[0, 0] - nx * step[0, 1]) ** 2 + (ny * step[1, 0] - nx * step[1, 1]) ** 2
        return _share(r - shape[5] + tangent / (24.0 * r), p, q)
    xu, xv = c * step[0, 0] + s * step[0, 1], c * step[1, 0] + s * step[1, 1]
    yu, yv = c * step[0, 1] - s * step[0, 0], c * step[1, 1] - s * step[1, 0]
    if kind == RECTANGLE:
        return _strip(x, shape[5], xu, xv) * _strip(y, shape[6], yu, yv)
    if kind == HEXAGON:
        share = _strip(x, shape[5], xu, xv)
        for k in (1, -1):
            h = k * 0.8660254037844386
            share *= _strip(0.5 * x + h * y, shape[5], 0.5 * xu + h * yu, 0.5 * xv + h * yv)
        return share
    ex, ey = abs(x) - (shape[5] - shape[7]), abs(y) - (shape[6] - shape[7])
    if ex <= 0.0 or ey <= 0.0:  # opposite a straight side
        return _strip(x, shape[5], xu, xv) * _strip(y, shape[6], yu, yv)
    r = max(np.sqrt(ex * ex + ey * ey), 1e-9)
    nx, ny = ex / r * np.sign(x), ey / r * np.sign(y)
    return _share(r - shape[7], nx * xu + ny * yu, nx * xv + ny * yv)


@_compiled
def _texel(levels: Bytes, level: tuple[int, int, int], x: float, y: float, is_tiled: bool) -> float:
    """Bilinear grey 0..255 at (x, y) in texels of a level (start, width, height); texel centres stand at halves."""
    start, w, h = level
    x, y = x - 0.5, y - 0.5
    if is_tiled:
        x, y = x - w * np.floor(x * (1.0 / w)), y - h * np.floor(y * (1.0 / h))
    j, i = int(np.floor(x)), int(np.floor(y))
    fx, fy = x - j, y - i
    j0, i0, j1, i1 = j, i, j + 1, i + 1
    if j0 < 0 or j1 >= w or i0 < 0 or i1 >= h:
        if is_tiled:
            j0, j1, i0, i1 = j0 % w, j1 % w, i0 % h, i1 % h
        else:
            j0, j1, i0, i1 = max(j0, 0), min(j1, w - 1), max(i0, 0), min(i1, h - 1)
            j0, i0, j1, i1 = min(j0, w - 1), min(i0, h - 1), max(j1, 0), max(i1, 0)
    top = levels[start + i0 * w + j0] * (1.0 - fx) + levels[start + i0 * w + j1] * fx
    low = levels[start + i1 * w + j0] * (1.0 - fx) + levels[start + i1 * w + j1] * fx
    return float(top * (1.0 - fy) + low * fy)


@_compiled
def _halo(glows: Array, listed: Ints, span: tuple[int, int], a: float, b: float) -> float:
    """Sum of the halos at (a, b) of the lights ``listed`` in ``span``, each 1 / (1 + (d / length)^2), 0 at its reach.

    ``glows`` is (M, 6): x, y, radius, strength, length, reach; d is the distance to the rim.
    """
    total = 0.0
    for i in range(span[0], span[1]):
        k = listed[i]
        d = np.sqrt((a - glows[k, 0]) ** 2 + (b - glows[k, 1]) ** 2) - glows[k, 2]
        if d <= 0.0:
            total += glows[k, 3]
        elif d < glows[k, 5]:
            fade = 1.0 - d / glows[k, 5]
            total += glows[k, 3] * fade * fade / (1.0 + (d / glows[k, 4]) ** 2)
    return total


@_compiled
def _lit(shading: Array, a: float, b: float, size: Array) -> float:
    """Light at (a, b) of a patch of ``size``: linear between the nodes of ``shading`` (R, C); 1 if there are none."""
    rows, columns = shading.shape
    if rows == 0:
        return 1.0
    x, y = a / size[0] * (columns - 1), b / size[1] * (rows - 1)
    j, i = min(max(int(x), 0), columns - 2), min(max(int(y), 0), rows - 2)
    fx, fy = x - j, y - i
    top = shading[i, j] * (1.0 - fx) + shading[i, j + 1] * fx
    low = shading[i + 1, j] * (1.0 - fx) + shading[i + 1, j + 1] * fx
    return float(top * (1.0 - fy) + low * fy)


@_compiled
def _footprint(rays: Array, plane: Array, size: Array, pixel: tuple[int, int], step: Array) -> None:
    """Set ``step`` (2, 2) to the sides of a pixel's footprint on the patch [m], from the rays of its neighbours."""
    u, v = pixel
    for k in range(2):
        x1, y1 = rays[v + 1 + k, u + 2 - k, 0], rays[v + 1 + k, u + 2 - k, 1]
        x0, y0 = rays[v + 1 - k, u + k, 0], rays[v + 1 - k, u + k, 1]
        z1 = 0.5 / (plane[0, 0] * x1 + plane[0, 1] * y1 + plane[0, 2])
        z0 = 0.5 / (plane[0, 0] * x0 + plane[0, 1] * y0 + plane[0, 2])
        for c in range(2):
            p = plane[c + 1]
            step[k, c] = ((p[0] * x1 + p[1] * y1 + p[2]) * z1 - (p[0] * x0 + p[1] * y0 + p[2]) * z0) * size[c]


@_compiled
def shade(
    rays: Array, frame: tuple[Array, Array], seen: tuple[Array, Indices, int, Ints], surface: Surface, out: Floats
) -> None:
    """Add what the pixels of one patch see to ``out``.

    Args:
        rays: (H + 2, W + 2, 2) of ``camera.ray_table``.
        frame: the patch's rows as for ``raster``, and its size (2,) [m].
        seen: inverse depth and ids of ``raster``, the patch's id, and the box of its pixels.
        surface: the texture's level to use, bars, cells, shapes, glows and shading:
            texture: grey levels, start, width (0 for none), height, texels per metre, is it tiled, radiance of white;
            bars: pitch, width (0 for none), how near counts as near [m], radiance;
            cells: side of a cell [m], columns, rows, and per cell the shapes and the glows as starts and lists;
            shapes: (N, 11) kind, x, y, cos, sin, half length, half width, corner radius, radiance, and how far from the
            centre a pixel can touch it along U and V [m]; later ones cover earlier;
            glows: (M, 6), see ``_halo``;
            shading: (R, C) light on the patch, see ``_lit``; no rows for even light.
        out: (H, W) radiance, 1.0 is a full pixel at gain 1; changed.
    """
    plane, size = frame
    depth, ids, index, box = seen
    texture, bars, cells, shapes, glows, shading = surface
    levels, start, width, height, scale, is_tiled, white = texture
    side, columns, rows, shape_start, shape_list, glow_start, glow_list = cells
    # Numbers that do not change are copied out of their arrays: the compiler cannot know that ``out`` is none of them.
    s0, s1, s2 = size[0] * plane[1, 0], size[0] * plane[1, 1], size[0] * plane[1, 2]
    t0, t1, t2 = size[1] * plane[2, 0], size[1] * plane[2, 1], size[1] * plane[2, 2]
    pitch, bar, margin, bar_light = bars
    per_pitch, per_cell, near_bar = 1.0 / pitch, 1.0 / side, 0.5 * bar + margin
    step = np.empty((2, 2))
    for v in range(box[2], box[3] + 1):
        for u in range(box[0], box[1] + 1):
            if ids[v, u] != index:
                continue
            x, y = rays[v + 1, u + 1, 0], rays[v + 1, u + 1, 1]
            z = 1.0 / depth[v, u]
            a = (s0 * x + s1 * y + s2) * z
            b = (t0 * x + t1 * y + t2) * z
            light = white
            if width > 0:
                light *= _texel(levels, (start, width, height), a * scale, b * scale, is_tiled) * (1.0 / 255.0)
            column = min(max(int(a * per_cell), 0), columns - 1)
            cell = min(max(int(b * per_cell), 0), rows - 1) * columns + column
            has_grid = False
            if bar > 0.0:
                ga = a - pitch * np.floor(a * per_pitch + 0.5)
                gb = b - pitch * np.floor(b * per_pitch + 0.5)
                has_grid = min(abs(ga), abs(gb)) < near_bar
            has_step = False
            if has_grid:
                _footprint(rays, plane, size, (u, v), step)
                has_step = True
                bare = 1.0 - _strip(ga, 0.5 * bar, step[0, 0], step[1, 0])
                bare *= 1.0 - _strip(gb, 0.5 * bar, step[0, 1], step[1, 1])
                light = light * bare + bar_light * (1.0 - bare)
            for k in range(shape_start[cell], shape_start[cell + 1]):
                i = shape_list[k]
                if abs(a - shapes[i, 1]) > shapes[i, 9] or abs(b - shapes[i, 2]) > shapes[i, 10]:
                    continue
                if not has_step:
                    _footprint(rays, plane, size, (u, v), step)
                    has_step = True
                light += _covered(shapes[i], a, b, step) * (shapes[i, 8] - light)
            light *= _lit(shading, a, b, size)
            out[v, u] += light + _halo(glows, glow_list, (glow_start[cell], glow_start[cell + 1]), a, b)


@_compiled
def expose(light: Floats, shares: Floats, noise: Floats, levels: tuple[float, float, float], out: Bytes) -> None:
    """Turn radiance into bytes by ``imager`` eqs. (1), (2); ``levels`` are gain, read noise and shot noise."""
    gain, read, shot = levels
    for v in range(light.shape[0]):
        for u in range(light.shape[1]):
            grey = 255.0 * gain * light[v, u] * shares[v, u]
            grey += noise[v, u] * np.sqrt(read * read + shot * max(grey, 0.0))
            out[v, u] = np.uint8(min(max(grey, 0.0), 255.0) + 0.5)
