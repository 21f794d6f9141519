"""Stages ``write-report`` and ``write-picture``: keep a run's numbers, and draw them when the log has ended."""

from collections.abc import Iterator, Mapping

from ...formats.errors import ConfigError
from ...formats.events import Event, Notice, Pose, Summary
from ...formats.files import replacing, replacing_text
from ...formats.landmarks import read_landmarks
from ...formats.marks import read_marks
from ...formats.products import LandmarkMap, MarkMap
from ..engine.params import Field, InputPath, OutputPath, Params
from .captions import PictureName, draw_picture
from .findings import Findings
from .landmarks.kept import LandmarkKeeper
from .marks.kept import MarkKeeper
from .page import render_page
from .track import START_POSE, TRUTH, TrackBuilder, primary_of


class WriteReportParams(Params):
    """Where the page goes, and what it shows beside the run itself."""

    path: OutputPath = Field("report.html", description="page to write")
    map: InputPath | None = Field(
        None, description="landmark map drawn under the trajectories; none is drawn without it"
    )
    marks: InputPath | None = Field(None, description="map of stripe marks, marks.yaml, drawn likewise")
    title: str = Field("logpose report", description="title of the page")


def write_report(events: Iterator[Event], params: WriteReportParams) -> Iterator[Event]:
    """Write one self-contained page with the pictures and tables a person would look at."""
    maps = _maps(params.map, params.marks)
    with replacing_text(params.path) as file:
        collector = Collector()
        for event in events:
            collector.take(event)
            yield event
        file.write(render_page(collector.findings(*maps), title=params.title))


class WritePictureParams(Params):
    """Which picture goes where."""

    path: OutputPath = Field("map.svg", description="picture to write; .png or .svg")
    picture: PictureName = Field("map", description="which one: those of the report by name, or the headline")
    map: InputPath | None = Field(
        None, description="landmark map drawn under the trajectories; none is drawn without it"
    )
    marks: InputPath | None = Field(None, description="map of stripe marks, marks.yaml, drawn likewise")


def write_picture(events: Iterator[Event], params: WritePictureParams) -> Iterator[Event]:
    """Write one of the report's pictures as a file of its own."""
    suffix = params.path.rsplit(".", 1)[-1].lower()
    if suffix not in {"png", "svg"}:
        raise ConfigError(f"{params.path}: no picture can be written so. Name it .png or .svg.")
    maps = _maps(params.map, params.marks)
    collector = Collector()
    for event in events:
        collector.take(event)
        yield event
    drawn = draw_picture(collector.findings(*maps), params.picture, "png" if suffix == "png" else "svg")
    with replacing(params.path) as file:
        file.write(drawn)


def _maps(landmarks: str | None, marks: str | None) -> tuple[LandmarkMap | None, MarkMap | None]:
    """Read the maps that are given; what is wrong with them is told before the log is read."""
    return (
        None if landmarks is None else read_landmarks(landmarks),
        None if marks is None else read_marks(marks),
    )


class Collector:
    """Keeps of each event what the page needs: some numbers, and the pixels of a few images.

    Poses, results and notices are kept here; what a system sees is kept by a keeper of its own.
    """

    def __init__(self) -> None:
        self._tracks: dict[str, TrackBuilder] = {}
        self._results: dict[str, Mapping[str, object]] = {}
        self._notices: dict[str, tuple[Notice, int]] = {}
        self._landmarks = LandmarkKeeper()
        self._marks = MarkKeeper()

    def take(self, event: Event) -> None:
        """Keep what is needed of one event."""
        match event:
            case Pose() if event.source != START_POSE:
                track = self._tracks.setdefault(event.source, TrackBuilder(event.source))
                track.add(event.stamp, event.position, event.orientation, event.covariance, event.info)
            case Summary(values=Mapping() as values):
                self._results[event.source] = values
            case Notice():
                first, n = self._notices.get(event.code, (event, 0))
                self._notices[event.code] = (first, n + 1)
            case _:
                self._landmarks.take(event)
                self._marks.take(event)

    def findings(self, landmarks: LandmarkMap | None = None, marks: MarkMap | None = None) -> Findings:
        """Return what was kept; what was seen is what the first source of sightings says."""
        tracks = {source: track.build() for source, track in self._tracks.items()}
        truth = tracks.pop(TRUTH, None)
        primary = primary_of(tracks)
        matcher = None if primary is None or primary.source == self._landmarks.first else primary.source
        return Findings(
            estimates=tracks,
            truth=truth,
            seen=self._landmarks.seen(),
            matched=self._landmarks.matched(matcher),
            landmarks=landmarks,
            matched_ids=self._landmarks.matched_ids,
            marks=self._marks.build(marks),
            results=self._results,
            notices=tuple(self._notices.values()),
        )
