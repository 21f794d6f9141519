"""Maps of stripe marks: ``marks.yaml``.

::

    logpose: marks/1
    frame: map
    marks:
      - {id: 1, lines_m: [-0.06, 0.0, 0.04, 0.12], bar_m: 0.03, height_m: 0.2, x_m: 0.0, y_m: 0.0, heading_rad: 0.0}

``lines_m`` are the rising edges (dark to bright), left to right as a viewer sees them, on an axis that points to the
viewer's right; ``x_m``, ``y_m`` and ``heading_rad`` say where the origin of that axis lies and where it points.
``bar_m`` is the width of the bright bars, one number or a list with one per line; without it only the rising edges are
known. ``height_m``, how high the bars are, may be missing too.
"""

import math
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np

from ..errors import FormatError
from ..events import Array
from ..files import replacing_text
from ..products import MarkMap, StripeMark
from ..text import content_lines, read_text
from ..yaml_file import YamlMapping, YamlSequence, yaml_float, yaml_text
from .map_file import in_metres, map_entries, map_id, map_number

SCHEMA = "marks/1"
MIN_LINES = 3
"""A pose has three unknowns, and every line gives one equation."""
MAX_WIDTH_M = 100.0
"""No mark is wider: such a file has its lines in millimetres."""

_KEYS = {"id", "lines_m", "bar_m", "height_m", "x_m", "y_m", "heading_rad"}
_EXAMPLE = "{id: 1, lines_m: [..], bar_m: .., x_m: .., y_m: .., heading_rad: ..}"

At = Callable[[str], str]
"""Key of a mark -> where it stands, for the message of an error."""


def read_marks(path: str | Path) -> MarkMap:
    """Read a map of stripe marks.

    Raises:
        FormatError: no such file, another schema or version, a missing or unknown key, a number that is none, no mark
            at all, an id that stands twice, or a mark that cannot be (``check_marks``).
    """
    text, name = read_text(path), str(path)
    if not any(content_lines(enumerate(text.splitlines()))):
        raise FormatError(f"{name}: is empty. Name a map of stripe marks, 'logpose: {SCHEMA}'.")
    frame, entries = map_entries(text, name, SCHEMA, noun="map of stripe marks", short="map")
    if not entries:
        raise FormatError(f"{name}: the map has no marks. Give at least one.")
    return MarkMap(marks=_entries(entries, name), frame_id=frame)


def write_marks(marks: MarkMap, path: str | Path) -> None:
    """Write a map of stripe marks; exact to the last bit.

    Raises:
        FormatError: what ``read_marks`` would refuse.
    """
    check_marks(marks, str(path))
    with replacing_text(path) as stream:
        stream.write(f"logpose: {SCHEMA}\nframe: {yaml_text(marks.frame_id)}\nmarks:\n")
        for mark in marks.marks:
            bars = ""
            if mark.bars is not None:
                is_one = bool(np.all(mark.bars == mark.bars[0]))
                bars = f", bar_m: {yaml_float(mark.bars[0]) if is_one else _list(mark.bars)}"
            height = "" if mark.height is None else f", height_m: {yaml_float(mark.height)}"
            x, y, heading = (yaml_float(value) for value in mark.pose)
            stream.write(f"  - {{id: {int(mark.id)}, lines_m: {_list(mark.lines)}{bars}{height}, ")
            stream.write(f"x_m: {x}, y_m: {y}, heading_rad: {heading}}}\n")


def check_marks(marks: MarkMap, where: str) -> None:
    """Refuse marks that cannot be.

    Raises:
        FormatError: no mark, an id below 0 or twice, fewer than three lines, lines that do not increase, bars that
            touch the next line, a height that is none, or sizes that are no metres.
    """
    if not marks.marks:
        raise FormatError(f"{where}: the map has no marks. Give at least one.")
    seen: set[int] = set()
    for mark in marks.marks:
        here = f"{where}: mark {mark.id}"
        map_id(mark.id, here)
        if mark.id in seen:
            raise FormatError(f"{here}: the id stands twice. Give each mark its own.")
        seen.add(mark.id)
        _check(mark, lambda _key, here=here: here)  # type: ignore[misc]


def _list(values: Array) -> str:
    return f"[{', '.join(yaml_float(value) for value in values)}]"


