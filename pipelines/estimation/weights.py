"""Weights of particles, kept as logarithms: a product of a hundred small densities does not underflow."""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]


def normalise(log_w: Array) -> tuple[Array, float]:
    """Scale weights so that they sum to one.

    Args:
        log_w: (N,) logarithms of weights; -inf is a weight of zero.

    Returns:
        (N,) logarithms of the scaled weights, and the logarithm of the sum before. If no weight is positive
        and finite the sum is -inf and the weights are uniform: the cloud is kept, and the caller counts it.

    Raises:
        ValueError: a weight is nan or infinite.
    """
    top = float(np.max(log_w))
    if np.isnan(top) or top == np.inf:
        raise ValueError(f"log-weights: {top!r} is not a weight")
    if top == -np.inf:
        return np.full_like(log_w, -np.log(len(log_w))), -np.inf
    log_sum = top + float(np.log(np.sum(np.exp(log_w - top))))
    return log_w - log_sum, log_sum


def log_sum_exp(log_values: Array) -> Array:
    """Return log(sum(exp(x))) (...) along the last axis (..., N) without overflow; -inf where all are -inf."""
    top = np.max(log_values, axis=-1, keepdims=True)
    top = np.where(np.isfinite(top), top, 0.0)
    with np.errstate(divide="ignore"):
        summed = np.log(np.sum(np.exp(log_values - top), axis=-1))
    return np.asarray(summed + np.squeeze(top, axis=-1))


def effective_sample_size(log_w: Array) -> float:
    """Return 1 / sum(w^2) of normalised weights: 1 (one particle has it all) ... N (all equal)."""
    return float(1.0 / np.sum(np.exp(2.0 * log_w)))


def uniform(n: int) -> Array:
    """Return (n,) logarithms of equal weights."""
    return np.full(n, -np.log(n))
