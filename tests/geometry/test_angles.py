import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from logpose.pipelines.geometry import so3
from logpose.pipelines.geometry.angles import (
    circular_mean,
    difference,
    quaternion_from_yaw,
    wrap,
    yaw_from_quaternion,
)

ANGLE = st.floats(-1e3, 1e3)


@given(ANGLE)
def test_wrapped_angle_is_in_range_and_the_same_direction(angle):
    wrapped = float(wrap(angle))
    assert -np.pi < wrapped <= np.pi
    assert np.cos(wrapped) == pytest.approx(np.cos(angle), abs=1e-12)
    assert np.sin(wrapped) == pytest.approx(np.sin(angle), abs=1e-12)


def test_wrap_leaves_the_range_untouched_bit_by_bit():
    a = np.array([-np.pi + 1e-9, -1.0, 0.0, 1e-300, 2.0, np.pi])
    assert np.array_equal(wrap(a), a)


def test_minus_pi_wraps_to_pi():
    assert float(wrap(-np.pi)) == np.pi
    assert float(wrap(3 * np.pi)) == pytest.approx(np.pi, abs=1e-15)


def test_difference_goes_the_short_way_over_the_seam():
    assert float(difference(np.radians(179), np.radians(-179))) == pytest.approx(np.radians(-2), abs=1e-12)


def test_mean_direction_over_the_seam_is_not_zero():
    angles = np.radians([170.0, -170.0])
    assert abs(circular_mean(angles)) == pytest.approx(np.pi, abs=1e-12)
    assert circular_mean(angles, np.array([1.0, 0.0])) == pytest.approx(np.radians(170), abs=1e-12)


@given(ANGLE)
def test_yaw_survives_the_quaternion(yaw):
    q = quaternion_from_yaw(yaw)
    assert q[3] >= 0.0
    assert float(difference(yaw_from_quaternion(q), yaw)) == pytest.approx(0.0, abs=1e-9)
    assert yaw_from_quaternion(-3.0 * q) == pytest.approx(yaw_from_quaternion(q), abs=1e-12)


def test_yaw_is_the_first_of_yaw_pitch_roll():
    yaw, pitch, roll = (so3.exp(np.array(v)) for v in ([0, 0, 1.2], [0, -0.4, 0], [0.3, 0, 0]))
    assert yaw_from_quaternion(so3.compose(yaw, so3.compose(pitch, roll))) == pytest.approx(1.2, abs=1e-15)
