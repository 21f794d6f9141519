"""Between pixels and the plane of the circles, by a table that is linear between its nodes.

Compiled by numba; imported where it is used.
"""

import numpy as np
import numpy.typing as npt
from numba import types

from ..engine.compiled import F32_3D_IN, compiled, floats

Rays = npt.NDArray[np.float32]


@compiled(floats(6)(F32_3D_IN, types.float64, types.float64, types.float64))
def to_plane(rays: Rays, step: float, u: float, v: float) -> tuple[float, float, float, float, float, float]:
    """Map a pixel to the plane of the circles and return x, y and d(x, y)/d(u, v); identity without a table.

    The table has a node every ``step`` pixels.
    """
    if rays.shape[0] < 2:
        return u, v, 1.0, 0.0, 0.0, 1.0
    a, b = u / step, v / step
    j = min(max(int(a), 0), rays.shape[1] - 2)
    i = min(max(int(b), 0), rays.shape[0] - 2)
    a -= j
    b -= i
    x00, x01, x10, x11 = rays[i, j, 0], rays[i, j + 1, 0], rays[i + 1, j, 0], rays[i + 1, j + 1, 0]
    y00, y01, y10, y11 = rays[i, j, 1], rays[i, j + 1, 1], rays[i + 1, j, 1], rays[i + 1, j + 1, 1]
    x = (x00 * (1.0 - a) + x01 * a) * (1.0 - b) + (x10 * (1.0 - a) + x11 * a) * b
    y = (y00 * (1.0 - a) + y01 * a) * (1.0 - b) + (y10 * (1.0 - a) + y11 * a) * b
    xu = ((x01 - x00) * (1.0 - b) + (x11 - x10) * b) / step
    yu = ((y01 - y00) * (1.0 - b) + (y11 - y10) * b) / step
    xv = ((x10 - x00) * (1.0 - a) + (x11 - x01) * a) / step
    yv = ((y10 - y00) * (1.0 - a) + (y11 - y01) * a) / step
    return x, y, xu, xv, yu, yv


@compiled(floats(6)(F32_3D_IN, types.float64, types.float64, types.float64, types.float64, types.float64))
def to_pixel(
    rays: Rays, step: float, x: float, y: float, u: float, v: float
) -> tuple[float, float, float, float, float, float]:
    """Invert ``to_plane`` from a near pixel u, v: return the pixel and d(u, v)/d(x, y)."""
    a, b, c, d, e, f = to_plane(rays, step, u, v)
    for _ in range(4):
        determinant = c * f - d * e
        du, dv = (f * (x - a) - d * (y - b)) / determinant, (c * (y - b) - e * (x - a)) / determinant
        u += du
        v += dv
        a, b, c, d, e, f = to_plane(rays, step, u, v)
        if abs(du) + abs(dv) < 1e-6:
            break
    determinant = c * f - d * e
    return u, v, f / determinant, -d / determinant, -e / determinant, c / determinant
