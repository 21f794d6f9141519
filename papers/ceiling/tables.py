"""Print Tables 4 and 5 of the paper beside ours.

Ours come from repeated runs of the rendered experiment: evaluation files (``logpose evaluate --json``) or run folders
with a ``report.json``. The paper prints the distance between a way point and the MEAN of five estimates, which hides
the scatter between runs; that number is given for comparison ("of the mean estimate"), and beside it what a single run
can expect: the mean distance, its standard deviation (n - 1) and the 95 % interval of the mean, over the runs.
"""

import argparse
import json
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from logpose.pipelines.report.spread import Spread, spread
from logpose.pipelines.report.tables import Column, render_table

HERE = Path(__file__).parent
PAPER = HERE / "paper_tables.yaml"
PAPER_METHOD, BEST = "ours, method: paper", "ours, default"


@dataclass(frozen=True, slots=True)
class Pass:
    """One pass of one way point: signed errors and distance [m]; nan where the run has none."""

    name: str
    dx: float
    dy: float
    distance: float


Run = Sequence[Pass]


def main(argv: Sequence[str] | None = None) -> int:
    """Write table4.md and table5.md and print them."""
    parser = argparse.ArgumentParser(description="Tables 4 and 5 of the paper, printed beside ours.")
    parser.add_argument("--paper", nargs="+", default=[], metavar="RUN", help="runs of `method: paper`")
    parser.add_argument("--best", nargs="+", default=[], metavar="RUN", help="runs of `method: best`, the default")
    parser.add_argument("-o", "--output", type=Path, default=HERE, metavar="DIR", help="where to write the tables")
    words = parser.parse_args(argv)
    try:
        ours = {PAPER_METHOD: read_runs(words.paper), BEST: read_runs(words.best)}
        paper = yaml.safe_load(PAPER.read_text(encoding="utf-8"))
        tables = {"table4.md": table4(paper, ours), "table5.md": table5(paper, ours)}
    except (OSError, ValueError) as err:
        print(err, file=sys.stderr)
        return 1
    words.output.mkdir(parents=True, exist_ok=True)
    for name, text in tables.items():
        (words.output / name).write_text(text, encoding="utf-8")
        print(text)
    return 0


def read_runs(paths: Sequence[str]) -> list[Run]:
    """Read the way points of each run.

    Raises:
        ValueError: a file has none, or not those of the first run.
    """
    runs = [read_run(Path(path)) for path in paths]
    for path, run in zip(paths, runs, strict=True):
        if [p.name for p in run] != [p.name for p in runs[0]]:
            raise ValueError(f"{path}: other way points than {paths[0]}. Give runs of one experiment.")
    return runs


def read_run(path: Path) -> Run:
    """Read one evaluation file, or the ``report.json`` of a run folder."""
    file = path / "report.json" if path.is_dir() else path
    try:
        result = json.loads(file.read_text(encoding="utf-8"))["result"]
    except (OSError, ValueError, KeyError, TypeError) as err:
        raise ValueError(f"{file}: no evaluation ({err}). Give the output of logpose evaluate --json.") from err
    found = next(_waypoint_lists(result), None)
    if not found:
        raise ValueError(f"{file}: no way points in it. Evaluate with --waypoints.")
    return [Pass(w["name"], *(_number(w[key]) for key in ("dx_m", "dy_m", "distance_m"))) for w in found]


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


def _waypoint_lists(node: object) -> Iterator[list[dict[str, Any]]]:
    """Find ``waypoints`` wherever the report keeps its evaluation, outermost first."""
    if isinstance(node, Mapping):
        if isinstance(node.get("waypoints"), list) and node["waypoints"]:
            yield node["waypoints"]
        yield from _waypoint_lists(node.get("evaluation"))


def paper_run(paper: Mapping[str, Any], *, is_corrected: bool) -> Run:
    """Recompute the paper's passes from its printed coordinates, with or without the correction of W1."""
    fixes = {(c["waypoint"], c["key"]): c["corrected"] for c in paper["table4"]["corrections"]} if is_corrected else {}
    passes = []
    for w in paper["table4"]["waypoints"]:
        x = fixes.get((w["name"], "estimate_x_m"), w["estimate_x_m"])
        y = fixes.get((w["name"], "estimate_y_m"), w["estimate_y_m"])
        dx, dy = x - w["x_m"], y - w["y_m"]
        passes.append(Pass(w["name"], dx, dy, math.hypot(dx, dy)))
    return passes


def mean_run(runs: Sequence[Run]) -> Run:
    """Average the estimates of the runs first, as the paper does, and take distances then; missed passes make nan."""
    means = []
    for passes in zip(*runs, strict=True):
        dx, dy = (sum(values) / len(passes) for values in ([p.dx for p in passes], [p.dy for p in passes]))
        means.append(Pass(passes[0].name, dx, dy, math.hypot(dx, dy)))
    return means


