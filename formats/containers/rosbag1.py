"""Reads ROS 1 bags, format 2.0 (http://wiki.ros.org/Bags/Format/2.0), also those that were never closed.

The file is walked once from record to record, without inflating anything: the index records behind each chunk tell the
times and counts of its messages. The index at the end of the file is a help, not needed; where a connection is not
described outside the chunks, they are inflated once to collect it. A bag that is cut is read up to the cut.
Uncompressed bags have no checksum: a changed byte inside a message cannot be noticed.
"""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ..errors import FormatError, LogposeError
from .container import Channel, Chunk, Loss, Record, explain, full_type, guarded, in_time_order, lost_of
from .inflate import inflate

MAGIC = b"#ROSBAG V2.0\n"
MESSAGE, BAG_HEADER, INDEX, CHUNK, CHUNK_INFO, CONNECTION = 2, 3, 4, 5, 6, 7
_MAX_HEADER = 1 << 20

_LENGTH = struct.Struct("<I")
_TIME = struct.Struct("<II")
_INDEX_ENTRY = np.dtype([("sec", "<u4"), ("nsec", "<u4"), ("offset", "<u4")])


class Rosbag1File:
    """A ROS 1 bag, walked; see ``container.Container``."""

    format = "ROS 1 bag"

    def __init__(self, path: Path, name: str = "") -> None:
        self.path = path
        self.name = name or str(path)
        self.problems: list[str] = []
        self.is_cut = False
        self.channels: dict[int, Channel] = {}
        self._chunks: list[Chunk] = []
        self._announced: dict[int, int] = {}
        self._index_position = 0
        self._chunk_count = 0
        self._chunk_positions: set[int] = set()
        self._visited: set[int] = set()
        self._outside = 0
        with guarded(self.name, "the bag structure"):
            with path.open("rb") as stream:
                self._walk(stream, path.stat().st_size)
            if not self._is_complete():
                self._collect_from_chunks()
            self._count()

    def records(self, wanted: frozenset[int], losses: list[Loss]) -> Iterator[Record]:
        """Yield the wanted channels' messages by log time; append to ``losses`` what could not be read."""
        with guarded(self.name, "a message"), self.path.open("rb") as stream:

            def load(chunk: Chunk) -> list[Record]:
                return self._load(stream, chunk, wanted, losses)

            yield from in_time_order(self._chunks, load, wanted)

    def _walk(self, stream: BinaryIO, size: int) -> None:
        """Read every record but the content of the chunks; where the file is damaged go on by its index."""
        reached = self._walk_from(stream, len(MAGIC), size)
        if self._outside:
            self.is_cut = True
            self.problems.append(f"{self._outside} messages stand outside chunks and are not read")
        if reached == size and self._index_position < size:
            if not self._index_position:
                self.problems.append("the bag was never closed (no index); all complete chunks are read")
            elif len(self._chunk_positions) < self._chunk_count:
                self.problems.append("the index at the end of the bag is cut off; all messages are there")
            return
        stream.seek(reached)
        is_gap = not any(stream.read(16))
        has_index = reached < self._index_position < size
        if has_index and self._walk_from(stream, self._index_position, size) == size:
            for position in sorted(p for p in self._chunk_positions if p > reached):
                self._walk_from(stream, position, size)
            if not is_gap:
                self.problems.append(f"the file is damaged at byte {reached}; the rest is found by the index")
        else:
            self.is_cut = True
            self.problems.append(f"the file is cut off at byte {reached} of {size}; what came before it is read")

    def _walk_from(self, stream: BinaryIO, position: int, size: int) -> int:
        """Read records up to the end, to one that was read already, or to what is no record; return that position."""
        while position < size and position not in self._visited:
            stream.seek(position)
            record = _read_record(stream, position, size)
            if record is None:
                break
            self._visited.add(position)
            fields, offset, length = record
            try:
                self._take(stream, fields, offset, length)
            except LogposeError:
                raise
            except Exception as err:  # noqa: BLE001  # a field that is missing or has another size
                self.problems.append(f"a damaged record at byte {position} is skipped ({explain(err)})")
                self.is_cut |= fields["op"][0] == CHUNK
            position = offset + length
        return position

    def _take(self, stream: BinaryIO, fields: dict[str, bytes], offset: int, length: int) -> None:
        opcode = fields["op"][0]
        if opcode == BAG_HEADER:
            (self._index_position,) = struct.unpack("<Q", fields["index_pos"])
            self._chunk_count = _uint32(fields["chunk_count"])
            if fields.get("encryptor"):
                raise FormatError(f"{self.name}: the bag is encrypted. Decrypt it first.")
        elif opcode == CHUNK:
            compression, inflated = fields["compression"].decode(), _uint32(fields["size"])
            self._chunks.append(Chunk(0, offset, length, inflated, compression))
        elif opcode == INDEX:
            self._index(stream.read(length), _uint32(fields["conn"]))
        elif opcode == CONNECTION:
            self._connect(fields, stream.read(length))
        elif opcode == CHUNK_INFO:
            self._chunk_positions.add(struct.unpack("<Q", fields["chunk_pos"])[0])
            for conn, count in struct.iter_unpack("<II", stream.read(length)):
                self._announced[conn] = self._announced.get(conn, 0) + count
        elif opcode == MESSAGE:
            self._outside += 1

    def _index(self, data: bytes, connection: int) -> None:
        entries = np.frombuffer(data, _INDEX_ENTRY)
        if not self._chunks or not len(entries):
            return
        times = entries["sec"].astype(np.int64) * 1_000_000_000 + entries["nsec"]
        chunk = self._chunks[-1]
        first = int(times.min())
        chunk.start = min(chunk.start, first) if chunk.counts else first
        chunk.counts[connection] = chunk.counts.get(connection, 0) + len(entries)

    def _connect(self, fields: dict[str, bytes], data: bytes) -> None:
        number = _uint32(fields["conn"])
        inner = _fields(data)
        topic = (fields.get("topic") or inner["topic"]).decode()
        kind = full_type(inner["type"].decode())
        definition = inner.get("message_definition", b"").decode(errors="replace")
        self.channels[number] = Channel(number, topic, kind, "ros1", definition, "ros1msg")

    def _is_complete(self) -> bool:
        used = {connection for chunk in self._chunks for connection in chunk.counts}
        return used <= self.channels.keys() and all(c.counts for c in self._chunks)

    def _collect_from_chunks(self) -> None:
        with self.path.open("rb") as stream:
            for chunk in self._chunks:
                counts: dict[int, int] = {}
                times: list[int] = []
                try:
                    data = _inflated(stream, chunk)
                    for fields, start, end in _split(data):
                        if fields["op"][0] == CONNECTION:
                            self._connect(fields, bytes(data[start:end]))
                        elif fields["op"][0] == MESSAGE:
                            number = _uint32(fields["conn"])
                            counts[number] = counts.get(number, 0) + 1
                            times.append(_nanoseconds(fields["time"]))
                except Exception:  # noqa: BLE001, S110  # counted as a loss when the messages are read
                    pass
                if times and not chunk.counts:
                    chunk.start, chunk.counts = min(times), counts

    def _count(self) -> None:
        seen: dict[int, int] = {}
        for chunk in self._chunks:
            for connection, count in chunk.counts.items():
                seen[connection] = seen.get(connection, 0) + count
        for number, channel in self.channels.items():
            count = max(seen.get(number, 0), self._announced.get(number, 0))
            self.channels[number] = Channel(
                number, channel.topic, channel.type, "ros1", channel.definition, "ros1msg", announced=count
            )
        if unknown := (seen.keys() | self._announced.keys()) - self.channels.keys():
            lost = sum(max(seen.get(n, 0), self._announced.get(n, 0)) for n in unknown)
            self.is_cut = True
            self.problems.append(f"{lost} messages belong to connections that the bag does not describe")

    def _load(self, stream: BinaryIO, chunk: Chunk, wanted: frozenset[int], losses: list[Loss]) -> list[Record]:
        found: list[Record] = []
        counts: dict[int, int] = {}
        try:
            data = _inflated(stream, chunk)
            for fields, start, end in _split(data):
                if fields["op"][0] != MESSAGE:
                    continue
                number = _uint32(fields["conn"])
                counts[number] = counts.get(number, 0) + 1
                if number in wanted:
                    place, channel = (chunk.offset, start), self.channels[number]
                    found.append(Record(_nanoseconds(fields["time"]), place, channel, data[start:end]))
        except Exception as err:  # noqa: BLE001  # whatever the decompressors throw
            losses += lost_of(chunk, counts, wanted, err)
        return found


