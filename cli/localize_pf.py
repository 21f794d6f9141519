"""``logpose localize-pf``."""

from typing import Any

import click

from .main import COMMANDS
from .options import (
    camera_option,
    initial_pose_option,
    method_option,
    reference_option,
    run_options,
    waypoints_option,
)

FLAGS = {
    "method": ["detect-circles.method", "localize-pf.method"],
    "map": ["detect-circles.map", "localize-pf.map", "write-log.map", "write-report.map"],
    "initial_pose": ["localize-pf.initial_pose", "dead-reckon.initial_pose"],
    "camera": ["detect-circles.camera"],
    "ceiling": ["detect-circles.ceiling_m"],
    "lamp_diameter": ["detect-circles.lamp_diameter_m"],
    "waypoints": ["evaluate.waypoints"],
}
STREAM = "write-trajectory"


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
@initial_pose_option
@click.option("--sightings", metavar="FILE|-", help="Sightings of detect-circles, instead of images.")
@method_option
@camera_option
@click.option(
    "--ceiling", type=float, metavar="M", help="Height of the lamps above base_link [m]. [default: the map's]"
)
@click.option("--lamp-diameter", type=float, metavar="M", help="Diameter of the lamps [m]; a wide range without it.")
@reference_option
@waypoints_option
def command(**options: Any) -> int:
    """Run the bundled pipeline; ``--sightings`` takes the place of the detector and its images."""
    from .call import Call, execute

    sightings = options["sightings"]
    swaps, topics = {}, {}
    if sightings:
        swaps = {"detect-circles": ("read-sightings", {"path": sightings})}
    if sightings is not None:
        topics = dict.fromkeys(("image", "camera_info", "sightings"), "none")
    return execute(Call(name="localize-pf", options=options, flags=FLAGS, stream=STREAM, swaps=swaps, topics=topics))
