"""EuRoC trajectories: CSV ``timestamp [ns], x, y, z [m], qw, qx, qy, qz``; further columns are read over."""

from collections.abc import Iterable
from pathlib import Path

from ..errors import FormatError
from ..files import replacing_text
from ..products import Trajectory
from ..text import content_lines, parse_nanoseconds, parse_number, text_lines
from .poses import PoseRows, check_trajectory, unit_quaternion

HEADER = "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []"
_NAMES = ("x", "y", "z", "qw", "qx", "qy", "qz")


def read_euroc(path: str | Path, *, allow_repeats: bool = False) -> Trajectory:
    """Read an EuRoC ground truth file.

    Raises:
        FormatError: as ``read_tum``; fewer than 8 columns, or a stamp that is no integer.
    """
    return parse_euroc(text_lines(path), str(path), allow_repeats=allow_repeats)


def parse_euroc(lines: Iterable[tuple[int, str]], name: str, *, allow_repeats: bool = False) -> Trajectory:
    """Read an EuRoC trajectory from numbered lines; ``name`` stands for the file in errors."""
    rows = PoseRows(name, allow_repeats)
    for number, text in content_lines(lines):
        where = f"{name}:{number}"
        cells = [cell.strip() for cell in text.split(",")]
        if len(cells) < 8:
            raise FormatError(f"{where}: has {len(cells)} columns, not 8 or more. EuRoC is 't,x,y,z,qw,qx,qy,qz'.")
        values = [parse_number(cell, where, key) for key, cell in zip(_NAMES, cells[1:8], strict=True)]
        rows.add(number, parse_nanoseconds(cells[0], where), values[:3], [*values[4:], values[3]])
    return rows.trajectory()


def write_euroc(trajectory: Trajectory, path: str | Path) -> None:
    """Write an EuRoC trajectory; floats are read back bit by bit. No command writes one: ``.csv`` means ours.

    Raises:
        ValueError: a pose that could not be read back (see ``check_trajectory``).
    """
    check_trajectory(trajectory)
    with replacing_text(path) as stream:
        stream.write(HEADER + "\n")
        for stamp, position, orientation in zip(
            trajectory.stamps.tolist(),
            trajectory.positions.tolist(),
            trajectory.orientations.tolist(),
            strict=True,
        ):
            qx, qy, qz, qw = unit_quaternion(orientation)
            stream.write(",".join([str(stamp), *(repr(v) for v in (*position, qw, qx, qy, qz))]) + "\n")
