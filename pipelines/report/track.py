"""What a report keeps of poses: some numbers of each.

A ``Track`` is one source's poses as arrays; ``TrackBuilder`` grows one in compact buffers (about 80 bytes per pose).
"""

import math
from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ...formats.events import LOGGED_POSE, Array, Pose
from ..geometry.angles import yaw_from_quaternion

DEAD_RECKON = "dead-reckon"

LONGEST_PAUSE_NS = 2_000_000_000
"""Poses farther apart in time than this, and than ten of their usual steps, are not joined by a line [ns]."""

Stamps = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Track:
    """The poses of one source over time.

    Attributes:
        source: who says so: ``truth``, or the name of a stage.
        stamps: (N,) [ns].
        xy: (N, 2) in the map frame [m].
        heading: (N,) in (-pi, pi] [rad].
        covariance: (N, 3, 3) of x, y, heading [m, rad]; nan where the source gave none.
        n_seen, n_matched: (N,) landmarks seen and matched for each pose; nan where not said.
        status: of each pose, an index into ``status_words``; -1 where not said.
        status_words: in order of appearance.
    """

    source: str
    stamps: Stamps
    xy: Array
    heading: Array
    covariance: Array
    n_seen: Array
    n_matched: Array
    status: npt.NDArray[np.int64]
    status_words: Sequence[str] = ()

    def __len__(self) -> int:
        """Return the number of poses."""
        return len(self.stamps)

    @property
    def length(self) -> float:
        """Path length [m]; grows with the noise of the poses."""
        return float(np.nansum(np.hypot(*np.diff(self.xy, axis=0).T)))


def primary_of(estimates: Mapping[str, Track]) -> Track | None:
    """Return the first track that was estimated from more than odometry, or the first."""
    tracks = list(estimates.values())
    others = (track for track in tracks if track.source not in {DEAD_RECKON, LOGGED_POSE})
    return next(others, tracks[0] if tracks else None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Waypoint:
    """The pass of one way point, as an evaluation tells it; nan for what it does not tell.

    Attributes:
        name: of the way point.
        x, y: where the robot was [m].
        estimate_x, estimate_y: where the estimate was [m].
        dx, dy, distance: estimate minus way point [m].
    """

    name: str
    x: float
    y: float
    estimate_x: float
    estimate_y: float
    dx: float
    dy: float
    distance: float

    @classmethod
    def read(cls, point: Mapping[str, object]) -> "Waypoint":
        """Take a way point from an evaluation."""
        keys = ("x", "y", "estimate_x", "estimate_y", "dx", "dy", "distance")
        return cls(name=str(point.get("name", "")), **{key: _number(point.get(f"{key}_m")) for key in keys})


def longest_step(stamps: Stamps) -> int:
    """Return the longest time between two poses over which a line may be drawn [ns].

    A line through a time of which nothing is said would say where the robot was.
    """
    steps = np.diff(stamps)
    return max(LONGEST_PAUSE_NS, 10 * int(np.median(steps))) if len(steps) else LONGEST_PAUSE_NS


class TrackBuilder:
    """Grows a track pose by pose."""

    def __init__(self, source: str) -> None:
        self.source = source
        self._stamps, self._numbers, self._status = array("q"), array("d"), array("q")
        self._words: dict[str, int] = {}

    def add(self, pose: Pose) -> None:
        """Append a pose."""
        cov, used = pose.covariance, (0, 1, 5)
        cells = [math.nan] * 9 if cov is None else [float(cov[i, j]) for i in used for j in used]
        x, y = float(pose.position[0]), float(pose.position[1])
        self._stamps.append(pose.stamp)
        self._numbers.extend([x, y, yaw_from_quaternion(pose.orientation), *cells])
        self._numbers.extend([_number(pose.info.get("n_seen")), _number(pose.info.get("n_matched"))])
        word = pose.info.get("status")
        self._status.append(-1 if word is None else self._words.setdefault(str(word), len(self._words)))

    def build(self) -> Track:
        """Return what was added so far."""
        numbers = np.array(self._numbers, dtype=np.float64).reshape(-1, 14)
        return Track(
            source=self.source,
            stamps=np.array(self._stamps, dtype=np.int64),
            xy=numbers[:, 0:2],
            heading=numbers[:, 2],
            covariance=numbers[:, 3:12].reshape(-1, 3, 3),
            n_seen=numbers[:, 12],
            n_matched=numbers[:, 13],
            status=np.array(self._status, dtype=np.int64),
            status_words=tuple(self._words),
        )


def _number(value: object) -> float:
    value = value.item() if hasattr(value, "item") else value
    return float(value) if isinstance(value, int | float) else math.nan
