"""Gaussians: moments of a weighted cloud of planar poses, sampling, and exact splitting."""

import math
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from ..geometry.angles import circular_mean, difference, wrap

Array: TypeAlias = npt.NDArray[np.float64]

LOG_2PI = float(np.log(2.0 * np.pi))


def pose_moments(poses: Array, w: Array) -> tuple[Array, Array]:
    """Return mean and covariance of weighted planar poses, the heading on the circle.

    Args:
        poses: (N, 3) [m, m, rad].
        w: (N,) weights, sum one.

    Returns:
        Mean (3,), heading in (-pi, pi], and covariance (3, 3), symmetric and not negative.
    """
    xy = w @ poses[:, :2]
    heading = circular_mean(poses[:, 2], w)
    d = np.column_stack([poses[:, :2] - xy, difference(poses[:, 2], heading)])
    shift = float(w @ d[:, 2])  # the mean of the differences is not exactly zero on a circle
    d[:, 2] -= shift
    return np.array([xy[0], xy[1], float(wrap(heading + shift))]), (d * w[:, None]).T @ d


def pose_covariance(sigma_m: float, sigma_rad: float) -> Array:
    """Return the covariance (3, 3) of a planar pose, x and y equally uncertain and nothing correlated."""
    return np.diag(np.square([sigma_m, sigma_m, sigma_rad]))


LOST = pose_covariance(1.0, 0.5)
"""A pose reported while lost is never said to be more certain than this [m^2, m^2, rad^2]."""


def largest_variance(S: Array) -> float:
    """Return the larger eigenvalue of a symmetric (2, 2) matrix."""
    a, b, c = float(S[0, 0]), float(S[0, 1]), float(S[1, 1])
    return 0.5 * (a + c) + math.hypot(0.5 * (a - c), b)


def sample(cov: Array, n: int, rng: np.random.Generator) -> Array:
    """Draw (n, d) zero-mean vectors of covariance (d, d), which may be singular."""
    # The Cholesky factor turns with a rigid move of the world as a whole, eigenvectors may flip their sign.
    d = len(cov)
    jitter = 1e-12 * max(float(np.max(np.diag(cov))), 1e-30)
    return rng.standard_normal((n, d)) @ np.linalg.cholesky(cov + jitter * np.eye(d)).T


def split(P: Array, kernel: Array, n: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Cut a Gaussian into n narrower ones whose mixture has the same distribution.

    Imagine that the first k components are measured with noise ``kernel``: before the measurement is known,
    the posterior mean is a random draw and the posterior covariance is not. By the law of total probability
    the mixture of all posteriors is the Gaussian itself, so drawing n means and taking the one posterior
    covariance represents it exactly as n grows, with all correlations.

    Args:
        P: (d, d) covariance.
        kernel: (k, k) covariance of the imagined noise, positive definite.
        n: number of draws.
        rng: source of randomness.

    Returns:
        Offsets of the means (n, d) and the common covariance (d, d) of the pieces.
    """
    k = len(kernel)
    S = P[:k, :k] + kernel
    gain = np.linalg.solve(S, P[:k]).T
    narrow = P - gain @ P[:k]
    return sample(S, n, rng) @ gain.T, 0.5 * (narrow + narrow.T)


def log_density(d: Array, S: Array) -> Array:
    """Return log N(d; 0, S) for offsets (..., 2) and one covariance (2, 2)."""
    a, b, c = float(S[0, 0]), float(S[0, 1]), float(S[1, 1])
    det = a * c - b * b
    square = (c * d[..., 0] ** 2 - 2.0 * b * d[..., 0] * d[..., 1] + a * d[..., 1] ** 2) / det
    return np.asarray(-0.5 * (square + np.log(det)) - LOG_2PI)
