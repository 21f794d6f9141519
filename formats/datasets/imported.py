"""What importers share: the events of a data set, the log with map and truth beside it, what was left out and why."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from heapq import merge
from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ..beside import write_beside
from ..events import NO_ID, Array, Event, Pose, Sightings
from ..products import LandmarkMap, Trajectory
from ..write_log import create_log

Stamps = npt.NDArray[np.int64]
Ids = npt.NDArray[np.int64]


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
    log: str | Path, streams: Iterable[Iterable[Event]], maps: Mapping[str, LandmarkMap], truth: Trajectory
) -> tuple[Path, ...]:
    """Write a log of streams, each sorted by time, and the maps and the truth beside it; return the paths."""
    path = Path(log)
    with create_log(path) as writer:
        for event in merge(*streams, key=lambda event: event.stamp):
            writer.write(event)
    return (path, *write_beside(path, maps, truth))


def sightings(
    stamps: Stamps, bounds: npt.NDArray[np.int64], *, xy: Array, cov: Array, ids: Ids, score: Array | None = None
) -> list[Sightings]:
    """Return one event per stamp from rows in the order of time.

    Args:
        stamps: (K,) [ns].
        bounds: (K + 1,) the rows of event i are ``bounds[i]`` to ``bounds[i + 1]``.
        xy: (N, 2) in robot coordinates [m].
        cov: (N, 2, 2) [m^2].
        ids: (N,) NO_ID where not known.
        score: (N,) 0..1, None where the data set has none.
    """
    events = []
    for stamp, (a, b) in zip(stamps.tolist(), pairwise(bounds.tolist()), strict=True):
        nothing = np.full(b - a, np.nan)
        events.append(
            Sightings(
                stamp=stamp,
                frame_id="base_link",
                xy=xy[a:b],
                cov=cov[a:b],
                uv=np.column_stack([nothing, nothing]),
                radius=nothing,
                score=nothing if score is None else score[a:b],
                ids=ids[a:b],
            )
        )
    return events


def blind(events: Iterable[Sightings]) -> list[Sightings]:
    """Return sightings without their ids as events of ``/sightings``."""
    return [replace(event, topic="/sightings", ids=np.full(len(event.ids), NO_ID)) for event in events]


def identified(events: Iterable[Sightings]) -> list[Sightings]:
    """Return sightings with their ids as events of ``/ground_truth/sightings``."""
    return [replace(event, topic="/ground_truth/sightings") for event in events]


def true_poses(stamps: Stamps, poses: Array) -> list[Pose]:
    """Return the poses (N, 3) x, y [m], heading [rad] as events of ``/ground_truth/pose``."""
    return [_pose(int(stamp), pose, "/ground_truth/pose", None) for stamp, pose in zip(stamps, poses, strict=True)]


def initial_pose(stamp: int, pose: Array) -> Pose:
    """Return the start pose (3,) as the event of ``/initialpose``, known to 2 cm and 1.1 degrees."""
    variances = [0.02**2, 0.02**2, 0.0, 0.0, 0.0, np.radians(1.1) ** 2]
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


def upright(heading: float) -> Array:
    """Return the quaternion (4,) x, y, z, w of a heading [rad]."""
    return np.array([0.0, 0.0, np.sin(heading / 2), np.cos(heading / 2)])


def _pose(stamp: int, pose: Array, topic: str, covariance: Array | None) -> Pose:
    x, y, heading = pose.tolist()
    return Pose(
        stamp=stamp,
        topic=topic,
        frame_id="map",
        position=np.array([x, y, 0.0]),
        orientation=upright(heading),
        covariance=covariance,
    )
