"""Stages that merge into the log, by time, what was computed earlier; they stand at the front of a pipeline."""

import heapq
from collections.abc import Iterable, Iterator

from ..formats.events import TRUTH, Event, Pose
from ..formats.sightings import read_sightings as lines_of
from ..formats.trajectories.trajectory import read_trajectory
from .engine.params import Field, InputPath, Params


class ReadSightingsParams(Params):
    """Where the sightings are."""

    path: InputPath = Field(description="sightings.jsonl of detect-circles; - is standard input")


def read_sightings(events: Iterator[Event], params: ReadSightingsParams) -> Iterator[Event]:
    """Merge a file of sightings into the log."""
    yield from merged(events, lines_of(params.path))


class ReadTruthParams(Params):
    """Where the reference is."""

    path: InputPath = Field(description="reference trajectory: TUM, KITTI, EuRoC, CSV, or LOG:/topic")


def read_truth(events: Iterator[Event], params: ReadTruthParams) -> Iterator[Event]:
    """Merge a reference trajectory into the log, as the truth that results are measured against."""
    reference = read_trajectory(params.path)
    truth = (
        Pose(
            stamp=int(stamp),
            source=TRUTH,
            frame_id=reference.frame_id,
            position=position,
            orientation=orientation,
        )
        for stamp, position, orientation in zip(
            reference.stamps, reference.positions, reference.orientations, strict=True
        )
    )
    yield from merged(events, truth)


def merged(events: Iterable[Event], more: Iterable[Event]) -> Iterator[Event]:
    """Merge two streams that are each ordered by time; of equal stamps the first stream's come first."""
    return heapq.merge(events, more, key=lambda event: event.stamp)
