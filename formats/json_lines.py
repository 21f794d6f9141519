"""Files of one JSON object per line: what all of them have in common.

The first line may name the schema, ``{"logpose": "<name>/<version>"}``; numbers that do not exist are ``null``, never
``NaN``.
"""

import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

from .errors import FormatError
from .events import NO_ID, Event
from .files import replacing_text
from .text import text_lines

E = TypeVar("E", bound=Event)


def schema_line(schema: str) -> str:
    """Return the first line of a file, with its line end."""
    return json_line({"logpose": schema})


def json_lines(path: str | Path, schema: str) -> Iterator[tuple[str, object]]:
    """Yield (where, value) of the lines, as they come, without the one that names the schema; ``-`` is standard input.

    Raises:
        FormatError: the file cannot be read, is of another schema or version, or a line is no JSON. An empty file holds
            no line and is no error.
    """
    name = "<stdin>" if str(path) == "-" else str(path)
    for number, text in text_lines(path):
        if not text.strip():
            continue
        where = f"{name}:{number}"
        value = _decode(text, where)
        if isinstance(value, dict) and "logpose" in value:
            if value["logpose"] != schema:
                raise FormatError(f"{where}: the file is {value['logpose']!r}, not {schema!r}. Convert it first.")
            continue
        yield where, value


def read_events(path: str | Path, schema: str, parse: Callable[[object, str], E]) -> Iterator[E]:
    """Yield what ``parse`` makes of the lines and where they stand, one by one; see ``json_lines``.

    Raises:
        FormatError: as of ``json_lines`` and ``parse``; stamps that go back.
    """
    last: int | None = None
    for where, value in json_lines(path, schema):
        event = parse(value, where)
        if last is not None and event.stamp < last:
            raise FormatError(f"{where}: stamp_ns {event.stamp} comes after {last}. Sort the lines by time.")
        last = event.stamp
        yield event


def write_events(events: Iterable[E], path: str | Path, schema: str, line: Callable[[E], str]) -> int:
    """Write the schema and a line of each event, and return the number of events; ``-`` is standard output."""
    count = 0
    with replacing_text(path) as stream:
        stream.write(schema_line(schema))
        for event in events:
            stream.write(line(event))
            count += 1
    return count


def json_line(value: Mapping[str, object]) -> str:
    """Return one line of a file, with its line end."""
    return json.dumps(value, allow_nan=False) + "\n"


def json_event(line: object, where: str) -> tuple[Mapping[str, Any], int]:
    """Return a line as a mapping, and its ``stamp_ns``.

    Raises:
        FormatError: it is no object, or has no such stamp.
    """
    if not isinstance(line, Mapping):
        raise FormatError(f"{where}: is {type(line).__name__}, not an object. Write one JSON object per line.")
    stamp = line.get("stamp_ns")
    if not isinstance(stamp, int) or isinstance(stamp, bool) or abs(stamp) >= 2**63:
        raise FormatError(f"{where}: stamp_ns is {stamp!r}. It must be integer nanoseconds.")
    return line, stamp


def json_string(value: object, where: str, key: str) -> str:
    """Return a value as a string.

    Raises:
        FormatError: it is none.
    """
    if not isinstance(value, str):
        raise FormatError(f"{where}: {key} is {value!r}. It must be a string.")
    return value


def json_index(value: object, where: str, key: str) -> int:
    """Return a value as an id or a place in a list, ``NO_ID`` for null.

    Raises:
        FormatError: it is neither null nor an integer from 0.
    """
    if value is None:
        return NO_ID
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < 2**63:
        raise FormatError(f"{where}: {key} is {value!r}. It must be null or an integer from 0.")
    return value


def or_none(value: float) -> float | None:
    """Return a number that JSON can hold, None for one that does not exist."""
    number = float(value)
    return number if math.isfinite(number) else None


def json_number(value: object, where: str, key: str, cure: str) -> float:
    """Return a value as a finite float.

    Args:
        value: of decoded JSON.
        where: file and line, for the message of an error.
        key: of the value.
        cure: what to do about one that is none, the end of the message.

    Raises:
        FormatError: it is no number, or not finite.
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise FormatError(f"{where}: {key} is {value!r}, not a number. {cure}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise FormatError(f"{where}: {key} is not finite. {cure}")
    return number


def _decode(text: str, where: str) -> object:
    try:
        return json.loads(text, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as err:
        reason = getattr(err, "msg", None) or str(err) or "too deep"
        raise FormatError(f"{where}: is no JSON ({reason}). Correct or remove the line.") from err


def _refuse_constant(word: str) -> float:
    raise ValueError(f"{word} is not allowed, missing numbers are null")
