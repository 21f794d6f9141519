"""What worlds of several kinds have in common: a camera and its sensor; a robot, its odometry and its start."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import partial
from typing import Literal

from ....formats.maps.waypoints import Waypoint
from ...engine.params import Field, Params
from ..camera import CameraParams, base_camera
from ..pose import View
from ..renderer import Patch
from ..robot import Drive, RobotParams, drive
from ..scene import Cause, Scene, Sensor, stream_of
from ..sensors.imager import ImagerParams
from ..sensors.imu import ImuParams, attitude
from ..sensors.odometry import OdometryParams, odometry
from ..sensors.pictures import camera_infos, pictures
from ..sensors.start import InitialPoseParams, frames, start_pose
from ..sensors.truth import true_poses

START_NS = 1_451_606_400_000_000_000


class World(Params, ABC):
    """What every world has."""

    logpose: Literal["world/1"] = Field(description="schema of the file")
    start_stamp_ns: int = Field(START_NS, gt=0, description="stamp of the first message [ns]")
    camera: CameraParams = Field(CameraParams(), description="lens, place and topics of the camera")
    sensor: ImagerParams = Field(ImagerParams(), description="the imager behind the lens")

    @abstractmethod
    def build(self) -> Scene:
        """Build the world.

        Raises:
            ValueError: it cannot be built.
        """

    def eye(self, time: float) -> View:  # noqa: ARG002
        """Return base_T_camera at a time [s]."""
        return base_camera(self.camera)

    def mounts(self) -> list[tuple[str, View]]:
        """Return the coordinate frames on the robot, each with base_T_frame."""
        return [(self.camera.frame, base_camera(self.camera))]

    def camera_sensors(self, patches: Sequence[Patch], *beside: Sensor) -> list[Sensor]:
        """Return what the log has of each image: calibration, true pose, what else is known, and the image."""
        return [
            partial(camera_infos, camera=self.camera),
            partial(true_poses, rate_hz=self.camera.rate_hz),
            *beside,
            partial(pictures, patches=patches, camera=self.camera, sensor=self.sensor, eye=self.eye),
        ]


class DrivenWorld(World):
    """What every world has in which a robot drives."""

    robot: RobotParams = Field(description="the route and how it is driven")
    odometry: OdometryParams = Field(OdometryParams(), description="wheel odometry")
    imu: ImuParams | None = Field(None, description="attitude sensor; none if absent")
    initial_pose: InitialPoseParams = Field(InitialPoseParams(), description="the start pose in the log")

    def drive(self, seed: int) -> Drive:
        """Drive the route in the run of a seed."""
        return drive(self.robot, stream_of(seed, Cause.DRIVE))

    def mounts(self) -> list[tuple[str, View]]:
        """Return the coordinate frames on the robot, each with base_T_frame."""
        return [*super().mounts(), *([] if self.imu is None else [(self.imu.frame, self.imu.mount.view)])]

    def body_sensors(self) -> list[Sensor]:
        """Return what the log has of the robot beside its images."""
        return [
            partial(frames, mounts=self.mounts()),
            partial(start_pose, params=self.initial_pose),
            partial(odometry, params=self.odometry),
            *([] if self.imu is None else [partial(attitude, params=self.imu)]),
        ]

    @property
    def waypoints(self) -> list[Waypoint]:
        """Places the robot drives over, as they are written beside the log."""
        return [Waypoint(w.name, w.x_m, w.y_m) for w in self.robot.waypoints]
