"""Stripe marks as they hang in a world: bright bars on a dark board with a margin around them."""

from itertools import pairwise
from typing import Annotated, Self

import numpy as np
from pydantic import BeforeValidator, model_validator

from ....formats.events import Array
from ....formats.products import StripeMark
from ...engine.params import Field, Params
from ..shapes import RECTANGLE, Shape
from .pairs import Span


def _many(value: object) -> object:
    return tuple(value) if isinstance(value, list | tuple) else (value,)


Widths = Annotated[tuple[float, ...], BeforeValidator(_many)]
"""One number for all, or a list with one for each."""


class PatternParams(Params):
    """What is printed on a board."""

    lines_m: tuple[float, ...] = Field(
        (-0.06, 0.0, 0.04, 0.12), min_length=3, description="abscissae of the rising edges, left to right as seen [m]"
    )
    bar_m: Widths = Field((0.03,), min_length=1, description="width of all bright bars, or of each [m]")
    height_m: float = Field(0.2, gt=0, description="height of the bars [m]")
    margin_m: float = Field(0.03, ge=0, description="dark ground around the bars [m]")
    bright: float = Field(0.8, ge=0, description="radiance of the bars in even light [1]")
    dark: float = Field(0.06, ge=0, description="radiance of the ground in even light [1]")

    @model_validator(mode="after")
    def _bars_stand_apart(self) -> Self:
        if any(b <= a for a, b in pairwise(self.lines_m)):
            raise ValueError("lines_m must increase. List the rising edges from left to right.")
        if len(self.bar_m) not in {1, len(self.lines_m)}:
            raise ValueError(
                f"bar_m has {len(self.bar_m)} widths for {len(self.lines_m)} lines. Give one each, or one."
            )
        if (self.bars <= 0).any():
            raise ValueError("bar_m must be above 0. Give the width of the bright bars.")
        if (np.array(self.lines_m[1:]) <= np.array(self.lines_m[:-1]) + self.bars[:-1]).any():
            raise ValueError("bar_m reaches the next line. Make the bars narrower.")
        return self

    @property
    def bars(self) -> Array:
        """Widths of the bars, (n,) [m]."""
        return np.broadcast_to(np.array(self.bar_m, float), (len(self.lines_m),)).copy()

    @property
    def span(self) -> Span:
        """Abscissae of the board's left and right border [m]."""
        return self.lines_m[0] - self.margin_m, self.lines_m[-1] + float(self.bars[-1]) + self.margin_m

    @property
    def board(self) -> tuple[float, float]:
        """Width and height of the board [m]."""
        return self.span[1] - self.span[0], self.height_m + 2 * self.margin_m

    def shapes(self, x: float, y: float) -> list[Shape]:
        """Return the drawing of a board whose abscissa 0, at half its height, lies at (x, y) of a patch."""
        width, height = self.board
        board = Shape(RECTANGLE, x + sum(self.span) / 2, y, width, height, self.dark)
        bars = [
            Shape(RECTANGLE, x + line + bar / 2, y, bar, self.height_m, self.bright)
            for line, bar in zip(self.lines_m, self.bars.tolist(), strict=True)
        ]
        return [board, *bars]

    def mark(self, number: int, pose: Array) -> StripeMark:
        """Return what the map says of it, at ``pose`` (3,)."""
        return StripeMark(
            id=number, lines=np.array(self.lines_m), bars=self.bars, pose=np.asarray(pose, float), height=self.height_m
        )
