"""What walls, floors and ceilings of a room are made of: their grain, and the patches that need nothing else."""

from functools import lru_cache

import cv2
import numpy as np

from ....formats.events import Array
from ..renderer import Patch, Texture
from ..shapes import RECTANGLE, Bars, Drawing, Shape

LAMP_M = (1.15, 0.28)
"""Length and width of a lamp under a ceiling."""
SKIRTING_M = (0.09, 0.012)
"""Height and thickness of a skirting board."""


@lru_cache(maxsize=8)
def plaster(radiance: float) -> Texture:
    """Return a plastered wall: fine grain and soft spots, a few per cent; repeats after 1.7 m."""
    return _grain(radiance, 300.0, 0.012, 0.02, 1)


def floor_patch(low: Array, high: Array) -> Patch:
    """Return a floor of speckled tiles between two corners (2,) [m]."""
    side_u, side_v = np.array([0.0, high[1] - low[1], 0.0]), np.array([high[0] - low[0], 0.0, 0.0])
    joints = Drawing(bars=Bars(0.5, 0.005, 0.16))
    return Patch(np.append(low, 0.0), side_u, side_v, joints, _grain(0.3, 200.0, 0.08, 0.04, 2), 0.3)


def ceiling_patch(low: Array, high: Array, height: float, lamps: Array, pitch: float) -> Patch:
    """Return a ceiling of tiles between two corners (2,), with lamps (K, 3) along the longer side [m]."""
    size = high - low
    turned = 0.0 if size[0] >= size[1] else np.pi / 2
    scale = min(1.0, 0.8 * pitch / LAMP_M[0]) if pitch > 0 else 1.0
    shapes = [Shape(RECTANGLE, x, y, scale * LAMP_M[0], LAMP_M[1], 3.0, turned) for x, y in lamps[:, :2] - low]
    drawing = Drawing(shapes, (), Bars(0.625, 0.024, 0.62))
    side_u, side_v = np.array([size[0], 0.0, 0.0]), np.array([0.0, size[1], 0.0])
    return Patch(np.append(low, height), side_u, side_v, drawing, radiance=0.55)


def skirting(left: Array, right: Array) -> Patch:
    """Return the skirting board of a wall from its left end to its right (2,) [m]."""
    along = (right - left) / np.hypot(*(right - left))
    inward = np.array([along[1], -along[0]])
    high, thick = SKIRTING_M
    corner = np.append(left + thick * inward, high)
    return Patch(corner, np.append(right - left, 0.0), np.array([0.0, 0.0, -high]), radiance=0.2)


@lru_cache(maxsize=8)
def _grain(radiance: float, texels_per_m: float, fine: float, soft: float, seed: int) -> Texture:
    """Return a surface with a relative unevenness, fine and soft, that repeats after 512 texels."""
    n, rng = 512, np.random.default_rng(seed)
    wrap = 96
    spots = np.pad(rng.standard_normal((n, n)), wrap, mode="wrap")
    picture = np.zeros((n, n))
    for sigma, share in ((1.0, fine), (20.0, soft)):
        part = cv2.GaussianBlur(spots, (0, 0), sigma)[wrap : wrap + n, wrap : wrap + n]
        picture += share * np.clip(part / part.std(), -3, 3)
    grey = np.clip(np.rint(170 * (1 + picture)), 0, 255).astype(np.uint8)
    return Texture.of(grey, texels_per_m, is_tiled=True, white=radiance * 255 / 170)
