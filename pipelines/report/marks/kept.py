"""What a report keeps of stripe marks: numbers per sighting, and the pixels of at most three images.

``MarkKeeper`` takes images and sightings as they pass; ``MarkFindings`` is what is left of them. Sightings of one stamp
belong to one image. A sighting is *used* where it says where the robot is: its mark was recognised (``ok``) or is
assumed to be known (``unverified``). About 300 bytes are kept per sighting.
"""

from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ....formats.events import NO_ID, Array, Event, Image, MarkSighting
from ....formats.products import MarkMap, StripeMark
from ..timeline import runs
from ..track import Stamps, Track
from .snapshots import Snapshot, SnapshotKeeper, residual_of

OK, UNVERIFIED = "ok", "unverified"
USED = (OK, UNVERIFIED)
"""Statuses of sightings that say where the robot is."""

BESIDE = 0.75
"""A pose nearer to a used image than this share of the time between images rests on it."""

Ints = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True, eq=False)
class MarkFindings:
    """All sightings of one source.

    Attributes:
        source: name of the stage.
        stamps: (N,) of the images, non-decreasing; an image with two marks stands here twice [ns].
        mark: (N,) ids, NO_ID where none was recognised.
        status: (N,) an index into ``status_words``.
        status_words: in order of appearance.
        pose, cov: (N, 3), (N, 3, 3) of phi, D_x, D_y in the level camera frame [rad, m, m]; nan for none.
        robot, robot_cov: (N, 3), (N, 3, 3) of x, y, heading in the map [m, m, rad]; nan for none.
        n_lines: (N,) edges found.
        residual: (N,) root mean square of what is left over at the edges [px]; nan for none.
        snapshots: what was found in the images worth a look.
        marks: where the marks hang, or None.
    """

    source: str
    stamps: Stamps
    mark: Ints
    status: Ints
    status_words: Sequence[str]
    pose: Array
    cov: Array
    robot: Array
    robot_cov: Array
    n_lines: Ints
    residual: Array
    snapshots: Sequence[Snapshot] = ()
    marks: MarkMap | None = None

    def __len__(self) -> int:
        """Return the number of sightings."""
        return len(self.stamps)

    @property
    def gives_poses(self) -> bool:
        """Whether one sighting says where the robot is: where there is a map, it does."""
        return True

    @cached_property
    def is_used(self) -> Mask:
        """(N,) whether a sighting says where the robot is."""
        words = [i for i, word in enumerate(self.status_words) if word in USED]
        return np.isin(self.status, words) & np.isfinite(self.robot).all(axis=1)

    @cached_property
    def images(self) -> Stamps:
        """(I,) stamps of all images [ns]."""
        return np.unique(self.stamps)

    @cached_property
    def used_images(self) -> Stamps:
        """(U,) stamps of the images with a sighting that is used [ns]."""
        return np.unique(self.stamps[self.is_used])

    @property
    def distance(self) -> Array:
        """(N,) from the lens to the origin of the mark [m]; nan without a pose."""
        return np.hypot(self.pose[:, 1], self.pose[:, 2])

    @property
    def period(self) -> float:
        """Usual time between images [ns]; 0 for a single one."""
        return float(np.median(np.diff(self.images))) if len(self.images) > 1 else 0.0

    def of_status(self, word: str) -> Mask:
        """(N,) whether a sighting has a status."""
        index = list(self.status_words).index(word) if word in self.status_words else -1
        return np.asarray(self.status == index)

    def mark_of(self, identity: int) -> StripeMark | None:
        """Return a mark of the map, or None."""
        known = () if self.marks is None else self.marks.marks
        return next((mark for mark in known if mark.id == identity), None)

    def rests_on_image(self, stamps: Stamps) -> Mask:
        """(M,) whether there is a used image beside each of these stamps; the others are carried by odometry alone."""
        used = self.used_images
        if len(used) == 0:
            return np.zeros(len(stamps), dtype=np.bool_)
        after = np.clip(np.searchsorted(used, stamps), 1, max(len(used) - 1, 1))
        near = np.minimum(np.abs(stamps - used[after - 1]), np.abs(stamps - used[np.minimum(after, len(used) - 1)]))
        return np.asarray(near <= BESIDE * self.period)

    def track(self) -> Track:
        """Return where the robot is by each used sighting alone."""
        n = int(self.is_used.sum())
        return Track(
            source=self.source,
            stamps=self.stamps[self.is_used],
            xy=self.robot[self.is_used, :2],
            heading=self.robot[self.is_used, 2],
            covariance=self.robot_cov[self.is_used],
            n_seen=np.full(n, np.nan),
            n_matched=np.full(n, np.nan),
            status=np.full(n, -1, dtype=np.int64),
        )


