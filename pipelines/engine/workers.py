"""One pure stage on several threads: order kept, at most ``2 n`` messages in flight, output equal to the serial one."""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor

from ...formats.events import Event

Work = Callable[[Event], list[Event]]


def apply_serially(work: Work, events: Iterable[Event], takes: type[Event]) -> Iterator[Event]:
    """Forward every event, each followed by what ``work`` makes of it."""
    for event in events:
        yield event
        if isinstance(event, takes):
            yield from work(event)


def apply_in_threads(work: Work, events: Iterable[Event], takes: type[Event], workers: int) -> Iterator[Event]:
    """Do the same with ``workers`` threads.

    The events between two messages wait with them, so memory is bounded by what the log holds during ``2 n`` messages.
    """
    waiting: deque[tuple[Event, Future[list[Event]] | None]] = deque()
    in_flight = 0
    with ThreadPoolExecutor(workers, thread_name_prefix="stage") as pool:
        try:
            for event in events:
                future = pool.submit(work, event) if isinstance(event, takes) else None
                in_flight += future is not None
                waiting.append((event, future))
                while waiting and (waiting[0][1] is None or in_flight >= 2 * workers):
                    head, made = waiting.popleft()
                    in_flight -= made is not None
                    yield head
                    if made is not None:
                        yield from made.result()
            for head, made in waiting:
                yield head
                if made is not None:
                    yield from made.result()
        finally:
            for _, made in waiting:
                if made is not None:
                    made.cancel()
