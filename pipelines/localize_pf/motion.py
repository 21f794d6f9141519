"""Motion of the cloud: each particle drives the odometry increment, corrected by its own scales and bias.

A particle is a pose X and five more numbers: relative error of speed and of turning, bias of the turn rate,
and the shift common to all sightings (x, y in the robot's frame). Around each stands the same small Gaussian
of covariance P (8, 8), whose pose error lives in the robot's frame: ``X_true = X exp(xi)``. There neither the
motion of an error nor its measurement depends on where the particle is, so that one P serves the whole
cloud. With the step (a, phi) of ``odometry/noise.py``::

    X'     = X o (a, phi)
    xi_xy' = Rot(-phi) (xi_xy + xi_th J a) + noise of (a, phi)        J = [0 -1; 1 0]
    xi_th' = xi_th + noise of phi
    shift' = e^(-dt / tau) shift + noise
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from ..geometry.motion import Increment
from ..geometry.se2 import compose, rotation
from ..odometry.noise import corrected, step_noise
from .params import LocalizePfParams

Array: TypeAlias = npt.NDArray[np.float64]

SPEED, TURN, BIAS = 0, 1, 2
SHIFT = slice(3, 5)
"""Columns of a particle's further numbers; in P they come after x, y, heading."""
N_AUX = 5
N_STATES = 3 + N_AUX


@dataclass(slots=True)
class Cloud:
    """Particles and the small Gaussian around each.

    Attributes:
        poses: (N, 3) [m, m, rad].
        aux: (N, 5) speed scale, turn scale [1], turn bias [rad/s], common shift x, y [m].
        log_w: (N,) logarithms of weights, normalised.
        P: (8, 8) covariance of a particle's error, the pose in its own frame.
    """

    poses: Array
    aux: Array
    log_w: Array
    P: Array


def start_covariance(pose_cov: Array, params: LocalizePfParams) -> Array:
    """Return P at the start, from the covariance (3, 3) of the pose in the robot's frame."""
    P = np.zeros((N_STATES, N_STATES))
    P[:3, :3] = pose_cov
    sigmas = [
        params.speed_scale_sigma,
        params.turn_scale_sigma,
        params.turn_bias_sigma_rad_s,
        params.shift_sigma_m,
        params.shift_sigma_m,
    ]
    P[3:, 3:] = np.diag(np.square(sigmas))
    return P


def drive(cloud: Cloud, u: Increment, params: LocalizePfParams) -> None:
    """Move every particle by one increment of odometry and let P grow.

    Args:
        cloud: moved in place.
        u: short enough that its curve hardly changes with the scales (a fraction of a radian).
        params: noise of odometry and of the common shift.
    """
    memory = float(np.exp(-u.dt / params.shift_s))
    n = np.array(u)
    step = corrected(cloud.aux[:, :3], n)
    scale = 1.0 + cloud.aux[:, SPEED]
    mean_scale, *_ = np.exp(cloud.log_w) @ np.column_stack([scale, step])
    a_phi = np.exp(cloud.log_w) @ step
    cloud.poses = compose(cloud.poses, step)
    cloud.aux[:, SHIFT] *= memory

    F, G = _linearise(a_phi, float(mean_scale), u)
    F[6, 6] = F[7, 7] = memory
    Q = np.zeros((N_STATES, N_STATES))
    Q[:3, :3] = step_noise(n, G, params)
    walk = [params.scale_walk_per_sqrt_s, params.scale_walk_per_sqrt_s, params.bias_walk_rad_s_per_sqrt_s]
    for i, sigma in enumerate(walk, start=3):
        Q[i, i] = sigma**2 * u.dt
    Q[6, 6] = Q[7, 7] = params.shift_sigma_m**2 * (1.0 - memory**2)
    cloud.P = F @ cloud.P @ F.T + Q


def _linearise(a_phi: Array, scale: float, u: Increment) -> tuple[Array, Array]:
    """Return how errors of the state (8, 8) and of the increment (3, 3) move into the next pose.

    As ``linearise`` of fuse-poses, whose products are elementwise. These go through BLAS and round differently, which
    shows in the last digits of a trajectory.
    """
    ax, ay, phi = (float(value) for value in a_phi)
    back = rotation(-phi)
    Ja = np.array([-ay, ax])
    F = np.eye(N_STATES)
    F[:2, :2] = back
    F[:2, 2] = back @ Ja
    G = np.eye(3)
    G[:2, :2] = back
    G[:2, 2] = back @ (0.5 * Ja)  # a wrong turn bends the arc from its middle on
    F[:3, 3 + SPEED] = G @ np.array([ax / scale, ay / scale, 0.0])
    F[:3, 3 + TURN] = G[:, 2] * u.dtheta
    F[:3, 3 + BIAS] = G[:, 2] * u.dt
    return F, G
