"""Landmark maps: ``landmarks.yaml`` and the same as CSV.

::

    logpose: landmarks/1
    frame: map
    landmarks:
      - {id: 0, x_m: 1.0, y_m: 2.0, z_m: 2.42}
      - {id: 1, x_m: 3.0, y_m: 2.0, z_m: 2.42, cov_m2: [xx, xy, xz, yy, yz, zz]}

``z_m`` may be missing (0), and ``cov_m2`` is the upper triangle row by row, or ``[xx, xy, yy]``; either all
landmarks have one or none. The CSV has a header ``id,x_m,y_m,z_m`` and no covariance; a ``# frame: odom``
line before it names the frame. The two are told apart by content.
"""

import csv
import math
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import ConfigError, FormatError
from ..events import Array
from ..files import replacing_text
from ..products import LandmarkMap
from ..text import comment_value, content_lines, parse_number, text_lines
from ..yaml_file import YamlMapping, yaml_float, yaml_text
from .map_file import in_metres, map_entries, map_id, map_number

SCHEMA = "landmarks/1"
MIN_DISTANCE_M = 0.05
"""Two landmarks nearer than this are one landmark surveyed twice: nothing could ever tell them apart."""

_CSV_COLUMNS = ["id", "x_m", "y_m", "z_m"]
_KEYS = {"id", "x_m", "y_m", "z_m", "cov_m2"}


def read_landmarks(path: str | Path) -> LandmarkMap:
    """Read a landmark map, YAML or CSV by content.

    Raises:
        FormatError: no such file, another schema or version, a missing key, a number that is none, no
            landmark at all, an id that stands twice, or two landmarks nearer than 0.05 m.
    """
    name, lines = str(path), list(text_lines(path))
    first = next(content_lines(lines), None)
    if first is None:
        raise FormatError(f"{path}: is empty. Name a landmark map, 'logpose: {SCHEMA}' or CSV.")
    if first[1].replace(" ", "").split(",")[0] == "id":
        frame, rows = _read_csv(lines, name)
    else:
        text = "\n".join(line for _, line in lines)
        frame, entries = map_entries(text, name, SCHEMA, noun="landmark map", short="landmark map")
        rows = [_entry(entry, name, i) for i, entry in enumerate(entries)]
    _check(rows, name)
    covariances = None
    if rows[0].covariance is not None:
        covariances = np.array([row.covariance for row in rows])
    return LandmarkMap(
        ids=np.array([row.id for row in rows], dtype=np.int64),
        positions=np.array([row.position for row in rows], dtype=np.float64),
        covariances=covariances,
        frame_id=frame,
    )


def write_landmarks(landmarks: LandmarkMap, path: str | Path) -> None:
    """Write a landmark map: CSV if the name ends in ``.csv``, otherwise YAML; exact to the last bit."""
    with replacing_text(path) as stream:
        if str(path).endswith(".csv"):
            stream.write(f"# frame: {landmarks.frame_id}\n{','.join(_CSV_COLUMNS)}\n")
            for identity, position in zip(landmarks.ids, landmarks.positions, strict=True):
                stream.write(",".join([str(int(identity)), *(repr(float(v)) for v in position)]) + "\n")
            return
        stream.write(f"logpose: {SCHEMA}\nframe: {yaml_text(landmarks.frame_id)}\nlandmarks:\n")
        for i, (identity, position) in enumerate(zip(landmarks.ids, landmarks.positions, strict=True)):
            x, y, z = (yaml_float(v) for v in position)
            cov = ""
            if landmarks.covariances is not None:
                triangle = landmarks.covariances[i][np.triu_indices(3)]
                cov = f", cov_m2: [{', '.join(yaml_float(v) for v in triangle)}]"
            stream.write(f"  - {{id: {int(identity)}, x_m: {x}, y_m: {y}, z_m: {z}{cov}}}\n")


def convert_landmarks(source: str, target: str) -> None:
    """Read a landmark map, write it in the format that the suffix of the target names (YAML without one).

    Raises:
        ConfigError: no format has this suffix.
        FormatError: as ``read_landmarks``.
    """
    suffix = Path(target).suffix
    if suffix not in {".yaml", ".yml", ".csv", ""}:
        raise ConfigError(f"{target}: no landmark map has the suffix {suffix!r}. Use .yaml or .csv.")
    write_landmarks(read_landmarks(source), target)


class _Row(NamedTuple):
    """One landmark and the line it stands in."""

    id: int
    position: list[float]
    covariance: Array | None
    line: int


