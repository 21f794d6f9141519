"""``trajectory.csv``: poses with covariance and whatever the estimator says of each.

::

    # logpose: trajectory/1
    # frame: map
    stamp_ns,x_m,y_m,z_m,qx,qy,qz,qw,cov_x_x_m2,cov_x_y_m2,...,cov_yaw_yaw_rad2,n_seen,...

The covariance columns are the upper triangle of the 6 x 6 of x, y, z, roll, pitch, yaw. A cell is empty where
a value does not exist. Floats are read back bit by bit.
"""

import csv
import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TextIO

import numpy as np

from ..errors import FormatError
from ..events import Array, Pose
from ..files import replacing_text
from ..products import Trajectory
from ..text import comment_value, parse_nanoseconds, parse_number, text_lines
from .poses import PoseRows, StampOrder, check_pose, check_trajectory, unit_quaternion

SCHEMA = "trajectory/1"
POSE_COLUMNS = ("stamp_ns", "x_m", "y_m", "z_m", "qx", "qy", "qz", "qw")

_AXES = ("x", "y", "z", "roll", "pitch", "yaw")
_TRIANGLE = [(i, j) for i in range(6) for j in range(i, 6)]
_UNITS = {0: "m2", 1: "m_rad", 2: "rad2"}
COVARIANCE_COLUMNS = tuple(f"cov_{_AXES[i]}_{_AXES[j]}_{_UNITS[(i > 2) + (j > 2)]}" for i, j in _TRIANGLE)


def read_trajectory_csv(path: str | Path, *, allow_repeats: bool = False) -> Trajectory:
    """Read a ``trajectory.csv``.

    Cells of further columns become integers, numbers, or words, and None where they are empty.

    Raises:
        FormatError: as ``read_tum``; also a column of the pose that is missing, or a covariance that is none.
    """
    return parse_trajectory_csv(text_lines(path), str(path), allow_repeats=allow_repeats)


def parse_trajectory_csv(lines: Iterable[tuple[int, str]], name: str, *, allow_repeats: bool = False) -> Trajectory:
    """Read a ``trajectory.csv`` from numbered lines; ``name`` stands for the file in errors."""
    rows = PoseRows(name, allow_repeats)
    header: list[str] | None = None
    covariances: list[Array] = []
    further: dict[str, list[float | int | str | None]] = {}
    for number, line in lines:
        text = line.strip()
        where = f"{name}:{number}"
        if text.startswith("#"):
            schema = comment_value(text, "logpose")
            if schema not in {None, SCHEMA}:
                raise FormatError(f"{where}: the file is {schema!r}, not {SCHEMA!r}. Convert it first.")
            rows.frame_id = comment_value(text, "frame") or rows.frame_id
            continue
        if not text:
            continue
        cells = _cells(line, where)
        if header is None:
            header = _check_header(cells, where)
            further = {key: [] for key in header if key not in POSE_COLUMNS and key not in COVARIANCE_COLUMNS}
            continue
        if len(cells) != len(header):
            raise FormatError(f"{where}: has {len(cells)} columns, the header {len(header)}. Correct the line.")
        cell = dict(zip(header, cells, strict=True))
        pose = [parse_number(cell[key], where, key) for key in POSE_COLUMNS[1:]]
        rows.add(number, parse_nanoseconds(cell["stamp_ns"], where, "stamp_ns"), pose[:3], pose[3:])
        if COVARIANCE_COLUMNS[0] in cell:
            covariances.append(_covariance(cell, where))
        for key, column in further.items():
            column.append(_value(cell[key]))
    return replace(rows.trajectory(), covariances=np.array(covariances) if covariances else None, columns=further)


def write_trajectory_csv(trajectory: Trajectory, path: str | Path) -> None:
    """Write a ``trajectory.csv``; ``-`` is standard output.

    Raises:
        ValueError: a pose that could not be read back (see ``check_trajectory``), or a column of another
            length.
    """
    check_trajectory(trajectory)
    for key, column in trajectory.columns.items():
        if len(column) != len(trajectory):
            raise ValueError(f"column {key!r} has {len(column)} values for {len(trajectory)} poses")
    with replacing_text(path) as stream:
        writer = CsvWriter(stream)
        for i, stamp in enumerate(trajectory.stamps.tolist()):
            pose = Pose(
                stamp=stamp,
                frame_id=trajectory.frame_id,
                position=trajectory.positions[i],
                orientation=trajectory.orientations[i],
                covariance=None if trajectory.covariances is None else trajectory.covariances[i],
                info={key: column[i] for key, column in trajectory.columns.items()},
            )
            writer.write(pose)


