"""Parameters of ``fuse-poses``.

Odometry has the same names, meanings and defaults as in ``localize-pf``: noise is a random walk in physical units, the
standard deviation after one metre, one radian, one second; it grows with their square root.
"""

from typing import Literal

from ..engine.params import Field, InputPath, Params


class FuseParams(Params):
    """Kalman filter of the robot's pose from stripe marks and odometry, and a smoother."""

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

    map_sigma_m: float = Field(0.005, ge=0, description="survey error of a mark's place, per axis [m]")
    map_sigma_deg: float = Field(0.3, ge=0, description="survey error of a mark's heading [deg]")
    news_length_m: float = Field(
        0.02, gt=0, description="way after which the noise of a sighting is new, and not the same again [m]"
    )
    news_turn_rad: float = Field(0.02, gt=0, description="turn after which it is [rad]")
    news_s: float = Field(1.0, gt=0, description="time after which it is, for a robot that stands [s]")

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

    along_per_sqrt_m: float = Field(0.01, ge=0, description="odometry noise along the way [m per sqrt m]")
    along_per_sqrt_s: float = Field(0.005, ge=0, description="odometry noise along the way [m per sqrt s]")
    cross_per_sqrt_m: float = Field(0.002, ge=0, description="odometry noise across the way [m per sqrt m]")
    heading_per_sqrt_rad: float = Field(0.01, ge=0, description="heading noise from turning [rad per sqrt rad]")
    heading_per_sqrt_m: float = Field(0.003, ge=0, description="heading noise from driving [rad per sqrt m]")
    heading_per_sqrt_s: float = Field(0.003, ge=0, description="heading noise over time [rad per sqrt s]")
    speed_scale: float = Field(0.0, gt=-1, description="expected error of the speed scale, true/odometry - 1 [1]")
    speed_scale_sigma: float = Field(0.04, ge=0, description="uncertainty of the speed scale [1]")
    turn_scale: float = Field(0.0, gt=-1, description="expected error of the turn scale, true/odometry - 1 [1]")
    turn_scale_sigma: float = Field(0.04, ge=0, description="uncertainty of the turn scale [1]")
    turn_bias_sigma_rad_s: float = Field(0.006, ge=0, description="uncertainty of the turn rate's bias [rad/s]")
    scale_walk_per_sqrt_s: float = Field(0.0005, ge=0, description="drift of both scales [1 per sqrt s]")
    bias_walk_rad_s_per_sqrt_s: float = Field(
        5e-5, ge=0, description="drift of the turn rate's bias [rad/s per sqrt s]"
    )
    gap_s: float = Field(1.0, gt=0, description="odometry silent for longer is a gap [s]")
    gap_speed_m_s: float = Field(0.3, ge=0, description="unknown speed in a gap of odometry, 1 sigma [m/s]")
    gap_turn_rad_s: float = Field(0.3, ge=0, description="unknown turn rate in a gap of odometry, 1 sigma [rad/s]")
    jump_speed_m_s: float = Field(
        10.0, gt=0, description="poses of odometry that move faster jump, which is said [m/s]"
    )
    jump_turn_rad_s: float = Field(10.0, gt=0, description="poses of odometry that turn faster jump [rad/s]")
