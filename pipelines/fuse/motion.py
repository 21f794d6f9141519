"""How the errors of a state move with the robot; for one step or for all of a log.

A state is x, y, heading, and the calibration of the odometry (``odometry/noise.py``), whose steps are (a, phi). The
error of a pose lives in the robot's frame, X_true = X o xi, where its motion does not depend on the pose::

    xi_xy' = Rot(-phi) (xi_xy + xi_th J a),   xi_th' = xi_th,   J = [0 -1; 1 0]

and so do errors of the calibration and the noise of the step. Arrays have any leading axes.
"""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from ..estimation.gaussian import pose_covariance
from ..odometry.noise import DT, DTHETA, corrected

Array: TypeAlias = npt.NDArray[np.float64]

N_POSE, N_STATE = 3, 6
SPEED, TURN, BIAS = 3, 4, 5
"""Where the calibration stands in a state."""

LEAST = pose_covariance(1e-4, 1e-4)
"""No step and no sighting is believed more exactly than this [m^2, m^2, rad^2]."""


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