@dataclass(slots=True)
class MarkKeeper:
    """Takes a run's images and sightings; the source that comes first is kept."""

    marks: MarkMap | None = None
    source: str = ""
    _stamps: "array[int]" = field(default_factory=lambda: array("q"))
    _ints: "array[int]" = field(default_factory=lambda: array("q"))
    _numbers: "array[float]" = field(default_factory=lambda: array("d"))
    _words: dict[str, int] = field(default_factory=dict)
    _image: Image | None = None
    _group: list[MarkSighting] = field(default_factory=list)
    _snapshots: SnapshotKeeper = field(default_factory=SnapshotKeeper)

    def take(self, event: Event) -> None:
        """Keep what is needed of an event."""
        match event:
            case Image():
                self._close()
                self._image = event
            case MarkSighting() if self.source in {"", event.source}:
                if self._group and self._group[0].stamp != event.stamp:
                    self._close()
                self.source = event.source
                self._group.append(event)
                self._add(event)
            case _:
                pass

    def build(self) -> MarkFindings | None:
        """Return what was kept so far, or None if there was no sighting."""
        self._close()
        n = len(self._stamps)
        if n == 0:
            return None
        ints = np.array(self._ints, dtype=np.int64).reshape(n, 3)
        numbers = np.array(self._numbers, dtype=np.float64).reshape(n, 25)
        return MarkFindings(
            source=self.source,
            stamps=np.array(self._stamps, dtype=np.int64),
            mark=ints[:, 0],
            status=ints[:, 1],
            n_lines=ints[:, 2],
            status_words=tuple(self._words),
            pose=numbers[:, 0:3],
            cov=numbers[:, 3:12].reshape(n, 3, 3),
            robot=numbers[:, 12:15],
            robot_cov=numbers[:, 15:24].reshape(n, 3, 3),
            residual=numbers[:, 24],
            snapshots=self._snapshots.chosen(),
            marks=self.marks,
        )

    def _add(self, event: MarkSighting) -> None:
        self._stamps.append(event.stamp)
        status = self._words.setdefault(event.status, len(self._words))
        self._ints.extend([event.mark, status, len(event.lines)])
        for values in (event.pose, event.cov, event.robot, event.robot_cov):
            self._numbers.extend(values.ravel().tolist())
        self._numbers.append(residual_of(event))

    def _close(self) -> None:
        """End the image that is open."""
        if self._group and self._image is not None and self._image.stamp == self._group[0].stamp:
            used = [s for s in self._group if s.status in USED and np.isfinite(s.pose).all()]
            self._snapshots.take(self._image, tuple(self._group), used)
        self._image, self._group = None, []


def ids_of(findings: MarkFindings) -> list[int]:
    """Return all ids there are, of the map and of the sightings, in order."""
    known = () if findings.marks is None else findings.marks.marks
    return sorted({mark.id for mark in known} | set(findings.mark[findings.mark != NO_ID].tolist()))


def bridged(marks: MarkFindings, track: Track | None) -> list[tuple[int, int]]:
    """Return the times that odometry carried alone: from the last used image before to the first one after [ns]."""
    if track is None or len(track) == 0 or track.source != marks.source:
        return []
    used = marks.used_images
    is_alone = ~marks.rests_on_image(track.stamps)
    spans: list[tuple[int, int]] = []
    for first, last in runs(is_alone):
        before, after = np.searchsorted(used, track.stamps[first]), np.searchsorted(used, track.stamps[last])
        start = int(used[before - 1]) if before > 0 else int(track.stamps[first])
        spans.append((start, int(used[after]) if after < len(used) else int(track.stamps[last])))
    return spans


def longest_bridged_s(marks: MarkFindings, track: Track | None) -> float:
    """Return the longest time that odometry carried alone [s]."""
    return max(((end - start) / 1e9 for start, end in bridged(marks, track)), default=0.0)
