"""Reads MCAP files (https://mcap.dev/spec): any profile, chunked or not, with or without an index.

The file is walked once from record to record, without inflating anything: every chunk tells its times and sizes, the
message indexes behind it tell how many messages of which channel it holds. Runs of messages outside chunks are treated
as chunks. So the summary at the end of the file is a help (channels, schemas, announced counts) but never needed; where
it does not name every channel, the chunks are inflated once to collect them. A file that is cut is read up to the cut.
Checksums of chunks are verified; a chunk that fails is counted as lost and the next one is read.
"""

import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from .container import Channel, Chunk, Loss, Record, explain, full_type, guarded, in_time_order, lost_of
from .inflate import inflate

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX = 1, 2, 3, 4, 5, 6, 7
CHUNK_INDEX, STATISTICS, DATA_END = 0x08, 0x0B, 0x0F
_MAX_TIME = 1 << 63
RUN_BYTES = 1 << 20
"""Messages outside chunks are read in runs of about this size."""

_RECORD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
_CHUNK = struct.Struct("<QQQII")
_FOOTER = struct.Struct("<QQI")


class McapFile:
    """An MCAP file, walked; see ``container.Container``."""

    format = "MCAP"

    def __init__(self, path: Path, name: str = "") -> None:
        self.path = path
        self.name = name or str(path)
        self.problems: list[str] = []
        self.is_cut = False
        self.channels: dict[int, Channel] = {}
        self._chunks: list[Chunk] = []
        self._schemas: dict[int, tuple[str, str, str]] = {}
        self._raw: dict[int, tuple[str, str, int]] = {}
        self._raw_of_data: dict[int, tuple[str, str, int]] = {}
        self._schemas_of_data: dict[int, tuple[str, str, str]] = {}
        self._announced: dict[int, int] | None = None
        self._chunk_positions: set[int] = set()
        self._visited: set[int] = set()
        self._is_data_ended = False
        self._footer = 0
        with guarded(self.name, "the MCAP structure"):
            with path.open("rb") as stream:
                self._walk(stream, path.stat().st_size)
            if not self._is_complete():
                self._collect_from_chunks()
            self._name_channels()

    def records(self, wanted: frozenset[int], losses: list[Loss]) -> Iterator[Record]:
        """Yield the wanted channels' messages by log time; append to ``losses`` what could not be read."""
        with guarded(self.name, "a message"), self.path.open("rb") as stream:

            def load(chunk: Chunk) -> list[Record]:
                return self._load(stream, chunk, wanted, losses)

            yield from in_time_order(self._chunks, load, wanted)

    # ---- the walk over the file -------------------------------------------------------------------------------

    def _walk(self, stream: BinaryIO, size: int) -> None:
        """Read every record but the content of the chunks; where the file is damaged go on by its summary."""
        reached = self._walk_from(stream, len(MAGIC), size)
        if self._footer:
            self._verify_summary(stream)
            stream.seek(reached)
            if stream.read(len(MAGIC) + 1) != MAGIC:
                self.problems.append("the end of the file is damaged; all messages are there")
            return
        if self._is_data_ended:
            self.problems.append("the summary at the end of the file is damaged; all messages are there")
            return
        summary = _summary_start(stream, size)
        end = self._walk_from(stream, summary, size) if reached < summary else 0
        if end == size - len(MAGIC) and self._announced is not None:
            for position in sorted(p for p in self._chunk_positions if p > reached):
                self._walk_from(stream, position, summary)
            self.problems.append(f"the file is damaged at byte {reached}; the rest is found by the summary")
        else:
            self.is_cut = True
            self.problems.append(f"the file is cut off at byte {reached} of {size}; what came before it is read")

    def _verify_summary(self, stream: BinaryIO) -> None:
        """Forget what the summary says where its checksum is wrong; the data section says it as well."""
        stream.seek(self._footer)
        start, _, crc = _FOOTER.unpack(stream.read(_FOOTER.size))
        if not crc or start >= self._footer:
            return
        stream.seek(start)
        if zlib.crc32(stream.read(self._footer + _FOOTER.size - 4 - start)) != crc:
            self.problems.append("the summary at the end of the file is damaged; all messages are there")
            self._raw, self._schemas, self._announced = self._raw_of_data, self._schemas_of_data, None

    def _walk_from(self, stream: BinaryIO, position: int, size: int) -> int:
        """Read records up to the footer, to one that was read already, or to what is none; return that position."""
        run: Chunk | None = None
        while position < size and position not in self._visited:
            stream.seek(position)
            head = stream.read(_RECORD.size)
            if len(head) < _RECORD.size:
                break
            opcode, length = _RECORD.unpack(head)
            body = position + _RECORD.size
            if opcode == 0 or body + length > size:
                break
            if opcode == MESSAGE:
                run = self._extend_run(stream, run, position, length)
            else:
                run = None
                self._visited.add(position)
                try:
                    self._take(stream, opcode, body, length)
                except Exception as err:  # noqa: BLE001  # whatever the mcap library throws
                    self.problems.append(f"a damaged record at byte {position} is skipped ({explain(err)})")
                    self.is_cut |= opcode == CHUNK
            position = body + length
            if opcode == FOOTER:
                break
        return position

    def _take(self, stream: BinaryIO, opcode: int, body: int, length: int) -> None:
        from mcap.data_stream import ReadDataStream
        from mcap.records import ChunkIndex, Header, Statistics

        if opcode == CHUNK:
            start, _, inflated, crc, n = _CHUNK.unpack(stream.read(_CHUNK.size))
            compression = stream.read(n).decode()
            (stored,) = struct.unpack("<Q", stream.read(8))
            offset = body + _CHUNK.size + n + 8
            stored = min(stored, body + length - offset)
            self._chunks.append(Chunk(start, offset, stored, inflated, compression, crc))
        elif opcode == MESSAGE_INDEX:
            channel, n = struct.unpack("<HI", stream.read(6))
            if n and self._chunks:
                counts = self._chunks[-1].counts
                counts[channel] = counts.get(channel, 0) + n // 16
        elif opcode in (SCHEMA, CHANNEL):
            self._define(opcode, stream.read(length))
        elif opcode == STATISTICS:
            counts = Statistics.read(ReadDataStream(BytesIO(stream.read(length)))).channel_message_counts
            self._announced = dict(counts)
        elif opcode == CHUNK_INDEX:
            self._chunk_positions.add(ChunkIndex.read(ReadDataStream(BytesIO(stream.read(length)))).chunk_start_offset)
        elif opcode == DATA_END:
            self._is_data_ended = True
            self._raw_of_data, self._schemas_of_data = dict(self._raw), dict(self._schemas)
        elif opcode == FOOTER:
            self._footer = body
        elif opcode == HEADER:
            Header.read(ReadDataStream(BytesIO(stream.read(length))))  # a damaged one is noticed here

    def _define(self, opcode: int, body: bytes) -> None:
        from mcap import records
        from mcap.data_stream import ReadDataStream

        if opcode == SCHEMA:
            schema = records.Schema.read(ReadDataStream(BytesIO(body)))
            text = schema.data.decode(errors="replace")
            self._schemas[schema.id] = (schema.name, schema.encoding, text)
        else:
            channel = records.Channel.read(ReadDataStream(BytesIO(body)))
            self._raw[channel.id] = (channel.topic, channel.message_encoding, channel.schema_id)

    def _extend_run(self, stream: BinaryIO, run: Chunk | None, position: int, length: int) -> Chunk:
        channel, _, log_time, _ = _MESSAGE.unpack(stream.read(_MESSAGE.size))
        if run is None or run.size > RUN_BYTES:
            run = Chunk(log_time, position, 0, 0, "")
            self._chunks.append(run)
        run.start = min(run.start, log_time)
        run.size += _RECORD.size + length
        run.inflated = run.size
        run.counts[channel] = run.counts.get(channel, 0) + 1
        return run

    # ---- channels ---------------------------------------------------------------------------------------------

    def _is_complete(self) -> bool:
        """Tell whether every channel, its schema and its count are known without inflating a chunk."""
        used = {channel for chunk in self._chunks for channel in chunk.counts}
        if self._announced is None and any(not chunk.counts for chunk in self._chunks):
            return False
        used.update(self._announced or ())
        schemas = {schema for _, _, schema in self._raw.values()} - {0}
        return used <= self._raw.keys() and schemas <= self._schemas.keys()

    def _collect_from_chunks(self) -> None:
        with self.path.open("rb") as stream:
            for chunk in self._chunks:
                try:
                    data = _inflated(stream, chunk)
                    counts: dict[int, int] = {}
                    for opcode, start, end in _split(data):
                        if opcode in (SCHEMA, CHANNEL):
                            self._define(opcode, data[start:end])
                        elif opcode == MESSAGE:
                            channel = _MESSAGE.unpack_from(data, start)[0]
                            counts[channel] = counts.get(channel, 0) + 1
                except Exception:  # noqa: BLE001, S112  # counted as a loss when the messages are read
                    continue
                chunk.counts = chunk.counts or counts

    def _name_channels(self) -> None:
        seen: dict[int, int] = {}
        for chunk in self._chunks:
            for channel, count in chunk.counts.items():
                seen[channel] = seen.get(channel, 0) + count
        announced = seen if self._announced is None else self._announced
        for number, (topic, encoding, schema) in self._raw.items():
            name, definition_format, definition = self._schemas.get(schema, ("", "", ""))
            name = full_type(name) if encoding in ("cdr", "ros1") else name
            count = max(announced.get(number, 0), seen.get(number, 0))
            self.channels[number] = Channel(
                number, topic, name, encoding, definition, definition_format, announced=count
            )
        if unknown := (seen.keys() | announced.keys()) - self._raw.keys():
            lost = sum(max(announced.get(n, 0), seen.get(n, 0)) for n in unknown)
            self.is_cut = True
            self.problems.append(f"{lost} messages belong to channels that the file does not describe")

    # ---- messages ---------------------------------------------------------------------------------------------

    def _load(self, stream: BinaryIO, chunk: Chunk, wanted: frozenset[int], losses: list[Loss]) -> list[Record]:
        found: list[Record] = []
        counts: dict[int, int] = {}
        try:
            data = memoryview(_inflated(stream, chunk))
            for opcode, start, end in _split(data):
                if opcode == MESSAGE:
                    channel, _, log_time, _ = _MESSAGE.unpack_from(data, start)
                    counts[channel] = counts.get(channel, 0) + 1
                    if channel in wanted and log_time >= _MAX_TIME:
                        losses.append(Loss(channel, 1, "damaged message (impossible log time)"))
                    elif channel in wanted:
                        place = (chunk.offset, start)
                        found.append(Record(log_time, place, self.channels[channel], data[start + _MESSAGE.size : end]))
        except Exception as err:  # noqa: BLE001  # whatever the decompressors throw
            losses += lost_of(chunk, counts, wanted, err)
        return found


