"""A room of any outline: walls with what hangs on them, floor, ceiling with lamps, posts and boxes.

Walls stand on the legs of a polygon that runs counter-clockwise, and are seen from inside. Clutter fills what is left
free on them. Blocks (posts, boxes) stand free, so they hide what is behind them from some places and not from others.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from pydantic import model_validator

from ....formats.events import Array
from ...engine.params import Field, Params
from ..renderer import Patch
from ..shapes import Drawing, Shape
from .clutter import ClutterParams, make
from .light import LightParams, lit
from .pairs import Point
from .surfaces import ceiling_patch, floor_patch, plaster, skirting

CORNER_M = 0.05
"""Bare wall between a corner and what hangs on the wall."""


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


class RoomParams(Params):
    """The building."""

    outline_m: tuple[Point, ...] = Field(min_length=3, description="corners of the floor, counter-clockwise: x, y [m]")
    height_m: float = Field(2.5, gt=0, description="of the ceiling above the floor [m]")
    seed: int = Field(1, ge=0, description="draws the building: clutter, survey errors")
    wall: float = Field(0.55, ge=0, description="radiance of a bare wall in even light [1]")
    clutter: ClutterParams = Field(ClutterParams(), description="what else hangs on the walls")
    blocks: tuple[BlockParams, ...] = Field((), description="posts and boxes")
    light: LightParams = Field(LightParams(), description="lamps, daylight")


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


def walls_of(outline: Sequence[Point]) -> list[Wall]:
    """Return the walls of an outline, one for each leg.

    Raises:
        ValueError: an outline that crosses itself or runs clockwise, or with two corners in one place.
    """
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


def furnish(
    params: RoomParams, walls: Sequence[Wall], hung: Sequence[Sequence[Shape]], rng: np.random.Generator
) -> tuple[Patch, ...]:
    """Return all surfaces of a room with the light on them, walls first.

    Args:
        params: the room.
        walls: of its outline; clutter is hung where they are free.
        hung: what is drawn on each wall already.
        rng: draws the clutter.
    """
    drawings = [[*_clutter(params, wall, rng), *shapes] for wall, shapes in zip(walls, hung, strict=True)]
    patches = [_wall_patch(params, *pair) for pair in zip(walls, drawings, strict=True)]
    patches += [skirting(wall.left, wall.right) for wall in walls]
    low, high = np.min(params.outline_m, axis=0), np.max(params.outline_m, axis=0)
    lamps = _lamps(params, low, high)
    patches += [floor_patch(low, high), ceiling_patch(low, high, params.height_m, lamps, params.light.lamp_pitch_m)]
    for block in params.blocks:
        patches += _block_patches(block)
    middle = (low + high) / 2
    return tuple(replace(patch, shading=lit(patch, params.light, lamps, middle)) for patch in patches)


def is_inside(point: Array, outline: Sequence[Point]) -> bool:
    """Whether a point (2,) lies inside a polygon."""
    inside, (x, y) = False, point
    for (x0, y0), (x1, y1) in zip(outline, [*outline[1:], outline[0]], strict=True):
        if (y0 > y) != (y1 > y) and x < x0 + (y - y0) * (x1 - x0) / (y1 - y0):
            inside = not inside
    return inside


def _clutter(params: RoomParams, wall: Wall, rng: np.random.Generator) -> list[Shape]:
    what = params.clutter
    shapes: list[Shape] = []
    for _ in range(int(rng.poisson(what.per_m * wall.length))):
        thing = make(what.kinds[int(rng.integers(len(what.kinds)))], rng)
        left = rng.uniform(CORNER_M, max(wall.length - thing.width - CORNER_M, CORNER_M), 20)
        for start in left.tolist():
            if wall.fits(start, start + thing.width, what.clearance_m):
                wall.taken.append((start, start + thing.width))
                shapes += thing.shapes(start, params.height_m)
                break
    return shapes


def _wall_patch(params: RoomParams, wall: Wall, shapes: Sequence[Shape]) -> Patch:
    corner, side = np.append(wall.left, params.height_m), np.append(wall.right - wall.left, 0.0)
    down = np.array([0.0, 0.0, -params.height_m])
    return Patch(corner, side, down, Drawing(shapes), plaster(params.wall), params.wall)


def _lamps(params: RoomParams, low: Array, high: Array) -> Array:
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
        sides.append(Patch(np.append(left, height), side, -up, radiance=share * block.radiance))
    side_u, side_v = np.append(corners[3] - corners[0], 0.0), np.append(corners[1] - corners[0], 0.0)
    return [*sides, Patch(np.append(corners[0], height), side_u, side_v, radiance=block.radiance)]
