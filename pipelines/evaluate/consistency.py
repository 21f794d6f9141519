"""Whether an estimator knows how wrong it is: the normalised estimation error squared (NEES).

For each pose the error e and the covariance P give e^T P^-1 e, which is chi-square with as many degrees of freedom as e
has numbers, if P is right. A filter whose mean is above its bound is overconfident, one below is timid. Trajectories
that both stay in a plane are judged in x, y, yaw (3), others in all six.

Source: Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with applications to tracking and navigation", 2001,
section 5.4.2. Differs from it in: one run is averaged over time, whose errors are correlated, so that the bounds of the
mean are narrower than the truth; the share of poses inside their own bounds does not suffer from that.
"""

import numpy as np

from ..geometry import so3
from ..geometry.angles import Array
from .associate import Track

CONFIDENCE = 0.95
_PLANAR = np.array([0, 1, 5])
_FLAT = 1e-6
"""A trajectory stays in a plane if z [m], roll and pitch [rad] never differ by more from their first values."""


def nees(reference: Track, estimate: Track) -> tuple[Array, int]:
    """Return e^T P^-1 e (N,), nan where P is singular or not given, and the degrees of freedom.

    Raises:
        ValueError: the estimate has no covariances.
    """
    if estimate.covariances is None:
        raise ValueError("the estimate has no covariances")
    turn = so3.log(so3.from_matrix(reference.rotations @ np.swapaxes(estimate.rotations, 1, 2)))
    error = np.concatenate([reference.positions - estimate.positions, turn], axis=1)
    covariances = estimate.covariances
    if is_planar(reference) and is_planar(estimate):
        error, covariances = error[:, _PLANAR], covariances[:, _PLANAR[:, None], _PLANAR]
    values = np.full(len(error), np.nan)
    usable = np.flatnonzero(np.isfinite(covariances).all(axis=(1, 2)))
    usable = usable[np.linalg.eigvalsh(covariances[usable])[:, 0] > 0]
    e = error[usable]
    values[usable] = np.sum(e * np.linalg.solve(covariances[usable], e[:, :, None])[:, :, 0], axis=1)
    return values, error.shape[1]


def consistency(reference: Track, estimate: Track) -> dict[str, object]:
    """Return the figures of the NEES as they stand in a report; None for what does not exist."""
    values, dof = nees(reference, estimate)
    known = values[np.isfinite(values)]
    n = len(known)
    tail = (1.0 - CONFIDENCE) / 2
    low, high = (_quantile(p, dof) for p in (tail, 1.0 - tail))
    result: dict[str, object] = {
        "dof": dof,
        "poses": n,
        "without_covariance": len(values) - n,
        "confidence": CONFIDENCE,
        "nees_low": low,
        "nees_high": high,
        "nees_expected_mean": float(dof),
        "nees_expected_median": _quantile(0.5, dof),
        **dict.fromkeys(("nees_mean", "nees_median", "nees_inside", "nees_mean_low", "nees_mean_high")),
    }
    if n:
        result |= {
            "nees_mean": float(known.mean()),
            "nees_median": float(np.median(known)),
            "nees_inside": float(np.mean((known >= low) & (known <= high))),
            "nees_mean_low": _quantile(tail, n * dof) / n,
            "nees_mean_high": _quantile(1.0 - tail, n * dof) / n,
        }
    return result


def is_planar(track: Track) -> bool:
    """Tell whether a trajectory stays in a plane parallel to x and y."""
    z = track.positions[:, 2]
    up = track.rotations[:, :, 2]
    return bool(np.abs(z - z[0]).max() <= _FLAT and np.abs(up - [0.0, 0.0, 1.0]).max() <= _FLAT)


def _quantile(probability: float, dof: int) -> float:
    """Return a quantile of chi-square, as ``scipy.stats.chi2.ppf``, which takes most of a second to import."""
    from scipy.special import gammaincinv

    return float(2.0 * gammaincinv(dof / 2.0, probability))
