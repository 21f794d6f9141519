"""A picture of what was found: the image in grey, every circle drawn over it with its centre, its score and its error.

Green: wholly in view. Orange: cut by the border. The outline is the mean radius; the ellipse around the centre is its
standard deviation, a hundred times enlarged, so that it can be seen.
"""

import cv2
import numpy as np

from .detect import Array, Bytes

GREEN = (80, 220, 60)
ORANGE = (0, 150, 255)
MAGNIFIED = 100.0
_SHIFT = 4  # fractional bits of cv2's drawing functions
_LIMIT = 1 << 15  # px; beyond it nothing is drawn, and cv2's integers would overflow


def draw_overlay(grey: Bytes, uv: Array, radius: Array, score: Array, cov_px: Array | None = None) -> Bytes:
    """Draw circles over an image.

    Args:
        grey: (H, W) uint8; never written to.
        uv: (N, 2) centres [px].
        radius: (N,) [px].
        score: (N,) 0..1.
        cov_px: (N, 2, 2) covariances of the centres [px^2], or None to draw no ellipse.

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
        if cov_px is not None:
            _draw_error(picture, u, v, cov_px[i])
        place = (int(np.clip(u + 0.72 * r + 2, 0, width - 34)), int(np.clip(v - 0.72 * r - 2, 10, height - 2)))
        cv2.putText(picture, f"{score[i]:.2f}", place, cv2.FONT_HERSHEY_PLAIN, 0.9, colour, 1, cv2.LINE_AA)
    return np.asarray(picture, dtype=np.uint8)


def _draw_error(picture: Bytes, u: float, v: float, cov: Array) -> None:
    values, vectors = np.linalg.eigh(cov)
    axes = MAGNIFIED * np.sqrt(np.maximum(values[::-1], 0.0))
    angle = np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1]))
    size = (round(min(axes[0], _LIMIT) * (1 << _SHIFT)), round(min(axes[1], _LIMIT) * (1 << _SHIFT)))
    cv2.ellipse(picture, _fixed(u, v), size, float(angle), 0.0, 360.0, (255, 200, 0), 1, cv2.LINE_AA, _SHIFT)


def _fixed(u: float, v: float) -> tuple[int, int]:
    return round(u * (1 << _SHIFT)), round(v * (1 << _SHIFT))
