"""Wheel odometry as it is logged: what the robot did since the last reading, with scale, bias and noise.

::

    v = (1 + speed scale) ds/dt + N(0, speed sd),   w = (1 + turn scale) dtheta/dt + bias + N(0, turn sd)    (1)

with ds and dtheta the distance and the turn since the last reading; so a reading is the mean over the interval that
ends at its stamp, and the logged pose is the exact sum of the readings.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...formats.events import Array
from ..engine.params import Field, Params
from .robot import advance
from .scene import Motion


class OdometryParams(Params):
    """Rate and errors of the odometry."""

    topic: str = Field("/odom", description="topic of the readings")
    rate_hz: float = Field(23.2, gt=0, le=10_000, description="readings per second [Hz]")
    speed_scale_pct: float = Field(2.0, gt=-100, description="systematic error of distances [%]")
    turn_scale_pct: float = Field(2.0, gt=-100, description="systematic error of turns [%]")
    gyro_bias_degps: float = Field(0.1, description="constant error of the turn rate [deg/s]")
    speed_sd_mps: float = Field(0.01, ge=0, description="white noise of the speed, per reading [m/s]")
    turn_sd_radps: float = Field(0.01, ge=0, description="white noise of the turn rate, per reading [rad/s]")


@dataclass(frozen=True, slots=True, eq=False)
class Reading:
    """One odometry message: time after the start [ns], pose (3,) in the odometry frame, speed and turn rate."""

    time_ns: int
    pose: Array
    speed: float
    turn_rate: float


def readings(motion: Motion, params: OdometryParams, rng: np.random.Generator) -> Iterator[Reading]:
    """Yield the readings of a drive; the first stands at 0, 0, 0 and at rest."""
    period_ns = round(1e9 / params.rate_hz)
    dt = period_ns * 1e-9
    logged = np.zeros(3)
    pose, distance, _ = motion.at(0.0)
    yield Reading(0, logged, 0.0, 0.0)
    for k in range(1, int(motion.duration * 1e9) // period_ns + 1):
        last_heading, last_distance = pose[2], distance
        pose, distance, _ = motion.at(k * period_ns * 1e-9)
        noise = rng.standard_normal(2)
        v = (1 + params.speed_scale_pct / 100) * (distance - last_distance) / dt + params.speed_sd_mps * noise[0]
        w = (1 + params.turn_scale_pct / 100) * (pose[2] - last_heading) / dt
        w += math.radians(params.gyro_bias_degps) + params.turn_sd_radps * noise[1]  # eq. (1)
        logged = advance(logged, v, w, dt)
        yield Reading(k * period_ns, logged, v, w)
