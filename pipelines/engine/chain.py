"""The stages of a pipeline, chained: one generator after the other, each watched.

Between two stages stands a watch. It counts and times what passes, keeps the event a stage was last given, and turns
whatever goes wrong inside a stage into one line that names file, line, stage, event and reason. Nothing runs until the
last stage is asked for an event; back-pressure is free.
"""

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from ...formats.errors import FormatError, LogposeError, StageError
from ...formats.events import Event
from .pipeline import BoundStage, Pipeline
from .workers import apply_in_threads, apply_serially


@dataclass(slots=True)
class StageTally:
    """What a stage did: events given to it and passed on by it, and the seconds it and all before it took."""

    name: str
    workers: int = 1
    events_in: int = 0
    events_out: int = 0
    seconds_with_upstream: float = 0.0


class Chain:
    """An iterator over what leaves the last stage."""

    def __init__(self, pipeline: Pipeline, events: Iterable[Event]) -> None:
        """Chain the stages of ``pipeline`` behind ``events``; nothing runs yet."""
        self.source = StageTally("read")
        self.tallies = [StageTally(stage.spec.name, stage.workers) for stage in pipeline.stages]
        self._open: list[Iterator[Event]] = []
        stream = _timed(iter(events), self.source)
        for stage, tally in zip(pipeline.stages, self.tallies, strict=True):
            stream = self._attach(stage, tally, stream)
        self._stream = stream

    def __iter__(self) -> Iterator[Event]:
        """Run the pipeline; on an error every stage is closed, so that writers remove what is half written."""
        try:
            yield from self._stream
        finally:
            for generator in reversed(self._open):
                close = getattr(generator, "close", None)
                if close:
                    close()

    def seconds(self) -> dict[str, float]:
        """Return the seconds each stage took by itself, the reading of the log first."""
        tallies = [self.source, *self.tallies]
        before = [0.0, *(tally.seconds_with_upstream for tally in tallies)]
        names = _numbered([tally.name for tally in tallies])
        return {name: tally.seconds_with_upstream - t for name, tally, t in zip(names, tallies, before, strict=False)}

    def _attach(self, stage: BoundStage, tally: StageTally, upstream: Iterator[Event]) -> Iterator[Event]:
        spec, params = stage.spec, stage.params
        given = _Given(upstream, tally)

        def work(event: Event) -> list[Event]:
            try:
                return list(spec.function(event, params))
            except Exception as err:
                raise _located(err, stage, event) from err

        if spec.takes is None:
            made = iter(spec.function(iter(given), params))
        elif stage.workers == 1:
            made = apply_serially(work, given, spec.takes)
        else:
            made = apply_in_threads(work, given, spec.takes, stage.workers)
        self._open.append(made)
        return _timed(_watched(made, stage, given), tally)


class _Given:
    """The events given to a stage; remembers the last one, for the error message."""

    def __init__(self, upstream: Iterator[Event], tally: StageTally) -> None:
        self.upstream, self.tally = upstream, tally
        self.last: Event | None = None
        self.is_over = False

    def __iter__(self) -> Iterator[Event]:
        for event in self.upstream:
            self.tally.events_in += 1
            self.last = event
            yield event
        self.is_over = True


def _watched(made: Iterator[Event], stage: BoundStage, given: _Given) -> Iterator[Event]:
    try:
        yield from made
    except Exception as err:
        event = None if given.is_over else given.last
        raise _located(err, stage, event) from err


def _timed(stream: Iterator[Event], tally: StageTally) -> Iterator[Event]:
    clock = time.perf_counter
    while True:
        start = clock()
        try:
            event = next(stream)
        except StopIteration:
            return
        finally:
            tally.seconds_with_upstream += clock() - start
        tally.events_out += 1
        yield event


def _located(err: Exception, stage: BoundStage, event: Event | None) -> Exception:
    """Say where it happened, unless the error already does; a reader of ours that went away is no error of a stage."""
    if isinstance(err, BrokenPipeError):
        return err
    if isinstance(err, OSError):
        reason = err.strerror or type(err).__name__
        return FormatError(
            f"{stage.spec.name}: cannot write ({reason}). Free some space or choose another place with -o."
        )
    if isinstance(err, StageError) and not err.is_located:
        reason = str(err)
    elif isinstance(err, LogposeError):
        return err
    elif isinstance(err, ValueError) and not isinstance(err, UnicodeError):
        reason = str(err)
    else:
        text = " ".join(str(err).split())  # a compiler's complaint has many lines
        reason = f"{type(err).__name__}: {text}. This is a fault of logpose; --traceback shows where"
    located = StageError(
        f"{stage.where}: stage {stage.spec.name!r} failed at {_describe(event)}: {reason.rstrip('.')}."
    )
    located.is_located = True
    return located


def _describe(event: Event | None) -> str:
    if event is None:
        return "the end of the log"
    place = f" on {event.topic}" if event.topic else f" from {event.source}" if event.source else ""
    return f"{type(event).__name__} t={event.stamp // 10**9}.{event.stamp % 10**9:09d} s{place}"


def _numbered(names: list[str]) -> list[str]:
    """Make names unique: the second ``write-trajectory`` is ``write-trajectory#2``."""
    return [
        name if names[:i].count(name) == 0 else f"{name}#{names[:i].count(name) + 1}" for i, name in enumerate(names)
    ]
