import math

import numpy as np
import pytest

from logpose.formats.errors import ConfigError
from logpose.formats.events import Odometry, Pose, Sightings
from logpose.pipelines.geometry.angles import yaw_from_quaternion
from logpose.pipelines.odometry.dead_reckon import DeadReckonParams, dead_reckon
from logpose.pipelines.odometry.poses import MISSING_START_POSE


def twists(n, v, w, dt=0.1):
    return [
        Odometry(
            stamp=round(k * dt * 1e9), source="odometry", linear=np.array([v, 0.0, 0.0]), angular=np.array([0, 0, w])
        )
        for k in range(n)
    ]


def nothing_seen(stamp):
    none = np.empty(0)
    return Sightings(
        stamp=stamp, source="sightings", xy=np.empty((0, 2)), cov=np.empty((0, 2, 2)), uv=np.empty((0, 2)),
        radius=none, score=none, ids=none.astype(np.int64),
    )  # fmt: skip


def made(out):
    return [e for e in out if isinstance(e, Pose) and e.source == "dead-reckon"]


def test_a_circle_closes():
    n = 101
    w = 2 * math.pi / 10.0
    out = list(dead_reckon(iter(twists(n, 0.5, w)), DeadReckonParams(initial_pose="3,4,90")))
    last = made(out)[-1]
    assert last.position == pytest.approx([3.0, 4.0, 0.0], abs=1e-9)
    assert yaw_from_quaternion(last.orientation) == pytest.approx(math.pi / 2)
    assert last.frame_id == "map"


def test_everything_is_forwarded_in_order_and_poses_follow_what_they_are_made_from():
    start = Pose(stamp=0, source="initial_pose", position=np.zeros(3), orientation=np.array([0.0, 0.0, 0.0, 1.0]))
    events = [start, *twists(5, 1.0, 0.0), nothing_seen(450_000_000)]
    out = list(dead_reckon(iter(events), DeadReckonParams()))
    assert [e for e in out if e in events] == events
    assert [e.stamp for e in out] == sorted(e.stamp for e in out)
    assert made(out)[-1].stamp == 450_000_000
    assert made(out)[-1].position[0] == pytest.approx(0.45)


def test_poses_can_be_thinned():
    out = list(dead_reckon(iter(twists(101, 1.0, 0.0)), DeadReckonParams(initial_pose="0,0,0", every_s=1.0)))
    assert len(made(out)) == 11


@pytest.mark.parametrize(
    ("events", "params", "message"),
    [
        ([], {"initial_pose": "0,0,0"}, "dead-reckon: no odometry in the log. Name its topic with --topic odometry=/NAME."),
        (
            twists(3, 1.0, 0.0), {},
            f"dead-reckon: {MISSING_START_POSE}",
        ),
    ],
)  # fmt: skip
def test_what_is_missing_is_said(events, params, message):
    with pytest.raises(ConfigError) as caught:
        list(dead_reckon(iter(events), DeadReckonParams(**params)))
    assert str(caught.value) == message
