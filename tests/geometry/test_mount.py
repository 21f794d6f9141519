import numpy as np
import pytest

from logpose.pipelines.geometry import so3
from logpose.pipelines.geometry.mount import AHEAD, UP, pan_tilt_roll, robot_tilt, upward

RIGHT, DOWN, VIEW = np.eye(3)
X, Y, Z = np.eye(3)


def test_a_camera_that_looks_ahead_is_level():
    assert pan_tilt_roll(AHEAD) == pytest.approx((0.0, 0.0, 0.0), abs=1e-15)
    assert np.array_equal(AHEAD @ np.column_stack([RIGHT, DOWN, VIEW]), np.column_stack([-Y, -Z, X]))


def test_a_camera_that_looks_up_has_the_top_of_its_image_forward_and_turns_with_its_yaw():
    assert np.array_equal(UP @ np.column_stack([RIGHT, -DOWN, VIEW]), np.column_stack([Y, X, Z]))
    assert upward(0.0) == pytest.approx(UP)
    assert upward(np.pi / 2) @ -DOWN == pytest.approx(Y)


def test_the_tilt_of_a_robot_is_that_of_its_unit_without_heading_and_mount():
    lean, heading = so3.exp(np.array([0.1, -0.05, 0.0])), so3.exp(np.array([0.0, 0.0, 2.0]))
    mount = so3.exp(np.array([0.0, 0.3, -1.0]))
    level = robot_tilt(so3.compose(heading, lean), None)
    assert np.arctan2(level[1, 0], level[0, 0]) == pytest.approx(0.0, abs=1e-15)
    assert level[2] == pytest.approx(so3.as_matrix(lean)[2])
    assert robot_tilt(so3.compose(so3.compose(heading, lean), mount), mount) == pytest.approx(level)
