"""``poses.jsonl``: where the camera stands before stripe marks, one line per sighting, at least one per image.

::

    {"logpose": "mark-poses/1"}
    {"stamp_ns": 0, "frame_id": "map", "mark": 1, "status": "ok", "phi_rad": .., "dx_m": .., "dy_m": ..,
     "cov": [..], "robot": {"x_m": .., "y_m": .., "heading_rad": .., "cov": [..]}, "tilt_rad": .., "roll_rad": ..,
     "row_px": .., "edges": [{"member": 0, "u_px": .., "slope": .., "first_row": .., "last_row": .., "residual_px": ..}
     ]}

``cov`` is the upper triangle row by row, of phi, d_x, d_y: ``[phi phi, phi dx, phi dy, dx dx, dx dy, dy dy]`` [rad^2,
rad m, rad m, m^2, m^2, m^2]; that of ``robot`` likewise of x, y, heading. ``slope`` is the change of an edge's column
per row. What does not exist is ``null``: ``mark`` where none was recognised, numbers without a pose, a whole ``cov`` or
``robot``. The first line may be missing. Floats are written so that they are read back bit by bit.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import numpy as np

from .errors import FormatError
from .events import NO_ID, Array, MarkSighting
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

SCHEMA = "mark-poses/1"
HEADER = schema_line(SCHEMA)
"""The first line of the file."""

_POSE = ("phi_rad", "dx_m", "dy_m")
_ROBOT = ("x_m", "y_m", "heading_rad")
_ATTITUDE = ("tilt_rad", "roll_rad")
_EDGE = ("u_px", "slope", "first_row", "last_row", "residual_px")
_UPPER = np.triu_indices(3)


def mark_pose_to_json(event: MarkSighting) -> dict[str, object]:
    """Return the line of one sighting as a JSON-ready mapping, not finite numbers as None."""
    has_robot = bool(np.isfinite(event.robot).any())
    robot = _named(_ROBOT, event.robot) | {"cov": _triangle(event.robot_cov)}
    return {
        "stamp_ns": int(event.stamp),
        "frame_id": event.frame_id,
        "mark": None if event.mark == NO_ID else int(event.mark),
        "status": event.status,
        **_named(_POSE, event.pose),
        "cov": _triangle(event.cov),
        "robot": robot if has_robot else None,
        **_named(_ATTITUDE, event.attitude),
        "row_px": or_none(event.row),
        "edges": [
            {"member": None if member < 0 else int(member), **_named(_EDGE, line)}
            for member, line in zip(event.members, event.lines, strict=True)
        ],
    }


def mark_pose_from_json(line: object, *, where: str = "mark-poses") -> MarkSighting:
    """Return the sighting that ``mark_pose_to_json`` made the mapping from.

    Args:
        line: the decoded JSON of one line.
        where: file and line, for the message of an error.

    Raises:
        FormatError: a key is missing or a value is not what it should be.
    """
    fields, stamp = json_event(line, where)
    frame_id = json_string(fields.get("frame_id", "map"), where, "frame_id")
    status = json_string(fields.get("status"), where, "status")
    robot = fields.get("robot")
    if robot is not None and not isinstance(robot, Mapping):
        raise FormatError(f"{where}: robot is {robot!r}. It must be null or {{x_m, y_m, heading_rad, cov}}.")
    rows = fields.get("edges", [])
    if not isinstance(rows, list):
        raise FormatError(f"{where}: edges is {rows!r}. It must be a list.")
    edges = [_edge(row, f"{where}: edges[{i}]") for i, row in enumerate(rows)]
    return MarkSighting(
        stamp=stamp,
        source="mark-poses",
        frame_id=frame_id,
        mark=json_index(fields.get("mark"), where, "mark"),
        status=status,
        pose=_values(fields, _POSE, where),
        cov=_matrix(fields.get("cov"), where, "cov"),
        attitude=_values(fields, _ATTITUDE, where),
        robot=_values(robot or {}, _ROBOT, f"{where}: robot"),
        robot_cov=_matrix((robot or {}).get("cov"), f"{where}: robot", "cov"),
        row=_number(fields.get("row_px"), where, "row_px"),
        lines=np.array([numbers for _, numbers in edges], dtype=np.float64).reshape(-1, len(_EDGE)),
        members=np.array([member for member, _ in edges], dtype=np.int64),
    )


def mark_pose_line(event: MarkSighting) -> str:
    """Return one sighting as one line of JSON with its line end."""
    return json_line(mark_pose_to_json(event))


def write_mark_poses(events: Iterable[MarkSighting], path: str | Path) -> int:
    """Write ``poses.jsonl`` and return the number of sightings; ``-`` is standard output."""
    return write_events(events, path, SCHEMA, mark_pose_line)


def read_mark_poses(path: str | Path) -> Iterator[MarkSighting]:
    """Yield the sightings of a ``poses.jsonl`` one by one, as the lines come; ``-`` is standard input.

    Raises:
        FormatError: the file cannot be read, is of another version, or a line is not what it should be; stamps that go
            back. An empty file holds no sighting and is no error.
    """
    return read_events(path, SCHEMA, lambda value, where: mark_pose_from_json(value, where=where))


def _named(keys: tuple[str, ...], values: Array) -> dict[str, object]:
    return {key: or_none(value) for key, value in zip(keys, values, strict=True)}


def _triangle(covariance: Array) -> list[float] | None:
    return [float(value) for value in covariance[_UPPER]] if np.isfinite(covariance).all() else None


def _values(line: Mapping[str, object], keys: tuple[str, ...], where: str) -> Array:
    return np.array([_number(line.get(key), where, key) for key in keys])


def _matrix(value: object, where: str, key: str) -> Array:
    """Return the covariance of an upper triangle, all nan for null."""
    if value is None:
        return np.full((3, 3), np.nan)
    if not isinstance(value, list) or len(value) != len(_UPPER[0]):
        raise FormatError(f"{where}: {key} is {value!r}. It must be null or the upper triangle, 6 numbers.")
    matrix = np.zeros((3, 3))
    matrix[_UPPER] = [json_number(item, where, key, _CURE) for item in value]
    matrix.T[_UPPER] = matrix[_UPPER]
    variances = np.diag(matrix)
    scale = np.sqrt(np.where(variances > 0, variances, 1.0))  # units differ: judge correlations, not eigenvalues
    if (variances < 0).any() or np.linalg.eigvalsh(matrix / scale / scale[:, None])[0] < -1e-9:
        raise FormatError(f"{where}: {key} {value!r} is no covariance. No eigenvalue may be negative.")
    return matrix


def _edge(row: object, where: str) -> tuple[int, list[float]]:
    if not isinstance(row, Mapping):
        raise FormatError(f"{where} is no object. Write one object per edge.")
    return json_index(row.get("member"), where, "member"), [_number(row.get(key), where, key) for key in _EDGE]


_CURE = "Correct or remove the line."


def _number(value: object, where: str, key: str) -> float:
    return math.nan if value is None else json_number(value, where, key, _CURE)
