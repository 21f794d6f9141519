"""``stripe-pose`` before marks are hung: ``--check-marks`` and ``--print-marks``, which read no log."""

import json
import math
from collections.abc import Mapping
from typing import Any

import click

from ..formats.calibration import Calibration, read_calibration
from ..formats.errors import ConfigError
from ..formats.maps.marks import read_marks
from ..formats.products import MarkMap
from ..pipelines.engine.report import dump_json
from .options import flag_of, numbers

CHECK = ("camera", "fx", "focal_length", "pixel_pitch", "width", "distance", "angle", "edge_sigma", "rows", "as_json")
"""Options that have a meaning with ``--check-marks``."""
N_DISTANCES, N_ANGLES = 5, 4
MAX_WIDTH = 100_000


def prepare(options: Mapping[str, Any]) -> int:
    """Check and print the marks of a file."""
    mode = "--print-marks" if options["check_marks"] is None else "--check-marks"
    if options["logs"]:
        raise ConfigError(f"{mode}: reads no log. Leave {options['logs'][0]} out.")
    known = {"check_marks", "print_marks", "marks", "quiet", *(CHECK if mode == "--check-marks" else ["as_json"])}
    for name, value in options.items():
        if value not in (None, False, ()) and name not in known | {"logs"}:
            raise ConfigError(f"{flag_of(name)}: has no meaning with {mode}. Leave it out.")
    path = options["check_marks"] or options["marks"]
    if path is None:
        raise ConfigError(f"{mode}: no marks. Name their map with --marks FILE.")
    if options["check_marks"] and options["marks"]:
        raise ConfigError("--marks: --check-marks names the map already. Leave it out.")
    marks = read_marks(path)
    if options["check_marks"] is not None:
        _check(marks, options)
    if options["print_marks"] is not None:
        from ..pipelines.stripe_pose.printing import print_marks

        files = print_marks(marks.marks, options["print_marks"], path)
        if not options["as_json"]:
            click.echo("\n".join(files), err=mode == "--check-marks")
        elif mode == "--print-marks":
            click.echo(json.dumps({"schema": "logpose.files/1", "result": {"files": files}}))
    return 0


def _check(marks: MarkMap, options: Mapping[str, Any]) -> None:
    """Print the table, or all of it as JSON."""
    from ..pipelines.geometry.camera import Camera
    from ..pipelines.stripe_pose.code_book import Optics, code_book
    from ..pipelines.stripe_pose.code_book_table import as_mapping, table
    from ..pipelines.stripe_pose.scene import Search
    from ..pipelines.stripe_pose.verdict import PART_PX, PART_SHARE

    near, far = numbers(options["distance"] or "0.3,1.5", "--distance", 2, "NEAR,FAR")
    if not 0 < near < far:
        raise ConfigError(f"--distance {options['distance']}: is no working area. Give 0 < NEAR < FAR.")
    angle = options["angle"] or 60.0
    if angle >= 90:
        raise ConfigError(f"--angle {angle:g}: from there no mark is seen. Give less than 90 degrees.")
    c = _calibration(options)
    given = {key: options[key] for key in ("edge_sigma", "rows") if options[key] is not None}
    camera = Camera(c.fx, c.fy, c.cx, c.cy, c.model, c.distortion)
    given |= {"tolerance": Search().residual_px, "tolerance_share": Search().residual_share}
    given |= {"part_tolerance": PART_PX, "part_share": PART_SHARE}
    optics = Optics.of(camera, c.width, c.height, **given)
    distances = [near + (far - near) * i / (N_DISTANCES - 1) for i in range(N_DISTANCES)]
    angles = [math.radians(angle) * i / (N_ANGLES - 1) for i in range(N_ANGLES)]
    book = code_book(marks.marks, optics, distances, angles)
    click.echo(dump_json(as_mapping(book, optics)) if options["as_json"] else table(book, optics, marks.marks))


def focal_length(options: Mapping[str, Any]) -> float | None:
    """Return the focal length [px] from ``--fx``, or from ``--focal-length`` and ``--pixel-pitch``."""
    fx, focal, pitch = (options[name] for name in ("fx", "focal_length", "pixel_pitch"))
    if options["camera"] is not None:
        for name in ("fx", "focal_length", "pixel_pitch"):
            if options[name] is not None:
                raise ConfigError(f"{flag_of(name)}: --camera says it already. Leave one of them out.")
    if fx is not None and (focal is not None or pitch is not None):
        raise ConfigError("--fx: --focal-length and --pixel-pitch say it already. Leave one of them out.")
    if (focal is None) != (pitch is None):
        if pitch is None:
            raise ConfigError("--focal-length: in mm needs the pitch of the pixels in mm. Add --pixel-pitch MM.")
        raise ConfigError("--pixel-pitch: in mm needs the focal length in mm. Add --focal-length MM.")
    return float(focal / pitch) if focal is not None else fx


def _calibration(options: Mapping[str, Any]) -> Calibration:
    """Return the camera that a check is for, from a file or from its few numbers."""
    fx, width = focal_length(options), options["width"]
    if options["camera"] is not None:
        if width is not None:
            raise ConfigError("--width: --camera says it already. Leave one of them out.")
        return read_calibration(options["camera"])
    if fx is None or width is None:
        raise ConfigError(
            "--check-marks: no camera. Name its calibration with --camera FILE, or give --fx PX and --width PX."
        )
    if width > MAX_WIDTH:
        raise ConfigError(f"--width {width:g}: no camera has so many pixels. Give the width of the images.")
    if width != round(width):
        raise ConfigError(f"--width {width:g}: is no whole number of pixels. Give the width of the images.")
    columns, rows = int(width), max(1, int(0.75 * width))
    return Calibration(columns, rows, fx, fx, 0.5 * (columns - 1), 0.5 * (rows - 1))
