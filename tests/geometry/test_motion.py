import math

import numpy as np
import pytest

from logpose.pipelines.geometry.motion import Gathered, Increment, arc, pose_increment, twist_increment

DT = 380 / 4400


@pytest.mark.parametrize(
    ("omega", "end"),
    [
        (0.5, (1.029494703699, 2.009826336299, 0.343181818182)),
        (0.0, (1.029702279935, 2.009187991880, 0.3)),
    ],
)
def test_arc_reaches_the_hand_computed_end(omega, end):
    # Printed in Table 2 as a quotient by omega, 0/0 for the second case.
    assert arc(np.array([1.0, 2.0, 0.3]), 0.36, omega, DT) == pytest.approx(end, abs=1e-9)


def test_arc_equals_the_printed_quotient():
    x, y, theta, v, w, dt = 1.0, 2.0, 0.3, 0.36, 0.5, 1.7
    r = v / w
    printed = (
        x - r * math.sin(theta) + r * math.sin(theta + w * dt),
        y + r * math.cos(theta) - r * math.cos(theta + w * dt),
        theta + w * dt,
    )
    assert arc(np.array([x, y, theta]), v, w, dt) == pytest.approx(printed, abs=1e-12)


def test_arc_works_on_a_batch_and_wraps():
    ends = arc(np.array([[0.0, 0.0, 3.0], [0.0, 0.0, -3.0]]), np.array([1.0, 0.0]), np.array([1.0, -1.0]), 1.0)
    assert ends.shape == (2, 3)
    assert np.all((ends[:, 2] > -np.pi) & (ends[:, 2] <= np.pi))


def test_increments_add_up_to_the_whole_arc():
    step = twist_increment((0.36, 0.0, 0.5), 0.1)
    whole = Increment()
    for _ in range(200):
        whole = whole.then(step)
    end = twist_increment((0.36, 0.0, 0.5), 20.0)
    assert whole == pytest.approx(end, abs=1e-11)
    assert whole.dtheta == pytest.approx(10.0)  # more than one turn is kept
    assert whole.length == pytest.approx(7.2)


def test_backwards_and_sideways_count_as_way():
    assert twist_increment((-1.0, 0.0, 0.0), 2.0).length == pytest.approx(2.0)
    assert twist_increment((0.0, 0.5, 0.0), 2.0).dy == pytest.approx(1.0)


def test_increment_of_a_pose_keeps_it():
    u = pose_increment(np.array([0.3, -0.4, -0.2]), 0.5)
    assert u == pytest.approx((0.3, -0.4, -0.2, 0.5, 0.2, 0.5, 0.0))


def test_increments_are_gathered_until_they_are_too_long():
    step = twist_increment((0.36, 0.0, 0.0), 0.1)
    gathered = Gathered()
    assert [gathered.add(step) for _ in range(2)] == [None, None]
    assert gathered.add(step) == step.then(step)
    assert gathered.take() == step
    assert gathered.take().is_none


def test_a_turn_that_is_too_long_is_kept_apart_even_from_nothing():
    turn = twist_increment((0.0, 0.0, 2.0), 0.1)
    gathered = Gathered()
    assert gathered.add(turn) == Increment()
    assert gathered.take() == turn


def test_a_step_of_time_alone_is_something_and_a_gap_alone_is_not():
    assert not Increment(dt=0.1).is_none
    assert Increment(gap=0.1).is_none