class CsvWriter:
    """Writes poses one by one, as they come; the first one names the frame and the columns.

    Attributes:
        repeats: poses left out because they repeat the stamp of the one before.
    """

    def __init__(self, stream: TextIO) -> None:
        self.repeats = 0
        self._stream = stream
        self._rows = csv.writer(stream, lineterminator="\n")
        self._order = StampOrder()
        self._further: list[str] = []
        self._has_covariance = False

    def write(self, pose: Pose) -> None:
        """Append a pose.

        Raises:
            ValueError: a value that is not finite, a quaternion that is none, a stamp that goes back, or a column
                that the first pose did not have.
        """
        if self._order.is_first:
            self._begin(pose)
        check_pose(pose.position, pose.orientation)
        if pose.covariance is not None and not self._has_covariance:
            raise ValueError("the pose has a covariance, the first one had none")
        if unknown := [key for key in pose.info if key not in self._further]:
            raise ValueError(f"the pose has a column {unknown[0]!r}, the first one had not")
        if self._order.is_repeat(pose.stamp):
            self.repeats += 1
            return
        row: list[object] = [pose.stamp, *pose.position.tolist(), *unit_quaternion(pose.orientation.tolist())]
        if self._has_covariance:
            cov = pose.covariance
            row += [None if cov is None else float(cov[i, j]) for i, j in _TRIANGLE]
        row += [pose.info.get(key) for key in self._further]
        self._rows.writerow([_cell(value) for value in row])

    def _begin(self, pose: Pose) -> None:
        self._further = list(pose.info)
        self._has_covariance = pose.covariance is not None
        if taken := [key for key in self._further if key in POSE_COLUMNS or key in COVARIANCE_COLUMNS]:
            raise ValueError(f"column {taken[0]!r} has the name of a column of the pose")
        self._stream.write(f"# logpose: {SCHEMA}\n# frame: {pose.frame_id or 'map'}\n")
        self._rows.writerow([*POSE_COLUMNS, *(COVARIANCE_COLUMNS if self._has_covariance else ()), *self._further])


def _cells(line: str, where: str) -> list[str]:
    try:
        return [cell.strip() for cell in next(csv.reader([line], strict=True))]
    except csv.Error as err:
        raise FormatError(f"{where}: is no CSV ({err}). Correct the line.") from err


def _check_header(cells: Sequence[str], where: str) -> list[str]:
    twice = [key for i, key in enumerate(cells) if key in cells[:i]]
    if twice:
        raise FormatError(f"{where}: column {twice[0]!r} stands twice. Remove one.")
    has_covariance = any(key in cells for key in COVARIANCE_COLUMNS)
    wanted = [*POSE_COLUMNS, *(COVARIANCE_COLUMNS if has_covariance else ())]
    if missing := [key for key in wanted if key not in cells]:
        raise FormatError(f"{where}: column {missing[0]!r} is missing. The columns begin {','.join(POSE_COLUMNS)}.")
    return list(cells)


def _covariance(cell: dict[str, str], where: str) -> Array:
    texts = [cell[key] for key in COVARIANCE_COLUMNS]
    matrix: Array = np.full((6, 6), np.nan)
    for (i, j), key, text in zip(_TRIANGLE, COVARIANCE_COLUMNS, texts, strict=True):
        if text:
            matrix[i, j] = matrix[j, i] = parse_number(text, where, key)
    if (np.diag(matrix) < 0).any():
        raise FormatError(f"{where}: a variance is negative. Correct or remove the line.")
    return matrix


def _value(text: str) -> float | int | str | None:
    if not text:
        return None
    for convert in (int, float):
        try:
            value = convert(text)
        except ValueError:
            continue
        # 'nan' and '1_000' are words here: missing numbers are empty cells.
        return value if math.isfinite(value) and "_" not in text else text
    return text


def _cell(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, bool | np.bool_):
        return str(int(value))
    if isinstance(value, float | np.floating):
        number = float(value)
        return repr(number) if math.isfinite(number) else ""
    return str(value)
