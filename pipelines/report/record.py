"""Stage ``write-log``: everything a run found as a log that Foxglove, RViz and rosbags open.

============================  =======================================================================================
``/<source>/pose``            each estimate (PoseWithCovarianceStamped; PoseStamped where there is no covariance)
``/<source>/path``            all of it (nav_msgs/Path), once at the end
``/<source>/sightings``       what was seen, as in ``sightings.jsonl`` or ``poses.jsonl`` (std_msgs/String with JSON)
``/<source>/annotations``     circles or edges over the camera's image (foxglove_msgs/ImageAnnotations)
``/<source>/mark_<id>/pose``  a stripe mark in the frame of the robot (PoseWithCovarianceStamped)
``/tf``                       map -> odom and odom -> base_link at each estimate (REP-105)
``/landmarks``, ``/marks``    the maps (foxglove_msgs/SceneUpdate), once
``/notices``                  what a person should know (foxglove_msgs/Log)
============================  =======================================================================================

What the stages summed up stands in metadata records named ``logpose.<source>``. Log time is the stamp of the event.
All messages are CDR: a log that mixes encodings cannot be played by ``ros2 bag play``.
"""

from array import array
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from ...formats.encode import TF_MESSAGE, header, pose_fields
from ...formats.events import INITIAL_POSE, TRUTH, Event, Notice, Odometry, Pose, Summary
from ...formats.foxglove import LOG, log_line
from ...formats.write_log import LogWriter, create_log
from ..engine.params import Field, InputPath, OutputPath, Params
from ..engine.report import dump_json
from .frames import FrameTree, Placed, Rigid
from .kinds import KINDS, read_maps
from .track import DEAD_RECKON


class WriteLogParams(Params):
    """Where the log goes, and what it shows beside the run itself."""

    path: OutputPath = Field("result.mcap", description="log to write, .mcap or .bag (which has no summaries)")
    map: InputPath | None = Field(None, description="landmark map written as a scene; none is written without it")
    marks: InputPath | None = Field(None, description="map of stripe marks, marks.yaml, written likewise")
    path_poses: int = Field(5000, ge=2, description="a path keeps at most this many poses, evenly chosen [1]")
    base_frame: str = Field("base_link", description="frame of the robot, where odometry does not name it")


def write_log(events: Iterator[Event], params: WriteLogParams) -> Iterator[Event]:
    """Write what passes, and what it amounts to, into a log."""
    maps = read_maps(params.map, params.marks)
    with create_log(params.path) as log:
        recorders = [*(kind.recorder(log, maps, params.base_frame) for kind in KINDS), _Recorder(log, params)]
        for event in events:
            for recorder in recorders:
                recorder.take(event)
            yield event
        for recorder in recorders:
            recorder.end()


class _Recorder:
    """Writes what all systems have in common: poses, paths, frames, notices, sums."""

    def __init__(self, log: LogWriter, params: WriteLogParams) -> None:
        self.log = log
        self.params = params
        self.tree = FrameTree()
        self.located: str | None = None
        self.frames = ("map", "odom", params.base_frame)
        self.paths: dict[str, _Path] = {}
        self.summaries: list[Summary] = []

    def take(self, event: Event) -> None:
        """Write what belongs in the log of one event."""
        match event:
            case Odometry():
                self._odometry(event)
            case Pose() if event.source != INITIAL_POSE:
                self._pose(event)
            case Notice():
                self.log.write_message("/notices", LOG, event.stamp, log_line(event))
            case Summary(values=Mapping()):  # a list has one item per message, and those stand in the log
                self.summaries.append(event)
            case _:
                pass

    def end(self) -> None:
        """Write what is known only now."""
        self._write_frames(self.tree.end())
        for source, path in self.paths.items():
            self.log.write_message(f"/{source}/path", "nav_msgs/msg/Path", path.last_stamp, path.fields())
        if not self.params.path.lower().endswith(".bag"):
            for summary in self.summaries:
                self.log.metadata(f"logpose.{summary.source}", {"json": dump_json(summary.values)})

    def _pose(self, event: Pose) -> None:
        self.log.write(replace(event, topic=f"/{event.source}/pose"))
        path = self.paths.setdefault(event.source, _Path(event.frame_id, self.params.path_poses))
        path.add(event)
        if self.located is None and event.source not in {TRUTH, DEAD_RECKON}:
            self.located = event.source
            self.frames = (event.frame_id or "map", *self.frames[1:])
        if event.source == self.located:
            self._write_frames(self.tree.estimate(event.stamp, (event.position, event.orientation)))

    def _odometry(self, event: Odometry) -> None:
        pose: Rigid | None = None
        if event.position is not None and event.orientation is not None and event.frame_id != self.frames[0]:
            pose = (event.position, event.orientation)
            self.frames = (self.frames[0], event.frame_id or "odom", event.child_frame_id or self.params.base_frame)
        self._write_frames(self.tree.odometry(event.stamp, pose))

    def _write_frames(self, placed: Iterable[Placed]) -> None:
        world, odom, base = self.frames
        for place in placed:
            if place.map_T_odom is None:
                transforms = [_transform(place.stamp, world, base, place.odom_T_base)]
            else:
                transforms = [
                    _transform(place.stamp, world, odom, place.map_T_odom),
                    _transform(place.stamp, odom, base, place.odom_T_base),
                ]
            self.log.write_message("/tf", TF_MESSAGE, place.stamp, {"transforms": transforms})


class _Path:
    """Poses evenly chosen from a stream of unknown length, in bounded memory.

    Every ``step``-th pose is kept; when there are too many, every second of them goes and the step doubles.
    """

    def __init__(self, frame_id: str, most: int) -> None:
        self.frame_id = frame_id or "map"
        self.most = most
        self.step, self.count = 1, 0
        self.stamps, self.numbers = array("q"), array("d")
        self.last: Pose | None = None

    @property
    def last_stamp(self) -> int:
        """Stamp of the last pose [ns]."""
        return 0 if self.last is None else self.last.stamp

    def add(self, event: Pose) -> None:
        """Take a pose."""
        if self.count % self.step == 0:
            if len(self.stamps) + 1 >= self.most:  # one place is kept for the last pose
                self.stamps = self.stamps[::2]
                self.numbers = array("d", np.array(self.numbers).reshape(-1, 7)[::2].ravel())
                self.step *= 2
            if self.count % self.step == 0:
                self._keep(event)
        self.count += 1
        self.last = event

    def fields(self) -> dict[str, object]:
        """Return the fields of ``nav_msgs/Path``."""
        if self.last is not None and self.stamps[-1] != self.last.stamp:
            self._keep(self.last)
        rows = np.array(self.numbers).reshape(-1, 7)
        poses = [
            {"header": header(stamp, self.frame_id), "pose": pose_fields(row[:3], row[3:])}
            for stamp, row in zip(self.stamps, rows, strict=True)
        ]
        return {"header": header(self.last_stamp, self.frame_id), "poses": poses}

    def _keep(self, event: Pose) -> None:
        self.stamps.append(event.stamp)
        self.numbers.extend([*event.position.tolist(), *event.orientation.tolist()])


def _transform(stamp: int, parent: str, child: str, pose: Rigid) -> dict[str, object]:
    translation, rotation = pose
    fields = pose_fields(translation, rotation)
    return {
        "header": header(stamp, parent),
        "child_frame_id": child,
        "transform": {"translation": fields["position"], "rotation": fields["orientation"]},
    }
