"""KITTI trajectories: the upper 3 x 4 of the pose matrix per line, row by row; stamps in a second file.

The file of stamps (decimal seconds, one per line) is ``<stem>.times.txt`` or ``times.txt`` beside it, or
named. Without one the i-th pose gets the stamp i seconds, so that two such files match line by line.
"""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..errors import FormatError
from ..files import replacing_text
from ..products import Trajectory
from ..rotation import quaternion_from_rotation, rotation_from_quaternion
from ..text import NANOSECONDS, content_lines, format_seconds, parse_number, parse_seconds, text_lines
from .poses import PoseRows, check_trajectory

ROTATION_TOLERANCE = 0.02
"""The largest entry of R R^T - I; more is no rounded rotation."""


def read_kitti(path: str | Path, times: str | Path | None = None) -> Trajectory:
    """Read a KITTI trajectory.

    Args:
        path: the poses.
        times: the stamps; None looks beside the poses.

    Raises:
        FormatError: as ``read_tum``; also a matrix that is no rotation, or another number of stamps than of
            poses.
    """
    return parse_kitti(text_lines(path), str(path), find_times(path) if times is None else times)


def find_times(path: str | Path) -> Path | None:
    """Return the file of stamps that stands beside a file of poses, or None."""
    beside = Path(path)
    for candidate in (times_path(beside), beside.with_name("times.txt")):
        if candidate.is_file() and candidate != beside:
            return candidate
    return None


def times_path(path: str | Path) -> Path:
    """Return the name of the file of stamps that belongs to a file of poses."""
    return Path(path).with_suffix(".times.txt")


def parse_kitti(lines: Iterable[tuple[int, str]], name: str, times: str | Path | None = None) -> Trajectory:
    """Read a KITTI trajectory from numbered lines; ``name`` stands for the file in errors."""
    stamps = None if times is None else _read_times(times)
    rows = PoseRows(name)
    matrices = []
    for number, text in content_lines(lines):
        where = f"{name}:{number}"
        cells = text.split()
        if len(cells) != 12:
            raise FormatError(f"{where}: has {len(cells)} columns, not 12. A KITTI line is a 3 x 4 matrix.")
        matrix = np.array([parse_number(cell, where, f"column {i + 1}") for i, cell in enumerate(cells)]).reshape(3, 4)
        rotation = matrix[:, :3]
        off = float(np.abs(rotation @ rotation.T - np.eye(3)).max())
        if off > ROTATION_TOLERANCE or np.linalg.det(rotation) < 0:
            raise FormatError(f"{where}: the matrix is no rotation (off by {off:.3g}). Check the order of the columns.")
        index = len(rows.stamps)
        if stamps is not None and index >= len(stamps):
            raise FormatError(
                f"{where}: there are only {len(stamps)} stamps in {times}. Name the right file of stamps."
            )
        stamp = index * NANOSECONDS if stamps is None else stamps[index]
        rows.add(number, stamp, matrix[:, 3].tolist(), quaternion_from_rotation(rotation).tolist())
        matrices.append(rotation)
    if stamps is not None and len(stamps) != len(rows.stamps):
        raise FormatError(
            f"{times}: has {len(stamps)} stamps for the {len(rows.stamps)} poses of {name}. "
            "Name the right file of stamps."
        )
    return replace(rows.trajectory(), matrices=np.array(matrices))


def write_kitti(trajectory: Trajectory, path: str | Path) -> None:
    """Write the poses, and the stamps into ``<stem>.times.txt`` beside them.

    Raises:
        ValueError: a pose that could not be read back (see ``check_trajectory``).
    """
    check_trajectory(trajectory)
    with replacing_text(path) as stream:
        for position, orientation in zip(trajectory.positions, trajectory.orientations, strict=True):
            matrix = np.column_stack([rotation_from_quaternion(orientation), position])
            stream.write(" ".join(repr(round(v, 12) + 0.0) for v in matrix.ravel().tolist()) + "\n")
    with replacing_text(times_path(path)) as stream:
        stream.writelines(format_seconds(stamp) + "\n" for stamp in trajectory.stamps.tolist())


def _read_times(path: str | Path) -> list[int]:
    return [parse_seconds(text, f"{path}:{number}") for number, text in content_lines(text_lines(path))]
