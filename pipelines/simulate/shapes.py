"""Flat shapes on a patch: discs, rings, squares, rectangles, hexagons, the bars between tiles, and the glow of lights.

Later shapes cover earlier ones. A pixel only looks at the shapes of its own cell of a grid over the patch, so a hall
with ten thousand shapes costs no more per pixel than one with ten.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from ...formats.events import Array

DISC, RECTANGLE, ROUNDED, HEXAGON = 0, 1, 2, 3
CELL_M = 0.2
MARGIN_M = 0.03

Ints = npt.NDArray[np.int64]
BarNumbers = tuple[float, float, float, float]
NO_BARS = (1.0, 0.0, 0.0, 0.0)
CellTables = tuple[float, int, int, Ints, Ints, Ints, Ints]


@dataclass(frozen=True, slots=True)
class Shape:
    """One shape; ``radiance`` 1.0 fills a pixel at gain 1.

    Attributes:
        kind: DISC, RECTANGLE, ROUNDED or HEXAGON.
        x, y: its centre on the patch [m].
        length, width: its full size [m]; a disc's diameter, and a hexagon's width across flats, is ``length``.
        turn: of its length against the patch's U [rad].
        corner: radius of the corners of ROUNDED [m].
        radiance: of its surface.
    """

    kind: int
    x: float
    y: float
    length: float
    width: float
    radiance: float
    turn: float = 0.0
    corner: float = 0.0

    @property
    def reach(self) -> float:
        """Radius of a circle around it [m]."""
        if self.kind == DISC:
            return self.length / 2
        return self.length * 0.58 if self.kind == HEXAGON else float(np.hypot(self.length, self.width)) / 2

    @property
    def extent(self) -> tuple[float, float]:
        """Half the sides of an upright rectangle around it, along U and V [m]."""
        if self.kind not in (RECTANGLE, ROUNDED):
            return self.reach, self.reach
        c, s = abs(np.cos(self.turn)), abs(np.sin(self.turn))
        return float(c * self.length + s * self.width) / 2, float(s * self.length + c * self.width) / 2

    def row(self) -> list[float]:
        """Return the numbers that ``kernels.shade`` takes."""
        size = [self.length / 2, self.width / 2, self.corner]
        turn = (float(np.cos(self.turn)), float(np.sin(self.turn)))
        return [self.kind, self.x, self.y, *turn, *size, self.radiance, *(half + MARGIN_M for half in self.extent)]


@dataclass(frozen=True, slots=True)
class Glow:
    """The halo around a light: ``strength`` at its rim, half of it ``length`` away, nothing at ``reach`` [m]."""

    x: float
    y: float
    radius: float
    strength: float
    length: float
    reach: float


@dataclass(frozen=True, slots=True)
class Bars:
    """The bars between the tiles of a suspended ceiling."""

    pitch: float
    width: float
    radiance: float


@dataclass(slots=True, eq=False)
class Drawing:
    """Everything drawn on one patch."""

    shapes: Sequence[Shape] = ()
    glows: Sequence[Glow] = ()
    bars: Bars | None = None
    _tables: tuple[BarNumbers, CellTables, Array, Array] | None = field(default=None, repr=False)

    def tables(self, size: Array) -> tuple[BarNumbers, CellTables, Array, Array]:
        """Return bars, cells, shapes and glows as ``kernels.shade`` takes them, for a patch of ``size`` (2,) [m]."""
        if self._tables is None:
            columns, rows = (max(int(np.ceil(s / CELL_M)), 1) for s in size)
            boxes = [(s.x, s.y, s.extent[0] + MARGIN_M, s.extent[1] + MARGIN_M) for s in self.shapes]
            shape_cells = _cells(boxes, columns, rows)
            glow_cells = _cells([(g.x, g.y, g.radius + g.reach, g.radius + g.reach) for g in self.glows], columns, rows)
            glows = [[g.x, g.y, g.radius, g.strength, g.length, g.reach] for g in self.glows]
            b = self.bars
            bars = (b.pitch, b.width, MARGIN_M / 2, b.radiance) if b else NO_BARS
            self._tables = (
                bars,
                (CELL_M, columns, rows, *shape_cells, *glow_cells),
                np.array([s.row() for s in self.shapes], float).reshape(-1, 11),
                np.array(glows, float).reshape(-1, 6),
            )
        return self._tables


def _cells(boxes: Sequence[tuple[float, float, float, float]], columns: int, rows: int) -> tuple[Ints, Ints]:
    """Return starts (cells + 1,) and list of the boxes (x, y, half sides) that reach into each cell, in their order."""
    cells, items = [], []
    for index, (x, y, half_x, half_y) in enumerate(boxes):
        left, right = (min(max(int((x + d) // CELL_M), 0), columns - 1) for d in (-half_x, half_x))
        low, high = (min(max(int((y + d) // CELL_M), 0), rows - 1) for d in (-half_y, half_y))
        for row in range(low, high + 1):
            for column in range(left, right + 1):
                cells.append(row * columns + column)
                items.append(index)
    order = np.argsort(np.array(cells, np.int64), kind="stable")
    starts = np.zeros(columns * rows + 1, np.int64)
    np.cumsum(np.bincount(np.array(cells, np.int64), minlength=columns * rows), out=starts[1:])
    return starts, np.array(items, np.int64)[order]
