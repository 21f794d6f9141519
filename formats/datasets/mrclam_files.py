"""The files of MRCLAM: columns of numbers, ``#`` before comments, stamps in decimal seconds."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import FormatError
from ..events import NO_ID, Array
from ..products import LandmarkMap
from ..text import content_lines, parse_number, parse_seconds, text_lines
from .imported import Ids, Stamps


@dataclass(frozen=True, slots=True)
class Measurements:
    """Rows of a measurement file, sorted by time.

    Attributes:
        stamps: (N,) [ns].
        subjects: (N,) 1 to 5 robots, 6 to 20 posts, NO_ID for unknown barcodes.
        polar: (N, 2) range [m], bearing [rad].
    """

    stamps: Stamps
    subjects: Ids
    polar: Array

    @property
    def xy(self) -> Array:
        """(N, 2) in robot coordinates [m]."""
        r, b = self.polar.T
        return np.column_stack([r * np.cos(b), r * np.sin(b)])


def read_posts(path: Path) -> LandmarkMap:
    """Read ``Landmark_Groundtruth.dat``: subject, x, y, sigma x, sigma y [m]."""
    rows = [_numbers(cells, where) for where, cells in _rows(path, 5)]
    table = np.array(rows).reshape(-1, 5)
    covariances = np.zeros((len(table), 3, 3))
    covariances[:, 0, 0], covariances[:, 1, 1] = table[:, 3] ** 2, table[:, 4] ** 2
    positions = np.column_stack([table[:, 1:3], np.zeros(len(table))])
    return LandmarkMap(ids=table[:, 0].astype(np.int64), positions=positions, covariances=covariances)


def read_barcodes(path: Path) -> dict[int, int]:
    """Read ``Barcodes.dat`` as barcode -> subject."""
    pairs = [_numbers(cells, where) for where, cells in _rows(path, 2)]
    return {int(barcode): int(subject) for subject, barcode in pairs}


def read_truth(path: Path, counts: Counter[str]) -> tuple[Stamps, Array]:
    """Read ``Robot1_Groundtruth.dat``: strictly increasing stamps and poses (N, 3) x, y [m], heading [rad]."""
    stamps, table = _stamped(path, 4, counts, "true poses")
    kept = np.ones(len(stamps), dtype=bool)
    kept[1:] = np.diff(stamps) > 0
    counts["true poses that repeat a stamp, left out"] += int((~kept).sum())
    return stamps[kept], table[kept]


def read_odometry(path: Path, counts: Counter[str]) -> tuple[Stamps, Array]:
    """Read ``Robot1_Odometry.dat``: strictly increasing stamps and commands (N, 2) v [m/s], omega [rad/s].

    Of commands with one stamp the last one stays: it is the one that was carried out.
    """
    stamps, table = _stamped(path, 3, counts, "commands")
    kept = np.ones(len(stamps), dtype=bool)
    kept[:-1] = np.diff(stamps) > 0
    counts["commands that the next one replaces at once, left out"] += int((~kept).sum())
    return stamps[kept], table[kept]


def read_measurements(path: Path, subjects: dict[int, int], counts: Counter[str]) -> Measurements:
    """Read ``Robot1_Measurement.dat``: stamp, barcode, range [m], bearing [rad]."""
    stamps, table = _stamped(path, 4, counts, "sightings")
    barcodes = table[:, 0].astype(np.int64).tolist()
    found = np.array([subjects.get(barcode, NO_ID) for barcode in barcodes], dtype=np.int64)
    counts["sightings of unknown barcodes"] += int((found == NO_ID).sum())
    if (table[:, 1] < 0).any():
        row = int(np.flatnonzero(table[:, 1] < 0)[0])
        raise FormatError(f"{path}: the range at {stamps[row] * 1e-9:.3f} s is negative. Remove the line.")
    return Measurements(stamps, found, table[:, 1:])


def _stamped(path: Path, n_columns: int, counts: Counter[str], what: str) -> tuple[Stamps, Array]:
    stamps, rows = [], []
    for where, cells in _rows(path, n_columns):
        stamps.append(parse_seconds(cells[0], where))
        rows.append(_numbers(cells[1:], where))
    times = np.array(stamps, dtype=np.int64)
    late = int((np.diff(times) < 0).sum())
    if late:
        counts[f"{what} that went back in time, sorted"] += late
    order = np.argsort(times, kind="stable")
    return times[order], np.array(rows, dtype=np.float64)[order]


def _rows(path: Path, n_columns: int) -> list[tuple[str, list[str]]]:
    rows = []
    for number, line in content_lines(text_lines(path)):
        cells = line.split()
        if len(cells) != n_columns:
            raise FormatError(f"{path}:{number}: has {len(cells)} columns, not {n_columns}. Name an MRCLAM folder.")
        rows.append((f"{path}:{number}", cells))
    if not rows:
        raise FormatError(f"{path}: has no rows. Name an MRCLAM folder.")
    return rows


def _numbers(cells: list[str], where: str) -> list[float]:
    return [parse_number(cell, where, f"column {i + 1}") for i, cell in enumerate(cells)]
