"""``logpose detect-circles``."""

from typing import Any

import click

from .main import COMMANDS
from .options import camera_option, overlays_option, run_options

FLAGS = {
    "method": ["detect-circles.method"],
    "polarity": ["detect-circles.polarity"],
    "camera": ["detect-circles.camera"],
    "ceiling": ["detect-circles.ceiling_m"],
    "lamp_diameter": ["detect-circles.lamp_diameter_m"],
    "map": ["detect-circles.map"],
}
METHODS = click.Choice(["best", "paper"])
POLARITIES = click.Choice(["bright", "dark", "both"])


@click.command(
    "detect-circles",
    help=COMMANDS["detect-circles"],
    epilog="""
    \b
    logpose detect-circles sample_logs/ceiling.mcap --ceiling 2.74 -o out/
    logpose detect-circles photos/ --camera camera.yaml --ceiling 2.42 -o -
    """,
)
@run_options
@click.option("--method", type=METHODS, help="Sub-pixel detector, or the paper's. [default: best]")
@camera_option
@click.option("--ceiling", type=float, metavar="M", help="Height of the features above base_link [m].")
@click.option("--lamp-diameter", type=float, metavar="M", help="Diameter of the lamps [m]; a wide range without it.")
@click.option("--map", metavar="FILE", help="Landmark map whose height is the ceiling's.")
@click.option("--polarity", type=POLARITIES, help="Bright or dark circles. [default: bright]")
@overlays_option
def command(**options: Any) -> int:
    """Run the bundled pipeline."""
    from .call import Call, execute

    return execute(
        Call(name="detect-circles", options=options, flags=FLAGS, stream="write-sightings", overlays="write-overlays")
    )
