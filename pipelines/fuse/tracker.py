"""One run of ``fuse-poses`` as numbers: what is believed of the sightings, and when the estimate begins anew.

Without odometry every image stands alone: the pose is that of its sightings, combined by their information. With
odometry the filter follows it, and each sighting must pass the gate:

- ``ok``: the most precise of an image first.
- ``ambiguous``: of candidates that lie over one another in the image the one that passes, if it is the only one.
- ``unverified``: a tighter gate, and only where the pose is known well enough for it to tell anything.

While sightings agree with one another against the pose (``rival.py``) it is ``lost``, and what is doubtful is left out.
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from ..estimation.gaussian import LOST, largest_variance, pose_covariance
from ..estimation.kalman import Consistency
from ..geometry.motion import Gathered, Increment
from .filter import PoseFilter
from .history import History
from .params import FuseParams
from .rival import Rival, agreement
from .view import Seen, View, by_precision, groups

Array: TypeAlias = npt.NDArray[np.float64]

Status = Literal["tracking", "dead-reckoning", "lost"]
STATUSES: tuple[Status, ...] = ("tracking", "dead-reckoning", "lost")


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """A pose (3,) with its covariance (3, 3) in the map, and what stands behind it."""

    pose: Array
    cov: Array
    status: Status
    n_seen: int = 0
    n_matched: int = 0


@dataclass(slots=True)
class Tally:
    """Counts over a run.

    Attributes:
        images: with and without marks.
        before_start: images of which no pose could be given.
        begun_anew: times that sightings overruled the pose.
        way_m: length of the way by odometry [m].
        status: of the poses at images.
        sightings: what became of them.
        innovations: of the sightings that were sure and accepted.
    """

    images: int = 0
    before_start: int = 0
    begun_anew: int = 0
    way_m: float = 0.0
    status: Counter[str] = field(default_factory=Counter)
    sightings: Counter[str] = field(default_factory=Counter)
    innovations: Consistency = field(default_factory=Consistency)


class Tracker:
    """Follows the robot.

    Attributes:
        filter: the estimate, or None before the start.
        history: what the smoother will need, or None if there will be none.
        has_odometry: whether odometry was heard; until then every image stands alone.
    """

    def __init__(self, places: Array, params: FuseParams) -> None:
        """Take where the marks hang (L, 2) [m]."""
        self.places, self.params = places, params
        self.tally = Tally()
        self.filter: PoseFilter | None = None
        self.history = History() if params.smooth else None
        self.has_odometry = False
        self.rival = Rival(places, params)
        self._gathered = Gathered()
        self._silent_s = 0.0  # how long odometry has been silent without a sighting

    @property
    def is_lost(self) -> bool:
        """Whether sightings agree with one another against the pose."""
        return len(self.rival.witnesses) > 1

    def start(self, pose: Array, cov: Array | None) -> None:
        """Begin, or begin anew, at a pose (3,) with a covariance (3, 3) in the map, or the parameters' one."""
        if cov is None:
            cov = pose_covariance(self.params.initial_sigma_m, float(np.radians(self.params.initial_sigma_deg)))
        robot = self._begin(PoseFilter(self.places, self.params, pose, cov))
        if self.history is not None:
            self.history.begin(robot, (robot.pose, robot.covariance()))

    def move(self, u: Increment) -> None:
        """Take an increment of odometry; nothing before the start."""
        if self.filter is None:
            return
        self.tally.way_m += u.length
        due = self._gathered.add(u)
        if due is not None:
            self._drive(self.filter, due)

    def look(self, view: View) -> Estimate | None:
        """Take one image; None if nothing can be said of where the robot is."""
        self.tally.images += 1
        if self.filter is None or not self.has_odometry:
            if not view.sure:
                self.tally.before_start += 1
                return None
            n_matched = self._begin_at(view)
        else:
            self._drive(self.filter, self._gathered.take())
            n_matched = self._follow(self.filter, view)
        estimate = self._estimate(view.stamp, view.n_seen, n_matched)
        self.tally.status[estimate.status] += 1
        return estimate

    def guess(self, stamp: int) -> Estimate:
        """Return the pose at ``stamp`` [ns] from odometry alone; only after the start."""
        self._drive(self._present, self._gathered.take())
        return self._estimate(stamp, 0, 0)

    @property
    def _present(self) -> PoseFilter:
        if self.filter is None:
            raise ValueError("the robot has no pose before the start")
        return self.filter

    def _begin(self, robot: PoseFilter) -> PoseFilter:
        self.filter, self._gathered, self._silent_s = robot, Gathered(), 0.0
        self.rival.dismiss()
        return robot

    def _begin_at(self, view: View) -> int:
        """Begin where the sightings of an image say; return how many of them agree with that."""
        robot, taken = agreement(self.places, self.params, view.sure)
        self._begin(robot)
        self._count(accepted=len(taken), rejected=len(view.sure) - len(taken))
        if self.history is not None:
            self.history.begin(robot)
            for seen in view.sure:
                self.history.see(seen, 1.0, is_taken=any(seen is one for one in taken))
        return len(taken)

    def _follow(self, robot: PoseFilter, view: View) -> int:
        """Correct the estimate by what one image shows; return by how many sightings."""
        taken, rejected = self._sift(robot, view.sure)
        if taken:
            self._silent_s = 0.0
            self.rival.dismiss()
            if self.history is not None:
                self.history.confirm(robot)
        elif rejected:
            self.rival.hear(view.stamp, rejected)
        other = self.rival.filter
        if other is not None and self.rival.is_convincing(view.stamp, robot):
            if self.history is not None:
                self.history.correct(other, self.rival.witnesses)
            self._begin(other)
            self.tally.begun_anew += 1
            return sum(other.expect(seen).passes(self.params.gate) for seen in view.sure)
        return len(taken) if self.is_lost else len(taken) + self._resolve(robot, view)

    def _sift(self, robot: PoseFilter, sightings: Sequence[Seen]) -> tuple[list[Seen], list[Seen]]:
        """Correct the estimate by the sightings that pass the gate; return them, and those that do not."""
        taken: list[Seen] = []
        rejected: list[Seen] = []
        for seen in by_precision(sightings):
            expected = robot.expect(seen)
            if expected.passes(self.params.gate):
                self.tally.innovations.add(expected)
                self._remember(seen, robot.correct(seen), is_taken=True)
                taken.append(seen)
            else:
                self._remember(seen, robot.news(seen.mark), is_taken=False)
                rejected.append(seen)
        self._count(accepted=len(taken), rejected=len(rejected))
        return taken, rejected

    def _resolve(self, robot: PoseFilter, view: View) -> int:
        """Correct the estimate by those doubtful sightings that it tells to be true; return how many."""
        chosen: list[Seen] = []
        for group in groups(view.ambiguous):
            passing = [seen for seen in group if robot.expect(seen).passes(self.params.gate)]
            is_clear = len(passing) == 1
            self._count(ambiguous_accepted=is_clear, ambiguous_left=not is_clear)
            chosen += passing if is_clear else []
        for seen in view.unverified:
            expected = robot.expect(seen)
            is_known = largest_variance(expected.S[:2, :2]) <= self.params.unverified_sigma_m**2
            is_true = is_known and expected.passes(self.params.unverified_gate)
            self._count(unverified_accepted=is_true, unverified_left=not is_true)
            chosen += [seen] if is_true else []
        for seen in chosen:
            self._remember(seen, robot.correct(seen), is_taken=True)
        return len(chosen)

    def _remember(self, seen: Seen, news: float, *, is_taken: bool) -> None:
        if self.history is not None:
            self.history.see(seen, news, is_taken=is_taken)

    def _count(self, **counts: int) -> None:
        self.tally.sightings.update({key: int(n) for key, n in counts.items()})

    def _estimate(self, stamp: int, n_seen: int, n_matched: int) -> Estimate:
        robot = self._present
        status: Status = "lost" if self.is_lost else "tracking" if n_matched else "dead-reckoning"
        if self.history is not None:
            self.history.ask(stamp, n_seen)
        cov = robot.covariance()
        return Estimate(robot.pose, cov + LOST if status == "lost" else cov, status, n_seen, n_matched)

    def _drive(self, robot: PoseFilter, u: Increment) -> None:
        """Let the estimate follow what has been gathered."""
        # The hidden speed is the same from step to step: what is unknown of the way grows with time, not with its root.
        before, self._silent_s = self._silent_s, self._silent_s + u.gap if u.gap else 0.0
        u = u._replace(gap=math.sqrt((before + u.gap) ** 2 - before**2))
        if not u.is_none:
            robot.predict(u)
            self.rival.predict(u)
            if self.history is not None:
                self.history.step(robot, u)
