"""Everything a page is made from: one field per kind of thing, None or empty where the run has none of it.

Tracks, notices and results are common to all systems; what a system sees has a field of its own, made by a keeper of
its own. Pictures and tables take it all and leave out what is not there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ...formats.events import Notice
from ...formats.products import LandmarkMap
from .marks.kept import MarkFindings
from .track import Counts, Track, Waypoint, primary_of


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Findings:
    """Everything a report is made from.

    Attributes:
        estimates: by source, in order of appearance; the first that is not dead reckoning is the one in question.
        truth: None when not known.
        seen: what was detected, per image; None when there were no sightings.
        matched: what the primary estimate took for landmarks of the map, per image; None when it did not say.
        landmarks: the map that was used, or None.
        matched_ids: landmarks that were matched at least once; empty when nobody said.
        marks: what images said of stripe marks; None when there were no such sightings.
        results: what the stages summed up, by source; ``run`` is the run itself.
        notices: what a person should know, the first of each code, with how often.
    """

    estimates: Mapping[str, Track] = field(default_factory=dict)
    truth: Track | None = None
    seen: Counts | None = None
    matched: Counts | None = None
    landmarks: LandmarkMap | None = None
    matched_ids: frozenset[int] = frozenset()
    marks: MarkFindings | None = None
    results: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    notices: Sequence[tuple[Notice, int]] = ()

    @property
    def primary(self) -> Track | None:
        """The estimate the report is about."""
        return primary_of(self.estimates)

    @property
    def is_by_marks(self) -> bool:
        """Whether the estimate the report is about comes from stripe marks."""
        return self.primary is not None and self.marks is not None and self.primary.source == self.marks.source

    @property
    def timed(self) -> "list[Track | Counts | MarkFindings]":
        """Everything that lies on the time axis."""
        parts: list[Track | Counts | MarkFindings | None] = [
            *self.estimates.values(),
            self.truth,
            self.seen,
            self.marks,
        ]
        return [part for part in parts if part is not None and len(part.stamps)]

    @property
    def start(self) -> int:
        """Stamp of the earliest thing known; the zero of all time axes [ns]."""
        return min((int(part.stamps[0]) for part in self.timed), default=0)

    @property
    def end(self) -> int:
        """Stamp of the latest thing known [ns]."""
        return max((int(part.stamps[-1]) for part in self.timed), default=0)

    @property
    def time_unit(self) -> tuple[str, float]:
        """Unit of the time axes, and how many ns it has."""
        return ("min", 60e9) if self.end - self.start > 3600e9 else ("s", 1e9)

    @property
    def evaluation(self) -> Mapping[str, object]:
        """What an evaluation against the truth found; empty when there was none."""
        return next((self.results[name] for name in ("evaluation", "evaluate") if name in self.results), {})

    @property
    def waypoints(self) -> list[Waypoint]:
        """The way points an evaluation told of, or none."""
        found = self.evaluation.get("waypoints")
        return (
            [Waypoint.read(point) for point in found if isinstance(point, Mapping)] if isinstance(found, list) else []
        )
