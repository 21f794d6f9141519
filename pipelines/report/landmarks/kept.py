"""What a report keeps of landmarks: how many each image shows, how many were matched, and which."""

from array import array

import numpy as np

from ....formats.events import NO_ID, Event, Sightings
from ..track import TRUE_SIGHTINGS, Counts


class LandmarkKeeper:
    """Takes a run's sightings, of each source apart."""

    def __init__(self) -> None:
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

    @property
    def first(self) -> str | None:
        """The source that came first: what it says was seen."""
        return next(iter(self._counts), None)

    @property
    def matched_ids(self) -> frozenset[int]:
        """Landmarks that were matched at least once."""
        return frozenset(self._matched)

    def seen(self) -> Counts | None:
        """Return how many landmarks were seen, per image."""
        return self._count(self.first, 1)

    def matched(self, source: str | None) -> Counts | None:
        """Return how many landmarks an estimator matched, per image."""
        return self._count(source, 2)

    def _count(self, source: str | None, column: int) -> Counts | None:
        kept = None if source is None else self._counts.get(source)
        if source is None or kept is None:
            return None
        return Counts(source=source, stamps=np.array(kept[0], dtype=np.int64), n=np.array(kept[column], dtype=np.int64))
