"""Puts messages that were logged in the order of arrival into the order of their header stamps.

A message waits until the log has gone on for the look-ahead; among the waiting ones the smallest stamp leaves first,
and equal stamps leave as they came. One wild stamp in the future therefore delays nothing but itself. A message that
comes after a later stamp has left is handed to ``late``. What waits is bounded in number and in bytes.
"""

from collections.abc import Callable, Iterable, Iterator
from heapq import heappop, heappush
from typing import NamedTuple

from .events import Event

LOOK_AHEAD_NS = 1_000_000_000
MAX_WAITING = 100_000
MAX_WAITING_BYTES = 512 << 20


class Message(NamedTuple):
    """A decoded message: sorts by stamp, then as it came.

    Attributes:
        stamp: of its events [ns].
        order: running number.
        log_time: when it was logged [ns].
        size: of its content [bytes].
        topic: its name.
        events: one for every role of the topic.
    """

    stamp: int
    order: int
    log_time: int
    size: int
    topic: str
    events: tuple[Event, ...]


def in_stamp_order(
    messages: Iterable[Message], late: Callable[[Message], None], look_ahead_ns: int = LOOK_AHEAD_NS
) -> Iterator[Message]:
    """Yield messages by stamp; they come by log time.

    Args:
        messages: by log time.
        late: is given every message whose stamp goes back by more than the look-ahead.
        look_ahead_ns: how long a message waits [ns].
    """
    waiting: list[Message] = []
    held = 0
    last: int | None = None
    for message in messages:
        if last is not None and message.stamp < last:
            late(message)
            continue
        heappush(waiting, message)
        held += message.size
        due = message.log_time - look_ahead_ns
        while waiting and (waiting[0].log_time <= due or len(waiting) > MAX_WAITING or held > MAX_WAITING_BYTES):
            ready = heappop(waiting)
            held -= ready.size
            last = ready.stamp
            yield ready
    while waiting:
        yield heappop(waiting)
