"""What flows through a pipeline: one frozen record per message, all in SI units.

Every event carries the time it was measured, ``stamp`` (integer nanoseconds since the epoch of the log, the header
stamp unless log time was asked for), and its ``source``: for an event read from a log the role of its topic in the
pipeline (``image``, ``odometry``, ``truth``, ...), for a made one the name of the stage that made it. Arrays inside
events are read-only by agreement: copy before writing.

Frames follow REP-103 and REP-105 (x forward, y left, z up; map -> odom -> base_link); quaternions are x, y, z, w.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from .calibration import Calibration

Array: TypeAlias = npt.NDArray[np.float64]
Bytes: TypeAlias = npt.NDArray[np.uint8]

NO_ID = -1
"""The id of a sighting whose landmark is not known; ids of landmarks are 0 or greater."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Event:
    """Anything with a time.

    Attributes:
        stamp: time of measurement [ns].
        source: role of the topic it was read from, or name of the stage that made it.
        topic: name of the topic it was read from; empty for made events.
        frame_id: coordinate frame of the content.
    """

    stamp: int
    source: str = ""
    topic: str = ""
    frame_id: str = ""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Mount:
    """Where a sensor sits on the robot: maps sensor coordinates to ``base_link``.

    Attributes:
        translation: (3,) [m].
        rotation: (4,) quaternion x, y, z, w.
    """

    translation: Array
    rotation: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Image(Event):
    """A picture, still as it was logged; ``images.decode`` and ``images.grey`` turn it into pixels.

    Attributes:
        encoding: mono8, mono16, rgb8, bgr8, bayer_*, 16UC1, 32FC1, ...; jpeg or png for compressed images.
        data: flat bytes, read-only.
        width, height, step: pixels, rows, bytes per row; 0 for compressed images.
        is_bigendian: byte order of 16 and 32 bit pixels.
        calibration: the camera's, from CameraInfo in the log, if there is one.
        mount: the camera's place on the robot (optical frame: z along the view), from tf_static, if there is one.
    """

    encoding: str
    data: Bytes
    width: int = 0
    height: int = 0
    step: int = 0
    is_bigendian: bool = False
    calibration: Calibration | None = None
    mount: Mount | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CameraInfo(Event):
    """A camera's calibration."""

    calibration: Calibration


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Odometry(Event):
    """What wheels (or a command log) say of the robot's motion; either half may be missing.

    Attributes:
        position, orientation: (3,) [m] and (4,) x, y, z, w in ``frame_id``, or None.
        linear, angular: (3,) [m/s] and (3,) [rad/s] in ``child_frame_id``, or None.
    """

    child_frame_id: str = "base_link"
    position: Array | None = None
    orientation: Array | None = None
    linear: Array | None = None
    angular: Array | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Imu(Event):
    """Attitude, rates and accelerations: (4,) x, y, z, w or None; (3,) [rad/s]; (3,) [m/s^2]."""

    angular: Array
    acceleration: Array
    orientation: Array | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Range(Event):
    """One sonar or infrared reading, REP-117: -inf too close, nan invalid, +inf no return [m, rad]."""

    range: float
    min_range: float
    max_range: float
    field_of_view: float
    mount: Mount | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LaserScan(Event):
    """One sweep: ranges (N,) [m] at ``angle_min + i * angle_increment`` [rad]."""

    ranges: Array
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    time_increment: float = 0.0
    mount: Mount | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Transform(Event):
    """Maps ``child_frame_id`` coordinates to ``frame_id``: (3,) [m] and (4,) x, y, z, w."""

    child_frame_id: str
    translation: Array
    rotation: Array
    is_static: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pose(Event):
    """A pose of the robot in ``frame_id``, read (truth, start pose) or estimated.

    Attributes:
        position: (3,) [m].
        orientation: (4,) x, y, z, w.
        covariance: (6, 6) of x, y, z, roll, pitch, yaw [m, rad], or None.
        info: what the estimator says of this pose; becomes columns of ``trajectory.csv``
            (``n_seen``, ``n_matched``, ``ess``, ``status``, ...).
    """

    position: Array
    orientation: Array
    covariance: Array | None = None
    info: Mapping[str, float | int | str | None] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sightings(Event):
    """All landmarks seen at one instant, in robot coordinates; also when there are none (N = 0).

    Attributes:
        xy: (N, 2) position in the robot's x-y plane [m].
        cov: (N, 2, 2) its covariance [m^2].
        uv: (N, 2) centre in the image [px], nan where there is no image.
        radius: (N,) mean radius in the image [px], nan where there is no image.
        score: (N,) 0..1.
        ids: (N,) int64, landmark ids, NO_ID where not known.
    """

    xy: Array
    cov: Array
    uv: Array
    radius: Array
    score: Array
    ids: npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Summary(Event):
    """What a stage has to say when the log has ended; becomes ``result.<source>`` of ``report.json``.

    Attributes:
        values: JSON-ready numbers, strings, lists and mappings.
    """

    values: Mapping[str, object]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Notice(Event):
    """Something a person should know; said once per code on stderr, counted in ``report.json``.

    Attributes:
        code: short, stable, like ``odometry-gap``.
        message: one line, what happened and what it means.
        is_loss: data was lost or skipped, so the run ends with exit status 3.
    """

    code: str
    message: str
    is_loss: bool = False