def _summary_start(stream: BinaryIO, size: int) -> int:
    """Return where the footer says that the summary starts, 0 where there is none."""
    footer = _RECORD.size + _FOOTER.size
    if size < footer + 2 * len(MAGIC):
        return 0
    stream.seek(size - len(MAGIC) - footer)
    opcode, length = _RECORD.unpack(stream.read(_RECORD.size))
    start = _FOOTER.unpack(stream.read(_FOOTER.size))[0]
    is_footer = opcode == FOOTER and length == _FOOTER.size and stream.read(len(MAGIC)) == MAGIC
    return int(start) if is_footer else 0


def _inflated(stream: BinaryIO, chunk: Chunk) -> bytes:
    stream.seek(chunk.offset)
    data = inflate(stream.read(chunk.size), chunk.compression, chunk.inflated)
    if chunk.crc and zlib.crc32(data) != chunk.crc:
        raise ValueError("its checksum is wrong")
    return data


def _split(data: bytes | memoryview) -> Iterator[tuple[int, int, int]]:
    """Yield (opcode, start, end) of the records in a chunk."""
    position, size = 0, len(data)
    while position < size:
        opcode, length = _RECORD.unpack_from(data, position)
        start = position + _RECORD.size
        position = start + length
        if position > size:
            raise ValueError("a record is longer than its chunk")
        yield opcode, start, position
