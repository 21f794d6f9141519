"""Any trajectory by content: TUM, KITTI, EuRoC, ``trajectory.csv``, standard input, or a topic of a log."""

from pathlib import Path

import numpy as np

from ..errors import ConfigError, FormatError
from ..products import Trajectory
from ..text import content_lines, text_lines
from .euroc import parse_euroc
from .kitti import find_times, parse_kitti, write_kitti
from .poses import check_trajectory
from .trajectory_csv import parse_trajectory_csv, write_trajectory_csv
from .tum import parse_tum, write_tum

_WRITERS = {
    ".tum": write_tum,
    ".txt": write_tum,
    ".csv": write_trajectory_csv,
    ".kitti": write_kitti,
    "": write_tum,
}


def convert_trajectory(source: str, target: str) -> None:
    """Read any trajectory, write it in the format that the suffix of the target names (TUM without one).

    Raises:
        ConfigError: no format has this suffix.
        FormatError: as ``read_trajectory``.
    """
    suffix = Path(target).suffix
    if suffix not in _WRITERS:
        raise ConfigError(f"{target}: no trajectory format has the suffix {suffix!r}. Use .tum, .csv or .kitti.")
    _WRITERS[suffix](read_trajectory(source, allow_repeats=False), target)


def read_trajectory(spec: str | Path, *, allow_repeats: bool = True) -> Trajectory:
    """Read a trajectory.

    Args:
        spec: a file (TUM, KITTI with ``<stem>.times.txt`` or ``times.txt`` beside it, EuRoC CSV,
            ``trajectory.csv``), ``POSES,TIMES`` (KITTI poses and their stamps), ``-`` (text on standard
            input), or ``LOG:/topic``.
        allow_repeats: keep poses that repeat the stamp of the one before, as the published references of TUM
            and the estimates scored against them have; stamps that go back are always refused.

    Raises:
        FormatError: the file is missing, is no trajectory, or a line is not what it should be.
        ConfigError: the topic is not in the log.
    """
    text = str(spec)
    path, colon, topic = text.rpartition(":/")
    if colon and path and not Path(text).exists():
        return _read_topic(path, "/" + topic, allow_repeats)
    poses, comma, times = text.rpartition(",")
    if comma and not Path(text).exists() and Path(poses).exists():
        return _parse(poses, Path(times), allow_repeats)
    if text != "-" and Path(text).is_dir():
        raise FormatError(f"{text}: is a folder. Name a file in it, or a topic of the log: {text}:/topic.")
    return _parse(text, None, allow_repeats)


def _parse(path: str, times: Path | None, allow_repeats: bool) -> Trajectory:
    name = "<stdin>" if path == "-" else path
    try:
        lines = list(text_lines(path))
    except FormatError as err:
        if isinstance(err.__cause__, UnicodeDecodeError):
            raise FormatError(f"{path}: is no text file. If it is a log, name a topic: {path}:/topic.") from err
        raise
    first = next(content_lines(lines), None)
    if first is None:
        raise FormatError(f"{name}: has no poses. Name a file with at least one.")
    number, text = first
    if "," in text:
        is_ours = text.replace(" ", "").split(",")[0] == "stamp_ns" or "stamp_ns" in text
        parse = parse_trajectory_csv if is_ours else parse_euroc
        return parse(lines, name, allow_repeats=allow_repeats)
    columns = len(text.split())
    if columns == 12:
        return parse_kitti(lines, name, find_times(path) if times is None and path != "-" else times)
    if columns == 8:
        return parse_tum(lines, name, allow_repeats=allow_repeats)
    raise FormatError(
        f"{name}:{number}: has {columns} columns. A trajectory has 8 (TUM), 12 (KITTI), or commas (EuRoC, "
        "trajectory.csv)."
    )


def _read_topic(log: str, topic: str, allow_repeats: bool) -> Trajectory:
    from ..events import LOGGED_POSE, Pose
    from ..log import open_log

    stamps: list[int] = []
    values: list[list[float]] = []
    covariances = []
    frame_id = "map"
    where = f"{log}:{topic}"
    for event in open_log([log], {LOGGED_POSE: topic}):
        if not isinstance(event, Pose) or event.topic not in {"", topic}:
            continue
        stamps.append(event.stamp)
        values.append([*event.position.tolist(), *event.orientation.tolist()])
        covariances.append(event.covariance)
        frame_id = event.frame_id or frame_id
    if not stamps:
        raise ConfigError(f"{where}: no poses on this topic. Run 'logpose inspect {log}' to see the topics.")
    table = np.array(values)
    trajectory = Trajectory(
        stamps=np.array(stamps, dtype=np.int64),
        positions=table[:, :3],
        orientations=table[:, 3:],
        frame_id=frame_id,
        covariances=np.array(covariances) if all(c is not None for c in covariances) else None,
    )
    try:
        check_trajectory(trajectory, allow_repeats=allow_repeats)
    except ValueError as err:
        raise FormatError(f"{where}: {err}. Correct the log, or write the topic to a file and clean that.") from err
    return trajectory
