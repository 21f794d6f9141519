"""``logpose convert``."""

import json

import click

from ..formats.conversions import CONVERSIONS
from .main import COMMANDS
from .options import F, traceback_option


def _options_of_kinds(function: F) -> F:
    for kind, conversion in CONVERSIONS.items():
        for name, option in conversion.options.items():
            text = f"{kind}: {option.help}"
            function = click.option(f"--{name}", type=int, default=option.default, show_default=True, help=text)(
                function
            )
    return function


@click.command(
    "convert",
    help=COMMANDS["convert"],
    epilog="""
    \b
    logpose convert trajectory sample_logs/ceiling.truth.tum -o truth.csv
    logpose convert landmarks sample_logs/ceiling.landmarks.yaml -o landmarks.csv
    logpose convert mrclam MRCLAM_Dataset1/ --robot 2 -o mrclam1r2.mcap
    """,
)
@click.argument("kind", type=click.Choice(list(CONVERSIONS)), metavar="KIND")
@click.argument("source", metavar="SOURCE")
@click.option(
    "-o",
    "--output",
    required=True,
    metavar="TARGET",
    help="File to write; for products its suffix says the format.",
)
@_options_of_kinds
@click.option("--json", "as_json", is_flag=True, help="Print the files written, and counts, as JSON.")
@traceback_option
def command(kind: str, source: str, output: str, as_json: bool, **options: int) -> int:
    """Read one format, write another."""
    conversion = CONVERSIONS[kind]
    imported = conversion(source, output, **{name: options[name] for name in conversion.options})
    files = [output] if imported is None else [str(path) for path in imported.files]
    counts = {} if imported is None else dict(imported.counts)
    for line in imported.lines() if imported else ():
        click.echo(line, err=True)
    if as_json:
        click.echo(json.dumps({"schema": "logpose.files/1", "result": {"files": files, "counts": counts}}))
    return 0
