"""How far an estimate is from the truth, pose by pose.

The truth is interpolated linearly to the stamps of the estimate (heading along the shorter arc). Where the truth has
a gap longer than a second, before its start and after its end nothing is said: nan, not a guess. The numbers of the
tables are those of ``evaluate``; these are for the pictures.
"""

from dataclasses import dataclass

import numpy as np

from ...formats.events import Array
from ..geometry.angles import difference
from .track import Track

LONGEST_GAP_NS = 1_000_000_000
"""Longer gaps in the truth are not bridged [ns]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Deviation:
    """Estimate minus truth.

    Attributes:
        dx, dy: (N,) in the map frame [m]; nan where the truth is not known.
        distance: (N,) [m].
        turn: (N,) in (-pi, pi] [rad].
        sigma: (N, 3) standard deviations of x, y, heading as the estimator claims them [m, m, rad]; nan for none.
    """

    dx: Array
    dy: Array
    distance: Array
    turn: Array
    sigma: Array

    @property
    def is_known(self) -> bool:
        """Tell whether there is any pose whose error is known."""
        return bool(np.isfinite(self.distance).any())

    def share_within(self, k: float) -> float | None:
        """Share of the poses whose x, y and heading errors all lie within k standard deviations, or None."""
        errors = np.column_stack([self.dx, self.dy, self.turn])
        is_told = np.isfinite(errors).all(axis=1) & np.isfinite(self.sigma).all(axis=1)
        if not is_told.any():
            return None
        return float((np.abs(errors[is_told]) <= k * self.sigma[is_told]).all(axis=1).mean())


def deviation(estimate: Track, truth: Track) -> Deviation:
    """Compare an estimate with the truth at the estimate's stamps."""
    n = len(estimate)
    sigma = np.sqrt(np.maximum(np.diagonal(estimate.covariance, axis1=1, axis2=2), 0.0))
    if n == 0 or len(truth) == 0:
        nothing = np.full(n, np.nan)
        return Deviation(dx=nothing, dy=nothing, distance=nothing, turn=nothing, sigma=sigma)
    first = np.int64(truth.stamps[0])
    at = (estimate.stamps - first).astype(np.float64)
    known = (truth.stamps - first).astype(np.float64)
    is_known = _is_bracketed(estimate, truth)
    x, y, heading = (
        np.where(is_known, np.interp(at, known, values), np.nan)
        for values in (truth.xy[:, 0], truth.xy[:, 1], np.unwrap(truth.heading))
    )
    dx, dy = estimate.xy[:, 0] - x, estimate.xy[:, 1] - y
    turn = difference(estimate.heading, heading)
    return Deviation(dx=dx, dy=dy, distance=np.hypot(dx, dy), turn=turn, sigma=sigma)


def _is_bracketed(estimate: Track, truth: Track) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Tell for each estimate whether truth stands close on both sides of it."""
    after = np.searchsorted(truth.stamps, estimate.stamps, side="left")
    last = len(truth) - 1
    right = truth.stamps[np.minimum(after, last)]
    left = truth.stamps[np.clip(np.where(right == estimate.stamps, after, after - 1), 0, last)]
    is_inside = (left <= estimate.stamps) & (estimate.stamps <= right)
    is_close: np.ndarray[tuple[int], np.dtype[np.bool_]] = is_inside & (right - left <= LONGEST_GAP_NS)
    return is_close
