"""Worlds of the kind ``stripe-bench``: section V of the stripe paper, a mark on a rail and a rotary table.

On the paper's bench the mark moves along and across the optical axis and turns; the camera stands. Only their relation
counts, so here the mark hangs at the origin of the map, its X axis along x, and a carriage carries the camera: seen
from the lens the mark's origin lies ``offset`` to the right and ``distance`` ahead, and the mark is turned by
``angle``, counter-clockwise from above. One image is taken at every combination of the lists, ``repeats`` times, each
time shifted sideways by up to half of ``phase_px`` pixels: the errors of edges that are read to whole pixels depend on
where the pixels fall.

The carriage rides at the height of the mark's middle plus ``height_m``; ``tilt_deg`` (up is positive) and ``roll_deg``
turn the camera about its lens. The log does not tell of these three; what it tells of is ``camera.mount``.
"""

import math
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import AfterValidator, model_validator

from ....formats.events import Array
from ....formats.products import MarkMap
from ...engine.params import Field, Params
from ..camera import LevelCameraParams
from ..pose import View, rpy
from ..renderer import Patch
from ..scene import MAP, Cause, Scene, stream_of
from ..sensors.start import frames
from ..shapes import Drawing
from .base import World
from .marks import PatternParams

CLEARANCE_M = 0.06
"""What is nearer to the lens is not drawn."""


def _listed(values: tuple[float, ...]) -> tuple[float, ...]:
    if len(set(values)) != len(values):
        raise ValueError("should name each value once")
    return values


Values = Annotated[tuple[float, ...], AfterValidator(_listed)]


class BenchParams(Params):
    """What is set on the bench."""

    distances_m: Values = Field(
        tuple(round(0.3 + 0.1 * k, 1) for k in range(13)), min_length=1, description="D_y, ahead of the lens [m]"
    )
    offsets_m: Values = Field((0.0, 0.02, 0.04, 0.06), min_length=1, description="D_x, to the right [m]")
    angles_deg: Values = Field(
        (0.0, 20.0, 40.0, 60.0, 80.0), min_length=1, description="phi, turn of the mark, between -90 and 90 [deg]"
    )
    repeats: int = Field(1, ge=1, le=100_000, description="images of each combination [1]")
    phase_px: float = Field(1.0, ge=0, description="width of the random sideways shift, in pixels on the mark [px]")
    height_m: float = Field(0.0, description="lens above the middle of the mark; not in the log [m]")
    tilt_deg: float = Field(0.0, ge=-45, le=45, description="optical axis above the horizon; not in the log [deg]")
    roll_deg: float = Field(0.0, ge=-45, le=45, description="turn about the optical axis; not in the log [deg]")
    backdrop: float = Field(0.25, ge=0, description="radiance of the wall behind the mark [1]")


@dataclass(frozen=True, slots=True, eq=False)
class Stops:
    """Where the carriage stood: one stop per image.

    Attributes:
        period: between stops [s].
        pose: (N, 3) x, y, heading of ``base_link`` [m, m, rad].
        height: of ``base_link`` [m].
        attitude: (3, 3) level_R_base, the tilt and roll that the log does not tell of.
        pivot: (3,) the lens in ``base_link`` [m], which they turn about.
    """

    period: float
    pose: Array
    height: float
    attitude: Array
    pivot: Array

    @property
    def duration(self) -> float:
        """From the first stop to the last [s]."""
        return (len(self.pose) - 1) * self.period

    def at(self, time: float) -> tuple[Array, float, Array]:
        """Return pose (3,) at a time [s]; a bench has no odometer and no floor."""
        return self.pose[min(max(round(time / self.period), 0), len(self.pose) - 1)], 0.0, np.zeros(2)

    def view(self, time: float) -> View:
        """Return map_T_base at a time [s]."""
        pose = self.at(time)[0]
        level = View(rpy(0.0, 0.0, pose[2]), np.array([pose[0], pose[1], self.height]))
        return level @ View(self.attitude, self.pivot - self.attitude @ self.pivot)


