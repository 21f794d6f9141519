"""What a kind of thing seen (landmarks, stripe marks) gives to reports: a folder of its own, summed up in one ``Kind``.

``kinds.py`` lists them, ``contents.py`` names their pictures; nothing else in the report knows a kind by
name, but for the maps that its stages take.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from ...formats.events import Array, Event
from ...formats.write_log import LogWriter
from .findings import Findings, Kept

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Maps: TypeAlias = Sequence[object]
"""The maps that were given, of any kind; ``first_of`` finds one."""


class Keeper(Protocol):
    """Takes a run's events and keeps what a page needs."""

    def take(self, event: Event) -> None:
        """Keep what is needed of an event."""

    def build(self) -> Kept | None:
        """Return what was kept, or None if a page has nothing of it."""


class Recorder(Protocol):
    """Writes what it takes into a log."""

    def take(self, event: Event) -> None:
        """Write what belongs in the log of one event."""

    def end(self) -> None:
        """Write what is known only when the log has ended."""


class Support(NamedTuple):
    """What poses had to go by: of each class which poses (N,), role of the colour, width of the line, and words."""

    classes: Sequence[tuple[npt.NDArray[np.bool_], str, float, str]]
    caption: str


Layer: TypeAlias = 'Callable[["Axes", Findings, float | None], None]'
"""Draws into a map whose extent is given [m]; None asks for places alone, without labels, as ground for something."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """What the report asks of a kind; every function takes the findings of runs without any of it, too.

    Attributes:
        keeper: makes what keeps it for a page, given the maps.
        recorder: makes what writes it into a log, given that log, the maps, and the name of the robot's frame.
        under, over: draw it into a map, before the trajectories and after them.
        places: of a map, what is shown in any case and what if it is near: (M, 2) each [m].
        map_caption: what to look for in the map.
        support: sorts the poses of the primary estimate by what they had to go by; None if it cannot.
        says: its part of the verdict.
        section: its part of the page, as HTML.
    """

    keeper: Callable[[Maps], Keeper]
    recorder: Callable[[LogWriter, Maps, str], Recorder]
    under: Layer = lambda *_: None
    over: Layer = lambda *_: None
    places: Callable[[Findings], tuple[Array, Array]] = lambda _: (np.empty((0, 2)), np.empty((0, 2)))
    map_caption: Callable[[Findings], str] = lambda _: ""
    support: Callable[[Findings], Support | None] = lambda _: None
    says: Callable[[Findings], Sequence[str]] = lambda _: ()
    section: Callable[[Findings], str] = lambda _: ""
