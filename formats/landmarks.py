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

import numpy as np

from .errors import ConfigError, FormatError
from .events import Array
from .files import replacing_text
from .products import LandmarkMap
from .text import parse_number, text_lines
from .yaml_file import YamlMapping, parse_yaml, yaml_float, yaml_text

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
    lines = list(text_lines(path))
    content = [line for _, line in lines if line.strip() and not line.lstrip().startswith("#")]
    if not content:
        raise FormatError(f"{path}: is empty. Name a landmark map, 'logpose: {SCHEMA}' or CSV.")
    if content[0].replace(" ", "").split(",")[0] == "id":
        found = _read_csv(lines, str(path))
    else:
        found = _read_yaml("\n".join(line for _, line in lines), str(path))
    _check(found, str(path))
    rows = found.rows
    covariances = None
    if rows and rows[0].covariance is not None:
        covariances = np.array([row.covariance for row in rows])
    return LandmarkMap(
        ids=np.array([row.id for row in rows], dtype=np.int64),
        positions=np.array([row.position for row in rows], dtype=np.float64),
        covariances=covariances,
        frame_id=found.frame,
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


class _Row:
    """One landmark and the line it stands in."""

    def __init__(self, identity: int, position: list[float], covariance: Array | None, line: int) -> None:
        self.id = identity
        self.position = position
        self.covariance = covariance
        self.line = line


class _Found:
    def __init__(self, frame: str, rows: list[_Row]) -> None:
        self.frame = frame
        self.rows = rows


def _read_csv(lines: list[tuple[int, str]], name: str) -> _Found:
    frame = "map"
    columns: list[str] | None = None
    rows = []
    for number, line in lines:
        where = f"{name}:{number}"
        text = line.strip()
        if text.startswith("#"):
            key, _, value = text.lstrip("# ").partition(":")
            frame = value.strip() if key.strip() == "frame" and value.strip() else frame
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
            _in_range(parse_number(cell.get(key, "0"), where, key), where, key) for key in ("x_m", "y_m", "z_m")
        ]
        rows.append(_Row(_identity(_integer(cell["id"]), where), position, None, number))
    return _Found(frame, rows)


def _read_yaml(text: str, name: str) -> _Found:
    document = parse_yaml(text, name)
    if not isinstance(document, YamlMapping):
        raise FormatError(f"{name}: is no landmark map. It must begin with 'logpose: {SCHEMA}'.")
    schema = document.get("logpose")
    if schema != SCHEMA:
        where = f"{name}:{document.lines.get('logpose', 1)}"
        if schema is None:
            raise FormatError(f"{where}: key 'logpose' is missing. Write 'logpose: {SCHEMA}' into the first line.")
        raise FormatError(f"{where}: the file is {schema!r}, not {SCHEMA!r}. Name a landmark map of this version.")
    frame = document.get("frame", "map")
    if not isinstance(frame, str):
        raise FormatError(f"{name}:{document.lines['frame']}: frame is {frame!r}. It must be a name.")
    if "landmarks" not in document:
        raise FormatError(f"{name}: key 'landmarks' is missing. Give a list of landmarks.")
    entries = document["landmarks"]
    if entries is None:
        entries = []
    if not isinstance(entries, list):
        raise FormatError(f"{name}:{document.lines['landmarks']}: landmarks is no list. Give one entry each.")
    return _Found(frame, [_entry(entry, name, i) for i, entry in enumerate(entries)])


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
    position = [_in_range(_yaml_number(entry.get(key, 0.0), where, key), where, key) for key in ("x_m", "y_m", "z_m")]
    return _Row(_identity(entry["id"], where), position, _covariance(entry, where), entry.line)


def _covariance(entry: Mapping[object, object], where: str) -> Array | None:
    given = entry.get("cov_m2")
    if given is None:
        return None
    if not isinstance(given, list) or len(given) not in {3, 6}:
        raise FormatError(f"{where}: cov_m2 is {given!r}. It must be [xx, xy, xz, yy, yz, zz] or [xx, xy, yy].")
    v = [_yaml_number(value, where, "cov_m2") for value in given]
    if len(v) == 3:
        v = [v[0], v[1], 0.0, v[2], 0.0, 0.0]
    matrix = np.array([[v[0], v[1], v[2]], [v[1], v[3], v[4]], [v[2], v[4], v[5]]])
    if np.linalg.eigvalsh(matrix)[0] < -1e-9 * max(1e-30, float(np.abs(matrix).max())):
        raise FormatError(f"{where}: cov_m2 {given!r} is no covariance. No eigenvalue may be negative.")
    return matrix


def _check(found: _Found, name: str) -> None:
    rows = found.rows
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


def _identity(value: object, where: str) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < 2**63:
        raise FormatError(f"{where}: id is {value!r}. It must be an integer from 0.")
    return value


def _integer(text: str) -> int | str:
    try:
        return int(text)
    except ValueError:
        return text


def _in_range(value: float, where: str, key: str) -> float:
    if abs(value) >= 1e9:
        raise FormatError(f"{where}: {key} is {value!r} m. No map is that large; the unit is metres.")
    return value


def _yaml_number(value: object, where: str, key: str) -> float:
    # YAML 1.1 reads 1e-3 (without a point) as a string: taken as the number that was meant.
    if isinstance(value, str):
        return parse_number(value, where, key)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise FormatError(f"{where}: {key} is {value!r}, not a number. Correct or remove the landmark.")
    return parse_number(repr(value), where, key)
