"""One run of ``localize-pf`` as numbers: odometry is gathered, images are explained, each with an honest status."""

from collections import Counter
from dataclasses import dataclass, field
from typing import Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from ..estimation.gaussian import pose_covariance
from ..geometry.motion import Gathered, Increment
from ..geometry.se2 import in_map
from .association import CLUTTER, Indices
from .filter import ParticleFilter, Update
from .paper import PaperFilter
from .params import LocalizePfParams
from .status import STATUSES, Judge, Status, honest_covariance

Array: TypeAlias = npt.NDArray[np.float64]


class Filter(Protocol):
    """What both methods can do."""

    def start(self, pose: Array, pose_cov: Array) -> None:
        """Place the cloud."""

    def predict(self, u: Increment) -> None:
        """Follow the odometry."""

    def search(self, dt: float) -> None:
        """Widen the cloud while lost."""

    def update(self, z: Array, R: Array, given: Indices | None = None) -> Update:
        """Explain the sightings of one image."""

    def estimate(self) -> tuple[Array, Array]:
        """Return mean pose and covariance."""

    def elsewhere(self) -> float:
        """Return the weight of the cloud at other places."""


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """A pose, and what stands behind it.

    Attributes:
        pose, cov: (3,) and (3, 3) in the map.
        status: how far to trust it.
        matches: (n,) index of the landmark of each sighting, or CLUTTER.
        ess: effective number of particles.
        elsewhere: weight of the cloud at other places.
    """

    pose: Array
    cov: Array
    status: Status
    matches: Indices
    ess: float
    elsewhere: float


@dataclass(slots=True)
class Tally:
    """Counts over a run."""

    frames: int = 0
    seen: Counter[int] = field(default_factory=Counter)
    matched: Counter[int] = field(default_factory=Counter)
    status: Counter[str] = field(default_factory=Counter)
    ess: float = 0.0
    resamplings: int = 0
    underflows: int = 0
    way_m: float = 0.0
    farthest_sighting_m: float = 0.0
    nearest_landmark_m: float = np.inf

    def count(self, update: Update, status: Status) -> None:
        """Count one image."""
        self.frames += 1
        self.seen[len(update.matches)] += 1
        self.matched[int(np.sum(update.matches != CLUTTER))] += 1
        self.status[status] += 1
        self.ess += update.ess
        self.resamplings += update.resampled
        self.underflows += update.underflow

    @property
    def any_matched(self) -> bool:
        """Whether any sighting was given a landmark."""
        return any(n > 0 for n in self.matched)

    def values(self) -> dict[str, object]:
        """Return everything JSON-ready."""
        n = max(self.frames, 1)
        return {
            "n_frames": self.frames,
            "status_share": {status: self.status[status] / n for status in STATUSES},
            "n_seen_histogram": _histogram(self.seen),
            "n_matched_histogram": _histogram(self.matched),
            "mean_ess": self.ess / n,
            "resamplings": self.resamplings,
            "underflows": self.underflows,
            "way_m": self.way_m,
        }


class Localizer:
    """Gathers odometry and feeds the filter."""

    def __init__(self, landmarks: Array, map_variance: float, params: LocalizePfParams) -> None:
        """Take the map: landmarks (L, 2) [m] and the variance of their survey per axis [m^2]."""
        self.params = params
        self.landmarks = landmarks
        self.filter: Filter = (
            PaperFilter(landmarks, map_variance, params)
            if params.method == "paper"
            else ParticleFilter(landmarks, map_variance, params)
        )
        self.judge = Judge(params)
        self.tally = Tally()
        self.is_started = False
        self._gathered = Gathered()
        self._search_s = 0.0

    def start(self, pose: Array, map_cov: Array | None) -> None:
        """Begin, or begin anew, at a pose (3,) with a covariance (3, 3) in the map, or the parameters' one."""
        if map_cov is None:
            body_cov = pose_covariance(self.params.initial_sigma_m, float(np.radians(self.params.initial_sigma_deg)))
        else:
            turn = in_map(pose[2])
            body_cov = turn.T @ map_cov @ turn
        self.filter.start(pose, body_cov)
        self.judge = Judge(self.params)
        self.is_started = True
        self._gathered = Gathered()

    def move(self, u: Increment) -> None:
        """Take an increment of odometry; nothing before the start."""
        if not self.is_started:
            return
        self.tally.way_m += u.length
        due = self._gathered.add(u)
        if due is not None:
            self._drive(due)

    def look(self, stamp: int, z: Array, R: Array, given: Indices | None = None) -> Estimate:
        """Explain the sightings of one image.

        Args:
            stamp: of the image [ns].
            z: (n, 2) in the robot's frame [m].
            R: (n, 2, 2) covariances [m^2].
            given: (n,) landmark indices where they are known.
        """
        self._drive(self._gathered.take())
        if self.judge.is_lost:
            self.filter.search(self._search_s)
        self._search_s = 0.0
        update = self.filter.update(z, R, given)
        elsewhere = self.filter.elsewhere()
        status = self.judge.look((stamp, self.tally.way_m), update.surprise, update.matches != CLUTTER, elsewhere)
        self.tally.count(update, status)
        pose, cov = self.filter.estimate()
        if len(z):
            nearest = np.min(np.hypot(*(self.landmarks - pose[:2]).T))
            self.tally.nearest_landmark_m = min(self.tally.nearest_landmark_m, float(nearest))
            farthest = float(np.max(np.hypot(z[:, 0], z[:, 1])))
            self.tally.farthest_sighting_m = max(self.tally.farthest_sighting_m, farthest)
        return Estimate(pose, honest_covariance(cov, status), status, update.matches, update.ess, elsewhere)

    def guess(self) -> Estimate:
        """Return the pose from odometry alone."""
        self._drive(self._gathered.take())
        pose, cov = self.filter.estimate()
        status = self.judge.unseen()
        none = np.zeros(0, dtype=np.intp)
        return Estimate(pose, honest_covariance(cov, status), status, none, float("nan"), self.filter.elsewhere())

    def _drive(self, u: Increment) -> None:
        """Let the filter follow what has been gathered."""
        if not u.is_none:
            self.filter.predict(u)
            self._search_s += u.dt


def _histogram(counts: Counter[int]) -> list[int]:
    """Return how often each number 0, 1, 2, ... was counted."""
    return [counts[n] for n in range(max(counts, default=-1) + 1)]
