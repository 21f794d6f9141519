"""Parameters of ``localize-pf``, by subject.

Defaults describe a wheeled robot indoors with a camera that looks at the ceiling.
"""

from typing import Literal

from ..engine.params import Field, InputPath, Params
from ..odometry.noise import OdometryErrors

Alphas = tuple[float, float, float, float, float, float]


class _Setup(Params):
    """The method, the map, the start, and what poses are given."""

    method: Literal["best", "paper"] = Field(
        "best",
        description="best: clutter floor and local Gaussians; paper: Tables 1 and 2, eqs 4-9 as published",
    )
    map: InputPath = Field(description="landmark map, landmarks.yaml or CSV")
    particles: int = Field(200, ge=1, le=1_000_000, description="number of particles")
    seed: int = Field(0, ge=0, description="seed of every random number")
    initial_pose: str | None = Field(
        None, description="start pose X,Y,HEADING_DEG [m, m, deg]; not given: the pose logged as initial_pose"
    )
    initial_sigma_m: float = Field(
        0.1, ge=0, description="standard deviation of the start position where the log gives none [m]"
    )
    initial_sigma_deg: float = Field(
        4.0, ge=0, description="standard deviation of the start heading where the log gives none [deg]"
    )
    association: Literal["unknown", "given"] = Field(
        "unknown",
        description="unknown: landmarks look alike; given: use the ids of the true sightings (the bound)",
    )
    odometry_from: Literal["auto", "pose", "twist"] = Field(
        "auto", description="half of the odometry messages to use; auto: the pose where there is one"
    )
    silence_s: float = Field(
        0.5,
        gt=0,
        description="without any sightings message for so long, poses follow the odometry alone [s]",
    )


class _SightingErrors(Params):
    """How sightings and landmarks err, and how much of an image is new evidence."""

    sighting_sigma_m: float = Field(
        0.005, ge=0, description="white error of a sighting beyond its own covariance, per axis [m]"
    )
    map_sigma_m: float = Field(
        0.015,
        ge=0,
        description="survey error of a landmark per axis [m]; a map with covariances says it itself, by their mean",
    )
    map_length_m: float = Field(
        1.5, gt=0, description="way after which survey errors of what is in view are new ones [m]"
    )
    map_turn_rad: float = Field(1.0, gt=0, description="turn after which they are [rad]")
    map_s: float = Field(
        60.0, gt=0, description="time after which they are, for a robot that stands (light, people change) [s]"
    )
    shift_sigma_m: float = Field(
        0.02,
        ge=0,
        description="error common to all sightings of one instant (tilt of the floor), per axis [m]",
    )
    shift_s: float = Field(1.0, gt=0, description="time in which the common error changes [s]")
    clutter: float = Field(0.1, gt=0, lt=1, description="share of sightings that are no landmark of the map [1]")
    clutter_area_m2: float = Field(
        5.0, gt=0, description="area over which such sightings are spread, the sensor's footprint [m^2]"
    )

    news_length_m: float = Field(
        0.5, gt=0, description="way after which what is seen is new evidence of where the robot is [m]"
    )
    news_turn_rad: float = Field(1.0, gt=0, description="turn after which it is [rad]")
    news_s: float = Field(30.0, gt=0, description="time after which it is, for a robot that stands [s]")


class _Cloud(Params):
    """When the cloud is spread, and when its pose is ambiguous or lost."""

    kernel_m: float = Field(
        0.1, gt=0, description="a particle whose position is less certain is spread into the cloud [m]"
    )
    kernel_deg: float = Field(
        4.0, gt=0, description="a particle whose heading is less certain is spread into the cloud [deg]"
    )
    ambiguous_m: float = Field(
        0.5, gt=0, description="poses farther than this from the likeliest are another place [m]"
    )
    ambiguous_share: float = Field(
        0.1, gt=0, lt=1, description="weight of other places from which the status is ambiguous [1]"
    )
    lost_window_s: float = Field(3.0, gt=0, description="time over which sightings are judged, at least [s]")
    lost_window_m: float = Field(1.0, ge=0, description="way over which sightings are judged, at least [m]")
    lost_count: int = Field(10, ge=1, description="sightings in that time without which nothing is judged")
    lost_unmatched_share: float = Field(
        0.6, gt=0, le=1, description="share of unmatched sightings above which the robot is lost [1]"
    )
    lost_sigma_m: float = Field(0.1, ge=0, description="search while lost: position noise added per sqrt s [m]")
    lost_sigma_deg: float = Field(5.0, ge=0, description="search while lost: heading noise added per sqrt s [deg]")


class _Paper(Params):
    """What only the method ``paper`` asks for."""

    alphas: Alphas = Field(
        (0.3, 0.3, 0.1, 0.25, 0.001, 0.001),
        description="method paper: a1..a6 of Table 2, units absorbed (Table 3)",
    )
    noise_as: Literal["std", "variance"] = Field(
        "std", description="method paper: what sample(b) of Table 2 takes b for"
    )
    exponent: Literal["2", "2pi"] = Field(
        "2",
        description="method paper: denominator of eqs 4, 5, 8, 9; 2pi is as printed, 2 is a normal density",
    )
    sigma_range_m: float = Field(0.1, gt=0, description="method paper: sigma_hit of the horizontal range [m]")
    sigma_bearing_deg: float = Field(5.0, gt=0, description="method paper: sigma_hit of the bearing [deg]")
    n_nearest: int = Field(6, ge=1, description="method paper: landmarks tried per particle, N of Table 1")
    nearest_to: Literal["particle", "detection"] = Field(
        "particle", description="method paper: what they are nearest to; printed: the particle"
    )


# The parameters of the last base come first, in a dump as in the reference.
class LocalizePfParams(_Paper, _Cloud, OdometryErrors, _SightingErrors, _Setup):
    """Particle filter on a known map of landmarks that all look alike."""
