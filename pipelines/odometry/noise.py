"""How odometry errs: scales and a bias that are not quite right, and noise; for one step or for all of a log.

The calibration of the odometry are relative errors s_v, s_w of speed and of turning, and the bias b of the turn rate.
An increment (dx, dy, dtheta) in time dt moves the robot by the step (a, phi)::

    delta = s_w dtheta + b dt,   phi = dtheta + delta,   a = (1 + s_v) Rot(delta / 2) (dx, dy),   X' = X o (a, phi)

Noise is a random walk in physical units, so that it does not depend on the rate of the log: the standard deviation
after one metre, one radian, one second; it grows with their square root. Arrays have any leading axes.
"""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from ..engine.params import Field, Params

Array: TypeAlias = npt.NDArray[np.float64]

DX, DY, DTHETA, LENGTH, ANGLE, DT, GAP = range(7)
"""The numbers of an ``Increment``."""

_LEAST_SCALE = 1e-9


class OdometryErrors(Params):
    """Noise, calibration, gaps and jumps of odometry."""

    along_per_sqrt_m: float = Field(0.01, ge=0, description="odometry noise along the way [m per sqrt m]")
    along_per_sqrt_s: float = Field(0.005, ge=0, description="odometry noise along the way [m per sqrt s]")
    cross_per_sqrt_m: float = Field(0.002, ge=0, description="odometry noise across the way [m per sqrt m]")
    heading_per_sqrt_rad: float = Field(0.01, ge=0, description="heading noise from turning [rad per sqrt rad]")
    heading_per_sqrt_m: float = Field(0.003, ge=0, description="heading noise from driving [rad per sqrt m]")
    heading_per_sqrt_s: float = Field(0.003, ge=0, description="heading noise over time [rad per sqrt s]")
    speed_scale: float = Field(0.0, gt=-1, description="expected error of the speed scale, true/odometry - 1 [1]")
    speed_scale_sigma: float = Field(0.04, ge=0, description="uncertainty of the speed scale [1]")
    turn_scale: float = Field(0.0, gt=-1, description="expected error of the turn scale, true/odometry - 1 [1]")
    turn_scale_sigma: float = Field(0.04, ge=0, description="uncertainty of the turn scale [1]")
    turn_bias_sigma_rad_s: float = Field(0.006, ge=0, description="uncertainty of the turn rate's bias [rad/s]")
    scale_walk_per_sqrt_s: float = Field(0.0005, ge=0, description="drift of both scales [1 per sqrt s]")
    bias_walk_rad_s_per_sqrt_s: float = Field(
        5e-5, ge=0, description="drift of the turn rate's bias [rad/s per sqrt s]"
    )
    gap_s: float = Field(1.0, gt=0, description="odometry silent for longer is a gap [s]")
    gap_speed_m_s: float = Field(0.3, ge=0, description="unknown speed in a gap of odometry, 1 sigma [m/s]")
    gap_turn_rad_s: float = Field(0.3, ge=0, description="unknown turn rate in a gap of odometry, 1 sigma [rad/s]")
    jump_speed_m_s: float = Field(
        10.0, gt=0, description="poses of odometry that move faster jump, which is said [m/s]"
    )
    jump_turn_rad_s: float = Field(10.0, gt=0, description="poses of odometry that turn faster jump [rad/s]")


def corrected(calibration: Array, u: Array) -> Array:
    """Return the steps (..., 3) of increments (..., 7) with errors of the calibration (..., 3) taken off."""
    delta = calibration[..., 1] * u[..., DTHETA] + calibration[..., 2] * u[..., DT]
    scale = 1.0 + calibration[..., 0]
    c, s = scale * np.cos(0.5 * delta), scale * np.sin(0.5 * delta)
    x = c * u[..., DX] - s * u[..., DY]
    y = s * u[..., DX] + c * u[..., DY]
    return np.stack([x, y, u[..., DTHETA] + delta], axis=-1)


def noise_variances(u: Array, params: OdometryErrors) -> Array:
    """Return variances (..., 3) of increments (..., 7): along, across [m^2] and of the heading [rad^2]."""
    gap_m, gap_rad = params.gap_speed_m_s * u[..., GAP], params.gap_turn_rad_s * u[..., GAP]
    along = params.along_per_sqrt_m**2 * u[..., LENGTH] + params.along_per_sqrt_s**2 * u[..., DT] + gap_m**2
    cross = params.cross_per_sqrt_m**2 * u[..., LENGTH] + gap_m**2
    heading = (
        params.heading_per_sqrt_rad**2 * u[..., ANGLE]
        + params.heading_per_sqrt_m**2 * u[..., LENGTH]
        + params.heading_per_sqrt_s**2 * u[..., DT]
        + gap_rad**2
    )
    return np.stack([along, cross, heading], axis=-1)


def step_noise(u: Array, G: Array, params: OdometryErrors) -> Array:
    """Return the covariance (..., 3, 3) that increments (..., 7) add to the error of the pose.

    Args:
        u: increments.
        G: (..., 3, 3) how errors of their steps show in the pose after them.
        params: noise.
    """
    variances = noise_variances(u, params)
    return np.asarray((G * variances[..., None, :]) @ np.swapaxes(G, -1, -2))


def walk_variances(u: Array, params: OdometryErrors) -> Array:
    """Return the variances (..., 3) that increments (..., 7) add to the calibration."""
    rates = [params.scale_walk_per_sqrt_s, params.scale_walk_per_sqrt_s, params.bias_walk_rad_s_per_sqrt_s]
    return np.asarray(np.square(rates) * u[..., DT, None])


def start_calibration(params: OdometryErrors) -> tuple[Array, Array]:
    """Return the expected calibration (3,) and its standard deviations (3,), none quite zero."""
    sigmas = [params.speed_scale_sigma, params.turn_scale_sigma, params.turn_bias_sigma_rad_s]
    return np.array([params.speed_scale, params.turn_scale, 0.0]), np.maximum(sigmas, _LEAST_SCALE)
