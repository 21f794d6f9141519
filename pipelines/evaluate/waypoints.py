"""The error at the pass of each waypoint, as the ceiling paper tabulates it (its Tables 4 and 5).

The pass is the moment at which the reference, a line through its poses, is nearest to the waypoint; both trajectories
are taken at that moment, interpolated linearly. A waypoint further than ``radius`` from the reference was not passed.
The averages are those of absolute errors and their standard deviations have n - 1, as in the paper; several runs are
pooled by giving all their passes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..geometry.angles import Array
from .associate import Track

MAX_GAP_NS = 1_000_000_000
"""The estimate is not interpolated across more than this."""


@dataclass(frozen=True, slots=True)
class Pass:
    """One waypoint and what happened there.

    Attributes:
        name: of the waypoint.
        stamp: of the pass [ns], None if there was none.
        truth: (2,) where the robot was [m].
        estimate: (2,) where it was thought to be [m], or None.
        why_not: why there is no error, or empty.
    """

    name: str
    stamp: int | None
    truth: Array | None
    estimate: Array | None
    why_not: str = ""

    def to_json(self) -> dict[str, object]:
        """Return the row of the table; None for what does not exist."""
        x, y = (None, None) if self.truth is None else self.truth.tolist()
        ex, ey = (None, None) if self.estimate is None else self.estimate.tolist()
        row: dict[str, object] = {"name": self.name, "stamp_ns": self.stamp, "x_m": x, "y_m": y}
        row |= {"estimate_x_m": ex, "estimate_y_m": ey, "dx_m": None, "dy_m": None, "distance_m": None}
        if self.error is not None:
            dx, dy = self.error.tolist()
            row |= {"dx_m": dx, "dy_m": dy, "distance_m": float(np.hypot(dx, dy))}
        if self.why_not:
            row["why_not"] = self.why_not
        return row

    @property
    def error(self) -> Array | None:
        """Estimate minus truth (2,) [m]."""
        return None if self.truth is None or self.estimate is None else np.asarray(self.estimate - self.truth)


def passes(
    reference: Track, estimate: Track, waypoints: Sequence[tuple[str, float, float]], radius: float
) -> list[Pass]:
    """Return the pass of each waypoint (name, x [m], y [m]) in their order; radius [m]."""
    return [_pass(reference, estimate, name, np.array([x, y]), radius) for name, x, y in waypoints]


def summary(found: Sequence[Pass]) -> dict[str, float | int | None]:
    """Return number, mean, standard deviation (n - 1) and largest of the distances, and of |dx| and |dy|."""
    errors = np.array([p.error for p in found if p.error is not None]).reshape(-1, 2)
    distance = np.hypot(errors[:, 0], errors[:, 1])
    result: dict[str, float | int | None] = {"n": len(errors), "n_missed": len(found) - len(errors)}
    for key, values in (("distance", distance), ("dx", np.abs(errors[:, 0])), ("dy", np.abs(errors[:, 1]))):
        result[f"mean_{key}_m"] = float(values.mean()) if len(values) else None
        result[f"sd_{key}_m"] = float(values.std(ddof=1)) if len(values) > 1 else None
        result[f"max_{key}_m"] = float(values.max()) if len(values) else None
    return result


def _pass(reference: Track, estimate: Track, name: str, waypoint: Array, radius: float) -> Pass:
    point, stamp = nearest_on_path(reference, waypoint)
    distance = float(np.hypot(*(point - waypoint)))
    if distance > radius:
        return Pass(name, None, None, None, f"the reference stays {distance:.3g} m away")
    after = int(np.searchsorted(estimate.stamps, stamp))
    if after == len(estimate.stamps) or (after == 0 and estimate.stamps[0] != stamp):
        return Pass(name, stamp, point, None, "the estimate does not cover this moment")
    before = max(after - 1, 0)
    gap = int(estimate.stamps[after] - estimate.stamps[before])
    if gap > MAX_GAP_NS and estimate.stamps[after] != stamp:
        return Pass(name, stamp, point, None, f"the estimate has a gap of {gap * 1e-9:.3g} s here")
    share = 1.0 if gap == 0 else (stamp - int(estimate.stamps[before])) / gap
    a, b = estimate.positions[before, :2], estimate.positions[after, :2]
    return Pass(name, stamp, point, a + share * (b - a))


def nearest_on_path(track: Track, point: Array) -> tuple[Array, int]:
    """Return the point (2,) of the path nearest to a point (2,) [m], and its stamp [ns]; the first of equal ones."""
    positions = track.positions[:, :2]
    if len(positions) == 1:
        return positions[0], int(track.stamps[0])
    a, step = positions[:-1], np.diff(positions, axis=0)
    square = np.sum(step * step, axis=1)
    share = np.sum((point - a) * step, axis=1) / np.where(square > 0, square, 1.0)
    share = np.clip(share, 0.0, 1.0)
    nearest = a + share[:, None] * step
    k = int(np.argmin(np.sum((nearest - point) ** 2, axis=1)))
    first, last = int(track.stamps[k]), int(track.stamps[k + 1])
    return nearest[k], first + round(float(share[k]) * (last - first))
