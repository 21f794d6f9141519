"""Everything a page is made from: tracks, results and notices, which all runs have, and what is kept of each kind seen.

Pictures and tables take it all and leave out what is not there.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

from ...formats.events import Notice
from .track import Stamps, Track, Waypoint, primary_of

T = TypeVar("T")


def first_of(things: Iterable[object], kind: type[T]) -> T | None:
    """Return the first thing of a class, or None."""
    return next((thing for thing in things if isinstance(thing, kind)), None)


class Kept(Protocol):
    """What is left of a kind when the log has ended."""

    @property
    def source(self) -> str:
        """The stage that saw it; empty if none did."""

    @property
    def stamps(self) -> Stamps:
        """(N,) of what was seen, non-decreasing [ns]."""

    @property
    def gives_poses(self) -> bool:
        """Whether one sighting says where the robot is."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Findings:
    """Everything a report is made from.

    Attributes:
        estimates: by source, in order of appearance; the first that is not dead reckoning is the one in question.
        truth: None when not known.
        kept: of the kinds of things that were seen or have a map.
        results: what the stages summed up, by source; ``run`` is the run itself.
        notices: what a person should know, the first of each code, with how often.
    """

    estimates: Mapping[str, Track] = field(default_factory=dict)
    truth: Track | None = None
    kept: Sequence[Kept] = ()
    results: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    notices: Sequence[tuple[Notice, int]] = ()

    def of(self, kind: type[T]) -> T | None:
        """Return what was kept of one kind, by its class, or None."""
        return first_of(self.kept, kind)

    @property
    def primary(self) -> Track | None:
        """The estimate the report is about."""
        return primary_of(self.estimates)

    @property
    def is_by_images(self) -> bool:
        """Whether the estimate the report is about comes from sightings that each give a whole pose."""
        track = self.primary
        return track is not None and any(part.gives_poses and part.source == track.source for part in self.kept)

    @property
    def timed(self) -> list[Track | Kept]:
        """Everything that lies on the time axis."""
        parts: list[Track | Kept | None] = [*self.estimates.values(), self.truth, *self.kept]
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
        return self.results.get("evaluation", {})

    @property
    def aligned_by(self) -> str:
        """How the evaluation moved the estimate onto the truth first; empty if it did not."""
        alignment = self.evaluation.get("alignment")
        mode = alignment.get("method") if isinstance(alignment, Mapping) else None
        return "" if mode in {None, "none"} else str(mode)

    @property
    def waypoints(self) -> list[Waypoint]:
        """The way points an evaluation told of, or none."""
        found = self.evaluation.get("waypoints")
        return (
            [Waypoint.read(point) for point in found if isinstance(point, Mapping)] if isinstance(found, list) else []
        )
