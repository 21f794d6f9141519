"""Stages that write what was found; they forward everything, so they may stand anywhere in a pipeline."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TypeVar

from ..formats.events import Event, MarkSighting, Notice, Pose, Sightings, Summary
from ..formats.files import replacing_text
from ..formats.mark_poses import HEADER as MARK_POSES_HEADER
from ..formats.mark_poses import mark_pose_line, mark_pose_to_json
from ..formats.sightings import HEADER, sightings_line
from ..formats.trajectories.trajectory_csv import CsvWriter
from ..formats.trajectories.tum import TumWriter
from .engine.params import Field, OutputPath, Params
from .images.checks import no_images

S = TypeVar("S", bound=Event)


class WriteTrajectoryParams(Params):
    """What to write, and where."""

    path: OutputPath = Field(
        "trajectory.tum", description="file to write; .csv holds covariances too, any other is TUM"
    )
    source: str = Field(description="name of the estimator whose poses are written")


def write_trajectory(events: Iterator[Event], params: WriteTrajectoryParams) -> Iterator[Event]:
    """Write the poses of one estimator as a TUM or CSV trajectory.

    Of two poses with one stamp the first is written: readers of trajectories want stamps that increase.
    """
    stamp = 0
    with replacing_text(params.path) as file:
        writer = CsvWriter(file) if params.path.endswith(".csv") else TumWriter(file)
        for event in events:
            yield event
            stamp = event.stamp
            if isinstance(event, Pose) and event.source == params.source:
                writer.write(event)
    if writer.repeats:
        message = f"{writer.repeats} poses repeat a stamp; {Path(params.path).name} keeps the first of each."
        yield Notice(stamp=stamp, source="write-trajectory", code="repeated-stamp", message=message)


class WriteSightingsParams(Params):
    """What to write, and where."""

    path: OutputPath = Field("sightings.jsonl", description="file to write")
    source: str = Field(description="name of the stage whose sightings are written")


def write_sightings(events: Iterator[Event], params: WriteSightingsParams) -> Iterator[Event]:
    """Write one line per image, also when nothing was seen in it.

    Raises:
        ConfigError: there was no image.
    """
    yield from _lines(events, Sightings, params.source, sightings_line, header=HEADER, path=params.path)


class WriteMarkPosesParams(Params):
    """What to write, and where."""

    path: OutputPath = Field("poses.jsonl", description="file to write")
    source: str = Field(description="name of the stage whose sightings of marks are written")
    in_report: bool = Field(default=False, description="also put them, without edges, into result.poses of report.json")


def write_mark_poses(events: Iterator[Event], params: WriteMarkPosesParams) -> Iterator[Event]:
    """Write one line per mark seen, at least one per image.

    Raises:
        ConfigError: there was no image.
    """
    poses: list[Mapping[str, object]] = []
    is_kept = params.in_report and params.path != "-"  # a stream leaves no report
    stamp = 0

    def line(event: MarkSighting) -> str:
        if is_kept:
            poses.append({key: value for key, value in mark_pose_to_json(event).items() if key != "edges"})
        return mark_pose_line(event)

    for event in _lines(events, MarkSighting, params.source, line, header=MARK_POSES_HEADER, path=params.path):
        yield event
        stamp = event.stamp
    if is_kept:
        yield Summary(stamp=stamp, source="poses", values=poses)


def _lines(
    events: Iterator[Event], kind: type[S], source: str, line: Callable[[S], str], *, header: str, path: str
) -> Iterator[Event]:
    """Write one line per sighting of a stage.

    Raises:
        ConfigError: there was none, so there was no image.
    """
    n = 0
    with replacing_text(path) as file:
        for event in events:
            yield event
            if isinstance(event, kind) and event.source == source:
                file.write(line(event) if n else header + line(event))
                n += 1
        if n == 0:
            raise no_images(source)
