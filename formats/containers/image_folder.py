"""Reads image files as a log: a folder, or single files.

The time of an image, by the first rule that holds for all of them:

1. ``stamps.csv`` in the folder, columns ``stamp_ns,file``;
2. numeric file names: 16 or more digits are nanoseconds, a name with a decimal point is seconds;
3. its index (by name; single files: in the order given) at a stated rate.
"""

import csv
import re
from collections.abc import Iterator, Sequence
from decimal import Decimal
from pathlib import Path

from ..errors import FormatError
from .container import Channel, Loss, Record, explain, guarded
from .sniff import image_encoding, image_files

TOPIC = "/image"
DEFAULT_RATE_HZ = 10.0

_NANOSECONDS = re.compile(r"\d{16,19}")
_SECONDS = re.compile(r"\d+\.\d{1,9}")


class ImageFiles:
    """Image files with their stamps; see ``container.Container``."""

    format = "images"

    def __init__(self, path: Path, files: Sequence[Path] | None = None, rate_hz: float = DEFAULT_RATE_HZ) -> None:
        self.path = path
        self.name = str(path)
        self.problems: list[str] = []
        self.is_cut = False
        with guarded(path, "the images"):
            self._stamps = self._find_stamps(image_files(path) if files is None else list(files), rate_hz)
        count = len(self._stamps)
        self.channels = {0: Channel(0, TOPIC, "image file", "file", announced=count)}

    def records(self, wanted: frozenset[int], losses: list[Loss]) -> Iterator[Record]:
        """Yield the images by time; append to ``losses`` what could not be read."""
        if 0 not in wanted:
            return
        for index, (stamp, file) in enumerate(self._stamps):
            try:
                data = file.read_bytes()
            except OSError as err:
                losses.append(Loss(0, 1, f"missing image ({explain(err)})"))
                continue
            if not image_encoding(data[:32]):
                losses.append(Loss(0, 1, "not an image"))
                continue
            yield Record(stamp, (index, 0), self.channels[0], data)

    def _find_stamps(self, files: list[Path], rate_hz: float) -> list[tuple[int, Path]]:
        table = self.path / "stamps.csv"
        if self.path.is_dir() and table.is_file():
            stamps = _read_stamps(table)
            unlisted = len({f.name for f in files} - {f.name for _, f in stamps})
            if unlisted:
                self.problems.append(f"{unlisted} images are not in stamps.csv and are left out")
            return sorted(stamps, key=lambda pair: pair[0])
        if all(_NANOSECONDS.fullmatch(f.stem) for f in files):
            return sorted(((int(f.stem), f) for f in files), key=lambda pair: pair[0])
        if all(_SECONDS.fullmatch(f.stem) for f in files):
            return sorted(((int(Decimal(f.stem) * 10**9), f) for f in files), key=lambda pair: pair[0])
        if len(files) > 1:
            self.problems.append(f"no stamps: image i stands at i / ({rate_hz:g} Hz). Write stamps.csv to change it")
        period = Decimal(10**9) / Decimal(repr(rate_hz))
        return [(int(i * period), file) for i, file in enumerate(files)]


def _read_stamps(path: Path) -> list[tuple[int, Path]]:
    with path.open(newline="", encoding="utf-8") as stream:
        rows = csv.DictReader(stream)
        if not {"stamp_ns", "file"} <= set(rows.fieldnames or ()):
            raise FormatError(f"{path}:1: has no columns 'stamp_ns' and 'file'. Write the header stamp_ns,file.")
        found: list[tuple[int, Path]] = []
        for row in rows:
            stamp, name = row["stamp_ns"], row["file"]
            if not stamp or not name or not re.fullmatch(r"\d{1,19}", stamp.strip()):
                line = rows.line_num
                raise FormatError(f"{path}:{line}: stamp_ns {stamp!r} is no whole number. Give nanoseconds and a file.")
            found.append((int(stamp), path.parent / name.strip()))
        return found
