"""``waypoints.yaml``: named places on a route, at whose passes an estimate is scored.

::

    logpose: waypoints/1
    waypoints:
      - {name: W1, x_m: 30.38, y_m: 27.2}
"""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from ..errors import FormatError
from ..files import replacing_text
from ..text import parse_number
from ..yaml_file import YamlMapping, read_yaml, yaml_float, yaml_text

SCHEMA = "waypoints/1"


@dataclass(frozen=True, slots=True)
class Waypoint:
    """A named place.

    Attributes:
        name: for tables.
        x: in the frame of the reference [m].
        y: in the frame of the reference [m].
    """

    name: str
    x: float
    y: float


def read_waypoints(path: str | Path) -> list[Waypoint]:
    """Read ``waypoints.yaml``.

    Raises:
        FormatError: no such file, another schema, a key that is missing, a number that is none, a name that stands
            twice, or no waypoint at all.
    """
    document = read_yaml(path)
    if not isinstance(document, YamlMapping) or document.get("logpose") != SCHEMA:
        raise FormatError(f"{path}: is no list of waypoints. It must begin with 'logpose: {SCHEMA}'.")
    entries = document.get("waypoints")
    if not isinstance(entries, list) or not entries:
        raise FormatError(f"{path}: has no waypoints. Give a list 'waypoints: [{{name: W1, x_m: .., y_m: ..}}]'.")
    waypoints: list[Waypoint] = []
    for i, entry in enumerate(entries):
        if not isinstance(entry, YamlMapping):
            raise FormatError(f"{path}: waypoints[{i}] is no mapping. Write {{name: W1, x_m: .., y_m: ..}}.")
        where = f"{path}:{entry.line}"
        for key in ("name", "x_m", "y_m"):
            if key not in entry:
                raise FormatError(f"{where}: key {key!r} is missing. Write {{name: W1, x_m: .., y_m: ..}}.")
        name = str(entry["name"])
        if any(name == other.name for other in waypoints):
            raise FormatError(f"{where}: waypoint {name!r} stands twice. Give each its own name.")
        x, y = (parse_number(str(entry[key]), where, key) for key in ("x_m", "y_m"))
        waypoints.append(Waypoint(name, x, y))
    return waypoints


def write_waypoints(waypoints: Iterable[Waypoint], path: str | Path) -> None:
    """Write ``waypoints.yaml``; floats are read back bit by bit."""
    with replacing_text(path) as stream:
        stream.write(f"logpose: {SCHEMA}\nwaypoints:\n")
        for w in waypoints:
            stream.write(f"  - {{name: {yaml_text(w.name)}, x_m: {yaml_float(w.x)}, y_m: {yaml_float(w.y)}}}\n")
