"""What an importer wrote: the log, the maps and the truth beside it, with counts of what was left out and why."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from heapq import merge
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ..events import Array, Event, Pose
from ..landmarks import write_landmarks
from ..products import LandmarkMap, Trajectory
from ..tum import write_tum
from ..write_log import create_log

Stamps = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Imported:
    """Files written and what a person should know of them.

    Attributes:
        files: the log first, then what was written beside it.
        counts: what was written, what was left out or repaired, by name.
        remarks: one line each.
    """

    files: tuple[Path, ...]
    counts: Mapping[str, int]
    remarks: tuple[str, ...] = ()

    def lines(self) -> list[str]:
        """Return the report, line by line."""
        return [
            *(f"wrote {path}" for path in self.files),
            *(f"{count} {name}" for name, count in self.counts.items()),
            *self.remarks,
        ]


def write_all(
    log: str | Path, streams: Iterable[Iterable[Event]], landmarks: LandmarkMap, truth: Trajectory
) -> tuple[Path, Path, Path]:
    """Write a log of streams, each sorted by time, and the map and the truth beside it; return the three paths."""
    path = Path(log)
    map_path, truth_path = path.with_suffix(".landmarks.yaml"), path.with_suffix(".truth.tum")
    with create_log(path) as writer:
        for event in merge(*streams, key=lambda event: event.stamp):
            writer.write(event)
    write_landmarks(landmarks, map_path)
    write_tum(truth, truth_path)
    return path, map_path, truth_path


def true_poses(stamps: Stamps, poses: Array) -> list[Pose]:
    """Return the poses (N, 3) x, y [m], heading [rad] as events of ``/ground_truth/pose``."""
    return [_pose(int(stamp), pose, "/ground_truth/pose", None) for stamp, pose in zip(stamps, poses, strict=True)]


def initial_pose(stamp: int, pose: Array, sigma_m: float = 0.02, sigma_rad: float = np.radians(1.1)) -> Pose:
    """Return the start pose (3,) as the event of ``/initialpose``, known to 2 cm and 1.1 degrees."""
    variances = [sigma_m**2, sigma_m**2, 0.0, 0.0, 0.0, sigma_rad**2]
    return _pose(stamp, pose, "/initialpose", np.diag(variances))


def true_trajectory(stamps: Stamps, poses: Array) -> Trajectory:
    """Return the poses (N, 3) x, y [m], heading [rad] as a trajectory in ``map``."""
    zero = np.zeros(len(poses))
    half = 0.5 * poses[:, 2]
    return Trajectory(
        stamps=np.asarray(stamps, dtype=np.int64),
        positions=np.column_stack([poses[:, :2], zero]),
        orientations=np.column_stack([zero, zero, np.sin(half), np.cos(half)]),
    )


def _pose(stamp: int, pose: Array, topic: str, covariance: Array | None) -> Pose:
    x, y, heading = pose.tolist()
    return Pose(
        stamp=stamp,
        topic=topic,
        frame_id="map",
        position=np.array([x, y, 0.0]),
        orientation=np.array([0.0, 0.0, np.sin(heading / 2), np.cos(heading / 2)]),
        covariance=covariance,
    )
