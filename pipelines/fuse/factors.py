"""What the smoother's states must fit, each kind of it as one function of all states (``estimation/smoothing.py``).

A state is x, y, heading and the calibration of the odometry; the error of its pose lives in the robot's frame. The
border are the survey errors of the marks, three numbers each. Residuals of poses are in the map, those of increments in
the frame of the robot after them.
"""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from ..estimation.losses import Loss
from ..estimation.smoothing import Factor, Linear, whitening
from ..geometry.angles import difference
from ..geometry.se2 import between, compose, in_map
from ..odometry.noise import corrected, start_calibration, walk_variances
from .history import Sightings, Starts
from .mark_errors import displaced, survey_sigmas
from .motion import LEAST, N_POSE, N_STATE, linearise
from .params import FuseParams

Array: TypeAlias = npt.NDArray[np.float64]
Indices: TypeAlias = npt.NDArray[np.intp]

_WEAK = 1e3
"""Standard deviation of a pose that nothing else holds [m, rad]."""

_LEAST_WALK = 1e-6
"""The calibration changes by so much at least from node to node, or the equations were too stiff to be solved."""


def sightings(seen: Sightings, places: Array, rows: Indices, loss: Loss) -> Factor:
    """Return the factor of K sightings.

    Args:
        seen: what was seen.
        places: (K, 2) where the mark of each hangs [m].
        rows: (K,) row of the mark of each among the survey errors in the border.
        loss: what they cost.
    """

    def linearised(states: Array, border: Array) -> Linear:
        found, by_pose, by_error = displaced(states[seen.at, :N_POSE], places, border.reshape(-1, 3)[rows])
        return Linear(_minus(found, seen.pose), _widened(by_pose), by_border=by_error)

    W = whitening((seen.cov + LEAST) / seen.news[:, None, None])
    return Factor(linearised, W, seen.at, 3 * rows[:, None] + np.arange(3), loss)


def starts(given: Starts, loss: Loss) -> Factor:
    """Return the factor of start poses."""

    def linearised(states: Array, _border: Array) -> Linear:
        poses = states[given.at, :N_POSE]
        return Linear(_minus(poses, given.pose), _widened(in_map(poses[:, 2])))

    return Factor(linearised, whitening(given.cov + LEAST), given.at, loss=loss)


def increments(at: Indices, u: Array, covariances: Array) -> Factor:
    """Return the factor of the way that odometry tells.

    Args:
        at: (K,) the state that each increment begins at.
        u: (K, 7) increments.
        covariances: (K, 3, 3) of their noise.
    """

    def linearised(states: Array, _border: Array) -> Linear:
        before = states[at]
        F, _ = linearise(before[:, N_POSE:], u)
        end = compose(before[:, :N_POSE], corrected(before[:, N_POSE:], u))
        r = between(end, states[at + 1, :N_POSE])
        back = np.tile(-np.eye(3), (len(at), 1, 1))  # how r changes with the error of ``end``
        back[:, 0, 2], back[:, 1, 2] = r[:, 1], -r[:, 0]
        return Linear(r, back @ F, _widened(in_map(r[:, 2])))

    return Factor(linearised, whitening(covariances + LEAST), at)


def calibration_walk(at: Indices, u: Array, params: FuseParams) -> Factor:
    """Return the factor that holds the calibration before and after increments together."""
    there = np.zeros((len(at), 3, N_STATE))
    there[:, :, N_POSE:] = np.eye(3)

    def linearised(states: Array, _border: Array) -> Linear:
        return Linear(states[at + 1, N_POSE:] - states[at, N_POSE:], -there, there)

    sigmas = np.sqrt(walk_variances(u, params) + _LEAST_WALK**2)
    return Factor(linearised, np.eye(3) / sigmas[:, None, :], at)


def calibration_starts(at: Indices, params: FuseParams) -> Factor:
    """Return the factor of what is known of the calibration where the estimate begins."""
    expected, sigmas = start_calibration(params)
    here = np.zeros((len(at), 3, N_STATE))
    here[:, :, N_POSE:] = np.eye(3)

    def linearised(states: Array, _border: Array) -> Linear:
        return Linear(states[at, N_POSE:] - expected, here)

    return Factor(linearised, np.tile(np.diag(1.0 / np.maximum(sigmas, _LEAST_WALK)), (len(at), 1, 1)), at)


def survey(n_marks: int, params: FuseParams) -> Factor:
    """Return the factor of what is known of the survey errors of the marks."""
    columns = np.arange(3 * n_marks).reshape(n_marks, 3)
    one = np.tile(np.eye(3), (n_marks, 1, 1))

    def linearised(_states: Array, border: Array) -> Linear:
        return Linear(border.reshape(-1, 3), by_border=one)

    return Factor(linearised, one / survey_sigmas(params)[:, None], columns=columns)


def anywhere(guess: Array) -> Factor:
    """Return the factor that holds every state near its guess (N, 6), so weakly that only lost ones feel it."""
    here = np.zeros((len(guess), 3, N_STATE))
    here[:, :, :N_POSE] = np.eye(3)

    def linearised(states: Array, _border: Array) -> Linear:
        return Linear(_minus(states[:, :N_POSE], guess[:, :N_POSE]), _widened(in_map(states[:, 2])))

    return Factor(linearised, np.tile(np.eye(3) / _WEAK, (len(guess), 1, 1)), np.arange(len(guess)))


def _minus(poses: Array, others: Array) -> Array:
    """Return poses (K, 3) minus others, headings the short way round."""
    r = poses - others
    r[:, 2] = difference(poses[:, 2], others[:, 2])
    return r


def _widened(by_pose: Array) -> Array:
    """Return sensitivities to a pose (K, 3, 3) as those to a state (K, 3, 6)."""
    by_state = np.zeros((len(by_pose), 3, N_STATE))
    by_state[:, :, :N_POSE] = by_pose
    return by_state
