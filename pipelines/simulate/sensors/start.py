"""What the log says before the robot moves: where its sensors sit, and about where it stands."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ....formats.events import INITIAL_POSE, Pose, Transform
from ...engine.params import Field, Params
from ..pose import View, place, quaternion, rpy
from ..scene import BASE, MAP, Cause, Run


class InitialPoseParams(Params):
    """What the robot is told of its start; the error is drawn with these standard deviations."""

    topic: str = Field("/initialpose", description="topic of the start pose")
    position_sd_m: float = Field(0.05, ge=0, description="error in x and in y [m]")
    heading_sd_deg: float = Field(2.0, ge=0, description="error of the heading [deg]")


def frames(run: Run, mounts: Sequence[tuple[str, View]]) -> Iterator[Transform]:
    """Yield where each coordinate frame sits on the robot: its name and base_T_frame."""
    for frame, view in mounts:
        mount = place(view)
        yield Transform(
            stamp=run.start_ns,
            topic="/tf_static",
            source="tf",
            frame_id=BASE,
            child_frame_id=frame,
            translation=mount.translation,
            rotation=mount.rotation,
            is_static=True,
        )


def start_pose(run: Run, params: InitialPoseParams) -> Iterator[Pose]:
    """Yield the pose that the robot is told to start from."""
    sd = np.array([params.position_sd_m, params.position_sd_m, math.radians(params.heading_sd_deg)])
    x, y, heading = run.motion.at(0.0)[0] + sd * run.stream(Cause.START).standard_normal(3)
    covariance = np.zeros((6, 6))
    covariance[[0, 1, 5], [0, 1, 5]] = sd**2
    yield Pose(
        stamp=run.start_ns,
        topic=params.topic,
        source=INITIAL_POSE,
        frame_id=MAP,
        position=np.array([x, y, 0.0]),
        orientation=quaternion(rpy(0.0, 0.0, heading)),
        covariance=covariance,
    )
