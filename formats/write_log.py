"""``create_log``: the only way out into a log, an MCAP file or a ROS 1 bag by the suffix of its name.

The same events give the same bytes. The file appears under its name when it is complete and not before; an error or a
kill leaves nothing, or the old file. MCAP files have checksums and every index, so any reader takes them; every message
is a ROS message (sightings are a String that holds their line of ``sightings.jsonl``), so ROS takes them too.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, Literal, Protocol, TypeVar, cast

from .containers.container import guarded
from .encode import Encoder, as_message
from .errors import ConfigError, FormatError, LogposeError
from .events import Event
from .files import replacing

T = TypeVar("T")
Compression = Literal["none", "lz4", "zstd", "bz2"]
CHUNK_BYTES = 1 << 20

_LATCHED = ("tf_static", "camera_info", "initialpose")
"""Ends of topics that a player must repeat to whoever comes later."""

_LATCHED_QOS = (
    "- history: 1\n  depth: 1\n  reliability: 1\n  durability: 1\n"
    "  deadline:\n    sec: 9223372036\n    nsec: 854775807\n"
    "  lifespan:\n    sec: 9223372036\n    nsec: 854775807\n"
    "  liveliness: 1\n  liveliness_lease_duration:\n    sec: 9223372036\n    nsec: 854775807\n"
    "  avoid_ros_namespace_conventions: false"
)


class _Sink(Protocol):
    """What writes one container."""

    def message(self, topic: str, ros_type: str, stamp: int, message: Any) -> None:
        """Write one message; the first of a topic also describes it."""

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record."""

    def attach(self, name: str, data: bytes) -> None:
        """Write an attachment."""

    def finish(self) -> None:
        """Write what stands at the end of the file."""


