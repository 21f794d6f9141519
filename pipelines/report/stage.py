"""Stages ``write-report`` and ``write-picture``: keep a run's numbers, and draw them when the log has ended."""

from collections.abc import Iterator

from ...formats.errors import ConfigError
from ...formats.events import Event
from ...formats.files import replacing, replacing_text
from ..engine.params import Field, InputPath, OutputPath, Params
from .collect import Collector
from .contents import PictureName, draw_picture
from .kinds import read_maps
from .page import render_page


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
    collector = Collector(read_maps(params.map, params.marks))
    with replacing_text(params.path) as file:
        for event in events:
            collector.take(event)
            yield event
        file.write(render_page(collector.findings(), title=params.title))


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
    collector = Collector(read_maps(params.map, params.marks))
    for event in events:
        collector.take(event)
        yield event
    drawn = draw_picture(collector.findings(), params.picture, "png" if suffix == "png" else "svg")
    with replacing(params.path) as file:
        file.write(drawn)
