"""What hangs on the walls of a corridor and is no mark, much of it with the upright edges that a mark has.

Doors and posters have a few; fences, blinds and radiators have many at one distance; a shelf of books has many at none.
Everything is drawn flat on the wall, from a left end at 0 and from the floor upwards.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from ...engine.params import Field, Params
from ..shapes import RECTANGLE, Shape

Kind = Literal["door", "poster", "fence", "blinds", "radiator", "shelf"]
Rectangles: TypeAlias = list[tuple[float, float, float, float, float]]
"""Left, right, low, high [m], radiance [1]; later ones cover earlier."""


class ClutterParams(Params):
    """What hangs on the walls and is no mark."""

    per_m: float = Field(0.35, ge=0, le=3, description="things per metre of wall, where there is room [1/m]")
    kinds: tuple[Kind, ...] = Field(
        ("door", "poster", "poster", "fence", "blinds", "radiator", "shelf"),
        min_length=1,
        description="what is hung, drawn from this list; twice in it is twice as often",
    )
    clearance_m: float = Field(0.08, ge=0, description="bare wall between a thing and a mark or another thing [m]")


@dataclass(frozen=True, slots=True, eq=False)
class Thing:
    """Something on a wall: its width [m] and what is drawn."""

    width: float
    rectangles: Rectangles

    def shapes(self, left: float, height: float) -> list[Shape]:
        """Return the drawing with its left end at ``left`` of a wall of a height [m]; what is higher is cut off."""
        drawn = []
        for x0, x1, z0, z1, light in self.rectangles:
            top = min(z1, height)
            if top > z0:
                middle = height - (z0 + top) / 2
                drawn.append(Shape(RECTANGLE, left + (x0 + x1) / 2, middle, x1 - x0, top - z0, light))
        return drawn


def make(kind: Kind, rng: np.random.Generator) -> Thing:
    """Make one thing of a kind."""
    return _MAKERS[kind](rng)


def _thing(drawn: Rectangles) -> Thing:
    left, right = min(r[0] for r in drawn), max(r[1] for r in drawn)
    return Thing(right - left, [(x0 - left, x1 - left, *rest) for x0, x1, *rest in drawn])  # type: ignore[misc]


def _door(rng: np.random.Generator) -> Thing:
    width, leaf = 0.95, float(rng.uniform(0.25, 0.75))
    frame = float(rng.uniform(0.2, 0.9))
    inner, high = (0.06, width - 0.06), 2.02
    drawn: Rectangles = [(0, width, 0, high + 0.06, frame), (*inner, 0, high, leaf)]
    if rng.random() < 0.5:  # two panels let in
        for low, top in ((0.2, 0.9), (1.05, 1.85)):
            drawn += [
                (0.18, width - 0.18, low, top, 0.8 * leaf),
                (0.2, width - 0.2, low + 0.02, top - 0.02, 1.06 * leaf),
            ]
    elif rng.random() < 0.6:  # a slit of glass
        drawn += [(0.62, 0.76, 0.75, 1.8, 0.1), (0.64, 0.74, 0.77, 1.78, float(rng.uniform(0.3, 0.9)))]
    drawn += [(0.1, 0.13, 0.96, 1.12, 0.15), (0.1, 0.22, 1.03, 1.055, 0.75)]
    return _thing(drawn)


def _poster(rng: np.random.Generator) -> Thing:
    width, height = (float(v) for v in rng.uniform([0.35, 0.5], [0.7, 0.95]))
    low, paper = float(rng.uniform(0.55, 0.95)), float(rng.uniform(0.55, 0.9))
    drawn: Rectangles = [(0, width, low, low + height, paper)]
    top = low + height - 0.05
    drawn.append((0.05, width - float(rng.uniform(0.05, 0.2)), top - 0.06, top, 0.12))
    top -= 0.1
    columns = int(rng.integers(1, 4))
    step = (width - 0.08) / columns
    for column in range(columns):
        z, x = top, 0.05 + column * step
        while z > low + 0.08:
            tall = float(rng.uniform(0.05, 0.2))
            bottom = max(z - tall, low + 0.05)
            if rng.random() < 0.45:  # a picture
                drawn.append((x, x + step - 0.03, bottom, z, float(rng.uniform(0.1, 0.6))))
                drawn.append((x + 0.03, x + 0.03 + 0.3 * step, bottom + 0.01, z - 0.015, float(rng.uniform(0.1, 0.8))))
            else:
                for line in np.arange(z - 0.012, bottom, -0.022).tolist():
                    end = x + (step - 0.03) * float(rng.uniform(0.6, 1.0))
                    drawn.append((x, end, line - 0.006, line, 0.55 * paper))
            z = bottom - 0.03
    return _thing(drawn)


def _fence(rng: np.random.Generator) -> Thing:
    n, pitch = int(rng.integers(8, 18)), float(rng.uniform(0.05, 0.12))
    picket, light = pitch * float(rng.uniform(0.35, 0.6)), float(rng.uniform(0.7, 0.95))
    low, high = 0.1, float(rng.uniform(1.0, 1.3))
    width = n * pitch
    ground = float(rng.uniform(0.05, 0.25))
    drawn: Rectangles = [(-0.02, width + 0.02, low - 0.05, high - 0.06, ground)]
    drawn += [(0, width, z, z + 0.05, 0.85 * light) for z in (low + 0.12, high - 0.25)]
    drawn += [(k * pitch, k * pitch + picket, low, high, light * float(rng.uniform(0.95, 1.05))) for k in range(n)]
    return _thing(drawn)


def _blinds(rng: np.random.Generator) -> Thing:
    n, pitch = int(rng.integers(9, 16)), float(rng.uniform(0.07, 0.11))
    width, low, high = n * pitch, 0.75, 2.0
    slat, dark = float(rng.uniform(0.7, 1.0)), float(rng.uniform(0.2, 0.45))
    gap = float(rng.uniform(0.2, 0.4)) * pitch
    drawn: Rectangles = [(-0.06, width + 0.06, low - 0.06, high + 0.06, 0.75), (0, width, low, high, dark)]
    drawn += [(k * pitch, (k + 1) * pitch - gap, low + 0.02, high, slat - 0.02 * (k % 2)) for k in range(n)]
    return _thing([*drawn, (0, width, high - 0.05, high, 0.5)])


def _radiator(rng: np.random.Generator) -> Thing:
    n, pitch = int(rng.integers(12, 24)), float(rng.uniform(0.045, 0.07))
    width, low, high = n * pitch, 0.15, float(rng.uniform(0.9, 1.15))
    drawn: Rectangles = [(0, width, low, high, 0.32)]
    for k in range(n):
        drawn.append((k * pitch, k * pitch + 0.62 * pitch, low, high, 0.72))
        drawn.append((k * pitch + 0.15 * pitch, k * pitch + 0.4 * pitch, low + 0.03, high - 0.03, 0.82))
    return _thing(drawn)


def _shelf(rng: np.random.Generator) -> Thing:
    width, board = float(rng.uniform(0.6, 1.1)), 0.025
    levels = [0.3, 0.66, 1.02, 1.38, 1.74]
    drawn: Rectangles = [
        (0, width, levels[0] - board, levels[-1], 0.45),
        (board, width - board, levels[0], levels[-1], 0.12),
    ]
    for low in levels[:-1]:
        x = board + 0.005
        while True:
            thick, tall = float(rng.uniform(0.015, 0.055)), float(rng.uniform(0.2, 0.31))
            if x + thick > width - board:
                break
            light = float(rng.uniform(0.06, 0.85))
            drawn.append((x, x + thick, low, low + tall, light))
            if thick > 0.03:
                drawn.append((x + 0.006, x + thick - 0.006, low + 0.6 * tall, low + 0.8 * tall, 0.9 - light))
            x += thick + (0.08 if rng.random() < 0.06 else 0.001)
        drawn.append((0, width, low - board, low, 0.5))
    return _thing(drawn)


_MAKERS: dict[Kind, Callable[[np.random.Generator], Thing]] = {
    "door": _door,
    "poster": _poster,
    "fence": _fence,
    "blinds": _blinds,
    "radiator": _radiator,
    "shelf": _shelf,
}
