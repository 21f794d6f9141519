"""What a stage is: a generator function over events, or a pure function of one message.

::

    def dead_reckon(events: Iterator[Event], params: DeadReckonParams) -> Iterator[Event]: ...

    @per_message
    def detect_circles(event: Image, params: DetectCirclesParams) -> Iterable[Event]: ...

A stage forwards every event, also what it consumes, in time order; a made event carries the stamp of what it was made
from and follows it. The engine forwards for a ``@per_message`` stage, which therefore yields only what it makes; only
such a stage takes ``workers``.
"""

from collections.abc import Callable
from typing import TypeVar

F = TypeVar("F", bound=Callable[..., object])

_MARK = "_logpose_per_message"


def per_message(function: F) -> F:
    """Mark a pure stage: one message of its first parameter's type in, events out, no state."""
    setattr(function, _MARK, True)
    return function


def is_per_message(function: Callable[..., object]) -> bool:
    """Tell whether ``function`` was marked by ``per_message``."""
    return getattr(function, _MARK, False)
