"""What worlds of several kinds have in common: a camera and its sensor; a robot, its odometry and its start."""

from typing import Annotated, Literal

from pydantic import AfterValidator

from ..engine.params import Field, Params
from .camera import CameraParams
from .imu import ImuParams
from .odometry import OdometryParams
from .robot import RobotParams
from .sensor import SensorParams
from .start import InitialPoseParams

START_NS = 1_451_606_400_000_000_000

Point = tuple[float, float]


def ordered(span: Point) -> Point:
    """Refuse a span that begins above its end."""
    if span[0] > span[1]:
        raise ValueError("should not begin above its end")
    return span


Span = Annotated[Point, AfterValidator(ordered)]


class WorldParts(Params):
    """What every world has."""

    logpose: Literal["world/1"] = Field(description="schema of the file")
    start_stamp_ns: int = Field(START_NS, gt=0, description="stamp of the first message [ns]")
    camera: CameraParams = Field(CameraParams(), description="lens, place and topics of the camera")
    sensor: SensorParams = Field(SensorParams(), description="the imager behind the lens")


class DrivenParts(WorldParts):
    """What every world has in which a robot drives."""

    robot: RobotParams = Field(description="the route and how it is driven")
    odometry: OdometryParams = Field(OdometryParams(), description="wheel odometry")
    imu: ImuParams | None = Field(None, description="attitude sensor; none if absent")
    initial_pose: InitialPoseParams = Field(InitialPoseParams(), description="the start pose in the log")
