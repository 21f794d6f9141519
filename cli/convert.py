"""``logpose convert``."""

import json
from pathlib import Path

import click

from ..formats.errors import ConfigError
from .main import COMMANDS
from .options import traceback_option

PRODUCTS = ("trajectory", "landmarks")
DATASETS = ("mrclam", "dlr-circles")


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
@click.argument("kind", type=click.Choice([*PRODUCTS, *DATASETS]), metavar="KIND")
@click.argument("source", metavar="SOURCE")
@click.option(
    "-o",
    "--output",
    required=True,
    metavar="TARGET",
    help="File to write; for products its suffix says the format.",
)
@click.option("--robot", type=int, default=1, show_default=True, help="mrclam: which of the five robots.")
@click.option("--json", "as_json", is_flag=True, help="Print the files written, and counts, as JSON.")
@traceback_option
def command(kind: str, source: str, output: str, robot: int, as_json: bool) -> int:
    """Read one format, write another."""
    files, counts = [output], {}
    if kind == "trajectory":
        _trajectory(source, output)
    elif kind == "landmarks":
        _landmarks(source, output)
    else:
        from ..formats.datasets import IMPORTERS

        imported = IMPORTERS[kind](source, output, robot=robot) if kind == "mrclam" else IMPORTERS[kind](source, output)
        files = [str(path) for path in (imported.log, imported.landmarks, imported.truth)]
        counts = dict(imported.counts)
        for line in imported.lines():
            click.echo(line, err=True)
    if as_json:
        click.echo(json.dumps({"schema": "logpose.files/1", "result": {"files": files, "counts": counts}}))
    return 0


def _landmarks(source: str, output: str) -> None:
    from ..formats.landmarks import read_landmarks, write_landmarks

    suffix = Path(output).suffix
    if suffix not in {".yaml", ".yml", ".csv", ""}:
        raise ConfigError(f"{output}: no landmark map has the suffix {suffix!r}. Use .yaml or .csv.")
    write_landmarks(read_landmarks(source), output)


def _trajectory(source: str, output: str) -> None:
    from ..formats.kitti import write_kitti
    from ..formats.trajectory import read_trajectory
    from ..formats.trajectory_csv import write_trajectory_csv
    from ..formats.tum import write_tum

    writers = {
        ".tum": write_tum,
        ".txt": write_tum,
        ".csv": write_trajectory_csv,
        ".kitti": write_kitti,
        "": write_tum,
    }
    suffix = Path(output).suffix
    if suffix not in writers:
        raise ConfigError(f"{output}: no trajectory format has the suffix {suffix!r}. Use .tum, .csv or .kitti.")
    writers[suffix](read_trajectory(source, allow_repeats=False), output)
