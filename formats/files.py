"""Whole files or nothing: everything is written to a temporary name beside its target, then renamed."""

import io
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, BinaryIO, TextIO, cast

from .errors import FormatError


@contextmanager
def replacing(path: str | Path) -> Iterator[BinaryIO]:
    """Open ``path`` for writing; the old file stays until the block ends without an error.

    A kill at any moment leaves the old file, the new file or nothing under this name. A target with the same bytes is
    not touched, so make's time stamps stay quiet.

    Raises:
        FormatError: the folder cannot be written to.
    """
    target = Path(path)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{target.name}.", suffix=".tmp", dir=target.parent)
    except OSError as err:
        raise FormatError(f"{target}: cannot be written ({err.strerror}). Choose another place.") from err
    try:
        with os.fdopen(handle, "w+b") as stream:
            yield cast("BinaryIO", stream)
            stream.flush()
            os.fsync(stream.fileno())
        if _same_bytes(Path(name), target):
            Path(name).unlink()
        else:
            Path(name).chmod(0o666 & ~_umask())
            Path(name).replace(target)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


@contextmanager
def replacing_text(path: str | Path) -> Iterator[TextIO]:
    """``replacing`` for UTF-8 text; ``-`` is standard output."""
    if str(path) == "-":
        yield sys.stdout
        sys.stdout.flush()
        return
    with replacing(path) as raw:
        text = io.TextIOWrapper(cast("IO[bytes]", raw), encoding="utf-8", newline="\n", write_through=True)
        try:
            yield text
            text.flush()
        finally:
            text.detach()


def _same_bytes(new: Path, old: Path) -> bool:
    if not old.is_file() or old.stat().st_size != new.stat().st_size:
        return False
    with new.open("rb") as a, old.open("rb") as b:
        while block := a.read(1 << 20):
            if block != b.read(len(block)):
                return False
    return True


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
