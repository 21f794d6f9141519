"""The drive: it passes its waypoints, keeps its limits, and its numbers agree with each other."""

import numpy as np
import pytest

from logpose.pipelines.simulate.robot import STEP_S, RobotParams, TiltParams, WaypointParams, drive
from logpose.pipelines.simulate.world import read_world


def route(*points, **more):
    waypoints = tuple(WaypointParams(name=str(i), x_m=float(x), y_m=float(y)) for i, (x, y) in enumerate(points))
    return RobotParams(waypoints=waypoints, **more)


@pytest.fixture(scope="module")
def paper(root):
    return read_world(root / "papers" / "ceiling" / "world.yaml").robot


@pytest.fixture(scope="module")
def driven(paper):
    return drive(paper, np.random.default_rng(1))


def test_the_route_of_the_paper_is_as_long_and_as_fast_as_printed(driven, paper):
    # Printed: 135 m in 380 s, 0.36 m/s; the closed polygon of the printed waypoints is 133.68 m.
    assert 133.68 < driven.distance[-1] < 135.0
    assert driven.duration == pytest.approx(380, abs=6)  # the speed wanders: 0.45 % of 380 s is one sigma
    assert driven.speed.max() <= paper.max_speed_mps
    assert np.abs(driven.turn_rate).max() <= paper.max_turn_radps + 1e-12
    assert driven.distance[-1] / driven.duration == pytest.approx(0.355, abs=0.006)


def test_every_waypoint_is_driven_over(driven, paper):
    for waypoint in paper.waypoints:
        assert np.hypot(*(driven.pose[:, :2] - [waypoint.x_m, waypoint.y_m]).T).min() < 0.01
    np.testing.assert_allclose(driven.pose[-1, :2], driven.pose[0, :2], atol=0.02)  # closed


def test_speed_and_turn_rate_change_no_faster_than_allowed(driven, paper):
    assert np.abs(np.diff(driven.speed[:-1])).max() <= paper.acceleration_mps2 * STEP_S + 1e-12
    assert np.abs(np.diff(driven.turn_rate[:-1])).max() <= paper.turn_acceleration_radps2 * STEP_S + 1e-12


def test_poses_are_the_sum_of_the_arcs(driven):
    heading = driven.pose[0, 2] + np.concatenate([[0], np.cumsum(driven.turn_rate[:-1] * STEP_S)])
    np.testing.assert_allclose(driven.pose[:, 2], heading, atol=1e-9)
    step = np.hypot(*np.diff(driven.pose[:, :2], axis=0).T)
    half = driven.turn_rate[:-1] * STEP_S / 2
    np.testing.assert_allclose(step, driven.speed[:-1] * STEP_S * np.sinc(half / np.pi), atol=1e-9)
    assert driven.distance[-1] == pytest.approx(driven.speed.sum() * STEP_S)


def test_a_pose_between_two_states_lies_on_the_arc(driven):
    i = int(np.argmax(np.abs(driven.turn_rate)))
    before, distance, _ = driven.at(i * STEP_S + 1e-9)
    half, further, _ = driven.at((i + 0.5) * STEP_S)
    after, _, _ = driven.at((i + 1) * STEP_S - 1e-12)
    np.testing.assert_allclose(before, driven.pose[i], atol=1e-6)
    np.testing.assert_allclose(after, driven.pose[i + 1], atol=1e-6)
    assert half[2] == pytest.approx((before[2] + after[2]) / 2, abs=1e-8)
    assert further - distance == pytest.approx(driven.speed[i] * STEP_S / 2, abs=1e-7)


def test_before_and_after_the_drive_the_robot_stands():
    driven = drive(route((0, 0), (1, 0), is_closed=False), np.random.default_rng(0))
    np.testing.assert_array_equal(driven.at(-1.0)[0], driven.pose[0])
    np.testing.assert_array_equal(driven.at(1e6)[0], driven.pose[-1])
    assert driven.speed[-1] == 0
    assert driven.pose[-1, 0] == pytest.approx(1.0, abs=0.01)


def test_the_tilt_has_its_standard_deviation_and_its_correlation():
    params = route((0, 0), (200, 0), is_closed=False, cruise_mps=0.4, tilt=TiltParams(sd_deg=0.5, correlation_s=1.0))
    tilt = np.degrees(drive(params, np.random.default_rng(3)).tilt)
    n_independent = len(tilt) * STEP_S / 2  # two correlation times apart
    bound = 3 * 0.5 / np.sqrt(2 * n_independent)  # 3 sigma of a standard deviation
    np.testing.assert_allclose(tilt.std(axis=0), 0.5, atol=bound)
    lag = int(1.0 / STEP_S)
    correlation = (tilt[lag:] * tilt[:-lag]).mean(axis=0) / tilt.var(axis=0)
    # First order of 1 s rounded by 0.1 s: (e^-1 - 0.1 e^-10) / 0.9 = 0.409
    np.testing.assert_allclose(correlation, 0.409, atol=3 / np.sqrt(n_independent))
    assert abs(np.corrcoef(tilt.T)[0, 1]) < 3 / np.sqrt(n_independent)
    # In 10 ms it moves by little: a robot has mass.
    assert np.abs(np.diff(tilt, axis=0)).max() < 0.2


def test_no_tilt_is_flat_and_no_wandering_is_constant():
    driven = drive(route((0, 0), (5, 0), is_closed=False, speed_sd_mps=0.0), np.random.default_rng(0))
    assert (driven.tilt == 0).all()
    assert driven.speed.max() == pytest.approx(0.36)
    assert np.abs(driven.pose[:, 1]).max() < 1e-12


def test_the_view_has_the_tilt_in_it():
    driven = drive(route((0, 0), (2, 0), tilt=TiltParams(sd_deg=1.0)), np.random.default_rng(0))
    view = driven.view(1.0)
    _, _, (roll, pitch) = driven.at(1.0)
    assert view.rotation[2, 0] == pytest.approx(-np.sin(pitch))
    assert view.rotation[2, 1] == pytest.approx(np.cos(pitch) * np.sin(roll))


def test_two_waypoints_in_one_place_are_refused():
    with pytest.raises(ValueError, match="waypoint 3 is where the one before it is"):
        drive(route((0, 0), (1, 0), (1, 0)), np.random.default_rng(0))


@pytest.mark.parametrize("cruise", [0.05, 0.2, 1.0, 3.0])
def test_slow_and_fast_robots_arrive(cruise):
    params = route((0, 0), (6, 0), (6, 5), (3, 2), cruise_mps=cruise, max_speed_mps=cruise)
    driven = drive(params, np.random.default_rng(0))
    assert driven.speed.max() <= cruise + 1e-12
    assert driven.duration < 3 * driven.distance[-1] / cruise + 60
