"""The stage ``evaluate``: scores an estimator's poses against the truth in the same stream, at the end of the log."""

from collections.abc import Iterator

import numpy as np

from ...formats.errors import FormatError
from ...formats.events import INITIAL_POSE, LOGGED_POSE, TRUTH, Event, Notice, Pose, Summary
from ...formats.maps.waypoints import Waypoint, read_waypoints
from ...formats.products import Trajectory
from .evaluation import EvaluateParams
from .evaluation import evaluate as compare

ROLES = frozenset({TRUTH, INITIAL_POSE, LOGGED_POSE})
"""Sources of poses that were read and not estimated."""


def evaluate(events: Iterator[Event], params: EvaluateParams) -> Iterator[Event]:
    """Compare the poses of an estimator with the truth; says nothing in a log without truth."""
    waypoints = None if params.waypoints is None else read_waypoints(params.waypoints)  # before the log is read
    truth: list[Pose] = []
    estimate: list[Pose] = []
    stamp = 0
    source = params.source
    for event in events:
        yield event
        stamp = max(stamp, event.stamp)
        if not isinstance(event, Pose):
            continue
        if event.source == TRUTH:
            truth.append(event)
        elif event.source not in ROLES:
            source = source or event.source
            if event.source == source:
                estimate.append(event)
    yield from _verdict(truth, estimate, source, stamp, params, waypoints)


def _verdict(
    truth: list[Pose],
    estimate: list[Pose],
    source: str,
    stamp: int,
    params: EvaluateParams,
    waypoints: list[Waypoint] | None,
) -> Iterator[Event]:
    def notice(code: str, message: str, *, is_loss: bool = False) -> Notice:
        return Notice(stamp=stamp, source="evaluate", code=code, message=message, is_loss=is_loss)

    if not truth:
        if waypoints is not None:
            message = "waypoints are given, but there is no truth to find their passes in. Pass --reference FILE."
            yield notice("waypoints-without-truth", message)
        return
    if not estimate:
        words = f"of {source!r} " if source else ""
        yield notice("evaluate-no-estimate", f"there is a truth but no pose {words}to compare with it")
        return
    try:
        evaluation = compare(trajectory(truth), trajectory(estimate), params, waypoints)
    except FormatError as err:
        yield notice("evaluate-failed", str(err), is_loss=True)
        return
    yield Summary(stamp=stamp, source="evaluation", values={"source": source, **evaluation.result})


def trajectory(poses: list[Pose]) -> Trajectory:
    """Return poses as a trajectory; covariances only if any pose has one, nan for those without."""
    covariances = None
    if any(pose.covariance is not None for pose in poses):
        nothing = np.full((6, 6), np.nan)
        covariances = np.array([nothing if pose.covariance is None else pose.covariance for pose in poses])
    return Trajectory(
        stamps=np.array([pose.stamp for pose in poses], dtype=np.int64),
        positions=np.array([pose.position for pose in poses], dtype=np.float64),
        orientations=np.array([pose.orientation for pose in poses], dtype=np.float64),
        frame_id=poses[0].frame_id,
        covariances=covariances,
    )
