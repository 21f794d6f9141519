"""Odometry errors have the sizes that were asked for, and none when none were."""

import numpy as np
import pytest

from logpose.pipelines.simulate.robot import RobotParams, WaypointParams, drive
from logpose.pipelines.simulate.scene import Run
from logpose.pipelines.simulate.sensors.odometry import OdometryParams, odometry

PERFECT = {
    "speed_scale_pct": 0.0,
    "turn_scale_pct": 0.0,
    "gyro_bias_degps": 0.0,
    "speed_sd_mps": 0.0,
    "turn_sd_radps": 0.0,
}


@pytest.fixture(scope="module")
def driven():
    points = [(0, 0), (12, 0), (12, 6), (2, 7)]
    waypoints = tuple(WaypointParams(name=str(i), x_m=float(x), y_m=float(y)) for i, (x, y) in enumerate(points))
    return drive(RobotParams(waypoints=waypoints), np.random.default_rng(0))


def collect(driven, **errors):
    params = OdometryParams(rate_hz=23.2, **{**PERFECT, **errors})
    found = list(odometry(Run(driven, 0, 5), params))
    times, position, turn, linear, angular = (
        np.array([getattr(e, name) for e in found])
        for name in ("stamp", "position", "orientation", "linear", "angular")
    )
    heading = np.unwrap(2 * np.arctan2(turn[:, 2], turn[:, 3]))
    return times, np.column_stack([position[:, :2], heading]), linear[:, 0], angular[:, 2]


def truth(driven, times):
    return np.array([driven.at(t * 1e-9)[0] for t in times])


def test_perfect_odometry_ends_where_the_robot_does(driven):
    times, poses, _, _ = collect(driven)
    true = truth(driven, times)
    np.testing.assert_allclose(poses[:, 2] + true[0, 2], true[:, 2], atol=1e-9)
    # Between readings, 43 ms apart, v and w are taken as constant, the robot accelerates: a few millimetres in 30 m.
    np.testing.assert_allclose(poses[:, :2], true[:, :2], atol=0.01)


def test_readings_come_at_their_rate_from_the_start_to_the_end(driven):
    times, poses, speed, turn_rate = collect(driven)
    assert times[0] == 0
    assert (np.diff(times) == round(1e9 / 23.2)).all()
    assert driven.duration - times[-1] * 1e-9 < 1 / 23.2
    assert (poses[0] == 0).all()
    assert speed[0] == turn_rate[0] == 0


def test_scale_errors_scale_and_the_bias_adds(driven):
    _, _, speed, turn_rate = collect(driven)
    _, _, faster, _ = collect(driven, speed_scale_pct=2.0)
    _, _, _, biased = collect(driven, turn_scale_pct=3.0, gyro_bias_degps=0.1)
    np.testing.assert_allclose(faster, 1.02 * speed, atol=1e-12)
    np.testing.assert_allclose(biased[1:], 1.03 * turn_rate[1:] + np.radians(0.1), atol=1e-12)


def test_noise_is_white_and_of_its_size(driven):
    _, _, speed, turn_rate = collect(driven)
    _, _, noisy, turning = collect(driven, speed_sd_mps=0.01, turn_sd_radps=0.02)
    n = len(speed) - 1
    for error, sd in ((noisy[1:] - speed[1:], 0.01), (turning[1:] - turn_rate[1:], 0.02)):
        assert error.std() == pytest.approx(sd, rel=3 / np.sqrt(2 * n))  # 3 sigma
        assert abs(error.mean()) < 3 * sd / np.sqrt(n)
        assert abs((error[1:] * error[:-1]).mean()) / sd**2 < 3 / np.sqrt(n)


def test_the_pose_is_the_exact_sum_of_the_readings(driven):
    times, poses, speed, turn_rate = collect(driven, speed_sd_mps=0.05, turn_sd_radps=0.1, gyro_bias_degps=1.0)
    dt = round(1e9 / 23.2) * 1e-9
    x = np.zeros(3)
    for k in range(1, len(times)):
        w = turn_rate[k] * dt
        x[:2] += speed[k] * dt * np.sinc(w / 2 / np.pi) * np.array([np.cos(x[2] + w / 2), np.sin(x[2] + w / 2)])
        x[2] += w
        np.testing.assert_allclose(poses[k], x, atol=1e-9)
