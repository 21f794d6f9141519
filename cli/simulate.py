"""``logpose simulate``."""

import json

import click

from .main import COMMANDS
from .options import setting, traceback_option


@click.command(
    "simulate",
    help=COMMANDS["simulate"],
    epilog="""
    \b
    logpose simulate papers/ceiling/world.yaml -o drive.mcap --seed 1
    """,
)
@click.argument("world", metavar="WORLD")
@click.option(
    "-o",
    "--output",
    required=True,
    metavar="LOG",
    help="Log to write, .mcap or .bag; maps and truth go beside it.",
)
@click.option("--seed", type=int, default=0, show_default=True, help="Everything random follows from it.")
@click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="KEY=VALUE",
    help="One value of the world, like odometry.rate_hz=50.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the files written as JSON.")
@click.option("-q", "--quiet", is_flag=True, help="Say nothing but errors.")
@traceback_option
def command(world: str, output: str, seed: int, settings: tuple[str, ...], as_json: bool, quiet: bool) -> int:
    """Render the world along its route and write the log."""
    from ..pipelines.engine.allocator import keep_buffers
    from ..pipelines.simulate.world import read_world
    from ..pipelines.simulate.write import write_simulation

    keep_buffers()
    files = [str(path) for path in write_simulation(read_world(world, list(map(setting, settings))), output, seed)]
    if as_json:
        click.echo(json.dumps({"schema": "logpose.files/1", "result": {"files": files}}))
    elif not quiet:
        click.echo("\n".join(files))
    return 0
