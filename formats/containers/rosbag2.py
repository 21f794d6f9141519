"""Reads ROS 2 bags: the folder with ``metadata.yaml`` (or without it) and its sqlite3 storage files.

MCAP storage files are read by ``mcap.py``. A ``.db3`` is opened read-only; every schema since the first is understood,
also those without message definitions (``decode.py`` then falls back to the definitions of a ROS distribution).
"""

import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from urllib.parse import quote

from ..errors import FormatError
from .container import Channel, Container, Loss, Record, explain, full_type, guarded
from .inflate import MAX_CHUNK, inflate_zstd
from .sniff import storage_files


@dataclass(frozen=True, slots=True)
class BagFolder:
    """What ``metadata.yaml`` says, or the folder's content where there is none.

    Attributes:
        files: the storage files in order.
        announced: number of messages by topic; empty without ``metadata.yaml``.
        is_message_compressed: every message is a zstd frame of its own.
        distro: ROS distribution that wrote it, or empty.
        problems: one line each.
    """

    files: tuple[Path, ...]
    announced: Mapping[str, int]
    is_message_compressed: bool = False
    distro: str = ""
    problems: tuple[str, ...] = ()


def read_folder(folder: Path) -> BagFolder:
    """Read ``metadata.yaml`` of a ROS 2 bag.

    Raises:
        FormatError: it is damaged, or a file it names is missing.
    """
    path = folder / "metadata.yaml"
    if not path.is_file():
        note = "there is no metadata.yaml; all storage files of the folder are read"
        return BagFolder(tuple(storage_files(folder)), {}, problems=(note,))
    import yaml

    with guarded(path, "metadata.yaml"):
        info = yaml.safe_load(path.read_text(encoding="utf-8"))["rosbag2_bagfile_information"]
        names = [PurePosixPath(str(name)).name for name in info["relative_file_paths"]]
        announced: dict[str, int] = {}
        for entry in info.get("topics_with_message_count") or ():
            topic = str(entry["topic_metadata"]["name"])
            announced[topic] = announced.get(topic, 0) + int(entry["message_count"])
        mode = str(info.get("compression_mode") or "").lower()
        distro = str(info.get("ros_distro") or "")
    if not names:
        raise FormatError(f"{path}: names no storage file. Run ros2 bag reindex on the folder.")
    missing = [name for name in names if not (folder / name).is_file()]
    problems = [f"{name} is named in metadata.yaml but missing" for name in missing]
    if len(missing) == len(names):
        raise FormatError(f"{folder}: {missing[0]} is named in metadata.yaml but missing. Copy it into the folder.")
    files = tuple(folder / name for name in names if name not in missing)
    return BagFolder(files, announced, mode == "message", distro, tuple(problems))


class SqliteFile:
    """A ``.db3`` storage file; see ``container.Container``."""

    format = "ROS 2 bag (sqlite3)"

    def __init__(self, path: Path, name: str = "", distro: str = "") -> None:
        self.path = path
        self.name = name or str(path)
        self.problems: list[str] = []
        self.is_cut = False
        self.channels: dict[int, Channel] = {}
        with guarded(self.name, "the database"), closing(self._connect()) as database:
            self._read_channels(database, distro)

    def records(self, wanted: frozenset[int], losses: list[Loss]) -> Iterator[Record]:
        """Yield the wanted channels' messages by log time; append to ``losses`` what could not be read."""
        topics = ", ".join(str(int(topic)) for topic in sorted(wanted))
        query = (
            f"SELECT id, topic_id, timestamp, data FROM messages WHERE topic_id IN ({topics}) ORDER BY timestamp, id"  # noqa: S608  # integers
        )
        read = dict.fromkeys(wanted, 0)
        with guarded(self.name, "a message"), closing(self._connect()) as database:
            try:
                for number, topic, timestamp, data in database.execute(query):
                    read[topic] += 1
                    if isinstance(data, bytes):
                        yield Record(int(timestamp), (int(number), 0), self.channels[topic], data)
                    else:
                        losses.append(Loss(topic, 1, "damaged message (no bytes)"))
            except sqlite3.Error as err:
                why = f"damaged database ({explain(err)})"
                for topic, count in read.items():
                    if missing := (self.channels[topic].announced or 0) - count:
                        losses.append(Loss(topic, missing, why))
                self.is_cut = True

    def _connect(self) -> sqlite3.Connection:
        # immutable: no lock and no journal file beside somebody's recording. A write-ahead log that was left behind
        # holds messages, so then the file is opened in the usual read-only way.
        log = self.path.with_name(self.path.name + "-wal")
        mode = "mode=ro" if log.is_file() and log.stat().st_size else "mode=ro&immutable=1"
        return sqlite3.connect(f"file:{quote(str(self.path.resolve()))}?{mode}", uri=True)

    def _read_channels(self, database: sqlite3.Connection, distro: str) -> None:
        tables = {str(name) for (name,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
        if not {"messages", "topics"} <= tables:
            raise FormatError(f"{self.name}: is an sqlite3 database but not a ROS 2 bag. Check the path.")
        definitions: dict[str, tuple[str, str]] = {}
        if "message_definitions" in tables:
            query = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
            definitions = {str(t): (str(e), str(d)) for t, e, d in database.execute(query)}
        if "schema" in tables and not distro and (row := database.execute("SELECT * FROM schema").fetchone()):
            distro = str(row[1]) if len(row) > 1 else ""
        query = "SELECT topic_id, count(*) FROM messages GROUP BY topic_id"
        counts = {int(topic): int(n) for topic, n in database.execute(query)}
        query = "SELECT id, name, type, serialization_format FROM topics ORDER BY id"
        for number, topic, kind, encoding in database.execute(query):
            form, text = definitions.get(str(kind), ("", ""))
            self.channels[int(number)] = Channel(
                int(number),
                str(topic),
                full_type(str(kind)),
                str(encoding),
                text,
                form,
                distro,
                counts.get(int(number), 0),
            )
        if unknown := counts.keys() - self.channels.keys():
            self.is_cut = True
            lost = sum(counts[n] for n in unknown)
            self.problems.append(f"{lost} messages belong to topics that the database does not describe")


class CompressedMessages:
    """A storage file whose every message is a zstd frame; see ``container.Container``."""

    def __init__(self, storage: Container) -> None:
        self._storage = storage
        self.name, self.format, self.channels = storage.name, storage.format, storage.channels
        self.problems = storage.problems

    @property
    def is_cut(self) -> bool:
        """Whether messages may be missing in a way the storage cannot count."""
        return self._storage.is_cut

    def records(self, wanted: frozenset[int], losses: list[Loss]) -> Iterator[Record]:
        """Yield the wanted channels' messages, inflated."""
        for record in self._storage.records(wanted, losses):
            try:
                data = inflate_zstd(bytes(record.data), MAX_CHUNK)
            except Exception as err:  # noqa: BLE001  # whatever zstandard throws
                losses.append(Loss(record.channel.id, 1, f"damaged message ({explain(err)})"))
                continue
            yield record._replace(data=data)
