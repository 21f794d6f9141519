"""What a stage is: a generator function over events, or a pure function of one message.

::

    def dead_reckon(events: Iterator[Event], params: DeadReckonParams) -> Iterator[Event]: ...

    @per_message
    def detect_circles(event: Image, params: DetectCirclesParams) -> Iterable[Event]: ...

A stage forwards every event, also what it consumes, in time order; a made event carries the stamp of what it was made
from and follows it. The engine forwards for a ``@per_message`` stage, which therefore yields only what it makes; only
such a stage takes ``workers``.

What a name in a pipeline file stands for is looked up in a table, name -> ``module:function``, that the caller gives
(``pipelines/catalog.py``): the engine knows no stage by name.
"""

import difflib
import importlib
import inspect
import typing
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import TypeVar

from ...formats.events import Event
from .params import Params

F = TypeVar("F", bound=Callable[..., object])

Table = Mapping[str, str]
"""Stage name -> ``module:function``."""

_MARK = "_logpose_per_message"


def per_message(function: F) -> F:
    """Mark a pure stage: one message of its first parameter's type in, events out, no state."""
    setattr(function, _MARK, True)
    return function


@dataclass(frozen=True, slots=True)
class StageSpec:
    """A stage that can be built.

    Attributes:
        name: as written in a pipeline file.
        function: the generator function, or the function of one message.
        params: model of its parameters.
        takes: for a ``@per_message`` stage the type of message it is called with, otherwise None.
    """

    name: str
    function: Callable[..., Iterable[Event]]
    params: type[Params]
    takes: type[Event] | None

    @property
    def doc(self) -> str:
        """First paragraph of what it does."""
        return (inspect.getdoc(self.function) or "").split("\n\n")[0]


@cache
def load_stage(name: str, target: str) -> StageSpec:
    """Import ``target`` (``module:function``) and read what it takes from its annotations."""
    module_name, _, function_name = target.partition(":")
    function = getattr(importlib.import_module(module_name), function_name)
    hints = typing.get_type_hints(function)
    names = list(inspect.signature(function).parameters)
    params = hints[names[1]]
    takes = hints[names[0]] if getattr(function, _MARK, False) else None
    return StageSpec(name, function, params, takes)


def closest(word: str, words: Iterable[str]) -> str:
    """Return a sentence that helps: the word that was probably meant, or all there are."""
    known = sorted(words)
    match = difflib.get_close_matches(word, known, n=1, cutoff=0.6)
    if match:
        return f"Did you mean {match[0]!r}?"
    return f"There is: {', '.join(known)}." if known else "There is none."
