"""``sightings.jsonl``: what was seen of landmarks, one line per image, also when nothing was seen.

::

    {"logpose": "sightings/1"}
    {"stamp_ns": 0, "frame_id": "base_link", "sightings": [{"x_m": .., "y_m": .., "cov_m2": [xx, xy, yy],
     "u_px": .., "v_px": .., "radius_px": .., "score": .., "id": null}]}

The first line may be missing. Numbers that do not exist are ``null``: ``u_px``, ``v_px``, ``radius_px`` and
``score`` may be, and ``id`` is where the landmark is not known. Floats are written so that they are read back
bit by bit.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import numpy as np

from .errors import FormatError
from .events import NO_ID, Sightings
from .json_lines import (
    json_event,
    json_index,
    json_line,
    json_number,
    json_string,
    or_none,
    read_events,
    schema_line,
    write_events,
)

SCHEMA = "sightings/1"
HEADER = schema_line(SCHEMA)
"""The first line of the file."""


def sightings_to_json(event: Sightings) -> dict[str, object]:
    """Return the line of one event as a JSON-ready mapping, not finite numbers as None."""
    return {
        "stamp_ns": int(event.stamp),
        "frame_id": event.frame_id,
        "sightings": [
            {
                "x_m": or_none(event.xy[i, 0]),
                "y_m": or_none(event.xy[i, 1]),
                "cov_m2": [or_none(event.cov[i, j, k]) for j, k in ((0, 0), (0, 1), (1, 1))],
                "u_px": or_none(event.uv[i, 0]),
                "v_px": or_none(event.uv[i, 1]),
                "radius_px": or_none(event.radius[i]),
                "score": or_none(event.score[i]),
                "id": None if event.ids[i] == NO_ID else int(event.ids[i]),
            }
            for i in range(len(event.xy))
        ],
    }


def sightings_from_json(line: object, *, where: str = "sightings") -> Sightings:
    """Return the event that ``sightings_to_json`` made the mapping from.

    Args:
        line: the decoded JSON of one line.
        where: file and line, for the message of an error.

    Raises:
        FormatError: a key is missing or a value is not what it should be.
    """
    fields, stamp = json_event(line, where)
    frame_id = json_string(fields.get("frame_id", "base_link"), where, "frame_id")
    rows = fields.get("sightings")
    if not isinstance(rows, list):
        raise FormatError(f"{where}: has no list 'sightings'. Write an empty list where nothing was seen.")
    parsed = [_row(row, f"{where}: sightings[{i}]") for i, row in enumerate(rows)]
    table = np.array([numbers for numbers, _ in parsed], dtype=np.float64).reshape(-1, 9)
    return Sightings(
        stamp=stamp,
        source="sightings",
        frame_id=frame_id,
        xy=table[:, 0:2],
        cov=table[:, [2, 3, 3, 4]].reshape(-1, 2, 2),
        uv=table[:, 5:7],
        radius=table[:, 7],
        score=table[:, 8],
        ids=np.array([identity for _, identity in parsed], dtype=np.int64),
    )


def sightings_line(event: Sightings) -> str:
    """Return one event as one line of JSON with its line end."""
    return json_line(sightings_to_json(event))


def write_sightings(events: Iterable[Sightings], path: str | Path) -> int:
    """Write ``sightings.jsonl`` and return the number of events; ``-`` is standard output."""
    return write_events(events, path, SCHEMA, sightings_line)


def read_sightings(path: str | Path) -> Iterator[Sightings]:
    """Yield the events of a ``sightings.jsonl`` one by one, as the lines come; ``-`` is standard input.

    Raises:
        FormatError: the file cannot be read, is of another version, or a line is not what it should be;
            stamps that go back. An empty file holds no event and is no error.
    """
    return read_events(path, SCHEMA, lambda value, where: sightings_from_json(value, where=where))


def _row(row: object, where: str) -> tuple[list[float], int]:
    if not isinstance(row, Mapping):
        raise FormatError(f"{where} is no object. Write one object per sighting.")
    cov = row.get("cov_m2")
    if not isinstance(cov, list) or len(cov) != 3:
        raise FormatError(f"{where}: cov_m2 is {cov!r}. It must be [xx, xy, yy].")
    numbers = [_number(row.get(key), where, key) for key in ("x_m", "y_m")]
    numbers += [_number(value, where, "cov_m2") for value in cov]
    xx, xy, yy = numbers[2:]
    if xx < 0 or yy < 0 or xy * xy > xx * yy * (1 + 1e-9):
        raise FormatError(f"{where}: cov_m2 {cov!r} is no covariance. Its determinant must not be negative.")
    for key in ("u_px", "v_px", "radius_px", "score"):
        value = row.get(key)
        numbers.append(math.nan if value is None else _number(value, where, key))
    return numbers, json_index(row.get("id"), where, "id")


def _number(value: object, where: str, key: str) -> float:
    return json_number(value, where, key, "Correct or remove the sighting.")
