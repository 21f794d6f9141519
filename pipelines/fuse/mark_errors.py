"""What a mark that hangs a little elsewhere than its map says does to the poses found by it.

The map has the mark at p, off by (t_x, t_y, beta) from where it really hangs: the error of the survey is a rigid motion
about p. Whoever locates himself by the mark is off by that motion, always by the same one: a hundred images of it know
the mark no better than one. Its error is therefore a state of its own, which begins with the standard deviation of the
survey, and not noise::

    z_xy = p + Rot(beta) (x - p) + t,   z_th = theta + beta,   (x, theta) the true pose, z the one found

Two marks that odometry connects tell of the errors of both. Considered instead: to widen the sighting, which a filter
averages away; to thin out the images of one mark, which holds for one speed and wastes the images.
"""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from ..geometry.se2 import rotation
from .motion import LEAST
from .params import FuseParams

Array: TypeAlias = npt.NDArray[np.float64]


def displaced(poses: Array, places: Array, errors: Array) -> tuple[Array, Array, Array]:
    """Return what is found at true poses by marks that were surveyed wrongly.

    Args:
        poses: (..., 3) of the robot [m, m, rad].
        places: (..., 2) of the mark in the map [m].
        errors: (..., 3) of its survey [m, m, rad].

    Returns:
        Poses found (..., 3), not wrapped, and how they change, in the map, with the error of the pose in the
        robot's frame (..., 3, 3) and with the error of the survey (..., 3, 3).
    """
    arm = (rotation(errors[..., 2]) @ (poses[..., :2] - places)[..., None])[..., 0]
    found = np.empty(np.broadcast_shapes(poses.shape, errors.shape))
    found[..., :2] = places + arm + errors[..., :2]
    found[..., 2] = poses[..., 2] + errors[..., 2]
    by_pose = np.zeros((*found.shape, 3))
    by_pose[..., :2, :2] = rotation(found[..., 2])
    by_pose[..., 2, 2] = 1.0
    by_error = np.zeros((*found.shape, 3))
    by_error[..., 0, 0] = by_error[..., 1, 1] = by_error[..., 2, 2] = 1.0
    by_error[..., 0, 2], by_error[..., 1, 2] = -arm[..., 1], arm[..., 0]
    return found, by_pose, by_error


def survey_sigmas(params: FuseParams) -> Array:
    """Return the standard deviations (3,) of a mark's survey error [m, m, rad]."""
    sigmas = np.array([params.map_sigma_m, params.map_sigma_m, np.radians(params.map_sigma_deg)])
    return np.asarray(np.sqrt(sigmas**2 + np.diag(LEAST)))
