"""A corridor of any outline: walls with stripe marks and clutter, floor, ceiling with lamps, posts and boxes.

Walls stand on the legs of a polygon that runs counter-clockwise, and are seen from inside. A mark with a place hangs on
the wall there; marks without one are spread evenly along the walls, in their order. Clutter fills what is left. Blocks
(posts, boxes) stand free, so they hide a mark from some places and not from others.

The corridor belongs to the world, not to the run: it follows from ``corridor.seed`` alone.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from pydantic import model_validator

from ...formats.events import Array
from ...formats.products import MarkMap, StripeMark
from ..engine.params import Field, Params
from .clutter import ClutterParams, make
from .light import LightParams, lit
from .marks import PatternParams
from .pairs import Point
from .renderer import Patch
from .scene import MAP
from .shapes import Drawing, Shape
from .surfaces import ceiling_patch, floor_patch, plaster, skirting

CORNER_M = 0.05
"""Bare wall between a corner and what hangs on the wall."""
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


class BlockParams(Params):
    """A post or a box."""

    at_m: Point = Field(description="x, y of its middle [m]")
    size_m: tuple[float, float, float] = Field((0.06, 0.06, 2.0), description="length, width, height [m]")
    turn_deg: float = Field(0.0, description="of its length from the x axis [deg]")
    radiance: float = Field(0.08, ge=0, description="of its sides in even light [1]")

    @model_validator(mode="after")
    def _has_a_size(self) -> Self:
        if min(self.size_m) <= 0:
            raise ValueError("size_m must be above 0. Give length, width and height.")
        return self


class CorridorParams(Params):
    """The building."""

    outline_m: tuple[Point, ...] = Field(min_length=3, description="corners of the floor, counter-clockwise: x, y [m]")
    height_m: float = Field(2.5, gt=0, description="of the ceiling above the floor [m]")
    seed: int = Field(1, ge=0, description="draws the building: clutter, survey errors")
    wall: float = Field(0.55, ge=0, description="radiance of a bare wall in even light [1]")
    marks: tuple[MarkParams, ...] = Field(min_length=1, description="the marks on the walls")
    clutter: ClutterParams = Field(ClutterParams(), description="what else hangs on the walls")
    blocks: tuple[BlockParams, ...] = Field((), description="posts and boxes")
    light: LightParams = Field(LightParams(), description="lamps, daylight")
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


@dataclass(frozen=True, slots=True, eq=False)
class Wall:
    """One wall; positions on it count from its left end as one sees it from inside.

    Attributes:
        left, right: (2,) its ends [m].
        taken: from, to of what hangs there [m]; changed while the walls are furnished.
    """

    left: Array
    right: Array
    taken: list[tuple[float, float]]

    @property
    def length(self) -> float:
        """From end to end [m]."""
        return float(np.hypot(*(self.right - self.left)))

    @property
    def along(self) -> Array:
        """Unit vector from left to right, (2,)."""
        return np.asarray((self.right - self.left) / self.length)

    @property
    def heading(self) -> float:
        """Of the direction from left to right [rad]."""
        return math.atan2(self.along[1], self.along[0])

    def fits(self, start: float, end: float, clearance: float) -> bool:
        """Whether there is room from ``start`` to ``end`` [m]."""
        if start < CORNER_M or end > self.length - CORNER_M:
            return False
        return all(end + clearance <= a or start - clearance >= b for a, b in self.taken)


def build_corridor(params: CorridorParams) -> Corridor:
    """Build a corridor.

    Raises:
        ValueError: an outline that crosses itself or runs clockwise, a mark on no wall or over another, or no room for
            a mark.
    """
    walls = _walls(params.outline_m)
    streams = [np.random.default_rng([params.seed, k]) for k in range(3)]
    drawings: list[list[Shape]] = [[] for _ in walls]
    hung = [_listed(mark, walls, params.height_m) for mark in params.marks]
    for number, mark in enumerate(params.marks):
        hung[number] = hung[number] or _placed(mark, number, params, walls)
    marks = []
    for mark, place in zip(params.marks, hung, strict=True):
        assert place is not None
        index, at = place
        wall = walls[index]
        marks.append(mark.mark(mark.id, np.append(wall.left + at * wall.along, wall.heading)))
        drawings[index] += mark.shapes(at, params.height_m - mark.z_m)
    for wall, drawing in zip(walls, drawings, strict=True):
        drawing[:0] = _clutter(params, wall, streams[0])
    patches = [_wall_patch(params, *pair) for pair in zip(walls, drawings, strict=True)]
    patches += [skirting(wall.left, wall.right) for wall in walls]
    low, high = np.min(params.outline_m, axis=0), np.max(params.outline_m, axis=0)
    lamps = _lamps(params, low, high)
    patches += [floor_patch(low, high), ceiling_patch(low, high, params.height_m, lamps, params.light.lamp_pitch_m)]
    for block in params.blocks:
        patches += _block_patches(block)
    middle = (low + high) / 2
    patches = [replace(patch, shading=lit(patch, params.light, lamps, middle)) for patch in patches]
    true = MarkMap(marks=tuple(marks), frame_id=MAP)
    return Corridor(true, _surveyed(true, params, streams[1]), tuple(patches))


def is_inside(point: Array, outline: Sequence[Point]) -> bool:
    """Whether a point (2,) lies inside a polygon."""
    inside, (x, y) = False, point
    for (x0, y0), (x1, y1) in zip(outline, [*outline[1:], outline[0]], strict=True):
        if (y0 > y) != (y1 > y) and x < x0 + (y - y0) * (x1 - x0) / (y1 - y0):
            inside = not inside
    return inside


def _walls(outline: Sequence[Point]) -> list[Wall]:
    corners = np.array(outline)
    following = np.roll(corners, -1, axis=0)
    if (np.hypot(*(following - corners).T) < 2 * CORNER_M).any():
        raise ValueError("two corners of outline_m lie in one place")
    if _crosses_itself(corners, following):
        raise ValueError("outline_m crosses itself")
    area = (corners[:, 0] * following[:, 1] - corners[:, 1] * following[:, 0]).sum()
    if area <= 0:
        raise ValueError("outline_m does not run counter-clockwise")
    # Who stands inside sees the end of a counter-clockwise leg on the left.
    return [Wall(end, start, []) for start, end in zip(corners, following, strict=True)]


def _crosses_itself(start: Array, end: Array) -> bool:
    def side(a: Array, b: Array, p: Array) -> float:
        return float((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]))

    n = len(start)
    for i in range(n):
        for j in range(i + 2, n if i else n - 1):
            a, b, c, d = start[i], end[i], start[j], end[j]
            if side(a, b, c) * side(a, b, d) < 0 and side(c, d, a) * side(c, d, b) < 0:
                return True
    return False


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


def _placed(mark: MarkParams, number: int, params: CorridorParams, walls: Sequence[Wall]) -> tuple[int, float]:
    """Return a place for the ``number``-th mark: evenly along the walls, or a little further on where it fits."""
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


def _clutter(params: CorridorParams, wall: Wall, rng: np.random.Generator) -> list[Shape]:
    what = params.clutter
    shapes: list[Shape] = []
    for _ in range(int(rng.poisson(what.per_m * wall.length))):
        thing = make(what.kinds[int(rng.integers(len(what.kinds)))], rng)
        left = rng.uniform(CORNER_M, max(wall.length - thing.width - CORNER_M, CORNER_M), 20)
        for start in left.tolist():
            if wall.fits(start, start + thing.width, what.clearance_m):
                wall.taken.append((start, start + thing.width))
                shapes += thing.shapes(start, params.height_m, params.height_m)
                break
    return shapes


def _wall_patch(params: CorridorParams, wall: Wall, shapes: Sequence[Shape]) -> Patch:
    corner, side = np.append(wall.left, params.height_m), np.append(wall.right - wall.left, 0.0)
    down = np.array([0.0, 0.0, -params.height_m])
    return Patch(corner, side, down, Drawing(shapes), plaster(params.wall), params.wall)


def _lamps(params: CorridorParams, low: Array, high: Array) -> Array:
    """Return the places of the lamps under the ceiling, (K, 3) [m]: a grid, evenly from wall to wall."""
    pitch = params.light.lamp_pitch_m
    if pitch <= 0 or params.light.lamp_strength <= 0:
        return np.zeros((0, 3))
    counts = np.maximum(np.rint((high - low) / pitch), 1).astype(int)
    axes = [lo + (np.arange(n) + 0.5) * (hi - lo) / n for lo, hi, n in zip(low, high, counts, strict=True)]
    places = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    keep = [place for place in places if is_inside(place, params.outline_m)]
    return np.array([[*place, params.height_m] for place in keep]).reshape(-1, 3)


def _block_patches(block: BlockParams) -> list[Patch]:
    """Return the four sides of a block and its top."""
    length, width, height = block.size_m
    c, s = math.cos(math.radians(block.turn_deg)), math.sin(math.radians(block.turn_deg))
    corners = np.array([[-length, -width], [length, -width], [length, width], [-length, width]]) / 2
    corners = corners @ np.array([[c, s], [-s, c]]) + block.at_m
    up = np.array([0.0, 0.0, height])
    sides = []
    for left, right, share in zip(corners, np.roll(corners, -1, axis=0), (1.0, 0.86, 1.0, 0.86), strict=True):
        # Counter-clockwise seen from above, so from outside a side runs from its left end to its right.
        side = np.append(right - left, 0.0)
        sides.append(Patch(np.append(left, height), side, -up, Drawing(), None, share * block.radiance))
    top = Patch(
        np.append(corners[0], height), np.append(corners[3] - corners[0], 0.0), np.append(corners[1] - corners[0], 0.0)
    )
    return [*sides, replace(top, radiance=block.radiance)]


def _surveyed(true: MarkMap, params: CorridorParams, rng: np.random.Generator) -> MarkMap:
    sd = np.array([params.survey_sd_m, params.survey_sd_m, math.radians(params.survey_sd_deg)])
    marks: list[StripeMark] = [replace(mark, pose=mark.pose + sd * rng.standard_normal(3)) for mark in true.marks]
    return MarkMap(marks=tuple(marks), frame_id=MAP)
