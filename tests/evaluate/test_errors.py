import numpy as np
import pytest

from logpose.pipelines.evaluate.associate import Track
from logpose.pipelines.evaluate.errors import (
    Delta,
    longest_loss,
    relative_errors,
    rotation_errors,
    statistics,
    steps,
    translation_errors,
)
from logpose.pipelines.geometry import so3


def track(xy, yaw):
    n = len(xy)
    rotations = so3.as_matrix(so3.exp(np.multiply.outer(yaw, [0.0, 0.0, 1.0])))
    return Track(np.arange(n), np.column_stack([np.array(xy, float), np.zeros(n)]), rotations)


def test_absolute_errors_are_distances_and_angles():
    a = track([[0, 0], [1, 0]], np.array([0.0, 3.0]))
    b = track([[3, 4], [1, 0]], np.array([0.1, -3.0]))
    np.testing.assert_allclose(translation_errors(a, b), [5, 0])
    np.testing.assert_allclose(rotation_errors(a, b), [0.1, 2 * np.pi - 6.0], atol=1e-12)


def test_relative_errors_do_not_see_a_motion_of_the_whole():
    a = track([[0, 0], [1, 0], [1, 1]], np.array([0.0, np.pi / 2, np.pi]))
    c, s = np.cos(0.7), np.sin(0.7)
    xy = a.positions[:, :2] @ np.array([[c, s], [-s, c]]) + [10, 20]
    b = track(xy, np.array([0.0, np.pi / 2, np.pi]) + 0.7)
    t, r = relative_errors(a, b, Delta(1, is_metres=False))
    np.testing.assert_allclose(t, 0, atol=1e-12)
    np.testing.assert_allclose(r, 0, atol=1e-7)


def test_relative_error_of_one_step_by_hand():
    # The estimate drives 1.1 m instead of 1 m and turns 90 degrees too far.
    a, b = track([[0, 0], [1, 0]], np.zeros(2)), track([[0, 0], [1.1, 0]], np.array([0.0, np.pi / 2]))
    t, r = relative_errors(a, b, Delta(1, is_metres=False))
    np.testing.assert_allclose(t, [0.1])
    np.testing.assert_allclose(r, [np.pi / 2])


def test_steps_follow_one_another_in_frames_and_in_metres():
    line = track([[0.4 * k, 0] for k in range(10)], np.zeros(10))
    i, j = steps(line, Delta(3, is_metres=False))
    assert (i.tolist(), j.tolist()) == ([0, 3, 6], [3, 6, 9])
    i, j = steps(line, Delta(1.0, is_metres=True))
    assert (i.tolist(), j.tolist()) == ([0, 3, 6], [3, 6, 9])  # 1.2 m is the first path of at least 1 m
    assert len(steps(line, Delta(100, is_metres=True))[0]) == 0


@pytest.mark.parametrize(("text", "value", "is_metres"), [("1f", 1, False), ("10m", 10, True), (" .5 m ", 0.5, True)])
def test_a_step_is_frames_or_metres(text, value, is_metres):
    assert Delta.parse(text) == Delta(value, is_metres)


@pytest.mark.parametrize("text", ["", "1", "0f", "1.5f", "-1m", "1 km", "nan m", "0m"])
def test_what_is_neither_is_refused(text):
    with pytest.raises(ValueError, match="is neither frames, like '1f', nor metres, like '10m'"):
        Delta.parse(text)


def test_statistics_by_hand():
    expected = {
        "rmse_m": np.sqrt(12.5),
        "mean_m": 3.5,
        "median_m": 3.5,
        "std_m": 0.5,
        "min_m": 3,
        "max_m": 4,
        "sse_m2": 25,
    }
    assert statistics(np.array([3.0, 4.0]), "m") == pytest.approx(expected)
    assert set(statistics(np.zeros(0), "rad").values()) == {None}


def test_the_longest_loss_is_unbroken():
    stamps = np.array([0, 1, 2, 3, 4, 5, 6, 7]) * 10**9
    errors = np.array([2.0, 0, 2, 2, 2, 0, 2, 2])
    assert longest_loss(stamps, errors, 1.0) == pytest.approx(3.0)
    assert longest_loss(stamps, errors * 0, 1.0) == 0
    assert longest_loss(stamps, errors * 0 + 2, 1.0) == pytest.approx(7.0)
