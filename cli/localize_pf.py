"""``logpose localize-pf``."""

from typing import Any

import click

from .main import COMMANDS
from .options import run_options

FLAGS = {
    "method": ["detect-circles.method", "localize-pf.method"],
    "map": ["detect-circles.map", "localize-pf.map", "write-log.map", "write-report.map"],
    "initial_pose": ["localize-pf.initial_pose", "dead-reckon.initial_pose"],
    "camera": ["detect-circles.camera"],
    "ceiling": ["detect-circles.ceiling_m"],
    "lamp_diameter": ["detect-circles.lamp_diameter_m"],
    "waypoints": ["evaluate.waypoints"],
}


@click.command(
    "localize-pf",
    help=COMMANDS["localize-pf"],
    epilog="""
    \b
    logpose localize-pf sample_logs/ceiling.mcap --map sample_logs/ceiling.landmarks.yaml -o out/
    logpose localize-pf drive.mcap --map landmarks.csv --method paper --set localize-pf.particles=500
    logpose detect-circles LOG -o - | logpose localize-pf LOG --sightings - --map M -o -
    """,
)
@run_options
@click.option("--map", metavar="FILE", help="Landmark map, YAML or CSV.")
@click.option("--initial-pose", metavar="X,Y,DEG", help="Start pose [m, m, deg], or a topic, instead of /initialpose.")
@click.option("--sightings", metavar="FILE|-", help="Sightings of detect-circles, instead of images.")
@click.option("--method", type=click.Choice(["best", "paper"]), help="Our way, or the paper's. [default: best]")
@click.option("--camera", metavar="FILE", help="Calibration, instead of CameraInfo in the log.")
@click.option(
    "--ceiling", type=float, metavar="M", help="Height of the lamps above base_link [m]. [default: the map's]"
)
@click.option("--lamp-diameter", type=float, metavar="M", help="Diameter of the lamps [m]; a wide range without it.")
@click.option("--reference", metavar="FILE|LOG:/TOPIC", help="Trajectory to measure the error against.")
@click.option("--waypoints", metavar="FILE", help="Waypoints whose passes are tabulated, as in the paper.")
def command(**options: Any) -> int:
    """Run the bundled pipeline, with what its flags put in place of images, start pose or truth."""
    from .call import Call, execute

    start, sightings, reference = options["initial_pose"], options["sightings"], options["reference"]
    topics = {}
    if start is not None and (start.startswith("/") or start == "none"):
        topics["initial_pose"] = start
        options["initial_pose"] = None
    if sightings is not None:
        topics |= dict.fromkeys(("image", "camera_info", "sightings"), "none")
    if reference is not None:
        topics["truth"] = "none"
    return execute(
        Call(
            name="localize-pf",
            options=options,
            flags=FLAGS,
            streams="write-trajectory",
            topics=topics,
            swaps={"detect-circles": ("read-sightings", {"path": sightings})} if sightings else {},
            inserts=(("read-truth", {"path": reference}),) if reference else (),
        )
    )
