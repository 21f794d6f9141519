"""How large a lamp can be in the image: from camera, ceiling and lamp, or a wide guess.

A lamp of diameter d at the distance h is about d f / (2 h) px in radius in the middle of the image; towards the corners
the lens changes that, so its outline is projected at places all over the image.
"""

import numpy as np

from .sighting import View

SHARE = (0.0125, 0.1)
"""Least and greatest radius that are looked for when nothing is known, as shares of the image's width."""

TOLERANCE = 0.2
"""Share by which the diameter of a lamp, or the height of the ceiling, may be wrong."""


def expected_radii(view: View, diameter_m: float) -> tuple[float, float]:
    """Return the least and greatest mean radius of a lamp anywhere in the image [px].

    Args:
        view: camera, mount and ceiling.
        diameter_m: of the lamp.

    Raises:
        ValueError: the camera sees no ceiling.
    """
    u, v = np.linspace(0, view.width - 1, 9), np.linspace(0, view.height - 1, 9)
    centres = view.to_robot(np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2))
    angles = np.arange(16) * np.pi / 8
    rim = 0.5 * diameter_m * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    outline = view.to_image(centres[:, None] + rim)
    radii = np.linalg.norm(outline - view.to_image(centres)[:, None], axis=-1).mean(axis=1)
    radii = radii[np.isfinite(radii)]
    if len(radii) == 0:
        raise ValueError("the camera does not look at the ceiling; its mount or calibration is wrong")
    return float(radii.min() * (1.0 - TOLERANCE)), float(radii.max() * (1.0 + TOLERANCE))


def default_radii(width: int) -> tuple[float, float]:
    """Return a wide range of radii for an image of this width [px]."""
    return max(4.0, SHARE[0] * width), max(8.0, SHARE[1] * width)
