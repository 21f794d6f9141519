"""What the smoother will need of a log: numbers of every step and every sighting, no images, no events.

A node is a place of the robot: at each image, and wherever the filter stepped between images. It has the filter's guess
of the state, and the increment that led to it from the node before, unless the estimate began there.

Where sightings overruled the filter its guesses were wrong from some node on. They are replaced by going back from
where the sightings say the robot is, to the last node that was confirmed, or to the start. The increment after a node
that was confirmed is open to doubt then: the robot may have been carried, or slipped.
"""

from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from ..geometry.motion import Increment
from ..geometry.se2 import compose, inverse
from ..odometry.noise import corrected
from .filter import PoseFilter
from .motion import N_POSE, N_STATE
from .view import Seen

Array: TypeAlias = npt.NDArray[np.float64]
Indices: TypeAlias = npt.NDArray[np.intp]
Mask: TypeAlias = npt.NDArray[np.bool_]

_N_STEP = len(Increment())


@dataclass(frozen=True, slots=True, eq=False)
class Sightings:
    """K sightings.

    Attributes:
        at: (K,) their nodes.
        mark: (K,) index of the mark in the map.
        pose, cov: (K, 3) and (K, 3, 3) where they say the robot is.
        news: (K,) how much of each was new.
        is_taken: (K,) whether the filter took it for true.
    """

    at: Indices
    mark: Indices
    pose: Array
    cov: Array
    news: Array
    is_taken: Mask

    def where(self, mask: Mask) -> "Sightings":
        """Return those of a mask (K,)."""
        return Sightings(
            self.at[mask], self.mark[mask], self.pose[mask], self.cov[mask], self.news[mask], self.is_taken[mask]
        )


@dataclass(frozen=True, slots=True, eq=False)
class Starts:
    """S start poses.

    Attributes:
        at: (S,) their nodes.
        pose, cov: (S, 3) and (S, 3, 3) where the robot was said to be.
        is_taken: (S,) whether no sightings overruled them.
    """

    at: Indices
    pose: Array
    cov: Array
    is_taken: Mask

    def where(self, mask: Mask) -> "Starts":
        """Return those of a mask (S,)."""
        return Starts(self.at[mask], self.pose[mask], self.cov[mask], self.is_taken[mask])


class History:
    """Grows along the log.

    Attributes:
        asked: node -> (stamp [ns], number of marks seen), where a pose is to be given.
        doubted: nodes to which the increment may lead wrongly.
    """

    def __init__(self) -> None:
        """Begin with nothing."""
        self.asked: dict[int, tuple[int, int]] = {}
        self.doubted: list[int] = []
        self._states, self._steps, self._linked = array("d"), array("d"), array("b")
        self._seen_at, self._seen_mark, self._seen, self._taken = array("q"), array("q"), array("d"), array("b")
        self._start_at, self._starts = array("q"), array("d")
        self._overruled: list[int] = []  # nodes where the estimate began wrongly
        self._rejected: list[tuple[int, Seen]] = []  # since a guess was confirmed
        self._sure = -1  # the last node whose guess was confirmed

    def __len__(self) -> int:
        """Return the number of nodes."""
        return len(self._linked)

    @property
    def states(self) -> Array:
        """(N, 6) guesses."""
        return np.array(self._states).reshape(-1, N_STATE)

    @property
    def steps(self) -> Array:
        """(N, 7) increments that led to the nodes."""
        return np.array(self._steps).reshape(-1, _N_STEP)

    @property
    def linked(self) -> Mask:
        """(N,) whether the increment connects the node with the one before."""
        return np.array(self._linked, dtype=bool)

    @property
    def sightings(self) -> Sightings:
        """All sightings that say of themselves that they are sure, and the others that the filter took."""
        rows = np.array(self._seen).reshape(-1, 13)
        at, mark = (np.array(a, dtype=np.intp) for a in (self._seen_at, self._seen_mark))
        is_taken = np.array(self._taken, dtype=bool)
        return Sightings(at, mark, rows[:, :3], rows[:, 3:12].reshape(-1, 3, 3), rows[:, 12], is_taken)

    @property
    def starts(self) -> Starts:
        """Poses at which the robot was said to start."""
        rows = np.array(self._starts).reshape(-1, 12)
        at = np.array(self._start_at, dtype=np.intp)
        return Starts(at, rows[:, :3], rows[:, 3:].reshape(-1, 3, 3), ~np.isin(at, self._overruled))

    def begin(self, guess: PoseFilter, start: tuple[Array, Array] | None = None) -> None:
        """Add a node that nothing leads to, with the pose and covariance it was said to have, if it was."""
        self._sure = len(self) - 1
        self._rejected.clear()
        self._add(guess, Increment(), linked=False)
        if start is not None:
            self._start_at.append(len(self) - 1)
            self._starts.extend([*start[0].tolist(), *start[1].ravel().tolist()])

    def step(self, guess: PoseFilter, u: Increment) -> None:
        """Add a node after an increment."""
        self._add(guess, u, linked=True)

    def see(self, seen: Seen, news: float, *, is_taken: bool) -> None:
        """Add a sighting at the last node."""
        if not is_taken:
            self._rejected.append((len(self._taken), seen))
        self._seen_at.append(len(self) - 1)
        self._seen_mark.append(seen.mark)
        self._seen.extend([*seen.pose.tolist(), *seen.cov.ravel().tolist(), news])
        self._taken.append(is_taken)

    def confirm(self, guess: PoseFilter) -> None:
        """Take a better guess of the last node, which sightings have confirmed."""
        self._sure = len(self) - 1
        self._rejected.clear()
        self._guess(self._sure, np.concatenate([guess.pose, guess.calibration]))

    def correct(self, guess: PoseFilter, witnesses: Sequence[Seen]) -> None:
        """Take quite another guess of the last node, by sightings that were rejected, and go back with it."""
        for k, seen in self._rejected:
            self._taken[k] = any(seen is witness for witness in witnesses)
        state = np.concatenate([guess.pose, guess.calibration])
        node = len(self) - 1
        self._guess(node, state)
        while self._linked[node] and node > self._sure + 1:
            u = np.array(self._steps[node * _N_STEP : (node + 1) * _N_STEP])
            state[:N_POSE] = compose(state[:N_POSE], inverse(corrected(state[N_POSE:], u)))
            node -= 1
            self._guess(node, state)
        (self.doubted if self._linked[node] else self._overruled).append(node)
        self._sure = len(self) - 1
        self._rejected.clear()

    def ask(self, stamp: int, n_seen: int) -> None:
        """Say that a pose is to be given at the last node; one that was asked for at the same time is not."""
        if self.asked:
            before, (at, _) = next(reversed(self.asked.items()))
            if at == stamp:
                del self.asked[before]
        self.asked[len(self) - 1] = (stamp, n_seen)

    def _add(self, guess: PoseFilter, u: Increment, *, linked: bool) -> None:
        self._states.extend([*guess.pose.tolist(), *guess.calibration.tolist()])
        self._steps.extend(u)
        self._linked.append(linked)

    def _guess(self, node: int, state: Array) -> None:
        self._states[node * N_STATE : (node + 1) * N_STATE] = array("d", state.tolist())