def _read_record(stream: BinaryIO, position: int, size: int) -> tuple[dict[str, bytes], int, int] | None:
    """Return the header fields of the record at ``position``, offset and length of its data; None where none is."""
    try:
        (length,) = _LENGTH.unpack(stream.read(4))
        if length > _MAX_HEADER:
            return None
        fields = _fields(stream.read(length))
        (data_length,) = _LENGTH.unpack(stream.read(4))
    except (struct.error, ValueError):
        return None
    offset = position + 8 + length
    is_whole = len(fields.get("op", b"")) == 1 and offset + data_length <= size
    return (fields, offset, data_length) if is_whole else None


def _fields(data: bytes | memoryview) -> dict[str, bytes]:
    """Split a header into its ``name=value`` fields."""
    fields: dict[str, bytes] = {}
    position, size = 0, len(data)
    while position < size:
        (length,) = _LENGTH.unpack_from(data, position)
        position += 4
        if position + length > size:
            raise ValueError("a header field is longer than its header")
        name, equals, value = bytes(data[position : position + length]).partition(b"=")
        if not equals:
            raise ValueError("a header field has no value")
        fields[name.decode("ascii")] = value
        position += length
    return fields


def _split(data: memoryview) -> Iterator[tuple[dict[str, bytes], int, int]]:
    """Yield (header fields, start, end) of the records in a chunk."""
    position, size = 0, len(data)
    while position < size:
        (length,) = _LENGTH.unpack_from(data, position)
        fields = _fields(data[position + 4 : position + 4 + length])
        (data_length,) = _LENGTH.unpack_from(data, position + 4 + length)
        start = position + 8 + length
        position = start + data_length
        if position > size:
            raise ValueError("a record is longer than its chunk")
        yield fields, start, position


def _inflated(stream: BinaryIO, chunk: Chunk) -> memoryview:
    stream.seek(chunk.offset)
    return memoryview(inflate(stream.read(chunk.size), chunk.compression, chunk.inflated))


def _uint32(value: bytes) -> int:
    return int(_LENGTH.unpack(value)[0])


def _nanoseconds(value: bytes) -> int:
    seconds, nanoseconds = _TIME.unpack(value)
    return int(seconds) * 1_000_000_000 + int(nanoseconds)
