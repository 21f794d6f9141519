"""Planar poses and the events that hold them: the start pose that comes in, poses of estimators that go out."""

from collections.abc import Mapping

import numpy as np

from ...formats.errors import ConfigError
from ...formats.events import Array, Pose
from ..geometry.angles import quaternion_from_yaw, yaw_from_quaternion

MISSING_START_POSE = (
    "no start pose. Pass --initial-pose X,Y,HEADING_DEG or log it on /initialpose; a logged one before --start is not "
    "seen."
)


_PLANE = 1e-6
"""Variance reported for height [m^2], roll and pitch [rad^2]: the robot stays on its plane, to a millimetre."""


def planar_covariance(cov: Array) -> Array:
    """Return the covariance (6, 6) of x, y, z, roll, pitch, yaw from that (3, 3) of x, y, yaw."""
    six = _PLANE * np.eye(6)
    six[np.ix_([0, 1, 5], [0, 1, 5])] = cov
    return six


def planar_pose(
    stamp: int,
    *,
    source: str,
    frame_id: str,
    pose: Array,
    cov: Array | None = None,
    info: Mapping[str, float | int | str | None] | None = None,
) -> Pose:
    """Return the event of a planar pose.

    Args:
        stamp: of it [ns].
        source: who says so.
        frame_id: frame of the map.
        pose: (3,) in the map [m, m, rad].
        cov: (3, 3) of it in the map; None: not known.
        info: what else is to be told of it.
    """
    return Pose(
        stamp=stamp,
        source=source,
        frame_id=frame_id,
        position=np.array([pose[0], pose[1], 0.0]),
        orientation=quaternion_from_yaw(float(pose[2])),
        covariance=None if cov is None else planar_covariance(cov),
        info={} if info is None else info,
    )


def parse_start_pose(text: str) -> Array:
    """Return (3,) [m, m, rad] of ``X,Y,HEADING_DEG``.

    Raises:
        ConfigError: it is not three finite numbers.
    """
    cells = text.split(",")
    try:
        x, y, heading_deg = (float(cell) for cell in cells)
    except ValueError:
        x = y = heading_deg = np.nan
    if not np.all(np.isfinite([x, y, heading_deg])):
        raise ConfigError(
            f"initial pose {text!r}: is not three numbers. Write X,Y,HEADING_DEG [m, m, deg], as in 1.5,2,90."
        )
    return np.array([x, y, np.radians(heading_deg)])


def start_pose_of(event: Pose) -> tuple[Array, Array | None]:
    """Return the planar pose (3,) of a logged start pose, and its covariance (3, 3) in the map if it has one.

    Raises:
        ValueError: a number is not finite, or the orientation is no rotation.
    """
    for name in ("position", "orientation"):
        values = getattr(event, name)
        if not np.all(np.isfinite(values)):
            raise ValueError(f"start pose {name} is not finite: {listed(values)}. Pass --initial-pose X,Y,HEADING_DEG.")
    if not np.any(event.orientation):
        raise ValueError("start pose orientation is all zeros, no rotation. Pass --initial-pose X,Y,HEADING_DEG.")
    pose = np.array([event.position[0], event.position[1], yaw_from_quaternion(event.orientation)])
    cov = None
    if event.covariance is not None:
        planar = np.asarray(event.covariance)[np.ix_([0, 1, 5], [0, 1, 5])]
        usable = np.all(np.isfinite(planar)) and np.any(planar) and np.linalg.eigvalsh(planar)[0] >= 0.0
        cov = planar if usable else None
    return pose, cov


def listed(values: Array) -> str:
    """Return numbers as an error message shows them."""
    return "[" + ", ".join(f"{float(v):g}" for v in np.ravel(values)) + "]"
