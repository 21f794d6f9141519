"""The ceiling of a hall: lamps, speakers and stickers to navigate by, and everything else that hangs there.

The landmarks are round, nearly of one size, and differ in brightness; no two can be told apart by a number on them. The
clutter is square, hexagonal, long or slatted. False lights look like landmarks but are not in the map. The map that the
robot is given was surveyed with an error; the true one is written beside it.

The building belongs to the world, not to the run: it follows from ``ceiling.seed`` alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
import numpy.typing as npt

from ....formats.events import Array
from ...engine.params import Field, Params
from ..renderer import Patch, Texture
from ..shapes import DISC, HEXAGON, RECTANGLE, ROUNDED, Bars, Drawing, Glow, Shape
from .pairs import Point, Span

MAX_FAILURES = 2000
"""Points in a row that fit nowhere, before a ceiling counts as full."""


class LandmarkParams(Params):
    """The round things of the map."""

    layout: Literal["random", "grid", "listed"] = Field("random", description="how they are placed")
    count: int = Field(297, ge=1, le=100_000, description="random: how many there are [1]")
    near_route: int = Field(146, ge=0, description="random: how many of them the robot passes under [1]")
    near_route_m: float = Field(0.9, gt=0, description="random: near means within this distance of the route [m]")
    far_from_route_m: float = Field(1.8, gt=0, description="random: the others are further away than this [m]")
    spacing_m: float = Field(0.8, ge=0.2, description="random: no two are nearer than this [m]")
    pitch_m: float = Field(1.2, ge=0.2, description="grid: distance between neighbours [m]")
    at_m: tuple[Point, ...] = Field((), description="listed: their x, y [m]")
    radius_m: Span = Field((0.06, 0.075), description="smallest and largest radius [m]")
    lamps: float = Field(0.5, ge=0, le=1, description="share of lamps, which have a halo [1]")
    speakers: float = Field(0.25, ge=0, le=1, description="share of loudspeakers; the rest are stickers [1]")
    lamp_radiance: Span = Field((1.1, 1.8), description="lamps; 1 saturates a pixel at gain 1 [1]")
    speaker_radiance: Span = Field((0.62, 0.8), description="loudspeakers [1]")
    sticker_radiance: Span = Field((0.75, 0.95), description="stickers [1]")
    halo: float = Field(0.1, ge=0, description="glow at a lamp's rim, relative to the lamp [1]")


class CeilingClutterParams(Params):
    """What hangs there and is no landmark."""

    per_m2: float = Field(0.4, ge=0, le=20, description="panels, vents, strips, hexagons [1/m^2]")
    side_m: Span = Field((0.045, 0.15), description="smallest and largest side [m]")
    radiance: Span = Field((0.45, 1.0), description="of the bright ones [1]")
    dark_share: float = Field(0.3, ge=0, le=1, description="share of dark ones [1]")
    clearance_m: float = Field(0.03, ge=0, description="gap to landmarks and false lights [m]")
    false_lights_per_m2: float = Field(0.0, ge=0, le=5, description="round lights that are not in the map [1/m^2]")


class TileParams(Params):
    """The tiles of a suspended ceiling."""

    pitch_m: float = Field(0.6, gt=0.05, description="side of a tile [m]")
    bar_m: float = Field(0.024, ge=0, description="width of the bars between tiles; 0 for none [m]")
    radiance: float = Field(0.3, ge=0, description="of a tile [1]")
    bar_radiance: float = Field(0.37, ge=0, description="of a bar [1]")
    contrast: float = Field(0.06, ge=0, le=0.5, description="relative unevenness of the tiles [1]")


class GapParams(Params):
    """A rectangle without landmarks."""

    x_m: Span = Field(description="from, to [m]")
    y_m: Span = Field(description="from, to [m]")


class CeilingParams(Params):
    """The building."""

    height_m: float = Field(gt=0, description="of the ceiling above the floor [m]")
    size_m: Point = Field((100.0, 50.0), description="extent along x and y, from 0, 0 [m]")
    seed: int = Field(1, ge=0, description="draws the building: layout, sizes, survey errors")
    landmarks: LandmarkParams = Field(LandmarkParams(), description="what the map holds")
    clutter: CeilingClutterParams = Field(CeilingClutterParams(), description="what it does not hold")
    tiles: TileParams = Field(TileParams(), description="the background")
    gaps: tuple[GapParams, ...] = Field((), description="places without landmarks")
    survey_sd_m: float = Field(0.0, ge=0, le=1, description="error of the map, standard deviation in x and in y [m]")


@dataclass(frozen=True, slots=True, eq=False)
class Ceiling:
    """A ceiling as built.

    Attributes:
        landmarks: (N, 3) true positions [m]; the id of a landmark is its row.
        surveyed: (N, 3) positions in the robot's map [m].
        false_lights: (M, 3) round things that are not in the map [m].
        radii: (N + M,) of landmarks, then of false lights [m].
        patch: all of it, to be rendered.
    """

    landmarks: Array
    surveyed: Array
    false_lights: Array
    radii: Array
    patch: Patch

    @property
    def height(self) -> float:
        """Above the floor [m]."""
        return float(self.patch.corner[2])


def build_ceiling(params: CeilingParams, route: Array) -> Ceiling:
    """Build the ceiling over a route (W, 2) [m].

    Raises:
        ValueError: there is no room for that many landmarks, or a radius or list makes no sense.
    """
    streams = [np.random.default_rng([params.seed, k]) for k in range(5)]
    xy = _places(params, route, streams[0])
    low, high = params.landmarks.radius_m
    area = params.size_m[0] * params.size_m[1]
    n_false = int(streams[1].poisson(params.clutter.false_lights_per_m2 * area))
    false_xy = _scatter(params, n_false, [(xy, 0.3)], 0.3, streams[1])
    radii = streams[2].uniform(low, high, len(xy) + len(false_xy))
    rounds = np.vstack([xy, false_xy])
    shapes, glows = _round_things(params.landmarks, rounds, radii, streams[2])
    clutter = _clutter(params, rounds, radii, streams[3])
    tile, size = params.tiles, params.size_m
    bars = Bars(tile.pitch_m, tile.bar_m, tile.bar_radiance) if tile.bar_m > 0 else None
    patch = Patch(
        np.array([0.0, 0.0, params.height_m]),
        np.array([size[0], 0.0, 0.0]),
        np.array([0.0, size[1], 0.0]),
        Drawing([*clutter, *shapes], glows, bars),
        _tiles(tile, np.random.default_rng([params.seed, 5])),
        tile.radiance,
    )
    level = np.full((len(rounds), 1), params.height_m)
    true = np.hstack([rounds, level])
    surveyed = true[: len(xy)].copy()
    surveyed[:, :2] += params.survey_sd_m * streams[4].standard_normal((len(xy), 2))
    return Ceiling(true[: len(xy)], surveyed, true[len(xy) :], radii, patch)


def distance_to_route(points: Array, route: Array) -> Array:
    """Return the distance of points (N, 2) to the nearest leg of a route (W, 2), (N,) [m]."""
    start, leg = route[:-1], np.diff(route, axis=0)
    along = np.einsum("nlk,lk->nl", points[:, None] - start, leg) / (leg**2).sum(axis=1)
    foot = start + np.clip(along, 0, 1)[..., None] * leg
    return np.asarray(np.linalg.norm(points[:, None] - foot, axis=2).min(axis=1))


def _places(params: CeilingParams, route: Array, rng: np.random.Generator) -> Array:
    """Return the places of the landmarks, (N, 2), those under the route first."""
    what = params.landmarks
    margin = what.radius_m[1]
    low, high = np.full(2, margin), np.array(params.size_m) - margin
    if what.layout == "listed":
        xy: Array = np.array(what.at_m, float).reshape(-1, 2)
        if not len(xy):
            raise ValueError("layout 'listed' needs at_m, the x, y of each landmark")
        if ((xy < low) | (xy > high)).any():
            raise ValueError(f"a listed landmark lies outside the ceiling of {params.size_m[0]} x {params.size_m[1]} m")
        return xy
    if what.layout == "grid":
        axes = [np.arange(what.pitch_m / 2, size - margin, what.pitch_m) for size in params.size_m]
        xy = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
        return np.asarray(xy[~_in_gaps(xy, params.gaps)])
    return _random_places(params, route, low, high, rng)


def _random_places(params: CeilingParams, route: Array, low: Array, high: Array, rng: np.random.Generator) -> Array:
    what = params.landmarks
    near = min(what.near_route, what.count)
    placed: list[Array] = []
    legs = np.diff(route, axis=0)
    lengths = np.hypot(legs[:, 0], legs[:, 1])
    failures = -1
    while len(placed) < what.count:
        failures += 1
        if failures > MAX_FAILURES:
            raise ValueError(f"no room for {what.count} landmarks {what.spacing_m} m apart; {len(placed)} fit")
        if len(placed) < near:
            leg = int(rng.choice(len(legs), p=lengths / lengths.sum()))
            t = legs[leg] / lengths[leg]
            left = rng.uniform(-what.near_route_m, what.near_route_m)
            point = route[leg] + rng.uniform(0, lengths[leg]) * t + left * np.array([-t[1], t[0]])
        else:
            point = rng.uniform(low, high)
            if distance_to_route(point[None], route)[0] < what.far_from_route_m:
                continue
        if (point < low).any() or (point > high).any() or _in_gaps(point[None], params.gaps)[0]:
            continue
        if not placed or ((np.array(placed) - point) ** 2).sum(axis=1).min() >= what.spacing_m**2:
            placed.append(point)
            failures = -1
    return np.array(placed)


def _in_gaps(points: Array, gaps: Sequence[GapParams]) -> npt.NDArray[np.bool_]:
    inside = np.zeros(len(points), bool)
    for gap in gaps:
        x, y = points[:, 0], points[:, 1]
        inside |= (x >= gap.x_m[0]) & (x <= gap.x_m[1]) & (y >= gap.y_m[0]) & (y <= gap.y_m[1])
    return inside


def _scatter(
    params: CeilingParams, n: int, clear: Sequence[tuple[Array, Array | float]], own: float, rng: np.random.Generator
) -> Array:
    """Return up to ``n`` random points (M, 2) that keep their distance from ``clear`` and from each other (``own``)."""
    points = rng.uniform([own, own], np.array(params.size_m) - own, (n, 2))
    keep: list[int] = []
    for i, point in enumerate(points):
        if any((np.hypot(*(xy - point).T) < gap).any() for xy, gap in clear if len(xy)):
            continue
        if keep and ((points[keep] - point) ** 2).sum(axis=1).min() < own * own:
            continue
        keep.append(i)
    return points[keep]


def _round_things(
    params: LandmarkParams, xy: Array, radii: Array, rng: np.random.Generator
) -> tuple[list[Shape], list[Glow]]:
    shapes, glows = [], []
    for (x, y), r in zip(xy.tolist(), radii.tolist(), strict=True):
        kind, draw = rng.random(), rng.random()

        def between(span: Span, draw: float = draw) -> float:
            return span[0] + draw * (span[1] - span[0])

        if kind < params.lamps:
            light = between(params.lamp_radiance)
            shapes.append(Shape(DISC, x, y, 2 * r, 2 * r, light))
            glows.append(Glow(x, y, r, params.halo * light, 0.04, 0.45))
        elif kind < params.lamps + params.speakers:
            light = between(params.speaker_radiance)
            shapes.append(Shape(DISC, x, y, 2 * r, 2 * r, light))
            shapes.append(Shape(DISC, x, y, 1.64 * r, 1.64 * r, 0.88 * light))
            shapes.append(Shape(DISC, x, y, 1.5 * r, 1.5 * r, 0.96 * light))
        else:
            shapes.append(Shape(DISC, x, y, 2 * r, 2 * r, between(params.sticker_radiance)))
    return shapes, glows


def _clutter(params: CeilingParams, rounds: Array, radii: Array, rng: np.random.Generator) -> list[Shape]:
    what = params.clutter
    n = int(rng.poisson(what.per_m2 * params.size_m[0] * params.size_m[1]))
    reach = 0.75 * what.side_m[1] + what.clearance_m  # half a diagonal, and a little for hexagons
    shapes: list[Shape] = []
    for x, y in _scatter(params, n, [(rounds, radii + 2 * reach)], 1.2 * reach, rng).tolist():
        side, light, turn = rng.uniform(*what.side_m), rng.uniform(*what.radiance), rng.uniform(0, np.pi)
        if rng.random() < what.dark_share:
            light = rng.uniform(0.05, 0.7) * params.tiles.radiance
        kind = int(rng.integers(6))
        if kind in (RECTANGLE, ROUNDED):
            shapes.append(Shape(kind, x, y, side, side, light, turn, 0.25 * side))
        elif kind == HEXAGON:
            shapes.append(Shape(HEXAGON, x, y, side, side, light, turn))
        elif kind == 0:
            shapes.append(Shape(RECTANGLE, x, y, side, rng.uniform(0.4, 0.8) * side, light, turn))
        elif kind == 4:  # a strip, longer than anything else
            shapes.append(Shape(RECTANGLE, x, y, 2 * reach, 0.02, light, turn))
        else:
            shapes += _vent(x, y, 2 * what.side_m[1] * 0.7, params.tiles.radiance)
    return shapes


def _vent(x: float, y: float, side: float, radiance: float) -> list[Shape]:
    """Return an air vent: a frame with five dark slits, in line with the tiles."""
    slits = [
        Shape(RECTANGLE, x, y + k * side / 6.5, 0.8 * side, 0.045 * side, 0.25 * radiance) for k in (-2, -1, 0, 1, 2)
    ]
    return [Shape(RECTANGLE, x, y, side, side, 1.25 * radiance), *slits]


def _tiles(params: TileParams, rng: np.random.Generator) -> Texture:
    """Return mineral fibre: fine grain, soft stains, and tiles that differ a little; repeats after four tiles."""
    n, tiles = 512, 4
    fine = cv2.GaussianBlur(rng.standard_normal((n, n)), (0, 0), 0.8, borderType=cv2.BORDER_REFLECT)
    spots = rng.standard_normal((n, n))
    soft = cv2.GaussianBlur(np.pad(spots, 96, mode="wrap"), (0, 0), 24)[96 : 96 + n, 96 : 96 + n]
    each = np.kron(rng.standard_normal((tiles, tiles)), np.ones((n // tiles, n // tiles)))
    grain = 0.45 * fine / fine.std() + 0.4 * soft / soft.std() + 0.6 * each
    picture = np.clip(np.rint(200 * (1 + params.contrast * np.clip(grain, -4, 4))), 0, 255).astype(np.uint8)
    return Texture.of(picture, n / (tiles * params.pitch_m), is_tiled=True, white=params.radiance * 255 / 200)
