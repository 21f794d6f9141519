"""Worlds of the kind ``stripe``: a corridor with stripe marks, and a robot whose camera looks at the walls."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Literal, Self

import numpy as np
from pydantic import model_validator

from ...formats.events import Event
from ..engine.params import Field
from .camera import CameraParams, base_camera
from .corridor import CorridorParams, build_corridor, is_inside
from .head import HeadParams, joints
from .parts import DrivenParts
from .pose import View
from .renderer import Patch
from .robot import Drive, drive
from .scene import Cause, Maps, Moment, Run, stream_of


class LevelCameraParams(CameraParams):
    """A camera that looks about level, ahead or to a side."""

    topic: str = Field("/camera/image_raw", description="topic of the images")
    info_topic: str = Field("/camera/camera_info", description="topic of the calibration")
    frame: str = Field("camera_optical_frame", description="coordinate frame of the camera")
    looks: Literal["up", "forward"] = Field("forward", description="where a camera with a straight mount looks")


class StripeWorld(DrivenParts):
    """A corridor with stripe marks on its walls, and a robot with a camera that looks at them."""

    kind: Literal["stripe"] = Field(description="what there is to see")
    corridor: CorridorParams = Field(description="the building")
    camera: LevelCameraParams = Field(LevelCameraParams(), description="lens, place and topics of the camera")
    head: HeadParams | None = Field(None, description="pan-tilt head under the camera; none if absent")

    @model_validator(mode="after")
    def _lens_is_in_the_room(self) -> Self:
        if not 0.02 <= self.camera.mount.z_m <= self.corridor.height_m - 0.02:
            raise ValueError(
                f"camera.mount.z_m is {self.camera.mount.z_m}, the ceiling is at {self.corridor.height_m} m. "
                "Put the lens between floor and ceiling."
            )
        return self

    @model_validator(mode="after")
    def _route_is_in_the_room(self) -> Self:
        places = list(self.robot.waypoints)
        for place in places:
            if not is_inside(np.array([place.x_m, place.y_m]), self.corridor.outline_m):
                raise ValueError(f"waypoint {place.name} lies outside corridor.outline_m. Move it.")
        for start, end in pairwise(places + places[:1] * self.robot.is_closed):
            leg = np.linspace([start.x_m, start.y_m], [end.x_m, end.y_m], 200)
            if not all(is_inside(point, self.corridor.outline_m) for point in leg):
                raise ValueError(f"the way from {start.name} to {end.name} leads through a wall. Add a waypoint.")
        return self


class StripeScene:
    """A corridor as built.

    Raises:
        ValueError: it cannot be built.
    """

    def __init__(self, world: StripeWorld) -> None:
        self.world = world
        self.building = build_corridor(world.corridor)
        self._mounted = base_camera(world.camera)

    @property
    def patches(self) -> Sequence[Patch]:
        """Walls, floor, ceiling and blocks."""
        return self.building.patches

    @property
    def maps(self) -> Maps:
        """The map the robot is given and, where it was surveyed with an error, the true one."""
        params = self.world.corridor
        if params.survey_sd_m == 0 and params.survey_sd_deg == 0:
            return {".marks.yaml": self.building.marks}
        return {".marks.yaml": self.building.surveyed, ".marks.true.yaml": self.building.marks}

    def motion(self, seed: int) -> Drive:
        """Return the drive along the route."""
        return drive(self.world.robot, stream_of(seed, Cause.DRIVE))

    def eye(self, time: float) -> View:
        """Return base_T_camera at a time [s]: the head moves it."""
        return self._mounted if self.world.head is None else self.world.head.turned(self._mounted, time)

    def of_image(self, moment: Moment) -> Iterator[Event]:  # noqa: ARG002
        """Yield nothing: the true pose and the map of marks say it all."""
        yield from ()

    def sensors(self, run: Run) -> Sequence[Iterator[Event]]:
        """Return the encoders of the head."""
        return () if self.world.head is None else (joints(run, self.world.head),)
