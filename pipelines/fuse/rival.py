"""When the estimate is wrong: sightings that agree with one another and not with it.

Sightings that are sure of themselves and that the estimate rejects found a rival, an estimate that begins at them and
follows the odometry beside it. Rejected sightings that fit the rival count for it; if none of an image fits, the rival
begins anew at them. A sighting that fits the estimate ends the rival. With ``lost_count`` sightings it is believed: at
once if they are of two marks; of one mark when they have agreed for ``lost_window_s``; but ten times as long if as many
sightings of other marks have spoken for the estimate, as the one mark is likelier to have been moved than the robot.
"""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from ..geometry.motion import Increment
from .filter import PoseFilter
from .params import FuseParams
from .view import Seen, by_precision

Array: TypeAlias = npt.NDArray[np.float64]


_STUBBORN = 10.0
"""One mark must contradict what another one said for so many times ``lost_window_s``."""


class Rival:
    """The case against the present estimate.

    Attributes:
        filter: the other estimate, or None while there is no case.
        witnesses: sightings that agree with it.
    """

    def __init__(self, places: Array, params: FuseParams) -> None:
        """Take where the marks hang (L, 2) [m]."""
        self.places, self.params = places, params
        self.dismiss()

    def dismiss(self) -> None:
        """Forget it."""
        self.filter: PoseFilter | None = None
        self.witnesses: list[Seen] = []
        self._since = 0

    def predict(self, u: Increment) -> None:
        """Follow one increment of odometry."""
        if self.filter is not None:
            self.filter.predict(u)

    def hear(self, stamp: int, rejected: Sequence[Seen]) -> None:
        """Take the sightings of one image (at ``stamp`` [ns]) that the estimate rejects, at least one."""
        fitting = [] if self.filter is None else correct_by(self.filter, rejected)
        if not fitting:
            self.dismiss()
            self.filter, fitting = agreement(self.places, self.params, rejected)
            self._since = stamp
        self.witnesses += fitting

    def is_convincing(self, stamp: int, robot: PoseFilter) -> bool:
        """Tell whether it is to take the place of the estimate ``robot`` at ``stamp`` [ns]."""
        if len(self.witnesses) < self.params.lost_count:
            return False
        marks = {seen.mark for seen in self.witnesses}
        others = sum(n for mark, n in robot.taken.items() if mark not in marks)
        patience = self.params.lost_window_s * (_STUBBORN if others >= self.params.lost_count else 1.0)
        return len(marks) > 1 or (stamp - self._since) * 1e-9 >= patience


def correct_by(robot: PoseFilter, sightings: Sequence[Seen]) -> list[Seen]:
    """Correct an estimate by those sightings that pass the gate, the most precise first; return them."""
    taken = []
    for seen in by_precision(sightings):
        if robot.expect(seen).passes(robot.params.gate):
            robot.correct(seen)
            taken.append(seen)
    return taken


def agreement(places: Array, params: FuseParams, sightings: Sequence[Seen]) -> tuple[PoseFilter, list[Seen]]:
    """Return the estimate that begins at the sightings of one image with which most others agree, and which those are.

    Of equal cases the one is taken that begins at the most precise sighting.
    """
    best: tuple[PoseFilter, list[Seen]] | None = None
    for first in by_precision(sightings):
        robot = PoseFilter.begin(places, params, first)
        taken = [first, *correct_by(robot, [seen for seen in sightings if seen is not first])]
        if best is None or len(taken) > len(best[1]):
            best = robot, taken
    if best is None:
        raise ValueError("no sightings to begin at")
    return best
