"""The attitude sensor tells the truth to its noise."""

import numpy as np
import pytest

from logpose.formats.events import Imu
from logpose.pipelines.simulate.simulate import events_of


def test_the_attitude_sensor_tells_the_floor_s_tilt_to_its_noise(room):
    imu = {"rate_hz": 100.0, "tilt_sd_deg": 0.2, "heading_sd_deg": 0.3, "rate_sd_radps": 0.01}
    world = room(robot__tilt={"sd_deg": 2.0}, robot__waypoints__1__x_m=3.5, imu=imu)
    scene = world.build()
    driven = scene.motion(1)
    readings = [e for e in events_of(scene, 1) if isinstance(e, Imu)]
    times = np.array([e.stamp - world.start_stamp_ns for e in readings]) * 1e-9
    x, y, z, w = np.array([e.orientation for e in readings]).T
    roll, pitch = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)), np.arcsin(2 * (w * y - z * x))
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    true = np.array([[*driven.at(t)[2], driven.at(t)[0][2]] for t in times])
    n = len(times)
    for error, sd in ((roll - true[:, 0], 0.2), (pitch - true[:, 1], 0.2), (yaw - true[:, 2] + true[0, 2], 0.3)):
        assert np.degrees(error.std()) == pytest.approx(sd, rel=3 / np.sqrt(2 * n))
        assert abs(np.degrees(error.mean())) < 3 * sd / np.sqrt(n)
    turning = np.array([e.angular for e in readings])[2:-2]
    rates = (true[4:] - true[:-4]) / 0.04  # small tilts: the rates of the angles are those of the body
    assert (turning - rates).std(axis=0) == pytest.approx([0.01] * 3, rel=0.2)
    # A sensor feels what holds it up, to its back when it tilts forward (pitch > 0), and what speeds it up and turns it.
    force = np.array([e.acceleration for e in readings])[2:-2]
    speed = driven.speed[np.minimum(np.rint(times * 100).astype(int), len(driven.speed) - 1)]
    ahead = -9.80665 * np.sin(true[2:-2, 1]) + (speed[4:] - speed[:-4]) / 0.04
    left = 9.80665 * np.sin(true[2:-2, 0]) + speed[2:-2] * rates[:, 2]
    for error in (force[:, 0] - ahead, force[:, 1] - left, force[:, 2] - 9.80665):
        assert error.std() == pytest.approx(0.05, rel=0.2)
        assert abs(error.mean()) < 0.02
