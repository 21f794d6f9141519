"""The stage ``evaluate``: scores an estimator's poses against the truth in the same stream, at the end of the log."""

from collections.abc import Iterator

import numpy as np

from ...formats.errors import FormatError
from ...formats.events import Event, Notice, Pose, Summary
from ...formats.products import Trajectory
from .evaluation import EvaluateParams
from .evaluation import evaluate as compare

ROLES = frozenset({"truth", "initial_pose", "pose"})
"""Sources of poses that were read and not estimated."""


def evaluate(events: Iterator[Event], params: EvaluateParams) -> Iterator[Event]:
    """Compare the poses of an estimator with the truth; says nothing in a log without truth."""
    truth: list[Pose] = []
    estimate: list[Pose] = []
    source = params.source
    for event in events:
        yield event
        if not isinstance(event, Pose):
            continue
        if event.source == "truth":
            truth.append(event)
        elif event.source not in ROLES:
            source = source or event.source
            if event.source == source:
                estimate.append(event)
    if not truth:
        return
    stamp = max(pose.stamp for pose in (truth[-1], *estimate[-1:]))
    if not estimate:
        words = f"of {source!r} " if source else ""
        message = f"there is a truth but no pose {words}to compare with it"
        yield Notice(stamp=stamp, source="evaluate", code="evaluate-no-estimate", message=message)
        return
    try:
        evaluation = compare(trajectory(truth), trajectory(estimate), params)
    except FormatError as err:
        yield Notice(stamp=stamp, source="evaluate", code="evaluate-failed", message=str(err), is_loss=True)
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
