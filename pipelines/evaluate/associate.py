"""Which pose of the estimate belongs to which pose of the reference: by time, one to one.

The trajectory with fewer poses is gone through; each of its poses takes the nearest stamp of the other, if it is at
most ``max_diff`` away. Of two stamps that are equally near in nanoseconds it takes the one that is nearer when stamps
are floating-point seconds: other tools have no nanoseconds, and the figures shall be theirs to the last digit. Where
several stamps want the same partner the nearest gets it and the others go without (other tools pair them all, and count
one pose twice). Poses that share one stamp count as one moment, each is scored; of partners that share a stamp the last
one is taken.

With ``interpolate`` the reference is interpolated at the stamps of the estimate instead, linear in position and along
the shortest turn, wherever its poses around the stamp are at most ``max_gap`` apart.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..geometry import so3
from ..geometry.angles import Array

Stamps = npt.NDArray[np.int64]
Indices = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Track:
    """A trajectory as arrays.

    Attributes:
        stamps: (N,) not decreasing [ns].
        positions: (N, 3) [m].
        rotations: (N, 3, 3).
        covariances: (N, 6, 6) of x, y, z, roll, pitch, yaw, or None.
    """

    stamps: Stamps
    positions: Array
    rotations: Array
    covariances: Array | None = None

    def take(self, indices: Indices) -> "Track":
        """Return the poses of these indices."""
        covariances = None if self.covariances is None else self.covariances[indices]
        return Track(self.stamps[indices], self.positions[indices], self.rotations[indices], covariances)


def associate(reference: Track, estimate: Track, max_diff: int) -> tuple[Track, Track]:
    """Return the pairs of both trajectories, of equal length, in time order; both empty if there are none.

    Args:
        reference: the truth.
        estimate: what is scored.
        max_diff: largest difference of the stamps of a pair [ns].
    """
    is_estimate_longer = len(estimate.stamps) > len(reference.stamps)
    few, many = (reference, estimate) if is_estimate_longer else (estimate, reference)
    i, j = nearest(few.stamps, many.stamps, max_diff)
    return (reference.take(i), estimate.take(j)) if is_estimate_longer else (reference.take(j), estimate.take(i))


def nearest(stamps: Stamps, others: Stamps, max_diff: int) -> tuple[Indices, Indices]:
    """Return the indices of pairs of nearest stamps, one partner per stamp; arguments sorted [ns]."""
    if len(stamps) == 0 or len(others) == 0:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    after = np.searchsorted(others, stamps, side="right")
    before = np.maximum(after - 1, 0)
    after = np.minimum(after, len(others) - 1)
    lower, upper = np.abs(stamps - others[before]), np.abs(others[after] - stamps)
    is_before = lower <= upper
    for k in np.flatnonzero((lower == upper) & (before != after)):
        low, middle, high = (int(s) / 1_000_000_000 for s in (others[before[k]], stamps[k], others[after[k]]))
        is_before[k] = middle - low <= high - middle
    partner = np.where(is_before, before, after)
    partner = np.searchsorted(others, others[partner], side="right") - 1  # the last one of those that share its stamp
    difference = np.abs(others[partner] - stamps)
    kept = difference <= max_diff
    # One to one: of the stamps that want one partner only the nearest keeps it, of equally near ones the first.
    order = np.lexsort((stamps, difference, partner))
    order = order[kept[order]]
    wanted, wanting = partner[order], stamps[order]
    is_first = np.ones(len(order), dtype=bool)
    is_first[1:] = wanted[1:] != wanted[:-1]
    group = np.cumsum(is_first) - 1
    winners = np.sort(order[wanting == wanting[is_first][group]]) if len(order) else order
    return winners.astype(np.int64), partner[winners].astype(np.int64)


def interpolate(reference: Track, estimate: Track, max_gap: int) -> tuple[Track, Track]:
    """Return the reference at the stamps of the estimate, and the poses of the estimate where it exists.

    Args:
        reference: at least one pose.
        estimate: what is scored.
        max_gap: of the reference around a stamp [ns].
    """
    stamps = estimate.stamps
    after = np.searchsorted(reference.stamps, stamps, side="left")
    is_inside = after < len(reference.stamps)
    after = np.minimum(after, len(reference.stamps) - 1)
    is_exact = is_inside & (reference.stamps[after] == stamps)
    before = np.where(is_exact, after, np.maximum(after - 1, 0))
    gap = reference.stamps[after] - reference.stamps[before]
    is_inside &= (is_exact | (reference.stamps[before] < stamps)) & (gap <= max_gap)
    i, j, kept = before[is_inside], after[is_inside], np.flatnonzero(is_inside)
    share = (stamps[kept] - reference.stamps[i]) / np.maximum(gap[kept], 1)
    return between(reference, i, j, share, stamps[kept]), estimate.take(kept)


def between(track: Track, i: Indices, j: Indices, share: Array, stamps: Stamps) -> Track:
    """Return poses between those of indices i and j: share (N,) 0 is i, 1 is j."""
    positions = track.positions[i] + share[:, None] * (track.positions[j] - track.positions[i])
    turn = so3.log(so3.from_matrix(np.swapaxes(track.rotations[i], 1, 2) @ track.rotations[j]))
    rotations = track.rotations[i] @ so3.as_matrix(so3.exp(share[:, None] * turn))
    return Track(stamps, positions, rotations)
