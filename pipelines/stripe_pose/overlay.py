"""A picture of what was found: the image in grey, the edges over the rows they were seen in, the row, and words.

Green: the mark was recognised. Orange: its sighting is not sure, or not used, for the reason in the words. They are the
mark's id, how much it is turned, and how far to the right and ahead it is. The dashed line is the row of the edges.
"""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from ..images.canvas import GREEN, LIMIT_PX, ORANGE, Array, Bytes, Colour, ground, is_drawable, line, put_text

ROW: Colour = (200, 90, 230)
DASH_PX = 8
HIGH_PX = 10
"""Height of letters."""


class Seen(NamedTuple):
    """One sighting of an image.

    Attributes:
        name: of the mark; empty where none was recognised.
        status: of the sighting.
        pose: (3,) phi, D_x, D_y [rad, m, m]; nan without a pose.
        lines: (N, 5) column at ``row`` [px], change of the column per row, first and last row [px], residual [px].
        row: at which the lines are given [px].
    """

    name: str
    status: str
    pose: Array
    lines: Array
    row: float


def draw_overlay(grey: Bytes, seen: Sequence[Seen]) -> Bytes:
    """Draw sightings over their image.

    Args:
        grey: (H, W) uint8; never written to.
        seen: all sightings of the image.

    Returns:
        (H, W, 3) uint8, blue, green, red.
    """
    picture = ground(grey)
    for row in sorted({item.row for item in seen if abs(item.row) < LIMIT_PX}):
        for start in range(0, picture.shape[1], 2 * DASH_PX):
            line(picture, np.array([start, row]), np.array([start + DASH_PX - 1, row]), ROW)
    for item in seen:
        ends = ends_of(item)
        ends = ends[is_drawable(ends).all(axis=1)]
        colour = GREEN if item.status == "ok" else ORANGE
        for start, end in ends:
            line(picture, start, end, colour)
        if len(ends):
            _write_above(picture, words(item), ends.reshape(-1, 2).min(axis=0), colour)
    return picture


def words(item: Seen) -> str:
    """Say in letters that every font has what was found."""
    name = item.name if item.status == "ok" else f"{item.name} {item.status}".strip()
    if not np.isfinite(item.pose).all():
        return name
    phi, dx, dy = item.pose
    return f"{name}: {np.degrees(phi):.2f} deg {dx:.3f} {dy:.3f} m"


def ends_of(item: Seen) -> Array:
    """Return first and last point of each edge: (N, 2, 2) column, row [px]."""
    at, slope, first, last, _ = item.lines.reshape(-1, 5).T
    rows = np.stack([first, last], axis=1)
    return np.stack([at[:, None] + slope[:, None] * (rows - item.row), rows], axis=2)


def _write_above(picture: Bytes, text: str, place: Array, colour: Colour) -> None:
    """Write text above a place, inside the picture, on a dark ground."""
    height, width = picture.shape[:2]
    (wide, _), below = cv2.getTextSize(text, cv2.FONT_HERSHEY_PLAIN, 0.9, 1)
    x = int(np.clip(place[0], 0, max(0, width - wide - 2)))
    y = int(np.clip(place[1] - 5, HIGH_PX, max(HIGH_PX, height - below - 1)))
    cv2.rectangle(picture, (x - 1, y - HIGH_PX - 1), (x + wide + 1, y + below), (30, 30, 30), -1)
    put_text(picture, text, (x, y), colour)