class BenchWorld(World):
    """A camera before a mark on a bench."""

    kind: Literal["stripe-bench"] = Field(description="what there is to see")
    mark: PatternParams = Field(PatternParams(), description="the mark")
    mark_id: int = Field(1, ge=0, description="number of the mark in the map")
    bench: BenchParams = Field(BenchParams(), description="distances, offsets, angles")
    camera: LevelCameraParams = Field(LevelCameraParams(), description="lens, place and topics of the camera")

    @model_validator(mode="after")
    def _mark_is_ahead(self) -> Self:
        for distance, angle in product(self.bench.distances_m, self.bench.angles_deg):
            nearest = distance + min(math.sin(math.radians(angle)) * x for x in self.mark.span)
            if abs(angle) >= 90 or nearest < CLEARANCE_M:
                raise ValueError(
                    f"at {distance} m and {angle} deg the mark reaches beside or behind the lens. "
                    "Leave that combination out."
                )
        return self

    def build(self) -> Scene:
        """Build the board, in a dark box."""
        left, right = self.mark.span
        width, height = self.mark.board
        board = Patch(
            np.array([left, 0.0, height / 2]),
            np.array([right - left, 0.0, 0.0]),
            np.array([0.0, 0.0, -height]),
            Drawing(self.mark.shapes(-left, height / 2)),
            radiance=self.mark.dark,
        )
        mark = self.mark.mark(self.mark_id, np.zeros(3))
        return Scene(
            start_ns=self.start_stamp_ns,
            motion=self.stops,
            sensors=[
                partial(frames, mounts=self.mounts()),
                *self.camera_sensors([board, *_backdrop(self.bench, width)]),
            ],
            maps={".marks.yaml": MarkMap(marks=(mark,), frame_id=MAP)},
        )

    def stops(self, seed: int) -> Stops:
        """Return the stops of the carriage, the last list running fastest."""
        bench, mount = self.bench, self.camera.mount
        phases = stream_of(seed, Cause.PHASE)
        poses = []
        for distance, offset, angle in product(bench.distances_m, bench.offsets_m, bench.angles_deg):
            shift = bench.phase_px * distance / self.camera.fx_px
            shifts = offset + shift * phases.uniform(-0.5, 0.5, bench.repeats)
            poses += [self.carriage(math.radians(angle), d_x, distance) for d_x in shifts.tolist()]
        tilt, roll = math.radians(bench.tilt_deg), math.radians(bench.roll_deg)
        pan = math.radians(mount.yaw_deg)
        # About the axes of the lens, whatever its pan: tilt turns nose up, so against the y axis that points left.
        attitude = rpy(0.0, 0.0, pan) @ rpy(roll, -tilt, 0.0) @ rpy(0.0, 0.0, -pan)
        return Stops(
            1 / self.camera.rate_hz, np.array(poses), bench.height_m - mount.z_m, attitude, mount.view.position
        )

    def carriage(self, phi: float, d_x: float, d_y: float) -> Array:
        """Return x, y, heading of ``base_link`` from which the mark is seen at phi, D_x, D_y [rad, m, m]."""
        c, s = math.cos(phi), math.sin(phi)
        lens = -np.array([c * d_x + s * d_y, -s * d_x + c * d_y])
        mount = self.camera.mount
        heading = math.pi / 2 - phi - math.radians(mount.yaw_deg)
        c, s = math.cos(heading), math.sin(heading)
        x, y = mount.x_m, mount.y_m
        return np.array([lens[0] - c * x + s * y, lens[1] - s * x - c * y, heading])


def _backdrop(bench: BenchParams, width: float) -> list[Patch]:
    """Return four walls that stand well outside of everything."""
    far = 2.0 * (max(bench.distances_m) + max(map(abs, bench.offsets_m)) + width) + 1.0
    corners = np.array([[-far, -far], [far, -far], [far, far], [-far, far]])
    down = np.array([0.0, 0.0, -4 * far])
    return [
        Patch(np.append(left, 2 * far), np.append(right - left, 0.0), down, radiance=bench.backdrop)
        for right, left in zip(corners, np.roll(corners, -1, axis=0), strict=True)
    ]
