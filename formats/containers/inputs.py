"""Paths -> opened containers: folders are unfolded, compressed storage is inflated, single images are put together."""

import hashlib
import os
import shutil
import sys
import tempfile
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from itertools import accumulate, pairwise
from pathlib import Path

from ..errors import ConfigError, FormatError
from .container import Channel, Container, guarded
from .image_folder import DEFAULT_RATE_HZ, ImageFiles
from .inflate import inflate_file
from .mcap import McapFile
from .rosbag1 import Rosbag1File
from .rosbag2 import BagFolder, CompressedMessages, SqliteFile, read_folder
from .sniff import InputType, kind_of

_WHOLE = 64 << 20
_PIECE = 1 << 20


@dataclass(frozen=True)
class InputFile:
    """One file that was read.

    Attributes:
        path: as it was given, or inside the folder that was given.
        size: [bytes].
    """

    path: str
    size: int

    @cached_property
    def digest(self) -> str:
        """``blake2b`` of the whole file up to 64 MiB; of its size, first and last MiB when it is larger."""
        digest = hashlib.blake2b(digest_size=32)
        with guarded(self.path, "it"), Path(self.path).open("rb") as stream:
            if self.size <= _WHOLE:
                while block := stream.read(_PIECE):
                    digest.update(block)
            else:
                digest.update(str(self.size).encode() + stream.read(_PIECE))
                stream.seek(-_PIECE, os.SEEK_END)
                digest.update(stream.read(_PIECE))
        return digest.hexdigest()


@dataclass(frozen=True)
class Opened:
    """All containers of the inputs.

    Attributes:
        where: the inputs for error messages.
        containers: in the order of the inputs and of the files in a folder.
        recordings: which containers belong to one recording, hence share a clock: those of a folder.
        files: the files that are read.
        expected: messages by topic that ``metadata.yaml`` files announce.
        problems: one line each.
    """

    where: str
    containers: tuple[Container, ...]
    recordings: tuple[range, ...]
    files: tuple[InputFile, ...]
    expected: Mapping[str, int]
    problems: tuple[str, ...]


def open_inputs(paths: str | Path | Sequence[str | Path], rate_hz: float = DEFAULT_RATE_HZ) -> Opened:
    """Open every path; ``-`` is standard input.

    Raises:
        ConfigError: no path.
        FormatError: a path that is not there, or not a log.
    """
    if isinstance(paths, str | Path):
        paths = [paths]
    if not paths:
        raise ConfigError("no log given. Name a bag, an MCAP file or a folder of images.")
    parts: list[_Part] = []
    images: list[Path] = []
    for path in map(Path, paths):
        if str(path) == "-":
            parts.append(_Part([_open_standard_input()], []))
        elif (kind := kind_of(path)) is InputType.IMAGE:
            images.append(path)
        else:
            parts.append(_open_path(path, kind, rate_hz))
    if images:
        parts.append(_Part([ImageFiles(images[0], images, rate_hz)], images))
    containers = [container for part in parts for container in part.containers]
    ends = list(accumulate(len(part.containers) for part in parts))
    expected: dict[str, int] = {}
    for part in parts:
        for topic, count in part.announced.items():
            expected[topic] = expected.get(topic, 0) + count
    problems = [text for part in parts for text in part.problems]
    problems += [f"{container.name}: {text}" for container in containers for text in container.problems]
    return Opened(
        where=", ".join(map(str, paths)),
        containers=tuple(containers),
        recordings=tuple(range(first, end) for first, end in pairwise([0, *ends])),
        files=tuple(InputFile(str(file), file.stat().st_size) for part in parts for file in part.files),
        expected=expected,
        problems=tuple(problems),
    )


@dataclass(frozen=True)
class _Part:
    """What one path gives."""

    containers: Sequence[Container]
    files: Sequence[Path]
    announced: Mapping[str, int] = field(default_factory=dict)
    problems: Sequence[str] = ()


def _open_path(path: Path, kind: InputType, rate_hz: float) -> _Part:
    if kind is InputType.IMAGE_FOLDER:
        return _Part([ImageFiles(path, rate_hz=rate_hz)], sorted(p for p in path.iterdir() if p.is_file()))
    if kind is InputType.ROSBAG2_FOLDER:
        folder = read_folder(path)
        containers = [_open_storage(file, kind_of(file), folder) for file in folder.files]
        return _Part(containers, folder.files, folder.announced, [f"{path}: {text}" for text in folder.problems])
    return _Part([_open_storage(path, kind)], [path])


def _open_storage(path: Path, kind: InputType, folder: BagFolder | None = None, name: str = "") -> Container:
    """Open a file of some kind, of a ROS 2 bag folder perhaps; ``name`` is what to call it, where it is a copy."""
    container: Container
    if kind is InputType.ZSTD:
        return _open_compressed(path, folder, name)
    if kind is InputType.MCAP:
        container = McapFile(path, name)
    elif kind is InputType.SQLITE:
        container = SqliteFile(path, name, folder.distro if folder else "")
    elif kind is InputType.ROSBAG1:
        container = Rosbag1File(path, name)
    else:
        raise FormatError(f"{name or path}: is no storage of a ROS 2 bag. Check metadata.yaml.")
    return CompressedMessages(container) if folder and folder.is_message_compressed else container


def _open_compressed(path: Path, folder: BagFolder | None, name: str) -> Container:
    name = name or str(path)
    with _temporary_folder() as (temporary, keep):
        with guarded(name, "the compressed file"):
            inflated = inflate_file(path, temporary)
        return keep(_open_storage(inflated, kind_of(inflated, name), folder, name))


def _open_standard_input() -> Container:
    with _temporary_folder() as (temporary, keep):
        copy = temporary / "standard-input"
        with copy.open("wb") as sink:
            shutil.copyfileobj(sys.stdin.buffer, sink, _PIECE)
        return keep(_open_storage(copy, kind_of(copy, "-"), name="-"))


@contextmanager
def _temporary_folder() -> Iterator[tuple[Path, Callable[[Container], Container]]]:
    """Make a folder that lives as long as the container that is opened in it."""
    folder = Path(tempfile.mkdtemp(prefix="logpose-"))

    def keep(container: Container) -> Container:
        weakref.finalize(container, shutil.rmtree, folder, ignore_errors=True)
        return container

    try:
        yield folder, keep
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise


def channels_of(opened: Opened) -> list[tuple[int, Channel]]:
    """Return (container index, channel) of all containers."""
    return [(i, c) for i, container in enumerate(opened.containers) for c in container.channels.values()]
