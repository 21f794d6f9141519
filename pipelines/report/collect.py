"""Keeps of a run's events what a page needs, as they pass: some numbers, and the pixels of a few images."""

from collections.abc import Mapping

from ...formats.events import INITIAL_POSE, TRUTH, Event, Notice, Pose, Summary
from .findings import Findings
from .kind import Maps
from .kinds import KINDS
from .track import TrackBuilder


class Collector:
    """Poses, results and notices are kept here; what is seen is kept by the keeper of its kind."""

    def __init__(self, maps: Maps = ()) -> None:
        self._tracks: dict[str, TrackBuilder] = {}
        self._results: dict[str, Mapping[str, object]] = {}
        self._notices: dict[str, tuple[Notice, int]] = {}
        self._keepers = [kind.keeper(maps) for kind in KINDS]

    def take(self, event: Event) -> None:
        """Keep what is needed of one event."""
        match event:
            case Pose() if event.source != INITIAL_POSE:
                self._tracks.setdefault(event.source, TrackBuilder(event.source)).add(event)
            case Summary(values=Mapping() as values):
                self._results[event.source] = values
            case Notice():
                first, n = self._notices.get(event.code, (event, 0))
                self._notices[event.code] = (first, n + 1)
            case _:
                for keeper in self._keepers:
                    keeper.take(event)

    def findings(self) -> Findings:
        """Return what was kept."""
        tracks = {source: track.build() for source, track in self._tracks.items()}
        kept = [keeper.build() for keeper in self._keepers]
        return Findings(
            truth=tracks.pop(TRUTH, None),
            estimates=tracks,
            kept=[part for part in kept if part is not None],
            results=self._results,
            notices=tuple(self._notices.values()),
        )
