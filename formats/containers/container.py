"""What every log container gives: channels, and their messages as bytes in the order of log time.

A container (``rosbag1.py``, ``mcap.py``, ``rosbag2.py``, ``image_folder.py``) knows bytes, not messages: ``decode.py``
makes ROS messages of the bytes and ``messages.py`` makes events of those. Two containers hold their messages in chunks
that may overlap in time; ``in_time_order`` walks them with no more than the overlapping chunks in memory, and orders
equal times by the place in the file.

``guarded`` is the one boundary where foreign exceptions (of rosbags, mcap, lz4, zstandard, sqlite3, numpy, struct, ...)
become a ``FormatError`` that names the file and what was being read.
"""

from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple, Protocol

from ..errors import FormatError, LogposeError


@dataclass(frozen=True, slots=True)
class Channel:
    """One stream of messages in one container.

    Attributes:
        id: unique in the container.
        topic: its name.
        type: ROS type as ``package/msg/Name``, or the name of the schema.
        encoding: ``cdr``, ``ros1``, ``json``, ``file`` (an image file) or a name we cannot decode.
        definition: text of the message definition, empty when the container has none.
        definition_format: ``ros1msg``, ``ros2msg``, ``ros2idl``, ``jsonschema`` or empty.
        distro: the ROS distribution that wrote it, where the container says so.
        announced: number of messages by the container's own index, None when it has none.
    """

    id: int
    topic: str
    type: str
    encoding: str
    definition: str = ""
    definition_format: str = ""
    distro: str = ""
    announced: int | None = None


class Record(NamedTuple):
    """One message as bytes; sorts by log time, then by place in the file."""

    log_time: int
    place: tuple[int, int]
    channel: Channel
    data: bytes | memoryview


class Loss(NamedTuple):
    """Messages of a channel that could not be read: how many, and why; None where it is not known."""

    channel_id: int | None
    messages: int | None
    why: str


@dataclass(slots=True)
class Chunk:
    """A piece of a file that is read at once.

    Attributes:
        start: first log time in it [ns].
        offset: of its data in the file.
        size: of its data in the file [bytes].
        inflated: size when decompressed [bytes].
        compression: empty, ``none``, ``lz4``, ``zstd`` or ``bz2``.
        crc: of the decompressed data, 0 when there is none.
        counts: number of messages by channel id, empty when not known.
    """

    start: int
    offset: int
    size: int
    inflated: int
    compression: str
    crc: int = 0
    counts: dict[int, int] = field(default_factory=dict)


class Container(Protocol):
    """An opened log file; its records can be read many times.

    Attributes:
        name: of the file as it was given, for messages.
        format: for people: ``ROS 1 bag``, ``ROS 2 bag (sqlite3)``, ``MCAP``, ``images``.
        problems: one line each, what is wrong with the file as a whole, although it can be read.
    """

    name: str
    format: str
    problems: list[str]

    @property
    def channels(self) -> Mapping[int, Channel]:
        """The channels by id."""
        ...

    @property
    def is_cut(self) -> bool:
        """Whether messages may be missing in a way the container cannot count."""
        ...

    def records(self, wanted: frozenset[int], losses: list[Loss]) -> Iterator[Record]:
        """Yield the wanted channels' messages by log time; append to ``losses`` what could not be read."""
        ...


def in_time_order(
    chunks: Iterable[Chunk], load: Callable[[Chunk], list[Record]], wanted: frozenset[int]
) -> Iterator[Record]:
    """Yield the messages of chunks by (log time, place), holding only the chunks that overlap.

    Chunks whose counts are known and hold no wanted channel are not loaded.
    """
    relevant = [c for c in chunks if not c.counts or not wanted.isdisjoint(c.counts)]
    pending: list[Record] = []
    for chunk in sorted(relevant, key=lambda c: (c.start, c.offset)):
        # Only what is strictly older than the next chunk is final: equal times are ordered by place.
        ready = bisect_left(pending, chunk.start, key=_log_time)
        yield from pending[:ready]
        del pending[:ready]
        pending += load(chunk)
        pending.sort(key=_order)
    yield from pending


def lost_of(chunk: Chunk, found: Mapping[int, int], wanted: frozenset[int], err: Exception) -> list[Loss]:
    """Return what is lost of a damaged chunk, given how many messages of each channel were found before the damage."""
    why = f"damaged chunk at byte {chunk.offset} ({explain(err)})"
    if not chunk.counts:
        return [Loss(None, None, why)]
    missing = {channel: count - found.get(channel, 0) for channel, count in chunk.counts.items() if channel in wanted}
    return [Loss(channel, count, why) for channel, count in missing.items() if count > 0]


def _log_time(record: Record) -> int:
    return record.log_time


def _order(record: Record) -> tuple[int, tuple[int, int]]:
    return record.log_time, record.place


def full_type(name: str) -> str:
    """Return a ROS type as ``package/msg/Name``, also for the short ``package/Name`` of ROS 1."""
    package, slash, rest = name.partition("/")
    return f"{package}/msg/{rest}" if slash and "/" not in rest else name


@contextmanager
def guarded(path: str | Path, what: str) -> Iterator[None]:
    """Turn every foreign exception raised inside into a one-line FormatError about ``path``."""
    try:
        yield
    except LogposeError:
        raise
    except FileNotFoundError as err:
        raise FormatError(f"{path}: no such file or folder. Check the path.") from err
    except PermissionError as err:
        raise FormatError(f"{path}: no permission to read it. Check its owner and mode.") from err
    except Exception as err:
        raise FormatError(f"{path}: {what} cannot be read ({explain(err)}). The file is damaged.") from err


def explain(err: BaseException) -> str:
    """Return what a foreign exception says, in one line."""
    text = " ".join(str(err).split())
    if not text or isinstance(err, KeyError):
        return f"{type(err).__name__} {text}".strip()
    return text if len(text) <= 200 else text[:197] + "..."
