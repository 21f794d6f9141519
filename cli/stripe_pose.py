"""``logpose stripe-pose``: poses along a log; and, before marks are hung, a check of them and their printing."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from .main import COMMANDS
from .options import Number, run_options

if TYPE_CHECKING:
    from ..formats.calibration import Calibration
    from ..formats.products import MarkMap

FLAGS = {
    "method": ["stripe-pose.method"],
    "marks": ["stripe-pose.marks", "fuse-poses.map", "write-log.marks", "write-report.marks"],
    "camera": ["stripe-pose.camera"],
    "fx": ["stripe-pose.fx_px"],
    "mark": ["stripe-pose.mark"],
    "tilt": ["stripe-pose.tilt_deg"],
    "roll": ["stripe-pose.roll_deg"],
    "pan": ["stripe-pose.pan_deg"],
    "mount_x": ["stripe-pose.mount_x_m"],
    "mount_y": ["stripe-pose.mount_y_m"],
    "mount_z": ["stripe-pose.mount_z_m"],
    "tilt_model": ["stripe-pose.tilt_model"],
    "tilt_joint": ["stripe-pose.tilt_joint"],
    "pan_joint": ["stripe-pose.pan_joint"],
    "initial_pose": ["fuse-poses.initial_pose", "dead-reckon.initial_pose"],
    "smooth": ["fuse-poses.smooth"],
    "waypoints": ["evaluate.waypoints"],
    "in_report": ["write-mark-poses.in_report"],
}
CHECK = ("camera", "fx", "focal_length", "pixel_pitch", "width", "distance", "angle", "edge_sigma", "rows", "as_json")
CHECK_ONLY = ("width", "distance", "angle", "edge_sigma", "rows")
"""Options of ``--check-marks``, and those of them that a run does not know."""
N_DISTANCES, N_ANGLES = 5, 4
MAX_WIDTH = 100_000


@click.command(
    "stripe-pose",
    help=COMMANDS["stripe-pose"],
    epilog="""
    \b
    logpose stripe-pose drive.mcap --marks marks.yaml -o out/
    logpose stripe-pose photos/ --marks marks.yaml --camera camera.yaml --tilt 5 -o -
    logpose stripe-pose --check-marks marks.yaml --camera camera.yaml --distance 0.3,1.5
    logpose stripe-pose --check-marks marks.yaml --fx 800 --width 640 --print-marks marks.pdf
    logpose stripe-pose --marks marks.yaml --print-marks marks.svg

    --check-marks and --print-marks read no log: they are for the time before the marks are hung.
    """,
)
@run_options
@click.option("--marks", metavar="FILE", help="Map of the stripe marks, marks.yaml.")
@click.option("--camera", metavar="FILE", help="Calibration, instead of CameraInfo in the log.")
@click.option("--method", type=click.Choice(["best", "paper"]), help="Our way, or the paper's. [default: best]")
@click.option("--mark", type=click.IntRange(min=0), metavar="ID", help="The mark that is seen, where it is known.")
@click.option("--tilt", type=Number(), metavar="DEG", help="Tilt of the camera, up is positive. [default: the log's]")
@click.option("--roll", type=Number(), metavar="DEG", help="Roll of the camera. [default: the log's]")
@click.option("--pan", type=Number(), metavar="DEG", help="Pan of the camera on the robot, to the left is positive.")
@click.option("--mount", metavar="X,Y,Z", help="Where the lens is on the robot [m]. [default: /tf_static]")
@click.option(
    "--tilt-model",
    type=click.Choice(["camera", "paper"]),
    help="What tilts: the camera, or the mark as in the paper. [default: camera]",
)
@click.option("--tilt-joint", metavar="NAME", help="Joint of JointState that tilts the camera.")
@click.option("--pan-joint", metavar="NAME", help="Joint of JointState that pans the camera.")
@click.option("--initial-pose", metavar="X,Y,DEG", help="Start pose [m, m, deg], or a topic, instead of /initialpose.")
@click.option("--smooth", is_flag=True, help="Poses from the whole log, instead of from what came before.")
@click.option("--reference", metavar="FILE|LOG:/TOPIC", help="Trajectory to measure the error against.")
@click.option("--waypoints", metavar="FILE", help="Waypoints whose passes are tabulated.")
@click.option("--overlays", metavar="DIR", help="Also draw what was found over each image; a folder in the run folder.")
@click.option("--check-marks", metavar="FILE", help="Tell which marks could be confused, and how exact poses will be.")
@click.option(
    "--fx",
    type=Number(above=0),
    metavar="PX",
    help="Focal length, if there is no --camera: no lens, axis in the middle.",
)
@click.option("--focal-length", type=Number(above=0), metavar="MM", help="The same with --pixel-pitch.")
@click.option("--pixel-pitch", type=Number(above=0), metavar="MM", help="Width of a pixel on the sensor.")
@click.option("--width", type=Number(above=0), metavar="PX", help="Check: width of the images; 4:3 is their shape.")
@click.option("--distance", metavar="NEAR,FAR", help="Check: distances of the working area [m]. [default: 0.3,1.5]")
@click.option("--angle", type=Number(above=0), metavar="DEG", help="Check: largest angle of view. [default: 60]")
@click.option("--edge-sigma", type=Number(above=0), metavar="PX", help="Check: error of an edge. [default: 0.05]")
@click.option(
    "--rows", type=click.IntRange(min=1), metavar="N", help="Check: rows across. [default: by height_m, or 1]"
)
@click.option("--print-marks", metavar="FILE", help="Write the marks to scale, .svg or .pdf, for the printer.")
def command(**options: Any) -> int:
    """Run the bundled pipeline, or check and print marks."""
    if options["check_marks"] is None and options["print_marks"] is None:
        return _run(options)
    return _prepare(options)


def _run(options: dict[str, Any]) -> int:
    from ..formats.errors import ConfigError
    from .call import Call, execute

    for name in CHECK_ONLY:
        if options[name] is not None:
            raise ConfigError(f"{_flag(name)}: belongs to --check-marks FILE. Add that, or leave it out.")
    options["fx"] = _focal_length(options)
    start, reference, overlays = options["initial_pose"], options["reference"], options["overlays"]
    mount = (None, None, None) if options["mount"] is None else _numbers(options["mount"], "--mount", 3, "X,Y,Z")
    options |= dict(zip(("mount_x", "mount_y", "mount_z"), mount, strict=True))
    options["smooth"] = options["smooth"] or None
    options["in_report"] = True if options["as_json"] else None  # a line per image, and a log may have a million
    topics = {}
    if start is not None and (start.startswith("/") or start == "none"):
        topics["initial_pose"] = start
        options["initial_pose"] = None
    if reference is not None:
        topics["truth"] = "none"
    return execute(
        Call(
            name="stripe-pose",
            options=options,
            flags=FLAGS,
            streams="write-mark-poses",
            topics=topics,
            inserts=(("read-truth", {"path": reference}),) if reference else (),
            appends=(("write-mark-overlays", {"path": overlays}),) if overlays else (),
        )
    )


def _prepare(options: Mapping[str, Any]) -> int:
    """Check and print the marks of a file."""
    from ..formats.errors import ConfigError
    from ..formats.marks import read_marks

    mode = "--print-marks" if options["check_marks"] is None else "--check-marks"
    if options["logs"]:
        raise ConfigError(f"{mode}: reads no log. Leave {options['logs'][0]} out.")
    known = {"check_marks", "print_marks", "marks", "quiet", *(CHECK if mode == "--check-marks" else ["as_json"])}
    for name, value in options.items():
        if value not in (None, False, ()) and name not in known | {"logs"}:
            raise ConfigError(f"{_flag(name)}: has no meaning with {mode}. Leave it out.")
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
            import json

            click.echo(json.dumps({"schema": "logpose.files/1", "result": {"files": files}}))
    return 0


def _check(marks: "MarkMap", options: Mapping[str, Any]) -> None:
    """Print the table, or all of it as JSON."""
    from ..formats.errors import ConfigError
    from ..pipelines.engine.report import dump_json
    from ..pipelines.geometry.camera import Camera
    from ..pipelines.stripe_pose.code_book import Optics, code_book
    from ..pipelines.stripe_pose.code_book_table import as_mapping, table
    from ..pipelines.stripe_pose.scene import Search
    from ..pipelines.stripe_pose.verdict import PART_PX, PART_SHARE

    near, far = _numbers(options["distance"] or "0.3,1.5", "--distance", 2, "NEAR,FAR")
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


def _focal_length(options: Mapping[str, Any]) -> float | None:
    """Return the focal length [px] from ``--fx``, or from ``--focal-length`` and ``--pixel-pitch``."""
    from ..formats.errors import ConfigError

    fx, focal, pitch = (options[name] for name in ("fx", "focal_length", "pixel_pitch"))
    if options["camera"] is not None:
        for name in ("fx", "focal_length", "pixel_pitch"):
            if options[name] is not None:
                raise ConfigError(f"{_flag(name)}: --camera says it already. Leave one of them out.")
    if fx is not None and (focal is not None or pitch is not None):
        raise ConfigError("--fx: --focal-length and --pixel-pitch say it already. Leave one of them out.")
    if (focal is None) != (pitch is None):
        if pitch is None:
            raise ConfigError("--focal-length: in mm needs the pitch of the pixels in mm. Add --pixel-pitch MM.")
        raise ConfigError("--pixel-pitch: in mm needs the focal length in mm. Add --focal-length MM.")
    return float(focal / pitch) if focal is not None else fx


def _calibration(options: Mapping[str, Any]) -> "Calibration":
    """Return the camera that a check is for, from a file or from its few numbers."""
    from ..formats.calibration import Calibration, read_calibration
    from ..formats.errors import ConfigError

    fx, width = _focal_length(options), options["width"]
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


def _numbers(text: str, flag: str, count: int, form: str) -> list[float]:
    from ..formats.errors import ConfigError

    try:
        values = [float(word) for word in text.split(",")]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        raise ConfigError(f"{flag} {text}: is not {form}. Give {count} finite numbers.")
    return values


def _flag(name: str) -> str:
    words = {"settings": "set", "topics": "topic", "as_json": "json"}
    return "--" + words.get(name, name).replace("_", "-")