def _read_csv(lines: list[tuple[int, str]], name: str) -> tuple[str, list[_Row]]:
    frame = "map"
    columns: list[str] | None = None
    rows = []
    for number, line in lines:
        where = f"{name}:{number}"
        text = line.strip()
        if text.startswith("#"):
            frame = comment_value(text, "frame") or frame
            continue
        if not text:
            continue
        cells = [cell.strip() for cell in next(csv.reader([line]))]
        if columns is None:
            columns = cells
            if missing := [c for c in _CSV_COLUMNS[:3] if c not in cells]:
                raise FormatError(f"{where}: column {missing[0]!r} is missing. The header is id,x_m,y_m,z_m.")
            continue
        if len(cells) != len(columns):
            raise FormatError(f"{where}: has {len(cells)} columns, the header {len(columns)}. Correct the line.")
        cell = dict(zip(columns, cells, strict=True))
        position = [
            in_metres(parse_number(cell.get(key, "0"), where, key), where, key) for key in ("x_m", "y_m", "z_m")
        ]
        rows.append(_Row(map_id(_integer(cell["id"]), where), position, None, number))
    return frame, rows


def _entry(entry: object, name: str, index: int) -> _Row:
    if not isinstance(entry, YamlMapping):
        raise FormatError(f"{name}: landmarks[{index}] is no mapping. Write {{id: 0, x_m: .., y_m: .., z_m: ..}}.")
    where = f"{name}:{entry.line}"
    for key in entry:
        if key not in _KEYS:
            raise FormatError(f"{where}: a landmark has no key {key!r}. Known keys: {', '.join(sorted(_KEYS))}.")
    for key in ("id", "x_m", "y_m"):
        if key not in entry:
            raise FormatError(f"{where}: key {key!r} is missing. Write {{id: 0, x_m: .., y_m: .., z_m: ..}}.")
    position = [
        in_metres(map_number(entry.get(key, 0.0), where, key, "landmark"), where, key) for key in ("x_m", "y_m", "z_m")
    ]
    return _Row(map_id(entry["id"], where), position, _covariance(entry, where), entry.line)


def _covariance(entry: Mapping[object, object], where: str) -> Array | None:
    given = entry.get("cov_m2")
    if given is None:
        return None
    if not isinstance(given, list) or len(given) not in {3, 6}:
        raise FormatError(f"{where}: cov_m2 is {given!r}. It must be [xx, xy, xz, yy, yz, zz] or [xx, xy, yy].")
    v = [map_number(value, where, "cov_m2", "landmark") for value in given]
    if len(v) == 3:
        v = [v[0], v[1], 0.0, v[2], 0.0, 0.0]
    matrix = np.array([[v[0], v[1], v[2]], [v[1], v[3], v[4]], [v[2], v[4], v[5]]])
    if np.linalg.eigvalsh(matrix)[0] < -1e-9 * max(1e-30, float(np.abs(matrix).max())):
        raise FormatError(f"{where}: cov_m2 {given!r} is no covariance. No eigenvalue may be negative.")
    return matrix


def _check(rows: list[_Row], name: str) -> None:
    if not rows:
        raise FormatError(f"{name}: the map has no landmarks. Give at least one.")
    seen: dict[int, int] = {}
    for row in rows:
        if row.id in seen:
            raise FormatError(
                f"{name}:{row.line}: id {row.id} stands twice (first in line {seen[row.id]}). "
                "Give each landmark its own."
            )
        seen[row.id] = row.line
    with_covariance = [row for row in rows if row.covariance is not None]
    if with_covariance and len(with_covariance) != len(rows):
        row = next(row for row in rows if row.covariance is None)
        raise FormatError(f"{name}:{row.line}: id {row.id} has no cov_m2, others do. Give it for all or none.")
    if pair := _near_pair(rows):
        a, b, distance = pair
        raise FormatError(
            f"{name}:{b.line}: landmarks {a.id} and {b.id} are {distance:.3f} m apart. "
            f"Remove one; landmarks must be at least {MIN_DISTANCE_M} m apart."
        )


def _near_pair(rows: list[_Row]) -> tuple[_Row, _Row, float] | None:
    """Return the first two landmarks nearer than allowed, sorting into cells of that size: O(n)."""
    cells: dict[tuple[int, ...], list[_Row]] = {}
    around = [(i, j, k) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1)]
    for row in rows:
        home = tuple(math.floor(v / MIN_DISTANCE_M) for v in row.position)
        for step in around:
            for other in cells.get(tuple(a + b for a, b in zip(home, step, strict=True)), ()):
                distance = math.dist(row.position, other.position)
                if distance < MIN_DISTANCE_M:
                    return other, row, distance
        cells.setdefault(home, []).append(row)
    return None


def _integer(text: str) -> int | str:
    try:
        return int(text)
    except ValueError:
        return text
