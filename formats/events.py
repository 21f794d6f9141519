"""What flows through a pipeline: one frozen record per message, all in SI units.

Every event carries the time it was measured, ``stamp`` (integer nanoseconds since the epoch of the log, the header
stamp unless log time was asked for), and its ``source``: for an event read from a log the role of its topic in the
pipeline (``image``, ``odometry``, ``truth``, ...), for a made one the name of the stage that made it. Arrays inside
events are read-only by agreement: copy before writing.

Frames follow REP-103 and REP-105 (x forward, y left, z up; map -> odom -> base_link); quaternions are x, y, z, w.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from .calibration import Calibration

Array: TypeAlias = npt.NDArray[np.float64]
Bytes: TypeAlias = npt.NDArray[np.uint8]

NO_ID = -1
"""The id of a sighting whose landmark is not known; ids of landmarks are 0 or greater."""


TRUTH, TRUE_SIGHTINGS = "truth", "true_sightings"
"""Roles of what is known better than by any estimate."""

INITIAL_POSE, LOGGED_POSE = "initial_pose", "pose"
"""Roles of the pose to start from, and of the poses that another program had logged."""


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
    mount: Mount | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointState(Event):
    """Positions of joints (a pan-tilt head, for one), by name.

    Attributes:
        names: of the joints.
        positions: (len(names),) [rad], or [m] of a joint that slides; nan where the log gives none.
    """

    names: tuple[str, ...]
    positions: Array


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
class MarkSighting(Event):
    """One stripe mark in one image, or why there is none: every image yields at least one.

    Of several marks in an image, and of several candidates for one, each is a sighting of its own with the same stamp.

    Attributes:
        mark: id of the mark, NO_ID where none was recognised.
        status: ``ok``; ``ambiguous`` (another mark or place fits as well, all are reported); ``unverified`` (too little
            is seen to tell the mark by, its identity is an assumption); ``mirrored_or_back``; ``poor_geometry`` (too
            narrow, too far, or edge-on); ``no_mark``.
        pose: (3,) phi, D_x, D_y: yaw of the mark in the level camera frame, counter-clockwise seen from above, and
            where its origin lies there, to the right and ahead [rad, m, m]; nan without a pose.
        cov: (3, 3) its covariance; nan without a pose.
        attitude: (2,) tilt (up is positive) and roll of the camera that the pose was found with [rad].
        robot: (3,) x, y, heading of ``base_link`` in ``frame_id``, which is the frame of the marks [m, m, rad]; nan
            without a pose.
        robot_cov: (3, 3) its covariance.
        row: image row through the principal point, at which the lines are given [px].
        lines: (N, 5) the edges found: column at ``row`` [px], change of the column per row, first and last row of the
            edge [px], distance from where the pose has it [px].
        members: (N,) int64, index of each line among the mark's edges, left to right.
    """

    mark: int
    status: str
    pose: Array
    cov: Array
    attitude: Array
    robot: Array
    robot_cov: Array
    row: float
    lines: Array
    members: npt.NDArray[np.int64]

    @property
    def ends(self) -> Array:
        """(N, 2, 2) first and last point of each edge found: column, row [px]."""
        at, slope, first, last, _ = self.lines.reshape(-1, 5).T
        rows = np.stack([first, last], axis=1)
        return np.stack([at[:, None] + slope[:, None] * (rows - self.row), rows], axis=2)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Summary(Event):
    """What a stage has to say when the log has ended; becomes ``result.<source>`` of ``report.json``.

    Attributes:
        values: JSON-ready numbers, strings, lists and mappings, by name; or a list of such, one per message.
    """

    values: Mapping[str, object] | Sequence[object]


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
