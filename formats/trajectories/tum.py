"""TUM trajectories: ``sec.nanosec x y z qx qy qz qw`` per line, the frame in a ``# frame: map`` line.

Stamps are written from and parsed to integer nanoseconds, never through a float. Positions and quaternions
are written as the shortest decimal of the value rounded to 1e-9.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import TextIO

from ..errors import FormatError
from ..events import Array, Pose
from ..files import replacing_text
from ..products import Trajectory
from ..text import comment_value, format_seconds, parse_number, parse_seconds, text_lines
from .poses import PoseRows, StampOrder, check_pose, check_trajectory, unit_quaternion

_NAMES = ("x", "y", "z", "qx", "qy", "qz", "qw")


def read_tum(path: str | Path, *, allow_repeats: bool = False) -> Trajectory:
    """Read a TUM trajectory.

    Args:
        path: the file; ``-`` is standard input.
        allow_repeats: keep poses that repeat the stamp of the one before, as published references have them.

    Raises:
        FormatError: no such file, no poses, a line without 8 columns, a number that is none or not finite,
            stamps that do not increase, or a quaternion that is none.
    """
    name = "<stdin>" if str(path) == "-" else str(path)
    return parse_tum(text_lines(path), name, allow_repeats=allow_repeats)


def parse_tum(lines: Iterable[tuple[int, str]], name: str, *, allow_repeats: bool = False) -> Trajectory:
    """Read a TUM trajectory from numbered lines; ``name`` stands for the file in errors."""
    rows = PoseRows(name, allow_repeats)
    for number, line in lines:
        text = line.strip()
        if text.startswith("#"):
            rows.frame_id = comment_value(text, "frame") or rows.frame_id
            continue
        if not text:
            continue
        where = f"{name}:{number}"
        cells = text.split()
        if len(cells) != 8:
            raise FormatError(f"{where}: has {len(cells)} columns, not 8. A TUM line is 't x y z qx qy qz qw'.")
        values = [parse_number(cell, where, key) for key, cell in zip(_NAMES, cells[1:], strict=True)]
        rows.add(number, parse_seconds(cells[0], where), values[:3], values[3:])
    return rows.trajectory()


def write_tum(trajectory: Trajectory, path: str | Path) -> None:
    """Write a TUM trajectory; ``-`` is standard output.

    Raises:
        ValueError: a pose that could not be read back (see ``check_trajectory``).
    """
    check_trajectory(trajectory)
    with replacing_text(path) as stream:
        stream.write(f"# frame: {trajectory.frame_id}\n")
        stream.writelines(map(_line, trajectory.stamps.tolist(), trajectory.positions, trajectory.orientations))


class TumWriter:
    """Writes poses one by one, as they come; the first one names the frame.

    Attributes:
        repeats: poses left out because they repeat the stamp of the one before.
    """

    def __init__(self, stream: TextIO) -> None:
        self.repeats = 0
        self._stream = stream
        self._order = StampOrder()

    def write(self, pose: Pose) -> None:
        """Append a pose.

        Raises:
            ValueError: a value that is not finite, a quaternion that is none, or a stamp that goes back.
        """
        if self._order.is_first:
            self._stream.write(f"# frame: {pose.frame_id or 'map'}\n")
        check_pose(pose.position, pose.orientation)
        if self._order.is_repeat(pose.stamp):
            self.repeats += 1
            return
        self._stream.write(_line(pose.stamp, pose.position, pose.orientation))


def _line(stamp: int, position: Array, orientation: Array) -> str:
    values = [*position.tolist(), *unit_quaternion(orientation.tolist())]
    return " ".join([format_seconds(stamp), *(_decimal(v) for v in values)]) + "\n"


def _decimal(value: float) -> str:
    return repr(round(value, 9) + 0.0)  # + 0.0: no negative zeros
