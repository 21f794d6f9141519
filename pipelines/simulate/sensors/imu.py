"""An attitude sensor: where the robot's body points, how fast it turns, and what force it feels, each with noise.

Roll and pitch are those of the body, as gravity shows them, with a constant offset; the heading is what a gyro has
summed up since the start, so it begins at zero and drifts. Rates and accelerations are differences over ``SPAN_S``.
"""

import math
from collections.abc import Iterator

import numpy as np

from ....formats.events import Array, Imu
from ...engine.params import Field, Params
from ..pose import MountParams, View, place, quaternion, rpy
from ..scene import Cause, Run

GRAVITY = 9.80665
SPAN_S = 0.02


class ImuParams(Params):
    """Rate, place and errors of the sensor."""

    topic: str = Field("/imu/data", description="topic of the readings")
    frame: str = Field("imu_link", description="coordinate frame of the sensor")
    rate_hz: float = Field(50.0, gt=0, le=10_000, description="readings per second [Hz]")
    mount: MountParams = Field(MountParams(), description="place on the robot")
    tilt_sd_deg: float = Field(0.05, ge=0, description="white noise of roll and pitch, per reading [deg]")
    tilt_bias_deg: tuple[float, float] = Field((0.0, 0.0), description="constant error of roll and of pitch [deg]")
    heading_sd_deg: float = Field(0.1, ge=0, description="white noise of the heading, per reading [deg]")
    heading_drift_degps: float = Field(0.0, description="drift of the heading [deg/s]")
    rate_sd_radps: float = Field(0.002, ge=0, description="white noise of the turn rates, per reading [rad/s]")
    acceleration_sd_mps2: float = Field(0.05, ge=0, description="white noise of the accelerations, per reading [m/s^2]")


def attitude(run: Run, params: ImuParams) -> Iterator[Imu]:
    """Yield the readings of a run."""
    rng, motion = run.stream(Cause.IMU), run.motion
    bias = np.radians(params.tilt_bias_deg)
    first, mounted = motion.at(0.0)[0][2], params.mount.view
    mount = place(mounted)
    for time_ns in run.ticks(params.rate_hz):
        time = time_ns * 1e-9
        noise = rng.standard_normal(9)
        (_, _, heading), _, tilt = motion.at(time)
        roll, pitch = tilt + bias + math.radians(params.tilt_sd_deg) * noise[:2]
        yaw = heading - first + math.radians(params.heading_drift_degps * time + params.heading_sd_deg * noise[2])
        before, here, after = (motion.view(time + dt) @ mounted for dt in (-SPAN_S, 0.0, SPAN_S))
        force = (before.position - 2 * here.position + after.position) / SPAN_S**2 + [0.0, 0.0, GRAVITY]
        yield Imu(
            stamp=run.start_ns + time_ns,
            topic=params.topic,
            source="imu",
            frame_id=params.frame,
            angular=_rates(before, after) + params.rate_sd_radps * noise[3:6],
            acceleration=here.rotation.T @ force + params.acceleration_sd_mps2 * noise[6:],
            orientation=quaternion(rpy(roll, pitch, yaw) @ mounted.rotation),
            mount=mount,
        )


def _rates(before: View, after: View) -> Array:
    """Return the turn rates in the sensor's frame (3,) [rad/s] between two attitudes ``2 SPAN_S`` apart."""
    x, y, z, w = quaternion(before.rotation.T @ after.rotation)
    return np.array([x, y, z]) / float(w * SPAN_S)
