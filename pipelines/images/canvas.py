"""What pictures of sightings share: the image in grey as ground, and colours and lines to a sixteenth of a pixel."""

from typing import TypeAlias

import cv2
import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]
Bytes: TypeAlias = npt.NDArray[np.uint8]
Colour: TypeAlias = tuple[int, int, int]
"""Blue, green, red."""

GREEN: Colour = (80, 220, 60)
"""What is sure."""
ORANGE: Colour = (0, 150, 255)
"""What is not."""

LIMIT_PX = 1 << 15
"""Beyond it nothing can be drawn: cv2's integers would overflow."""
_SHIFT = 4  # fractional bits of cv2's drawing functions


def ground(grey: Bytes) -> Bytes:
    """Return an image to draw on: (H, W) -> (H, W, 3) blue, green, red; the image itself is never written to."""
    return np.repeat(grey[:, :, None], 3, axis=2)


def is_drawable(points: Array) -> npt.NDArray[np.bool_]:
    """Return which points (..., 2) can be drawn: known, and not absurdly far outside."""
    return np.asarray((np.abs(points) < LIMIT_PX).all(axis=-1))


def line(picture: Bytes, start: Array, end: Array, colour: Colour) -> None:
    """Draw a line between two points: (2,) column, row [px]."""
    cv2.line(picture, _fixed(start), _fixed(end), colour, 1, cv2.LINE_AA, _SHIFT)


def circle(picture: Bytes, centre: Array, radius: float, colour: Colour) -> None:
    """Draw a circle around a point (2,) [px]."""
    cv2.circle(picture, _fixed(centre), round(radius * (1 << _SHIFT)), colour, 1, cv2.LINE_AA, _SHIFT)


def put_text(picture: Bytes, text: str, place: tuple[int, int], colour: Colour) -> None:
    """Write small letters, the first one's lower left corner at a place [px]."""
    cv2.putText(picture, text, place, cv2.FONT_HERSHEY_PLAIN, 0.9, colour, 1, cv2.LINE_AA)


def _fixed(point: Array) -> tuple[int, int]:
    return round(float(point[0]) * (1 << _SHIFT)), round(float(point[1]) * (1 << _SHIFT))
