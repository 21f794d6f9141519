"""A picture of what was found: the image in grey, every circle drawn over it with its centre and its score.

Green: wholly in view. Orange: cut by the border. The outline is the mean radius.
"""

import cv2
import numpy as np

from .detect import Array, Bytes

GREEN = (80, 220, 60)
ORANGE = (0, 150, 255)
_SHIFT = 4  # fractional bits of cv2's drawing functions
_LIMIT = 1 << 15  # px; beyond it nothing is drawn, and cv2's integers would overflow


def draw_overlay(grey: Bytes, uv: Array, radius: Array, score: Array) -> Bytes:
    """Draw circles over an image.

    Args:
        grey: (H, W) uint8; never written to.
        uv: (N, 2) centres [px].
        radius: (N,) [px].
        score: (N,) 0..1.

    Returns:
        (H, W, 3) uint8, blue, green, red.
    """
    picture: Bytes = np.repeat(grey[:, :, None], 3, axis=2)
    height, width = grey.shape
    is_drawn = np.isfinite(uv).all(axis=1) & (np.abs(uv) < _LIMIT).all(axis=1) & (radius < _LIMIT)
    for i in np.flatnonzero(is_drawn):
        (u, v), r = uv[i], radius[i]
        is_cut = min(u, v, width - 1 - u, height - 1 - v) < r
        colour = ORANGE if is_cut else GREEN
        cv2.circle(picture, _fixed(u, v), round(r * (1 << _SHIFT)), colour, 1, cv2.LINE_AA, _SHIFT)
        for du, dv in ((4, 0), (0, 4)):
            cv2.line(picture, _fixed(u - du, v - dv), _fixed(u + du, v + dv), colour, 1, cv2.LINE_AA, _SHIFT)
        place = (int(np.clip(u + 0.72 * r + 2, 0, width - 34)), int(np.clip(v - 0.72 * r - 2, 10, height - 2)))
        cv2.putText(picture, f"{score[i]:.2f}", place, cv2.FONT_HERSHEY_PLAIN, 0.9, colour, 1, cv2.LINE_AA)
    return np.asarray(picture, dtype=np.uint8)


def _fixed(u: float, v: float) -> tuple[int, int]:
    return round(u * (1 << _SHIFT)), round(v * (1 << _SHIFT))