class LogWriter:
    """Takes events and messages; log time and publish time are the event's stamp."""

    def __init__(self, path: Path, sink: _Sink) -> None:
        self._path = path
        self._sink = sink

    def write(self, event: Event) -> None:
        """Write an event on its topic.

        Raises:
            FormatError: the event has no topic, or cannot be a message.
        """
        if not event.topic:
            raise FormatError(f"{self._path}: a {type(event).__name__} has no topic. Give it one before writing it.")
        ros_type, fields = self._guard(lambda: as_message(event))
        self.write_message(event.topic, ros_type, event.stamp, fields)

    def write_message(self, topic: str, ros_type: str, stamp: int, message: Any) -> None:
        """Write any ROS message.

        Args:
            topic: its name.
            ros_type: ``package/msg/Name`` of a type that ROS defines.
            stamp: log time [ns].
            message: its fields as a mapping in ROS 2 names, what is missing is zero; or a ready message object.

        Raises:
            FormatError: an unknown type or field, or a value that does not fit.
        """
        self._guard(lambda: self._sink.message(topic, ros_type, stamp, message))

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Add a metadata record.

        Raises:
            FormatError: the container has none (ROS 1 bag).
        """
        self._guard(lambda: self._sink.metadata(name, values))

    def attach(self, name: str, data: bytes) -> None:
        """Attach a file.

        Raises:
            FormatError: the container has no attachments (ROS 1 bag).
        """
        self._guard(lambda: self._sink.attach(name, data))

    def _guard(self, write: Callable[[], T]) -> T:
        try:
            return write()
        except LogposeError:
            raise
        except (ValueError, TypeError, KeyError, AttributeError, OverflowError) as err:
            raise FormatError(f"{self._path}: {err}. Check the event.") from err


@contextmanager
def create_log(path: str | Path, *, compression: Compression = "zstd") -> Iterator[LogWriter]:
    """Open a log for writing; it appears under its name when the block ends without an error.

    Args:
        path: ends in ``.mcap`` or ``.bag``.
        compression: of the chunks. A bag knows no zstd: there it means lz4; MCAP knows no bz2.

    Raises:
        ConfigError: another suffix, or a compression the container does not have.
        FormatError: the file cannot be written.
    """
    target = Path(path)
    suffix = target.suffix.lower()
    if suffix not in (".mcap", ".bag"):
        raise ConfigError(f"{target}: the suffix says neither MCAP nor ROS 1 bag. Name it .mcap or .bag.")
    if suffix == ".mcap" and compression == "bz2":
        raise ConfigError(f"{target}: MCAP knows no bz2. Choose none, lz4 or zstd.")
    if target.is_dir():
        raise ConfigError(f"{target}: is a folder. Name a file.")
    with replacing(target) as stream:
        sink: _Sink = _McapSink(stream, compression) if suffix == ".mcap" else _BagSink(stream, compression)
        yield LogWriter(target, sink)
        with guarded(target, "what was written"):
            sink.finish()


class _McapSink:
    """Writes MCAP with the mcap library: chunk and summary checksums, all indexes."""

    def __init__(self, stream: BinaryIO, compression: str) -> None:
        from mcap.writer import CompressionType, Writer

        self._writer: Any = Writer(stream, CHUNK_BYTES, CompressionType[compression.upper()])
        self._writer.start(profile="ros2", library="logpose")
        self._encoder = Encoder("ros2")
        self._channels: dict[tuple[str, str], int] = {}
        self._schemas: dict[str, int] = {}
        self._sequence: dict[int, int] = {}

    def message(self, topic: str, ros_type: str, stamp: int, message: Any) -> None:
        data = self._encoder.encode(ros_type, message)
        if (topic, ros_type) not in self._channels:
            definition = self._encoder.definition(ros_type)[0]
            metadata = {"offered_qos_profiles": _LATCHED_QOS if topic.endswith(_LATCHED) else ""}
            schema = self._schema(ros_type, "ros2msg", definition)
            self._channels[topic, ros_type] = self._writer.register_channel(topic, "cdr", schema, metadata)
        self._add(self._channels[topic, ros_type], stamp, bytes(data))

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        self._writer.add_metadata(name, dict(values))

    def attach(self, name: str, data: bytes) -> None:
        media = "application/json" if name.endswith(".json") else "application/octet-stream"
        self._writer.add_attachment(0, 0, name, media, data)

    def finish(self) -> None:
        self._writer.finish()

    def _schema(self, name: str, form: str, definition: str) -> int:
        if name not in self._schemas:
            self._schemas[name] = self._writer.register_schema(name, form, definition.encode())
        return self._schemas[name]

    def _add(self, channel: int, stamp: int, data: bytes) -> None:
        if not 0 <= stamp < 2**63:
            raise ValueError(f"stamp {stamp} ns cannot be written")
        sequence = self._sequence[channel] = self._sequence.get(channel, 0) + 1
        self._writer.add_message(channel, stamp, data, stamp, sequence)


class _OpenedAlready:
    """Stands in for the path of rosbags' writer, which would open a file of its own."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream

    def open(self, _mode: str) -> "_OpenedAlready":
        """Return itself: there is nothing to open."""
        return self

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def close(self) -> None:
        """Leave the stream open: who opened it closes it."""


class _BagSink:
    """Writes a ROS 1 bag with rosbags' writer."""

    def __init__(self, stream: BinaryIO, compression: str) -> None:
        from rosbags.rosbag1 import Writer

        self._writer = Writer("a file that does not exist")
        self._writer.path = cast("Path", _OpenedAlready(stream))
        if compression != "none":
            form = Writer.CompressionFormat.BZ2 if compression == "bz2" else Writer.CompressionFormat.LZ4
            self._writer.set_compression(form)
        self._writer.open()
        self._encoder = Encoder("ros1")
        self._connections: dict[tuple[str, str], Any] = {}

    def message(self, topic: str, ros_type: str, stamp: int, message: Any) -> None:
        data = self._encoder.encode(ros_type, message)
        if (topic, ros_type) not in self._connections:
            definition, digest = self._encoder.definition(ros_type)
            latching = int(topic.endswith(_LATCHED))
            self._connections[topic, ros_type] = self._writer.add_connection(
                topic, ros_type, msgdef=definition, md5sum=digest, callerid="/logpose", latching=latching
            )
        if not 0 <= stamp < 2**32 * 1_000_000_000:
            raise ValueError(f"stamp {stamp} ns cannot be written")
        self._writer.write(self._connections[topic, ros_type], stamp, data)

    def metadata(self, name: str, values: Mapping[str, str]) -> None:  # noqa: ARG002
        raise ValueError("a ROS 1 bag holds no metadata records; write .mcap")

    def attach(self, name: str, data: bytes) -> None:  # noqa: ARG002
        raise ValueError("a ROS 1 bag holds no attachments; write .mcap")

    def finish(self) -> None:
        self._writer.close()
