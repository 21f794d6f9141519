"""The particle filter as published, method ``paper``, errata of the print corrected or switchable.

Table 2, motion of a particle, with its own noise per step::

    v^ = v + sample(a1 v^2 + a2 w^2)      w^ = w + sample(a3 v^2 + a4 w^2)      g^ = sample(a5 v^2 + a6 w^2)
    x' = x + arc(v^, w^, dt)              theta' = theta + w^ dt + g^ dt

Table 1, the landmark of a detection: of the N landmarks nearest to the particle the one that maximises P_r
P_b. Eqs (4)-(9), for horizontal range r and bearing b of every detection, each with its landmark::

    w = prod P_r P_b,     P(z, z*) = exp(-(z - z*)^2 / (2 sigma^2)) / sqrt(2 pi sigma^2)

Roulette resampling after every image in which a landmark was seen.

Differs from the print in: products are sums of logarithms; the bearing's residual is wrapped; Table 1 loops
over the detections too, and the answer has an index per particle; ``arc`` is finite at w = 0 (0/0 in print);
range is the horizontal one on both sides (eq. 1 is the slant range, the map is flat). ``exponent: 2pi``
restores the printed denominator 2 pi sigma^2, which is no normal density; ``noise_as: variance`` reads b as a
variance. Not in the paper: when all weights are zero the cloud stays as it is, and that is counted; the reported
id is the vote of the cloud.
"""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from ..estimation.gaussian import pose_moments, sample
from ..estimation.resampling import roulette
from ..estimation.weights import effective_sample_size, normalise, uniform
from ..geometry.angles import difference, wrap
from ..geometry.motion import Increment, arc
from ..geometry.se2 import compose, exp, transform
from .association import CLUTTER, Indices, vote
from .filter import Update
from .params import Alphas, LocalizePfParams

Array: TypeAlias = npt.NDArray[np.float64]

_TINY = np.log(np.finfo(np.float64).tiny)
"""Products below this are zero in double precision; in logarithms they would not be."""


def sample_motion_model_velocity(
    poses: Array, u: tuple[float, float, float], alphas: Alphas, normal: Array, *, noise_as: str = "std"
) -> Array:
    """Move particles by one step of Table 2.

    Args:
        poses: (N, 3) [m, m, rad].
        u: speed [m/s], turn rate [rad/s], time step [s].
        alphas: a1..a6, units absorbed.
        normal: (N, 3) standard normal numbers.
        noise_as: "std", sample(b) has standard deviation b as the text says, or "variance".

    Returns:
        (N, 3) moved poses.
    """
    v, w, dt = u
    a = np.array(alphas).reshape(3, 2)
    b = a @ np.array([v * v, w * w])
    noise = normal * (b if noise_as == "std" else np.sqrt(b))
    moved = arc(poses, v + noise[:, 0], w + noise[:, 1], dt)
    moved[:, 2] = wrap(moved[:, 2] + noise[:, 2] * dt)
    return moved


def log_gaussian(residual: Array, sigma: float, exponent: str = "2") -> Array:
    """Return the logarithm of eqs (4), (5), (8), (9); ``exponent`` "2pi" is as printed, "2" a normal density."""
    denominator = 2.0 if exponent == "2" else 2.0 * np.pi
    return np.asarray(-(residual**2) / (denominator * sigma**2) - 0.5 * np.log(2.0 * np.pi * sigma**2))


