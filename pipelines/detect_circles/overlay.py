"""A picture of what was found: the image in grey, every circle drawn over it with its centre and its score.

Green: wholly in view. Orange: cut by the border. The outline is the mean radius.
"""

import numpy as np

from ..images.canvas import GREEN, LIMIT_PX, ORANGE, Array, Bytes, circle, ground, is_drawable, line, put_text

ARMS = np.array([[4.0, 0.0], [0.0, 4.0]])
"""Half the cross over a centre [px]."""


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
    picture = ground(grey)
    height, width = grey.shape
    for i in np.flatnonzero(is_drawable(uv) & (radius < LIMIT_PX)):
        (u, v), r = uv[i], radius[i]
        is_cut = min(u, v, width - 1 - u, height - 1 - v) < r
        colour = ORANGE if is_cut else GREEN
        circle(picture, uv[i], r, colour)
        for arm in ARMS:
            line(picture, uv[i] - arm, uv[i] + arm, colour)
        place = (int(np.clip(u + 0.72 * r + 2, 0, width - 34)), int(np.clip(v - 0.72 * r - 2, 10, height - 2)))
        put_text(picture, f"{score[i]:.2f}", place, colour)
    return picture
