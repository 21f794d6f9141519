"""A pan-tilt head under the camera that looks around slowly, and its joint states.

The axes meet in the lens. Pan turns the camera about the robot's z axis, counter-clockwise from above; tilt turns it
about its own image-right axis, up is positive::

    base_R_camera = Rz(pan) mount_R Rx(tilt)                                             (1)

so ``/tf_static`` holds the place of a head with both joints at zero.
"""

import math
from collections.abc import Iterator

import numpy as np

from ....formats.events import Array, JointState
from ...engine.params import Field, Params
from ..pose import View, rpy
from ..scene import Cause, Run


class SweepParams(Params):
    """How one joint moves: ``middle + swing sin(2 pi t / period)``."""

    middle_deg: float = Field(0.0, ge=-180, le=180, description="middle of the sweep [deg]")
    swing_deg: float = Field(0.0, ge=0, le=180, description="how far it goes to either side [deg]")
    period_s: float = Field(20.0, gt=0, description="time for there and back [s]")

    def angle(self, time: float) -> float:
        """Return the angle at a time [s], in rad."""
        return math.radians(self.middle_deg + self.swing_deg * math.sin(2 * math.pi * time / self.period_s))


class HeadParams(Params):
    """The head and its encoders."""

    topic: str = Field("/joint_states", description="topic of the joint states")
    rate_hz: float = Field(50.0, gt=0, le=10_000, description="joint states per second [Hz]")
    pan_joint: str = Field("pan", description="name of the joint that turns left and right")
    tilt_joint: str = Field("tilt", description="name of the joint that turns up and down")
    pan: SweepParams = Field(SweepParams(swing_deg=20.0), description="how it looks left and right")
    tilt: SweepParams = Field(SweepParams(), description="how it looks up and down")
    sd_deg: float = Field(0.02, ge=0, description="white noise of an encoder, per reading [deg]")

    def angles(self, time: float) -> Array:
        """Return pan and tilt (2,) at a time [s], in rad."""
        return np.array([self.pan.angle(time), self.tilt.angle(time)])

    def turned(self, mounted: View, time: float) -> View:
        """Return base_T_camera at a time [s], by eq. (1), from that with both joints at zero."""
        pan, tilt = self.angles(time)
        return View(rpy(0.0, 0.0, pan) @ mounted.rotation @ rpy(tilt, 0.0, 0.0), mounted.position)


def joints(run: Run, params: HeadParams) -> Iterator[JointState]:
    """Yield the joint states of a run."""
    rng = run.stream(Cause.HEAD)
    for time_ns in run.ticks(params.rate_hz):
        noise = math.radians(params.sd_deg) * rng.standard_normal(2)
        yield JointState(
            stamp=run.start_ns + time_ns,
            topic=params.topic,
            source="joints",
            names=(params.pan_joint, params.tilt_joint),
            positions=params.angles(time_ns * 1e-9) + noise,
        )
