"""The Kalman filter of ``fuse-poses``: pose, calibration of the odometry, and survey errors of the marks seen so far.

::

    begin     X = z,  P from the noise of the sighting and the survey of its mark, both remembered
    predict   X <- X o step(u),  P <- F P F' + Q                          (motion.py)
    sighting  r = z - found(X, survey error),  gate, correct              (mark_errors.py, estimation/kalman.py)

A sighting that looks like the last one of the same mark because the robot hardly moved has the same noise again (the
edges fall on the same pixels): its covariance is divided by its news, tanh of the way, turn and time since then in
units of ``news_*``. The gate takes it as it is.
"""

from collections import Counter
from typing import Self, TypeAlias

import numpy as np
import numpy.typing as npt

from ..estimation.kalman import Innovation, correct, innovation, predict
from ..geometry.angles import difference
from ..geometry.motion import Increment
from ..geometry.se2 import compose, in_map
from ..odometry.noise import corrected, start_calibration, step_noise, walk_variances
from .mark_errors import displaced, survey_sigmas
from .motion import LEAST, N_POSE, N_STATE, linearise
from .params import FuseParams
from .view import Seen

Array: TypeAlias = npt.NDArray[np.float64]

_NO_NEWS = 1e-6


class PoseFilter:
    """One estimate of the robot.

    Attributes:
        pose: (3,) in the map [m, m, rad].
        calibration: (3,) speed scale, turn scale [1], turn bias [rad/s].
        errors: (M, 3) survey errors of the marks seen so far [m, m, rad].
        P: (6 + 3 M, 6 + 3 M) covariance; the pose's part in the robot's frame.
        marks: index of a mark in the map -> row of ``errors``.
        taken: sightings of each mark that were taken for true.
    """

    def __init__(self, places: Array, params: FuseParams, pose: Array, cov: Array) -> None:
        """Begin at a pose.

        Args:
            places: (L, 2) where the marks hang [m].
            params: noise and gates.
            pose: (3,) [m, m, rad].
            cov: (3, 3) of it in the map.
        """
        self.places, self.params = places, params
        self.calibration, sigmas = start_calibration(params)
        self.pose = np.array(pose, dtype=np.float64)
        self.errors = np.zeros((0, 3))
        self.marks: dict[int, int] = {}
        self.P = np.zeros((N_STATE, N_STATE))
        turn = in_map(float(self.pose[2]))
        self.P[:N_POSE, :N_POSE] = turn.T @ (cov + LEAST) @ turn
        self.P[N_POSE:, N_POSE:] = np.diag(sigmas**2)
        self.taken: Counter[int] = Counter()
        self._gone = np.zeros(3)
        self._last: dict[int, Array] = {}  # what had gone when a mark was seen last

    @classmethod
    def begin(cls, places: Array, params: FuseParams, seen: Seen) -> Self:
        """Begin where a sighting says, with the survey error of its mark in mind."""
        made = cls(places, params, seen.pose, seen.cov)
        made._meet(seen.mark)
        _, by_pose, by_error = displaced(made.pose, places[seen.mark], np.zeros(3))
        pull = -by_pose.T @ by_error  # by_pose is a rotation: this is how the pose moves with the error
        survey = made.P[N_STATE:, N_STATE:]
        made.P[:N_POSE, :N_POSE] += pull @ survey @ pull.T
        made.P[:N_POSE, N_STATE:] = pull @ survey
        made.P[N_STATE:, :N_POSE] = made.P[:N_POSE, N_STATE:].T
        made._take(seen.mark)
        return made

    def predict(self, u: Increment) -> None:
        """Follow one increment of odometry, short enough that its curve hardly changes with the scales."""
        n = np.array(u)
        F = np.eye(N_STATE)
        F[:N_POSE], G = linearise(self.calibration, n)
        Q = np.zeros((N_STATE, N_STATE))
        Q[:N_POSE, :N_POSE] = step_noise(n, G, self.params)
        Q[N_POSE:, N_POSE:] = np.diag(walk_variances(n, self.params))
        self.pose = compose(self.pose, corrected(self.calibration, n))
        self.P = predict(self.P, F, Q)
        self._gone = self._gone + np.array([u.length, u.turn, u.dt])

    def expect(self, seen: Seen) -> Innovation:
        """Return what a sighting says against the estimate."""
        self._meet(seen.mark)
        row = self.marks[seen.mark]
        found, by_pose, by_error = displaced(self.pose, self.places[seen.mark], self.errors[row])
        residual = seen.pose - found
        residual[2] = difference(seen.pose[2], found[2])
        H = np.zeros((3, len(self.P)))
        H[:, :N_POSE] = by_pose
        H[:, N_STATE + 3 * row : N_STATE + 3 * row + 3] = by_error
        return innovation(self.P, residual, H, seen.cov + LEAST)

    def news(self, mark: int) -> float:
        """Return how much of a sighting of a mark is new, from next to 0 (the same image again) to 1."""
        if mark not in self._last:
            return 1.0
        scales = [self.params.news_length_m, self.params.news_turn_rad, self.params.news_s]
        return max(float(np.tanh(np.sum((self._gone - self._last[mark]) / scales))), _NO_NEWS)

    def correct(self, seen: Seen) -> float:
        """Take a sighting for true; return its news."""
        news = self.news(seen.mark)
        expected = self.expect(seen)
        more = (1.0 / news - 1.0) * expected.R
        error, self.P = correct(self.P, expected._replace(R=expected.R + more, S=expected.S + more))
        self.pose = compose(self.pose, error[:N_POSE])
        self.calibration = self.calibration + error[N_POSE:N_STATE]
        self.errors = self.errors + error[N_STATE:].reshape(-1, 3)
        self._take(seen.mark)
        return news

    def covariance(self) -> Array:
        """Return the covariance (3, 3) of the pose in the map."""
        turn = in_map(float(self.pose[2]))
        return np.asarray(turn @ self.P[:N_POSE, :N_POSE] @ turn.T)

    def _take(self, mark: int) -> None:
        self.taken[mark] += 1
        self._last[mark] = self._gone

    def _meet(self, mark: int) -> None:
        """Make room for the survey error of a mark that was not seen before."""
        if mark in self.marks:
            return
        n = len(self.P)
        self.marks[mark] = len(self.errors)
        self.errors = np.vstack([self.errors, np.zeros(3)])
        P = np.zeros((n + 3, n + 3))
        P[:n, :n] = self.P
        P[n:, n:] = np.diag(survey_sigmas(self.params) ** 2)
        self.P = P
