"""Wheel odometry as it is logged: what the robot did since the last reading, with scale, bias and noise.

::

    v = (1 + speed scale) ds/dt + N(0, speed sd),   w = (1 + turn scale) dtheta/dt + bias + N(0, turn sd)    (1)

with ds and dtheta the distance and the turn since the last reading; so a reading is the mean over the interval that
ends at its stamp, and the logged pose is the exact sum of the readings.
"""

import math
from collections.abc import Iterator

import numpy as np

from ....formats.events import Odometry
from ...engine.params import Field, Params
from ..pose import quaternion, rpy
from ..robot import advance
from ..scene import BASE, ODOM, Cause, Run


class OdometryParams(Params):
    """Rate and errors of the odometry."""

    topic: str = Field("/odom", description="topic of the readings")
    rate_hz: float = Field(23.2, gt=0, le=10_000, description="readings per second [Hz]")
    speed_scale_pct: float = Field(2.0, gt=-100, description="systematic error of distances [%]")
    turn_scale_pct: float = Field(2.0, gt=-100, description="systematic error of turns [%]")
    gyro_bias_degps: float = Field(0.1, description="constant error of the turn rate [deg/s]")
    speed_sd_mps: float = Field(0.01, ge=0, description="white noise of the speed, per reading [m/s]")
    turn_sd_radps: float = Field(0.01, ge=0, description="white noise of the turn rate, per reading [rad/s]")


def odometry(run: Run, params: OdometryParams) -> Iterator[Odometry]:
    """Yield the readings of a run; the first stands at 0, 0, 0 and at rest."""
    rng, ticks = run.stream(Cause.ODOMETRY), run.ticks(params.rate_hz)
    dt = ticks.step * 1e-9
    logged, v, w = np.zeros(3), 0.0, 0.0
    pose, distance, _ = run.motion.at(0.0)
    for time_ns in ticks:
        if time_ns > 0:
            last_heading, last_distance = pose[2], distance
            pose, distance, _ = run.motion.at(time_ns * 1e-9)
            noise = rng.standard_normal(2)
            v = (1 + params.speed_scale_pct / 100) * (distance - last_distance) / dt + params.speed_sd_mps * noise[0]
            w = (1 + params.turn_scale_pct / 100) * (pose[2] - last_heading) / dt
            w += math.radians(params.gyro_bias_degps) + params.turn_sd_radps * noise[1]  # eq. (1)
            logged = advance(logged, v, w, dt)
        yield Odometry(
            stamp=run.start_ns + time_ns,
            topic=params.topic,
            source="odometry",
            frame_id=ODOM,
            child_frame_id=BASE,
            position=np.array([logged[0], logged[1], 0.0]),
            orientation=quaternion(rpy(0.0, 0.0, logged[2])),
            linear=np.array([v, 0.0, 0.0]),
            angular=np.array([0.0, 0.0, w]),
        )
