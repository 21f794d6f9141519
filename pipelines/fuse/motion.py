"""How odometry moves the robot, if its scales and its bias are not quite right; for one step or for all of a log.

A state is x, y, heading, and the calibration of the odometry: relative errors s_v, s_w of speed and of turning, bias b
of the turn rate. An increment (dx, dy, dtheta) in time dt moves it by the step (a, phi)::

    delta = s_w dtheta + b dt,   phi = dtheta + delta,   a = (1 + s_v) Rot(delta / 2) (dx, dy),   X' = X o (a, phi)

The error of a pose lives in the robot's frame, X_true = X o xi, where its motion does not depend on the pose::

    xi_xy' = Rot(-phi) (xi_xy + xi_th J a),   xi_th' = xi_th,   J = [0 -1; 1 0]

and so do errors of the calibration and the noise of the step. Arrays have any leading axes.
"""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from ..geometry.motion import Increment
from .params import FuseParams

Array: TypeAlias = npt.NDArray[np.float64]

N_POSE, N_STATE = 3, 6
SPEED, TURN, BIAS = 3, 4, 5
"""Where the calibration stands in a state."""

DX, DY, DTHETA, LENGTH, ANGLE, DT, GAP = range(7)
"""The numbers of an ``Increment``."""

LEAST_M, LEAST_RAD = 1e-4, 1e-4
"""No step and no sighting is believed more exactly than this."""
_LEAST_SCALE = 1e-9


def corrected(calibration: Array, u: Array) -> Array:
    """Return the steps (..., 3) of increments (..., 7) with errors of the calibration (..., 3) taken off."""
    delta = calibration[..., 1] * u[..., DTHETA] + calibration[..., 2] * u[..., DT]
    scale = 1.0 + calibration[..., 0]
    c, s = scale * np.cos(0.5 * delta), scale * np.sin(0.5 * delta)
    x = c * u[..., DX] - s * u[..., DY]
    y = s * u[..., DX] + c * u[..., DY]
    return np.stack([x, y, u[..., DTHETA] + delta], axis=-1)


def linearise(calibration: Array, u: Array) -> tuple[Array, Array]:
    """Return how errors of the state (..., 3, 6) and of the step (..., 3, 3) show in the pose after it."""
    step = corrected(calibration, u)
    ax, ay, phi = step[..., 0], step[..., 1], step[..., 2]
    scale = 1.0 + calibration[..., 0]
    c, s = np.cos(phi), np.sin(phi)
    F = np.zeros((*step.shape[:-1], N_POSE, N_STATE))
    F[..., 0, 0], F[..., 0, 1], F[..., 1, 0], F[..., 1, 1], F[..., 2, 2] = c, s, -s, c, 1.0
    F[..., 0, 2], F[..., 1, 2] = -c * ay + s * ax, s * ay + c * ax
    G = F[..., :, :N_POSE].copy()
    G[..., :2, 2] *= 0.5  # a wrong turn bends the arc from its middle on
    F[..., 0, SPEED], F[..., 1, SPEED] = (c * ax + s * ay) / scale, (-s * ax + c * ay) / scale
    F[..., TURN] = G[..., 2] * u[..., DTHETA, None]
    F[..., BIAS] = G[..., 2] * u[..., DT, None]
    return F, G


def step_noise(u: Array, G: Array, params: FuseParams) -> Array:
    """Return the covariance (..., 3, 3) that increments (..., 7) add to the error of the pose."""
    gap_m, gap_rad = params.gap_speed_m_s * u[..., GAP], params.gap_turn_rad_s * u[..., GAP]
    along = params.along_per_sqrt_m**2 * u[..., LENGTH] + params.along_per_sqrt_s**2 * u[..., DT] + gap_m**2
    cross = params.cross_per_sqrt_m**2 * u[..., LENGTH] + gap_m**2
    heading = (
        params.heading_per_sqrt_rad**2 * u[..., ANGLE]
        + params.heading_per_sqrt_m**2 * u[..., LENGTH]
        + params.heading_per_sqrt_s**2 * u[..., DT]
        + gap_rad**2
    )
    variances = np.stack([along, cross, heading], axis=-1)
    return np.asarray((G * variances[..., None, :]) @ np.swapaxes(G, -1, -2))


def walk_variances(u: Array, params: FuseParams) -> Array:
    """Return the variances (..., 3) that increments (..., 7) add to the calibration."""
    rates = [params.scale_walk_per_sqrt_s, params.scale_walk_per_sqrt_s, params.bias_walk_rad_s_per_sqrt_s]
    return np.asarray(np.square(rates) * u[..., DT, None])


def start_calibration(params: FuseParams) -> tuple[Array, Array]:
    """Return the expected calibration (3,) and its standard deviations (3,), none quite zero."""
    sigmas = [params.speed_scale_sigma, params.turn_scale_sigma, params.turn_bias_sigma_rad_s]
    return np.array([params.speed_scale, params.turn_scale, 0.0]), np.maximum(sigmas, _LEAST_SCALE)


def numbers(u: Increment) -> Array:
    """Return an increment as an array (7,)."""
    return np.array(u, dtype=np.float64)
