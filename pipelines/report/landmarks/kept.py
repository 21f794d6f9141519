"""What a report keeps of landmarks: how many each image shows, how many were matched, and which.

Sightings of the stage that comes first are what was seen; what a later one repeats with ids is what it matched.
"""

from array import array
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from ....formats.events import NO_ID, TRUE_SIGHTINGS, Event, Sightings
from ....formats.products import LandmarkMap
from ..track import Stamps, Track


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Counts:
    """How many landmarks each image has, by one source.

    Attributes:
        source: who says so.
        stamps: (N,) [ns].
        n: (N,).
    """

    source: str
    stamps: Stamps
    n: npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LandmarkFindings:
    """The map, and the sightings of all sources.

    Attributes:
        seen: what was detected, per image; None when there were no sightings.
        matches: by source, what it took for landmarks of the map, per image.
        matched_ids: landmarks that were matched at least once; empty when nobody said.
        landmarks: the map that was used, or None.
    """

    seen: Counts | None = None
    matches: Mapping[str, Counts] = field(default_factory=dict)
    matched_ids: frozenset[int] = frozenset()
    landmarks: LandmarkMap | None = None

    @property
    def source(self) -> str:
        """The stage whose sightings were seen first; empty if there were none."""
        return "" if self.seen is None else self.seen.source

    @property
    def stamps(self) -> Stamps:
        """(N,) of the images [ns]."""
        return np.empty(0, dtype=np.int64) if self.seen is None else self.seen.stamps

    @property
    def gives_poses(self) -> bool:
        """Whether one sighting says where the robot is: it takes several."""
        return False

    def matched_by(self, track: Track | None) -> Counts | None:
        """Return what an estimate took for landmarks; None if its source matched none, or only saw."""
        return None if track is None or track.source == self.source else self.matches.get(track.source)


class LandmarkKeeper:
    """Takes a run's sightings, of each source apart."""

    def __init__(self, landmarks: LandmarkMap | None = None) -> None:
        self._landmarks = landmarks
        self._counts: dict[str, tuple[array[int], array[int], array[int]]] = {}
        self._matched: set[int] = set()

    def take(self, event: Event) -> None:
        """Keep what is needed of an event."""
        if not isinstance(event, Sightings) or event.source == TRUE_SIGHTINGS:
            return
        named = event.ids[event.ids != NO_ID].tolist()
        stamps, seen, matched = self._counts.setdefault(event.source, (array("q"), array("q"), array("q")))
        stamps.append(event.stamp)
        seen.append(len(event.xy))
        matched.append(len(named))
        self._matched.update(named)

    def build(self) -> LandmarkFindings | None:
        """Return what was kept, or None if there was neither a map nor a sighting."""
        if self._landmarks is None and not self._counts:
            return None
        first = next(iter(self._counts), None)
        return LandmarkFindings(
            seen=None if first is None else self._count(first, 1),
            matches={source: self._count(source, 2) for source in self._counts},
            matched_ids=frozenset(self._matched),
            landmarks=self._landmarks,
        )

    def _count(self, source: str, column: int) -> Counts:
        stamps, n = self._counts[source][0], self._counts[source][column]
        return Counts(source=source, stamps=np.array(stamps, dtype=np.int64), n=np.array(n, dtype=np.int64))
