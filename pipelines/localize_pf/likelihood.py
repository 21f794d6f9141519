"""How well a landmark explains a sighting, in robot coordinates, with a floor for what is no landmark.

A sighting z at (x, y) of covariance R, seen from the pose X with the common shift t, leaves to the landmark l
the innovation ``d = z - t - X^-1 l``, whose covariance is ``S = H P H^T + R`` with ``H = [-I, (z_y, -z_x)^T,
0, I]``. Its density is that of a mixture: a landmark of the map, or anything, anywhere in the footprint of
area A::

    p(z) = (1 - eps) sum_l N(d_l; 0, S) + eps / A

R holds the sighting's own covariance, a floor, and the survey error of the map. That one is the same in every
image as long as the landmark is in view; a filter that takes it for white counts it n times. As a first-order
process over progress p (way, turning and time, scaled to its correlation length) it weighs as much as white
noise of variance ``sigma^2 coth(p / 2)`` per image: sigma^2 for images far apart, and without bound for a
robot that stands.

The same holds for what a sighting says of *which* landmark it is: another robot that holds still is taken for a
landmark in every image, and n images of it are not n witnesses. Weights therefore take the density to the power
``tanh(p)``, with a correlation length of its own. Without it (power 1) two robots that stood like two posts led the
filter away from the true ones on MRCLAM set 1, robot 2, in every run.
"""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from ..geometry.motion import Increment
from .params import LocalizePfParams

Array: TypeAlias = npt.NDArray[np.float64]

_MOST = 1e6

LEAST_M2 = 1e-8
"""Variance below a tenth of a millimetre squared is no claim a sensor can make; keeps S invertible."""


def map_noise(variance: float, since: Increment, params: LocalizePfParams) -> float:
    """Return the white variance per image that weighs as much as the survey error of landmarks in view.

    Args:
        variance: of the survey error per axis [m^2].
        since: motion since the last image with sightings; ``dt`` of infinity for the first.
        params: the way, turn and time that are a progress of one.

    Returns:
        ``variance * coth(progress / 2)`` [m^2].
    """
    progress = since.length / params.map_length_m + since.turn / params.map_turn_rad + since.dt / params.map_s
    return variance / max(float(np.tanh(0.5 * progress)), 1.0 / _MOST)


def novelty(since: Increment, params: LocalizePfParams) -> float:
    """Return how much of an image's evidence is new, from 0 (the same image again) to 1 (the first)."""
    progress = since.length / params.news_length_m + since.turn / params.news_turn_rad + since.dt / params.news_s
    return float(np.tanh(progress))


def sensitivity(z: Array) -> Array:
    """Return H (2, 8), how a particle's error shows in the innovation of a sighting at ``z`` (2,) [m]."""
    H = np.zeros((2, 8))
    H[0, 0] = H[1, 1] = -1.0
    H[0, 2], H[1, 2] = z[1], -z[0]
    H[0, 6] = H[1, 7] = 1.0
    return H


def innovations(seen: Array, headings: Array, landmarks: Array) -> Array:
    """Return d (N, C, 2), in each particle's frame.

    Args:
        seen: (N, 2) where each particle sees the sighting, in the map, its own shift taken off [m].
        headings: (N,) of the particles [rad].
        landmarks: (C, 2) candidates [m].
    """
    east = seen[:, None, 0] - landmarks[None, :, 0]
    north = seen[:, None, 1] - landmarks[None, :, 1]
    c, s = np.cos(headings)[:, None], np.sin(headings)[:, None]
    return np.stack([c * east + s * north, c * north - s * east], axis=-1)
