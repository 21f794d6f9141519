"""``logpose evaluate``."""

from pathlib import Path

import click

from .main import COMMANDS
from .options import traceback_option, waypoints_option


@click.command(
    "evaluate",
    help=COMMANDS["evaluate"],
    epilog="""
    \b
    logpose evaluate sample_logs/ceiling.truth.tum out/trajectory.tum
    logpose evaluate drive.mcap:/ground_truth/pose out/trajectory.tum --json
    logpose evaluate truth.tum estimate.tum --align se3 --fail-if "ate.rmse>0.10"
    """,
)
@click.argument("reference", metavar="REFERENCE")
@click.argument("estimate", metavar="ESTIMATE")
@click.option(
    "--align",
    type=click.Choice(["none", "origin", "se2", "se3", "sim3"]),
    default="none",
    show_default=True,
    help="Move the estimate onto the reference first.",
)
@click.option("--max-diff", type=float, metavar="S", help="Largest difference of stamps of a pair [s]. [default: 0.01]")
@click.option("--interpolate", is_flag=True, help="Interpolate the reference at the stamps of the estimate.")
@click.option(
    "--delta",
    metavar="N|M",
    help="Step of the relative error: 1f is one frame, 10m ten metres. [default: 1f]",
)
@waypoints_option
@click.option(
    "--fail-if",
    "gates",
    multiple=True,
    metavar="EXPR",
    help='Exit with 4 if this holds, like "ate.rmse>0.10".',
)
@click.option("--json", "as_json", is_flag=True, help="Print the evaluation as JSON.")
@traceback_option
def command(
    reference: str,
    estimate: str,
    align: str,
    max_diff: float | None,
    interpolate: bool,
    delta: str | None,
    waypoints: str | None,
    gates: tuple[str, ...],
    as_json: bool,
) -> int:
    """Read both, compare, print, and check the gates."""
    from ..formats.errors import GateError
    from ..formats.maps.waypoints import read_waypoints
    from ..formats.trajectories.trajectory import read_trajectory
    from ..pipelines.catalog import STAGES
    from ..pipelines.engine.document import Document, StageEntry, Value
    from ..pipelines.engine.pipeline import bind
    from ..pipelines.engine.report import dump_json
    from ..pipelines.evaluate.evaluation import EvaluateParams, evaluate
    from ..pipelines.evaluate.gate import failed_gates, parse_gate
    from ..pipelines.evaluate.table import table

    parsed = [parse_gate(text) for text in gates]
    given = {
        "align": ("--align", align),
        "max_diff_s": ("--max-diff", max_diff),
        "interpolate": ("--interpolate", interpolate),
        "delta": ("--delta", delta),
        "waypoints": ("--waypoints", waypoints),
    }
    values = {key: Value(value, flag, Path()) for key, (flag, value) in given.items() if value is not None}
    entry = StageEntry("evaluate", "the command line", values)
    params = bind(Document("evaluate", {}, (entry,)), STAGES, Path()).stages[0].params
    assert isinstance(params, EvaluateParams)
    truth, guess = read_trajectory(reference), read_trajectory(estimate)
    places = None if waypoints is None else read_waypoints(waypoints)
    evaluation = evaluate(truth, guess, params, places)
    click.echo(dump_json(evaluation.to_json()) if as_json else table(evaluation))
    failed = failed_gates(parsed, evaluation.result)
    if failed:
        raise GateError(f"{estimate}: {'; '.join(failed)}. The results above stand.")
    return 0
