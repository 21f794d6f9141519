"""The smoother of ``fuse-poses``: the likeliest way through the whole log, from what the filter remembered of it.

States are the places of the robot with the calibration of its odometry, chained by the increments; the border are the
survey errors of the marks, which are the same at all times. Three passes, each from where the one before ended:

1. Huber's loss with the sightings and start poses that the filter took, which finds the way. What the filter took
   later than its poses is now behind all of them.
2. Geman and McClure's with all of them, which lets go of what does not lie on it.
3. Least squares with those that pass the gate, so that covariances are those of good measurements.

Increments are trusted: a stiff false sighting could break two of them, and look good. Where the filter had to begin
anew (``history.py``) the chain is cut, as a stiff false increment would bend all it is tied to. It is joined again in
pass 3 if both ends lie as the increment says, within what pass 2 knows of them.
"""

from collections.abc import Iterator
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from ..estimation.gaussian import LOST
from ..estimation.kalman import chi_square
from ..estimation.losses import SQUARES, Loss
from ..estimation.smoothing import Factor, Smoothed, smooth
from ..geometry.se2 import compose, in_map
from ..odometry.noise import step_noise
from . import factors
from .history import History
from .motion import LEAST, N_POSE, linearise
from .params import FuseParams
from .tracker import Estimate, Status

Array: TypeAlias = npt.NDArray[np.float64]
Indices: TypeAlias = npt.NDArray[np.intp]
Mask: TypeAlias = npt.NDArray[np.bool_]

_ROUGH, _FINE = 1e-2, 1e-12
"""Passes 1 and 2, and pass 3, end when a step gains less than this (a squared length in standard deviations)."""

_PATIENCE = 15
"""Steps of passes 1 and 2: what lies between good and false goes on moving by little for long."""


class Way(NamedTuple):
    """What the smoother found.

    Attributes:
        result: states (N, 6), their covariances, and survey errors as its border.
        marks: (M,) index in the map of each mark in the border.
        is_kept: (K,) which sightings of the history were taken for true.
        broken: (B,) nodes to which no good increment leads, though the filter thought one would.
    """

    result: Smoothed
    marks: Indices
    is_kept: Mask
    broken: Indices


def smooth_way(history: History, places: Array, params: FuseParams) -> Way:
    """Find the likeliest way.

    Args:
        history: at least one node.
        places: (L, 2) where the marks hang [m].
        params: noise and gates.
    """
    problem = _Problem(history, places, params)
    most = chi_square(params.gate, N_POSE)
    scale = float(np.sqrt(most))
    none = np.zeros(len(problem.doubted), dtype=bool)
    taken = _Trust(Loss("huber", scale), problem.seen.is_taken, problem.starts.is_taken, none)
    result = problem.solve(history.states, np.zeros(3 * len(problem.marks)), taken)
    every = _Trust(Loss("geman-mcclure", scale), np.ones_like(taken.sightings), np.ones_like(taken.starts), none)
    result = problem.solve(result.states, result.border, every)
    seen, starts = result.squares[:2]
    good = _Trust(SQUARES, seen <= most * problem.seen.news, starts <= most, problem.gaps(result) <= most)
    result = problem.solve(result.states, result.border, good)
    return Way(result, problem.marks, good.sightings, problem.doubted[~good.doubted] + 1)


def poses_along(history: History, way: Way) -> Iterator[tuple[int, Estimate]]:
    """Yield the stamp [ns] and the smoothed pose wherever the filter was asked for one.

    Where an increment was broken the robot was carried, or slipped, some time before the next sighting; until there it
    is ``lost``.
    """
    matched = np.bincount(history.sightings.at[way.is_kept], minlength=len(history))
    lost = np.zeros(len(history), dtype=bool)
    for node in way.broken:
        seen = np.flatnonzero(matched[node:])
        lost[node : node + seen[0] if len(seen) else None] = True
    for node, (stamp, n_seen) in history.asked.items():
        pose = way.result.states[node, :N_POSE]
        turn = in_map(float(pose[2]))
        cov = turn @ way.result.covariances[node, :N_POSE, :N_POSE] @ turn.T
        n = int(matched[node])
        status: Status = "lost" if lost[node] else "tracking" if n else "dead-reckoning"
        yield stamp, Estimate(pose, cov + LOST if lost[node] else cov, status, n_seen, n)


class _Trust(NamedTuple):
    """What a pass takes for true.

    Attributes:
        loss: of sightings and start poses.
        sightings, starts, doubted: (K,), (S,), (D,) which sightings, start poses and doubted increments are used.
    """

    loss: Loss
    sightings: Mask
    starts: Mask
    doubted: Mask


class _Problem:
    """The measurements of a log."""

    def __init__(self, history: History, places: Array, params: FuseParams) -> None:
        self.params = params
        self.seen, self.starts, self.steps = history.sightings, history.starts, history.steps
        self.links = np.flatnonzero(history.linked) - 1  # the nodes that increments begin at
        self.doubted = np.array(history.doubted, dtype=np.intp) - 1
        self.begun = np.flatnonzero(~history.linked)
        self.marks, self.rows = np.unique(self.seen.mark, return_inverse=True)
        self.places = places[self.seen.mark]

    def solve(self, states: Array, border: Array, trust: _Trust) -> Smoothed:
        """Smooth from a start; the first squares are those of sightings and of start poses."""
        used = trust.sightings
        parts = [
            factors.sightings(self.seen.where(used), self.places[used], self.rows[used], trust.loss),
            factors.starts(self.starts.where(trust.starts), trust.loss),
            self._increments(states, np.setdiff1d(self.links, self.doubted[~trust.doubted])),
            factors.calibration_walk(self.links, self.steps[self.links + 1], self.params),
            factors.calibration_starts(self.begun, self.params),
            factors.survey(len(self.marks), self.params),
            factors.anywhere(states),
        ]
        if trust.loss is SQUARES:
            return smooth(states, parts, _add, border=border, tolerance=_FINE)
        return smooth(states, parts, _add, border=border, iterations=_PATIENCE, tolerance=_ROUGH)

    def gaps(self, result: Smoothed) -> Array:
        """Return how far the ends of doubted increments lie apart (D,), squared, in standard deviations."""
        at = self.doubted
        linear = self._increments(result.states, at).linearise(result.states, result.border)
        S = self._noise(result.states, at) + LEAST
        for J, node in ((linear.by_state, at), (linear.by_next, at + 1)):
            if J is not None:
                S = S + J @ result.covariances[node] @ np.swapaxes(J, 1, 2)
        r = linear.residual[..., None]
        return np.asarray((np.swapaxes(r, 1, 2) @ np.linalg.solve(S, r))[:, 0, 0])

    def _increments(self, states: Array, at: Indices) -> Factor:
        return factors.increments(at, self.steps[at + 1], self._noise(states, at))

    def _noise(self, states: Array, at: Indices) -> Array:
        """Return the covariances (K, 3, 3) of the increments that begin at nodes (K,)."""
        u = self.steps[at + 1]
        _, G = linearise(states[at, N_POSE:], u)
        return step_noise(u, G, self.params)


def _add(states: Array, errors: Array) -> Array:
    """Add errors (N, 6) to states (N, 6)."""
    poses = compose(states[:, :N_POSE], errors[:, :N_POSE])
    return np.concatenate([poses, states[:, N_POSE:] + errors[:, N_POSE:]], axis=1)
