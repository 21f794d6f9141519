"""The stage ``dead-reckon``: where odometry alone leads from the start pose, to compare with."""

from collections.abc import Iterator
from typing import Literal

import numpy as np

from ...formats.errors import ConfigError
from ...formats.events import INITIAL_POSE, Event, MarkSighting, Odometry, Pose, Sightings
from ..engine.params import Field, Params
from ..geometry.se2 import compose
from .poses import MISSING_START_POSE, parse_start_pose, planar_pose, start_pose_of
from .reader import MISSING_ODOMETRY, OdometryReader

SOURCE = "dead-reckon"


class DeadReckonParams(Params):
    """Integration of odometry."""

    initial_pose: str | None = Field(
        None, description="start pose X,Y,HEADING_DEG [m, m, deg]; not given: the pose logged as initial_pose"
    )
    odometry_from: Literal["auto", "pose", "twist"] = Field(
        "auto", description="half of the odometry messages to use; auto: the pose where there is one"
    )
    optional: bool = Field(
        default=False, description="a log without odometry or start pose is no error, and has no pose"
    )
    every_s: float = Field(0.0, ge=0, description="least time between two poses [s]; 0: one per odometry message")


def dead_reckon(events: Iterator[Event], params: DeadReckonParams) -> Iterator[Event]:
    """Integrate odometry into poses from the same start pose as the estimators.

    Yields a Pose after each Odometry message from the start pose on, and after each Sightings or MarkSighting, so
    that a trajectory has poses at the same stamps as the estimate.

    Raises:
        ConfigError: no start pose, or no odometry, unless they are optional.
        ValueError: odometry is not finite or goes back in time.
    """
    reader = OdometryReader(params.odometry_from)
    pose = None if params.initial_pose is None else parse_start_pose(params.initial_pose)
    last: int | None = None
    for event in events:
        yield event
        if isinstance(event, Pose) and event.source == INITIAL_POSE and params.initial_pose is None:
            reader.until(event.stamp)
            pose, _ = start_pose_of(event)
        elif isinstance(event, Odometry | Sightings | MarkSighting):
            step = reader.read(event) if isinstance(event, Odometry) else reader.until(event.stamp)
            reader.gaps.clear()
            reader.jumps.clear()
            if pose is None:
                continue
            pose = compose(pose, np.array([step.dx, step.dy, step.dtheta]))
            is_due = last is None or event.stamp - last >= round(params.every_s * 1e9)
            if reader.count and event.stamp != last and is_due:
                last = event.stamp
                yield planar_pose(event.stamp, source=SOURCE, frame_id="map", pose=pose)
    if params.optional:
        return
    if reader.count == 0:
        raise ConfigError(f"{SOURCE}: {MISSING_ODOMETRY}")
    if pose is None:
        raise ConfigError(f"{SOURCE}: {MISSING_START_POSE}")
