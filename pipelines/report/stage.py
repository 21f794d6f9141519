"""Stages ``write-report`` and ``write-picture``: keep a run's numbers, and draw them when the log has ended."""

from array import array
from collections.abc import Iterator, Mapping

import numpy as np

from ...formats.errors import ConfigError
from ...formats.events import NO_ID, Event, Notice, Pose, Sightings, Summary
from ...formats.files import replacing, replacing_text
from ...formats.landmarks import read_landmarks
from ...formats.products import LandmarkMap
from ..engine.params import Field, InputPath, OutputPath, Params
from .captions import PictureName, draw_picture
from .page import render_page
from .track import START_POSE, TRUE_SIGHTINGS, TRUTH, Counts, Findings, TrackBuilder, primary_of


class WriteReportParams(Params):
    """Where the page goes, and what it shows beside the run itself."""

    path: OutputPath = Field("report.html", description="page to write")
    map: InputPath | None = Field(
        None, description="landmark map drawn under the trajectories; none is drawn without it"
    )
    title: str = Field("logpose report", description="title of the page")


def write_report(events: Iterator[Event], params: WriteReportParams) -> Iterator[Event]:
    """Write one self-contained page with the pictures and tables a person would look at."""
    landmarks = None if params.map is None else read_landmarks(params.map)
    with replacing_text(params.path) as file:
        collector = Collector()
        for event in events:
            collector.take(event)
            yield event
        file.write(render_page(collector.findings(landmarks), title=params.title))


class WritePictureParams(Params):
    """Which picture goes where."""

    path: OutputPath = Field("map.svg", description="picture to write; .png or .svg")
    picture: PictureName = Field("map", description="which one: those of the report by name, or the headline")
    map: InputPath | None = Field(
        None, description="landmark map drawn under the trajectories; none is drawn without it"
    )


def write_picture(events: Iterator[Event], params: WritePictureParams) -> Iterator[Event]:
    """Write one of the report's pictures as a file of its own."""
    suffix = params.path.rsplit(".", 1)[-1].lower()
    if suffix not in {"png", "svg"}:
        raise ConfigError(f"{params.path}: no picture can be written so. Name it .png or .svg.")
    landmarks = None if params.map is None else read_landmarks(params.map)
    collector = Collector()
    for event in events:
        collector.take(event)
        yield event
    drawn = draw_picture(collector.findings(landmarks), params.picture, "png" if suffix == "png" else "svg")
    with replacing(params.path) as file:
        file.write(drawn)


class Collector:
    """Keeps of each event what the page needs: some numbers."""

    def __init__(self) -> None:
        self._tracks: dict[str, TrackBuilder] = {}
        self._counts: dict[str, tuple[array[int], array[int], array[int]]] = {}
        self._matched: set[int] = set()
        self._results: dict[str, Mapping[str, object]] = {}
        self._notices: dict[str, tuple[Notice, int]] = {}

    def take(self, event: Event) -> None:
        """Keep what is needed of one event."""
        match event:
            case Pose() if event.source != START_POSE:
                track = self._tracks.setdefault(event.source, TrackBuilder(event.source))
                track.add(event.stamp, event.position, event.orientation, event.covariance, event.info)
            case Sightings() if event.source != TRUE_SIGHTINGS:
                named = event.ids[event.ids != NO_ID].tolist()
                stamps, seen, matched = self._counts.setdefault(event.source, (array("q"), array("q"), array("q")))
                stamps.append(event.stamp)
                seen.append(len(event.xy))
                matched.append(len(named))
                self._matched.update(named)
            case Summary():
                self._results[event.source] = event.values
            case Notice():
                first, n = self._notices.get(event.code, (event, 0))
                self._notices[event.code] = (first, n + 1)
            case _:
                pass

    def findings(self, landmarks: LandmarkMap | None = None) -> Findings:
        """Return what was kept; what was seen is what the first source of sightings says."""
        tracks = {source: track.build() for source, track in self._tracks.items()}
        truth = tracks.pop(TRUTH, None)
        first = next(iter(self._counts), None)
        primary = primary_of(tracks)
        matcher = None if primary is None or primary.source == first else primary.source
        return Findings(
            estimates=tracks,
            truth=truth,
            seen=self._count(first, 1),
            matched=self._count(matcher, 2),
            landmarks=landmarks,
            matched_ids=frozenset(self._matched),
            results=self._results,
            notices=tuple(self._notices.values()),
        )

    def _count(self, source: str | None, column: int) -> Counts | None:
        kept = None if source is None else self._counts.get(source)
        if source is None or kept is None:
            return None
        return Counts(source=source, stamps=np.array(kept[0], dtype=np.int64), n=np.array(kept[column], dtype=np.int64))
