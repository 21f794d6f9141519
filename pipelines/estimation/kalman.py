"""One step of a Kalman filter on errors: predict, gate, correct; what the errors mean is the caller's business.

The caller keeps the state x with its retraction and linearises; here only the covariance P of the error lives. With
the residual ``z - h(x)`` and its sensitivity H to the error::

    predict   P <- F P F' + Q
    gate      S = H P H' + R,   nis = r' S^-1 r <= quantile of chi-square
    correct   K = P H' S^-1,    error = K r,   P <- (I - K H) P (I - K H)' + K R K'

The last line (Joseph's form) keeps P symmetric and positive whatever rounding does to K. It is evaluated from the left,
in steps of (n, n) times (n, r), so that many states cost n^2 and not n^3.

Source: Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with applications to tracking and navigation", 2001,
sections 5.2 (filter, Joseph's form) and 5.4 (innovations as a test).
"""

from functools import lru_cache
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]


class Innovation(NamedTuple):
    """What a measurement says against the prediction.

    Attributes:
        residual: (r,) measured minus predicted.
        H: (r, n) sensitivity of the measurement to the error of the state.
        R: (r, r) covariance of the measurement's noise.
        PHt: (n, r) P H'.
        S: (r, r) covariance of the residual.
        nis: r' S^-1 r, chi-square with r degrees of freedom if all of it is true.
    """

    residual: Array
    H: Array
    R: Array
    PHt: Array
    S: Array
    nis: float

    def passes(self, probability: float) -> bool:
        """Tell whether a true measurement would be as far off with at least 1 - ``probability``."""
        return self.nis <= chi_square(probability, len(self.residual))


def predict(P: Array, F: Array, Q: Array) -> Array:
    """Return the covariance (n, n) after a motion.

    Args:
        P: (n, n) covariance before.
        F: (k, k) how the first k errors move, k <= n; the others stay as they are.
        Q: (k, k) noise added to them.
    """
    k = len(F)
    moved = P.copy()
    moved[:k] = F @ P[:k]
    moved[:, :k] = moved[:, :k] @ F.T
    moved[:k, :k] += Q
    return _symmetric(moved)


def innovation(P: Array, residual: Array, H: Array, R: Array) -> Innovation:
    """Return what a measurement says against the prediction.

    Args:
        P: (n, n) covariance of the state's error.
        residual: (r,) measured minus predicted, angles wrapped.
        H: (r, n) sensitivity of the measurement to the error.
        R: (r, r) covariance of its noise; S must be positive definite.
    """
    PHt = P @ H.T
    S = _symmetric(H @ PHt + R)
    nis = float(residual @ np.linalg.solve(S, residual))
    return Innovation(residual, H, R, PHt, S, nis)


def correct(P: Array, seen: Innovation) -> tuple[Array, Array]:
    """Return the error (n,) of the state, to be retracted by the caller, and the covariance (n, n) after it."""
    K = np.linalg.solve(seen.S, seen.PHt.T).T
    left = P - K @ seen.PHt.T  # (I - K H) P
    joseph = left - (left @ seen.H.T) @ K.T + K @ seen.R @ K.T
    return K @ seen.residual, _symmetric(joseph)


@lru_cache(maxsize=256)
def chi_square(probability: float, dof: int) -> float:
    """Return a quantile of chi-square, as ``scipy.stats.chi2.ppf``, which takes most of a second to import."""
    from scipy.special import gammaincinv

    return float(2.0 * gammaincinv(0.5 * dof, probability))


class Consistency:
    """Gathers innovations: whether measurements scatter as the filter says they would.

    Attributes:
        count: innovations.
        dof: their degrees of freedom together.
        total: their NIS together.
    """

    def __init__(self) -> None:
        """Begin with nothing."""
        self.count = self.dof = 0
        self.total = 0.0

    def add(self, seen: Innovation) -> None:
        """Count one innovation."""
        self.count += 1
        self.dof += len(seen.residual)
        self.total += seen.nis

    @property
    def ratio(self) -> float:
        """Mean NIS per degree of freedom; 1 for an honest filter, nan without innovations."""
        return self.total / self.dof if self.dof else float("nan")

    def bounds(self, confidence: float = 0.95) -> tuple[float, float]:
        """Return between what ``ratio`` lies with that probability if the filter is honest; needs an innovation."""
        tail = 0.5 * (1.0 - confidence)
        return chi_square(tail, self.dof) / self.dof, chi_square(1.0 - tail, self.dof) / self.dof


def _symmetric(matrix: Array) -> Array:
    return np.asarray(0.5 * (matrix + matrix.T))
