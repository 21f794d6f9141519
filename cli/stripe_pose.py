"""``logpose stripe-pose``: poses along a log; what is done before marks are hung stands in ``stripe_marks``."""

from typing import Any

import click

from .main import COMMANDS
from .options import (
    Number,
    camera_option,
    flag_of,
    initial_pose_option,
    method_option,
    numbers,
    overlays_option,
    reference_option,
    run_options,
    waypoints_option,
)

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
    "as_json": ["write-mark-poses.in_report"],  # a line per image, and a log may have a million
}
CHECK_ONLY = ("width", "distance", "angle", "edge_sigma", "rows")
"""Options of ``--check-marks`` that a run does not know."""


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
@camera_option
@method_option
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
@initial_pose_option
@click.option(
    "--smooth", is_flag=True, default=None, help="Poses from the whole log, instead of from what came before."
)
@reference_option
@waypoints_option
@overlays_option
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
    from .stripe_marks import focal_length, prepare

    if options["check_marks"] is not None or options["print_marks"] is not None:
        return prepare(options)
    from ..formats.errors import ConfigError
    from .call import Call, execute

    for name in CHECK_ONLY:
        if options[name] is not None:
            raise ConfigError(f"{flag_of(name)}: belongs to --check-marks FILE. Add that, or leave it out.")
    options["fx"] = focal_length(options)
    if options["mount"] is not None:
        mount = numbers(options["mount"], "--mount", 3, "X,Y,Z")
        options |= dict(zip(("mount_x", "mount_y", "mount_z"), mount, strict=True))
    return execute(
        Call(
            name="stripe-pose", options=options, flags=FLAGS, stream="write-mark-poses", overlays="write-mark-overlays"
        )
    )
