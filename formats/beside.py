"""What belongs to a log stands beside it under the log's name: ``run.landmarks.yaml``, ``run.truth.tum``, ..."""

from collections.abc import Mapping
from pathlib import Path

from .maps.landmarks import write_landmarks
from .maps.marks import write_marks
from .products import LandmarkMap, MarkMap, Trajectory
from .trajectories.tum import write_tum


def beside(log: Path, end: str) -> Path:
    """Return the name of a file that belongs to a log: its stem and ``end``, like ``.waypoints.yaml``."""
    return log.with_name(log.stem + end)


def write_beside(log: Path, maps: Mapping[str, LandmarkMap | MarkMap], truth: Trajectory) -> list[Path]:
    """Write the maps and the truth of a log beside it.

    Args:
        log: the log; its stem is the stem of all.
        maps: end of the name, like ``.landmarks.yaml``, -> the map.
        truth: goes into ``<stem>.truth.tum``.

    Returns:
        The files written, in this order.
    """
    files = [beside(log, end) for end in maps]
    for path, given in zip(files, maps.values(), strict=True):
        if isinstance(given, LandmarkMap):
            write_landmarks(given, path)
        else:
            write_marks(given, path)
    files.append(beside(log, ".truth.tum"))
    write_tum(truth, files[-1])
    return files