def _entries(entries: list[object], name: str) -> tuple[StripeMark, ...]:
    seen: dict[int, int] = {}
    marks = []
    for i, entry in enumerate(entries):
        if not isinstance(entry, YamlMapping):
            raise FormatError(f"{name}: marks[{i}] is no mapping. Write {_EXAMPLE}.")
        mark = _mark(entry, name)
        line = entry.lines["id"]
        if mark.id in seen:
            raise FormatError(
                f"{name}:{line}: id {mark.id} stands twice (first in line {seen[mark.id]}). Give each mark its own."
            )
        seen[mark.id] = line
        marks.append(mark)
    return tuple(marks)


def _mark(entry: YamlMapping, name: str) -> StripeMark:
    for key in entry:
        if key not in _KEYS:
            where = f"{name}:{entry.lines[key]}"
            raise FormatError(f"{where}: a mark has no key {key!r}. Known keys: {', '.join(sorted(_KEYS))}.")
    for key in ("id", "lines_m", "x_m", "y_m", "heading_rad"):
        if key not in entry:
            raise FormatError(f"{name}:{entry.line}: key {key!r} is missing. Write {_EXAMPLE}.")

    def at(key: str) -> str:
        return f"{name}:{entry.lines.get(key, entry.line)}"

    lines = _numbers(entry["lines_m"], at, "lines_m")
    bars = entry.get("bar_m")
    widths = None
    if isinstance(bars, list):
        widths = np.array(_numbers(bars, at, "bar_m"))
    elif bars is not None:
        widths = np.full(len(lines), _number(bars, at("bar_m"), "bar_m"))
    height = entry.get("height_m")
    mark = StripeMark(
        id=map_id(entry["id"], at("id")),
        lines=np.array(lines, dtype=np.float64),
        bars=widths,
        pose=np.array([_number(entry[key], at(key), key) for key in ("x_m", "y_m", "heading_rad")]),
        height=None if height is None else _number(height, at("height_m"), "height_m"),
    )
    _check(mark, at)
    return mark


def _check(mark: StripeMark, at: At) -> None:
    """Refuse one mark that cannot be; ``at`` says where its keys stand."""
    lines = [float(x) for x in mark.lines]
    if len(lines) < MIN_LINES:
        raise FormatError(f"{at('lines_m')}: lines_m has {len(lines)} lines. A pose needs {MIN_LINES} at least.")
    for left, right in pairwise(lines):
        if not left < right:
            raise FormatError(
                f"{at('lines_m')}: lines_m does not increase: {right!r} follows {left!r}. "
                "List the rising edges from left to right."
            )
    _check_bars(mark, lines, at)
    width = max(*(float(x) for x in mark.edges), 0.0) - min(*lines, 0.0)
    if not width <= MAX_WIDTH_M:
        raise FormatError(
            f"{at('lines_m')}: the mark is {width:.6g} m wide. No mark is that large; the unit is metres."
        )
    if mark.height is not None and not 0 < mark.height <= MAX_WIDTH_M:
        raise FormatError(
            f"{at('height_m')}: height_m is {mark.height!r}. It must be greater than 0 and at most {MAX_WIDTH_M:g} m."
        )
    for key, value in zip(("x_m", "y_m"), mark.pose[:2], strict=True):
        in_metres(float(value), at(key), key)
    heading = float(mark.pose[2])
    if not abs(heading) <= 2 * math.pi:
        raise FormatError(
            f"{at('heading_rad')}: heading_rad is {heading!r}. It is at most one turn; the unit is radians."
        )


def _check_bars(mark: StripeMark, lines: list[float], at: At) -> None:
    if mark.bars is None:
        return
    if len(mark.bars) != len(lines):
        raise FormatError(
            f"{at('bar_m')}: bar_m has {len(mark.bars)} widths for {len(lines)} lines. Give one number, or one a line."
        )
    for line, bar, following in zip(lines, map(float, mark.bars), [*lines[1:], math.inf], strict=True):
        if not line + bar > line:
            raise FormatError(f"{at('bar_m')}: bar_m is {bar!r}. It must be greater than 0.")
        if not line + bar < following:
            raise FormatError(
                f"{at('bar_m')}: the bar that begins at {line!r} m is {bar!r} m wide and touches the line at "
                f"{following!r} m. Make it narrower."
            )


def _numbers(value: object, at: At, key: str) -> list[float]:
    if not isinstance(value, YamlSequence):
        raise FormatError(f"{at(key)}: {key} is {value!r}, not a list. Write {key}: [.., .., ..].")
    file = at(key).rpartition(":")[0]
    return [_number(item, f"{file}:{line}", key) for item, line in zip(value, value.lines, strict=True)]


def _number(value: object, where: str, key: str) -> float:
    return map_number(value, where, key, "mark")
