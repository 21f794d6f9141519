"""Worlds of the kind ``stripe``: a corridor with stripe marks, and a robot whose camera looks at the walls."""

from functools import partial
from itertools import pairwise
from typing import Literal, Self

import numpy as np
from pydantic import model_validator

from ...engine.params import Field
from ..camera import LevelCameraParams
from ..pose import View
from ..scene import Scene, Sensor
from ..sensors.head import HeadParams, joints
from .base import DrivenWorld
from .corridor import CorridorParams, build_corridor
from .room import is_inside


class StripeWorld(DrivenWorld):
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

    def eye(self, time: float) -> View:
        """Return base_T_camera at a time [s]: the head moves it."""
        mounted = super().eye(time)
        return mounted if self.head is None else self.head.turned(mounted, time)

    def build(self) -> Scene:
        """Build the corridor; a true map stands beside the given one where that was surveyed with an error."""
        corridor = build_corridor(self.corridor)
        maps = {".marks.yaml": corridor.surveyed, ".marks.true.yaml": corridor.marks}
        if self.corridor.survey_sd_m == 0 and self.corridor.survey_sd_deg == 0:
            maps = {".marks.yaml": corridor.marks}
        head: list[Sensor] = [] if self.head is None else [partial(joints, params=self.head)]
        return Scene(
            start_ns=self.start_stamp_ns,
            motion=self.drive,
            sensors=[*self.body_sensors(), *head, *self.camera_sensors(corridor.patches)],
            maps=maps,
            waypoints=self.waypoints,
        )
