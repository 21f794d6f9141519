"""Worlds of the kind ``ceiling``: a hall, and a robot with a camera that looks up."""

from functools import partial
from typing import Literal, Self

import numpy as np
from pydantic import model_validator

from ....formats.products import LandmarkMap
from ...engine.params import Field
from ..scene import MAP, Scene
from ..sensors.truth import true_poses
from .base import DrivenWorld
from .ceiling import CeilingParams, build_ceiling
from .sightings import AbstractParams, sightings


class CeilingWorld(DrivenWorld):
    """A hall with landmarks on its ceiling, and a robot with a camera that looks up."""

    kind: Literal["ceiling"] = Field(description="what there is to see")
    ceiling: CeilingParams = Field(description="the building")
    images: bool = Field(True, description="render images; otherwise abstract sightings, for Monte-Carlo tests only")
    sightings: AbstractParams = Field(AbstractParams(), description="used where images is false")

    @model_validator(mode="after")
    def _lens_is_below_ceiling(self) -> Self:
        if self.ceiling.height_m - self.camera.mount.z_m < 0.1:
            raise ValueError(
                f"ceiling.height_m is {self.ceiling.height_m}, the lens is at {self.camera.mount.z_m} m. "
                "The ceiling must be at least 0.1 m above the lens."
            )
        return self

    def build(self) -> Scene:
        """Build the hall; landmark ids are the same in the map the robot is given and in the true one."""
        hall = build_ceiling(self.ceiling, self.robot.route)
        seen = partial(sightings, camera=self.camera, ceiling=hall, abstract=None if self.images else self.sightings)
        true = partial(true_poses, rate_hz=self.camera.rate_hz)
        ids = np.arange(len(hall.landmarks), dtype=np.int64)
        return Scene(
            start_ns=self.start_stamp_ns,
            motion=self.drive,
            sensors=[*self.body_sensors(), *(self.camera_sensors([hall.patch], seen) if self.images else [true, seen])],
            maps={
                ".landmarks.yaml": LandmarkMap(ids=ids, positions=hall.surveyed, frame_id=MAP),
                ".landmarks.true.yaml": LandmarkMap(ids=ids, positions=hall.landmarks, frame_id=MAP),
            },
            waypoints=self.waypoints,
        )
