import math

import numpy as np
import pytest

from logpose.formats.errors import ConfigError
from logpose.formats.events import Pose
from logpose.pipelines.odometry.poses import parse_start_pose, start_pose_of


def test_start_pose_is_read_in_metres_and_degrees():
    assert parse_start_pose(" 1.5, -2,90") == pytest.approx([1.5, -2.0, math.pi / 2])


@pytest.mark.parametrize("text", ["", "1,2", "1,2,3,4", "1,x,3", "1,2,nan", "1;2;3"])
def test_bad_start_pose_says_what_to_write(text):
    with pytest.raises(ConfigError) as caught:
        parse_start_pose(text)
    assert str(caught.value) == (
        f"initial pose {text!r}: is not three numbers. Write X,Y,HEADING_DEG [m, m, deg], as in 1.5,2,90."
    )


def test_logged_start_pose_keeps_its_covariance_unless_it_is_empty():
    event = Pose(
        stamp=0, position=np.array([1.0, 2.0, 0.0]), orientation=np.array([0, 0, 1.0, 0]), covariance=0.04 * np.eye(6)
    )
    pose, cov = start_pose_of(event)
    assert pose == pytest.approx([1.0, 2.0, math.pi])
    assert np.array_equal(cov, 0.04 * np.eye(3))
    empty = Pose(stamp=0, position=np.zeros(3), orientation=np.array([0, 0, 0, 1.0]), covariance=np.zeros((6, 6)))
    assert start_pose_of(empty)[1] is None


def test_logged_start_pose_that_is_none_is_refused():
    with pytest.raises(ValueError) as caught:
        start_pose_of(Pose(stamp=0, position=np.array([np.nan, 0, 0]), orientation=np.array([0, 0, 0, 1.0])))
    assert str(caught.value) == ("start pose position is not finite: [nan, 0, 0]. Pass --initial-pose X,Y,HEADING_DEG.")