def table4(paper: Mapping[str, Any], ours: Mapping[str, Sequence[Run]]) -> str:
    """Render Table 4: the error at each way point, first as the paper has it, then over the runs."""
    columns = [
        Column("name", "way point"), Column("actual", "actual x, y [m]"), Column("printed", "paper, printed", 6),
        Column("recomputed", "paper, recomputed", 6), *(Column(title, digits=4) for title in ours),
    ]  # fmt: skip
    points = paper["table4"]["waypoints"]
    recomputed = paper_run(paper, is_corrected=False)
    rows: list[dict[str, object]] = [
        {
            "name": w["name"],
            "actual": f"{w['x_m']:.2f}, {w['y_m']:.2f}",
            "printed": w["distance_m"],
            "recomputed": p.distance,
        }
        for w, p in zip(points, recomputed, strict=True)
    ]
    means = [spread(w["distance_m"] for w in points).mean, spread(p.distance for p in recomputed).mean]
    rows.append({"name": "mean", "printed": means[0], "recomputed": means[1]})
    for title, runs in ours.items():
        for row in rows if runs else []:
            row[title] = _distance_of_mean(runs, str(row["name"]))
    body = "Distance of the mean estimate [m], as the paper has it:\n\n" + render_table(rows, columns, "markdown")
    body += "\nDistance of a single run [m]; mean ± standard deviation (n - 1), 95 % interval of the mean:\n"
    heads = [Column(title, f"{title} (n = {len(runs)})") for title, runs in ours.items()]
    cells: list[dict[str, object]] = []
    for name in (str(row["name"]) for row in rows):
        found = {title: _cell(spread(_distances(runs, name)), len(runs)) for title, runs in ours.items()}
        cells.append({"name": name} | found)
    body += "\n" + render_table(cells, [Column("name", "way point"), *heads], "markdown")
    notes = [
        f"- {c['waypoint']} is printed with {c['key']} = {c['printed']}; {c['corrected']} was meant: {c['why']}."
        for c in paper["table4"]["corrections"]
    ]
    notes += [
        "- The paper's numbers are distances of the mean of five estimates; the scatter between runs averages out.",
        "- The way points of the paper were passed by joystick: that accuracy, some centimetres, is in its numbers.",
    ]
    return _page("Table 4", paper["table4"]["caption"], body, notes)


def _distances(runs: Sequence[Run], name: str) -> list[float]:
    """Return the distances of all runs that passed a way point; for ``mean``, of each run that passed them all."""
    if name == "mean":
        means = [sum(p.distance for p in run) / len(run) for run in runs]
        return [mean for mean in means if math.isfinite(mean)]
    return [p.distance for run in runs for p in run if p.name == name and math.isfinite(p.distance)]


def _distance_of_mean(runs: Sequence[Run], name: str) -> float | None:
    passes = mean_run(runs)
    if name == "mean":
        return sum(p.distance for p in passes) / len(passes)
    return next((p.distance for p in passes if p.name == name), None)


def table5(paper: Mapping[str, Any], ours: Mapping[str, Sequence[Run]]) -> str:
    """Render Table 5: the error over all way points, then over the runs."""
    axes = ("x_m", "y_m", "distance_m")
    columns = [Column("what", "")]
    for axis in axes:
        name = axis.removesuffix("_m")
        columns += [Column(f"{axis} mean", f"mean {name} [m]", 6), Column(f"{axis} sd", f"sd {name} [m]", 6)]
    columns.append(Column("n", "n"))
    rows: list[dict[str, object]] = []
    for what, key in (("paper, printed", "printed"), ("paper, transposition undone", "corrected")):
        block = paper["table5"][key]
        row: dict[str, object] = {"what": what, "n": len(paper["table4"]["waypoints"])}
        for axis in axes:
            row |= {f"{axis} mean": block["average"][axis], f"{axis} sd": block["standard_deviation"][axis]}
        rows.append(row)
    rows.append(_row5("paper, recomputed as printed", paper_run(paper, is_corrected=False)))
    rows.append(_row5("paper, recomputed with W1 corrected", paper_run(paper, is_corrected=True)))
    for title, runs in ours.items():
        told = [p for p in mean_run(runs) if math.isfinite(p.distance)] if runs else []
        rows.append(_row5(f"{title}, of the mean estimate", told))
    return _page(
        "Table 5",
        paper["table5"]["caption"],
        render_table(rows, columns, "markdown")
        + "\nPer run (mean over the way points), over the runs:\n\n"
        + _runs(ours),
        [f"- In print {c['why']}." for c in paper["table5"]["corrections"]],
    )


def _row5(what: str, run: Run) -> dict[str, object]:
    row: dict[str, object] = {"what": what, "n": len(run)}
    values = {"x_m": [abs(p.dx) for p in run], "y_m": [abs(p.dy) for p in run], "distance_m": [p.distance for p in run]}
    for axis, found in values.items():
        described = spread(found)
        row |= {f"{axis} mean": described.mean, f"{axis} sd": described.sd}
    return row


def _runs(ours: Mapping[str, Sequence[Run]]) -> str:
    columns = [
        Column("what", ""), Column("runs"), Column("mean", "mean distance [m]", 4), Column("sd", "sd over runs [m]", 4),
        Column("interval", "95 % interval of the mean [m]"), Column("max", "largest at any way point [m]", 4),
    ]  # fmt: skip
    rows = []
    for title, runs in ours.items():
        described = spread(_distances(runs, "mean"))  # of each run its mean over the way points
        largest = max((p.distance for run in runs for p in run if math.isfinite(p.distance)), default=None)
        rows.append(
            {"what": title, "runs": described.n, "mean": described.mean, "sd": described.sd, "max": largest,
             "interval": None if described.low is None else f"{described.low:.4f} to {described.high:.4f}"}
        )  # fmt: skip
    return render_table(rows, columns, "markdown")


def _cell(described: Spread, n_runs: int) -> str | None:
    if described.mean is None:
        return None
    text = f"{described.mean:.4f}"
    if described.sd is not None:
        text += f" ± {described.sd:.4f} [{described.low:.4f}, {described.high:.4f}]"
    return text if described.n == n_runs else f"{text} (n = {described.n})"


def _page(title: str, caption: str, body: str, notes: Sequence[str]) -> str:
    return f"# {title}\n\n{caption}\n\n{body}\n" + "\n".join(notes) + "\n"


if __name__ == "__main__":
    sys.exit(main())