class PaperFilter:
    """Tables 1 and 2 with eqs (4)-(9); the same face as ``ParticleFilter``."""

    def __init__(self, landmarks: Array, map_variance: float, params: LocalizePfParams) -> None:
        """Take the map: landmarks (L, 2) [m]; its survey error is not in the paper."""
        del map_variance
        self.landmarks = landmarks
        self.params = params
        self.rng = np.random.default_rng(params.seed)

    def start(self, pose: Array, pose_cov: Array) -> None:
        """Place the cloud around a pose (3,) with covariance (3, 3) in the robot's frame."""
        n = self.params.particles
        self.poses = compose(np.tile(pose, (n, 1)), exp(sample(pose_cov, n, self.rng)))
        self.log_w = uniform(n)

    def predict(self, u: Increment) -> None:
        """Table 2, for the speed and turn rate that the increment amounts to."""
        if u.dt <= 0.0:
            return
        half = 0.5 * u.dtheta
        chord = (u.dx * np.cos(half) + u.dy * np.sin(half)) / np.sinc(half / np.pi)
        step = (chord / u.dt, u.dtheta / u.dt, u.dt)
        normal = self.rng.standard_normal((len(self.poses), 3))
        self.poses = sample_motion_model_velocity(
            self.poses, step, self.params.alphas, normal, noise_as=self.params.noise_as
        )

    def search(self, dt: float) -> None:
        """Do nothing: the paper has no search."""

    def update(self, z: Array, R: Array, given: Indices | None = None) -> Update:
        """Weigh by eqs (7)-(9) with the ids of Table 1, and resample; a cloud that learnt nothing stays as it is.

        Args:
            z: (n, 2) in the robot's frame [m].
            R: (n, 2, 2), not used: the paper has one sigma per kind.
            given: (n,) indices of the landmarks where they are known; the others are left out.
        """
        del R
        n, N = len(z), len(self.poses)
        answers = np.full((N, n), CLUTTER)
        surprise = np.zeros(n)
        product = np.zeros(N)
        nearest = self._nearest(self.poses[:, :2]) if self.params.nearest_to == "particle" else None
        for i in range(n):
            if given is not None and given[i] == CLUTTER:
                continue
            if given is not None:
                options = np.full((N, 1), given[i])
            elif nearest is not None:
                options = nearest
            else:
                options = self._nearest(transform(self.poses, z[i]))
            log_p = self._belief(z[i], options)
            best = np.argmax(log_p, axis=1)  # Table 1, line 4
            answers[:, i] = options[np.arange(N), best]
            log_p_best = log_p[np.arange(N), best]
            surprise[i] = self._surprise(log_p_best + self.log_w, z[i])
            product += log_p_best  # eq. (7)
        underflow = n > 0 and float(product.max()) < _TINY
        if not underflow:
            self.log_w, _ = normalise(self.log_w + product)
        ess, w = effective_sample_size(self.log_w), np.exp(self.log_w)
        matches = np.array([vote(answers[:, i], w) for i in range(n)], dtype=np.intp)
        resampled = not underflow and bool(np.any(answers != CLUTTER))
        if resampled:
            self.poses = self.poses[roulette(w, self.rng)]
            self.log_w = uniform(N)
        return Update(matches, surprise, ess, resampled, underflow)

    def _nearest(self, points: Array) -> Indices:
        """Return (N, n_nearest) indices of the landmarks nearest to points (N, 2), Table 1, line 2."""
        n = min(self.params.n_nearest, len(self.landmarks))
        centre = points.mean(axis=0)
        spread = float(np.max(np.hypot(*(points - centre).T)))
        distance = np.hypot(*(self.landmarks - centre).T)
        # The n landmarks nearest to the centre are within this distance of every point, so nothing farther can count.
        near = np.flatnonzero(distance <= np.partition(distance, n - 1)[n - 1] + 2.0 * spread)
        square = np.sum((points[:, None, :] - self.landmarks[None, near, :]) ** 2, axis=2)
        if len(near) == n:
            return np.tile(near, (len(points), 1))
        return near[np.sort(np.argpartition(square, n - 1, axis=1)[:, :n], axis=1)]

    def _belief(self, z: Array, options: Indices) -> Array:
        """Return (N, n) log P_r P_b of eqs (4)-(6)."""
        offset = self.landmarks[options] - self.poses[:, None, :2]
        r = np.hypot(offset[..., 0], offset[..., 1])
        b = np.arctan2(offset[..., 1], offset[..., 0]) - self.poses[:, None, 2]
        p = self.params
        log_r = log_gaussian(float(np.hypot(z[0], z[1])) - r, p.sigma_range_m, p.exponent)
        bearing = float(np.arctan2(z[1], z[0]))
        log_b = log_gaussian(difference(bearing, b), np.radians(p.sigma_bearing_deg), p.exponent)
        return log_r + log_b

    def _surprise(self, log_density: Array, z: Array) -> float:
        """Return the density per square metre under the cloud, over that of clutter, as a logarithm."""
        top = float(log_density.max())
        evidence = top + float(np.log(np.exp(log_density - top).sum()))
        r = max(float(np.hypot(z[0], z[1])), self.params.sigma_range_m)  # dr db covers r dr db square metres
        return max(evidence - float(np.log(r)), -50.0) + float(np.log(self.params.clutter_area_m2))

    def estimate(self) -> tuple[Array, Array]:
        """Return mean pose (3,) and covariance (3, 3) of the cloud in the map."""
        return pose_moments(self.poses, np.exp(self.log_w))

    def elsewhere(self) -> float:
        """Return the weight of particles farther than ``ambiguous_m`` from the mean."""
        mean, _ = self.estimate()
        far = np.sum((self.poses[:, :2] - mean[:2]) ** 2, axis=1) > self.params.ambiguous_m**2
        return float(np.exp(self.log_w)[far].sum())
