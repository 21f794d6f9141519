"""The particle filter of ``localize-pf``, method ``best``.

Every particle is a small Gaussian, and all share its covariance P (``motion.py``): where the robot is known
well the filter is an extended Kalman filter with bias states that does not waste a random number; where P
grows beyond a kernel width (a wide start, a long way without landmarks) it is split exactly into a cloud
(``estimation/gaussian.py``) and the particles do what no Gaussian can: stand at several places, and mean
several landmarks, until it is decided. For each image::

    1. drive      X <- X o u, P <- F P F^T + Q                           (Table 2 of the paper)
    2. spread     P wider than the kernel: draw means, narrow P
    3. for each sighting, the most precise first:
         weigh    w <- w [(1 - eps) sum_l N(d_l; 0, S) + eps / A]^news    (eqs 7-9, in robot coordinates)
         draw     l ~ N(d_l; 0, S), each landmark once per particle       (Table 1)
         correct  X <- X exp(K d_l), P <- P - rho K S K^T,  K = P H^T S^-1
    4. resample   systematically, when 1 / sum w^2 < N / 2 or a weight has vanished, and the robot has moved

rho is the weight of the particles that took the sighting for a landmark; news, between 0 and 1, is how far the robot
has moved since the last image (``likelihood.py``).

Differs from the paper in: sums of logarithms; robot coordinates instead of range and bearing, whose error has
no constant spread near the zenith; all landmarks in reach instead of the N nearest; the floor eps / A; a draw
instead of the likeliest; errors that are common to an image or last longer than it (shift, survey error,
scales, bias).
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from ..estimation.gaussian import largest_variance, log_density, pose_covariance, pose_moments, split
from ..estimation.resampling import systematic
from ..estimation.weights import effective_sample_size, log_sum_exp, normalise, uniform
from ..geometry.motion import Increment
from ..geometry.se2 import compose, exp, in_map, transform
from .association import CLUTTER, Indices, candidates, draw, forbid_used, vote
from .likelihood import LEAST_M2, innovations, map_noise, novelty, sensitivity
from .motion import N_AUX, SHIFT, SPEED, TURN, Cloud, drive, start_covariance
from .params import LocalizePfParams

Array: TypeAlias = npt.NDArray[np.float64]

_MOVED_M, _MOVED_RAD = 0.005, 0.005
"""A robot that moved less since the last resampling stands still: the same images must not thin the cloud."""


_PRUNE = 1e-3
"""A particle below this part of an equal weight goes. Kept for ever, one of them needs only a few false landmarks that
hold still (another robot, a lamp that is not in the map) to be preferred to all that followed the true ones."""


@dataclass(frozen=True, slots=True, eq=False)
class Update:
    """What one image did.

    Attributes:
        matches: (n,) index of the landmark each sighting is, or CLUTTER.
        surprise: (n,) logarithm of the sighting's density under the cloud, over that of clutter.
        ess: effective number of particles before resampling.
        resampled: whether the cloud was drawn anew.
        underflow: whether all weights were zero, so that the cloud was kept as it is.
    """

    matches: Indices
    surprise: Array
    ess: float
    resampled: bool = False
    underflow: bool = False


class ParticleFilter:
    """A cloud of poses on a map of landmarks that look alike."""

    def __init__(self, landmarks: Array, map_variance: float, params: LocalizePfParams) -> None:
        """Take the map: landmarks (L, 2) [m] and the variance of their survey per axis [m^2]."""
        self.landmarks = landmarks
        self.map_variance = map_variance
        self.params = params
        self.rng = np.random.default_rng(params.seed)
        self.moved = Increment()  # since the last resampling
        self.since_seen = Increment(dt=np.inf)

    def start(self, pose: Array, pose_cov: Array) -> None:
        """Place the cloud at a pose (3,) with covariance (3, 3) in the robot's frame."""
        n = self.params.particles
        aux = np.zeros((n, N_AUX))
        aux[:, SPEED], aux[:, TURN] = self.params.speed_scale, self.params.turn_scale
        P = start_covariance(pose_cov, self.params)
        self.cloud = Cloud(np.tile(pose, (n, 1)), aux, uniform(n), P)
        self.since_seen = Increment(dt=np.inf)
        self.spread()

    def predict(self, u: Increment) -> None:
        """Follow the odometry, and spread the cloud where it has become uncertain."""
        drive(self.cloud, u, self.params)
        self.moved = self.moved.then(u)
        self.since_seen = self.since_seen.then(u)
        self.spread()

    def search(self, dt: float) -> None:
        """Let every fourth particle wander for ``dt`` [s] while the robot is lost; others stay in case it is not."""
        sigma = np.array([self.params.lost_sigma_m] * 2 + [np.radians(self.params.lost_sigma_deg)]) * np.sqrt(dt)
        some = slice(3, None, 4)
        wandering = self.cloud.poses[some]
        offsets = sigma * self.rng.standard_normal((len(wandering), 3))
        self.cloud.poses[some] = compose(wandering, exp(offsets))

    def spread(self) -> None:
        """Split the Gaussian of the particles if it is wider than the kernel."""
        cloud, width_m, width_rad = self.cloud, self.params.kernel_m, np.radians(self.params.kernel_deg)
        if largest_variance(cloud.P[:2, :2]) <= width_m**2 and cloud.P[2, 2] <= width_rad**2:
            return
        offsets, cloud.P = split(cloud.P, pose_covariance(width_m, width_rad), len(cloud.poses), self.rng)
        cloud.poses = compose(cloud.poses, exp(offsets[:, :3]))
        cloud.aux += offsets[:, 3:]

    def update(self, z: Array, R: Array, given: Indices | None = None) -> Update:
        """Weigh, associate and correct with the sightings of one image.

        Args:
            z: (n, 2) in the robot's frame [m].
            R: (n, 2, 2) covariances [m^2].
            given: (n,) indices of the landmarks where they are known, CLUTTER where it is known to be none.
        """
        n, cloud = len(z), self.cloud
        answers = np.full((len(cloud.poses), n), CLUTTER)
        surprise = np.zeros(n)
        white = self.params.sighting_sigma_m**2
        R = R + (LEAST_M2 + white + map_noise(self.map_variance, self.since_seen, self.params)) * np.eye(2)
        order = np.argsort(np.trace(R, axis1=1, axis2=2), kind="stable")
        news = novelty(self.since_seen, self.params)
        for k, i in enumerate(order):
            known = None if given is None else int(given[i])
            answers[:, i], surprise[i] = self._explain(z[i], R[i], answers[:, order[:k]], known, news)
        if n:
            self.since_seen = Increment()
        ess = effective_sample_size(cloud.log_w)
        w = np.exp(cloud.log_w)
        matches = np.array([vote(answers[:, i], w) for i in range(n)], dtype=np.intp)
        return Update(matches, surprise, ess, resampled=n > 0 and self._resample(ess))

    def _explain(self, z: Array, R: Array, used: Indices, known: int | None, news: float) -> tuple[Indices, float]:
        """Let every particle weigh, draw and correct with one sighting.

        Args:
            z: the sighting (2,) [m].
            R: its covariance (2, 2) [m^2].
            used: (N, m) answers to the earlier sightings of the image.
            known: index of the landmark if it is known, CLUTTER if it is known to be none, else None.
            news: how much of the evidence is new.

        Returns:
            Answers (N,), and the logarithm of the sighting's density over that of clutter.
        """
        cloud = self.cloud
        H = sensitivity(z)
        PHt = cloud.P @ H.T
        S = H @ PHt + R
        seen = transform(cloud.poses, z - cloud.aux[:, SHIFT])
        near = candidates(seen, self.landmarks, S) if known is None else _only(known)
        d = innovations(seen, cloud.poses[:, 2], self.landmarks[near])
        log_p = self._densities(d, S)
        options = np.concatenate([[CLUTTER], near])
        forbid_used(log_p, options, used)

        evidence = self._weigh(log_p, news)
        answers = draw(log_p, options, self.rng)
        taken = np.flatnonzero(answers != CLUTTER)
        if len(taken):
            self._correct(taken, d[taken, np.searchsorted(near, answers)[taken]], PHt, S)
        return answers, evidence + float(np.log(self.params.clutter_area_m2))

    def _densities(self, d: Array, S: Array) -> Array:
        """Return the logarithms (N, L + 1) of what clutter and each landmark would give the sighting.

        Args:
            d: innovations (N, L, 2) [m].
            S: their covariance (2, 2) [m^2].
        """
        eps = self.params.clutter
        log_p = np.empty((d.shape[0], d.shape[1] + 1))
        log_p[:, 0] = np.log(eps / self.params.clutter_area_m2)
        log_p[:, 1:] = np.log1p(-eps) + log_density(d, S)
        return log_p

    def _weigh(self, log_p: Array, news: float) -> float:
        """Multiply the weights by what particles gave the sighting, to the power of its news; return the evidence."""
        log_l = log_sum_exp(log_p)
        evidence = float(log_sum_exp(self.cloud.log_w + log_l))
        self.cloud.log_w, _ = normalise(self.cloud.log_w + news * log_l)
        return evidence

    def _correct(self, rows: Indices, d: Array, PHt: Array, S: Array) -> None:
        """Move the particles of these rows by their innovations (n, 2), and narrow what all share by their weight."""
        cloud = self.cloud
        K = np.linalg.solve(S, PHt.T).T
        correction = d @ K.T
        cloud.poses[rows] = compose(cloud.poses[rows], exp(correction[:, :3]))
        cloud.aux[rows] += correction[:, 3:]
        rho = float(np.exp(cloud.log_w[rows]).sum())
        P = cloud.P - rho * (K @ PHt.T)
        cloud.P = 0.5 * (P + P.T)

    def _resample(self, ess: float) -> bool:
        """Draw the cloud anew if few particles hold the weight; not while the robot stands."""
        cloud = self.cloud
        stands = self.moved.length < _MOVED_M and self.moved.turn < _MOVED_RAD
        n = len(cloud.log_w)
        if stands or (ess >= 0.5 * n and cloud.log_w.min() > np.log(_PRUNE / n)):
            return False
        chosen = systematic(np.exp(cloud.log_w), self.rng)
        cloud.poses, cloud.aux = cloud.poses[chosen], cloud.aux[chosen]
        cloud.log_w = uniform(len(chosen))
        self.moved = Increment()
        return True

    def estimate(self) -> tuple[Array, Array]:
        """Return mean pose (3,) and covariance (3, 3) in the map: spread of the cloud plus width of a particle."""
        mean, between = pose_moments(self.cloud.poses, np.exp(self.cloud.log_w))
        turn = in_map(mean[2])
        cov = between + turn @ self.cloud.P[:3, :3] @ turn.T
        return mean, 0.5 * (cov + cov.T)

    def elsewhere(self) -> float:
        """Return the weight of particles farther than ``ambiguous_m`` from the weighted median of each axis."""
        w = np.exp(self.cloud.log_w)
        xy = self.cloud.poses[:, :2]
        if float(np.max(np.ptp(xy, axis=0))) < 0.5 * self.params.ambiguous_m:
            return 0.0
        centre = _median(xy, w)
        far = np.sum((xy - centre) ** 2, axis=1) > self.params.ambiguous_m**2
        return float(w[far].sum())


def _only(known: int) -> Indices:
    """Return the landmarks that a sighting may be which is known to be this one, or none of them."""
    return np.array([] if known == CLUTTER else [known], dtype=np.intp)


def _median(xy: Array, w: Array) -> Array:
    """Return the weighted median of each axis on its own (2,).

    While one group of particles has more than half of the weight, it lies inside that group, unlike the mean.
    """
    half = []
    for axis in (0, 1):
        order = np.argsort(xy[:, axis], kind="stable")
        half.append(xy[order[np.searchsorted(np.cumsum(w[order]), 0.5)], axis])
    return np.array(half)
