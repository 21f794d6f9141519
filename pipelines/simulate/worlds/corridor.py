"""A corridor: a room with stripe marks on its walls.

A mark with a place hangs on the wall there; marks without one are spread evenly along the walls, in their order. The
corridor belongs to the world, not to the run: it follows from ``corridor.seed`` alone.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from pydantic import model_validator

from ....formats.products import MarkMap
from ...engine.params import Field
from ..renderer import Patch
from ..scene import MAP
from ..shapes import Shape
from .marks import PatternParams
from .pairs import Point
from .room import RoomParams, Wall, furnish, walls_of

ON_WALL_M = 0.02
"""A mark that is said to be nearer than this to a wall hangs on it."""
STEP_M = 0.05


class MarkParams(PatternParams):
    """One mark on a wall."""

    id: int = Field(ge=0, description="number of the mark in the map")
    at_m: Point | None = Field(
        None, description="x, y of its abscissa 0 on a wall; placed with the others if absent [m]"
    )
    z_m: float = Field(0.9, gt=0, description="height of its middle above the floor [m]")


class CorridorParams(RoomParams):
    """The building."""

    marks: tuple[MarkParams, ...] = Field(min_length=1, description="the marks on the walls")
    survey_sd_m: float = Field(0.0, ge=0, le=1, description="error of the map, standard deviation in x and in y [m]")
    survey_sd_deg: float = Field(0.0, ge=0, le=20, description="likewise of a mark's heading [deg]")

    @model_validator(mode="after")
    def _ids_differ(self) -> Self:
        ids = [mark.id for mark in self.marks]
        if twice := {i for i in ids if ids.count(i) > 1}:
            raise ValueError(f"marks: id {min(twice)} stands twice. Give each mark its own.")
        return self


@dataclass(frozen=True, slots=True, eq=False)
class Corridor:
    """A corridor as built.

    Attributes:
        marks: where the marks truly hang.
        surveyed: where the robot's map has them.
        patches: all of it, to be rendered.
    """

    marks: MarkMap
    surveyed: MarkMap
    patches: tuple[Patch, ...]


def build_corridor(params: CorridorParams) -> Corridor:
    """Build a corridor.

    Raises:
        ValueError: an outline that crosses itself or runs clockwise, a mark on no wall or over another, or no room for
            a mark.
    """
    walls = walls_of(params.outline_m)
    listed = [_listed(mark, walls, params.height_m) for mark in params.marks]
    places = [place or _placed(number, params, walls) for number, place in enumerate(listed)]
    marks = []
    hung: list[list[Shape]] = [[] for _ in walls]
    for mark, (index, at) in zip(params.marks, places, strict=True):
        wall = walls[index]
        marks.append(mark.mark(mark.id, np.append(wall.left + at * wall.along, wall.heading)))
        hung[index] += mark.shapes(at, params.height_m - mark.z_m)
    patches = furnish(params, walls, hung, np.random.default_rng([params.seed, 0]))
    true = MarkMap(marks=tuple(marks), frame_id=MAP)
    return Corridor(true, _surveyed(true, params, np.random.default_rng([params.seed, 1])), patches)


def _listed(mark: MarkParams, walls: Sequence[Wall], ceiling: float) -> tuple[int, float] | None:
    """Return the wall and the position of a mark with a place, and note that it is taken."""
    if abs(mark.z_m - ceiling / 2) > (ceiling - mark.board[1]) / 2:
        raise ValueError(f"mark {mark.id} reaches through the floor or the ceiling")
    if mark.at_m is None:
        return None
    for index, wall in enumerate(walls):
        offset = np.array(mark.at_m) - wall.left
        at, off = float(offset @ wall.along), float(wall.along[0] * offset[1] - wall.along[1] * offset[0])
        if abs(off) > ON_WALL_M or not 0 <= at <= wall.length:
            continue
        span = at + mark.span[0], at + mark.span[1]
        if not wall.fits(*span, 0.0):
            raise ValueError(f"mark {mark.id} reaches around a corner or over another mark")
        wall.taken.append(span)
        return index, at
    raise ValueError(f"mark {mark.id} is at {mark.at_m[0]}, {mark.at_m[1]}, where no wall is")


def _placed(number: int, params: CorridorParams, walls: Sequence[Wall]) -> tuple[int, float]:
    """Return a place for the ``number``-th mark: evenly along the walls, or a little further on where it fits."""
    mark = params.marks[number]
    ends = np.cumsum([wall.length for wall in walls])
    start = (number + 0.5) / len(params.marks) * ends[-1]
    for further in np.arange(0, ends[-1], STEP_M):
        s = (start + further) % ends[-1]
        index = int(np.searchsorted(ends, s, side="right"))
        at = float(ends[index] - s)  # the outline runs from the right end of a wall to its left end
        span = at + mark.span[0], at + mark.span[1]
        if walls[index].fits(*span, params.clutter.clearance_m):
            walls[index].taken.append(span)
            return index, at
    raise ValueError(f"there is no room for mark {mark.id}")


def _surveyed(true: MarkMap, params: CorridorParams, rng: np.random.Generator) -> MarkMap:
    sd = np.array([params.survey_sd_m, params.survey_sd_m, math.radians(params.survey_sd_deg)])
    marks = tuple(replace(mark, pose=mark.pose + sd * rng.standard_normal(3)) for mark in true.marks)
    return MarkMap(marks=marks, frame_id=MAP)
