"""Parameters of ``fuse-poses``, by subject."""

from typing import Literal

from ..engine.params import Field, InputPath, Params
from ..odometry.noise import OdometryErrors


class _Setup(Params):
    """The map, the start, and what poses are given."""

    map: InputPath = Field(description="stripe marks, marks.yaml")
    smooth: bool = Field(
        False, description="give the poses of the smoother over the whole log, at its end, instead of the filter's"
    )
    initial_pose: str | None = Field(
        None, description="start pose X,Y,HEADING_DEG [m, m, deg]; not given: the one logged as initial_pose, or none"
    )
    initial_sigma_m: float = Field(
        0.1, gt=0, description="standard deviation of the start position where the log gives none [m]"
    )
    initial_sigma_deg: float = Field(
        4.0, gt=0, description="standard deviation of the start heading where the log gives none [deg]"
    )
    odometry_from: Literal["auto", "pose", "twist"] = Field(
        "auto", description="half of the odometry messages to use; auto: the pose where there is one"
    )
    silence_s: float = Field(0.5, gt=0, description="without an image for so long, poses follow the odometry alone [s]")


class _SightingErrors(Params):
    """How marks were surveyed, and how much of a sighting is new."""

    map_sigma_m: float = Field(0.005, ge=0, description="survey error of a mark's place, per axis [m]")
    map_sigma_deg: float = Field(0.3, ge=0, description="survey error of a mark's heading [deg]")
    news_length_m: float = Field(
        0.02, gt=0, description="way after which the noise of a sighting is new, and not the same again [m]"
    )
    news_turn_rad: float = Field(0.02, gt=0, description="turn after which it is [rad]")
    news_s: float = Field(1.0, gt=0, description="time after which it is, for a robot that stands [s]")


class _Gates(Params):
    """Which sightings are believed, and when they are believed more than the pose."""

    gate: float = Field(
        0.999, gt=0, lt=1, description="a sighting that fits worse than this share of true ones is rejected [1]"
    )
    unverified_gate: float = Field(
        0.9, gt=0, lt=1, description="the same for sightings whose mark is an assumption (unverified) [1]"
    )
    unverified_sigma_m: float = Field(
        0.1, gt=0, description="they are used only where the pose is expected more surely than this [m]"
    )
    lost_count: int = Field(
        5, ge=2, description="so many sightings that agree with one another and not with the pose begin it anew"
    )
    lost_window_s: float = Field(
        3.0,
        ge=0,
        description="time over which they must agree if of one mark; tenfold if other marks said otherwise [s]",
    )


# The parameters of the last base come first, in a dump as in the reference.
class FuseParams(OdometryErrors, _Gates, _SightingErrors, _Setup):
    """Kalman filter of the robot's pose from stripe marks and odometry, and a smoother."""
