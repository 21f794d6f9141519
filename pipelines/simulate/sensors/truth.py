"""Where the robot truly is, as the log tells it.

The truth is planar (x, y, heading of the robot on the floor plan). The tilt of the floor is not in it: it is what an
estimator that believes in a flat floor has to live with.
"""

from collections.abc import Iterator

import numpy as np

from ....formats.events import TRUTH, Pose
from ..pose import quaternion, rpy
from ..scene import MAP, Run

TRUE_POSE = "/ground_truth/pose"


def true_poses(run: Run, rate_hz: float) -> Iterator[Pose]:
    """Yield the true poses of a run."""
    for time_ns in run.ticks(rate_hz):
        x, y, heading = run.motion.at(time_ns * 1e-9)[0]
        yield Pose(
            stamp=run.start_ns + time_ns,
            topic=TRUE_POSE,
            source=TRUTH,
            frame_id=MAP,
            position=np.array([x, y, 0.0]),
            orientation=quaternion(rpy(0.0, 0.0, heading)),
        )
