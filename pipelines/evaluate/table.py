"""An evaluation as lines for a person."""

from collections.abc import Mapping

from .evaluation import Evaluation


def table(evaluation: Evaluation) -> str:
    """Return the figures as aligned lines, no line end after the last."""
    result = evaluation.result
    alignment, lost = _mapping(result["alignment"]), _mapping(result["lost"])
    first = (
        f"{result['matched']} pairs of {result['reference_total']} poses of the reference and "
        f"{result['estimate_total']} of the estimate, over {_number(result['duration_s'])} s and "
        f"{_number(result['length_m'])} m; aligned: {alignment['method']}"
    )
    lines = [
        first,
        "",
        _row("", ["rmse", "mean", "median", "std", "min", "max"]),
    ]
    rpe = _mapping(result["rpe"])
    for title, values in (("ATE", _mapping(result["ate"])), (f"RPE {rpe['delta']}", rpe)):
        for unit in ("m", "rad"):
            keys = [f"{key}_{unit}" for key in ("rmse", "mean", "median", "std", "min", "max")]
            lines.append(_row(f"{title} [{unit}]", [_number(values[key]) for key in keys]))
    word = "LOST" if lost["is_lost"] else "not lost"
    lines += ["", f"{word}: off by more than {lost['threshold_m']} m for at most {_number(lost['longest_s'])} s"]
    if "consistency" in result:
        c = _mapping(result["consistency"])
        lines.append(
            f"NEES mean {_number(c['nees_mean'])}, median {_number(c['nees_median'])} (expected "
            f"{_number(c['nees_expected_mean'])}, {_number(c['nees_expected_median'])}); "
            f"{_percent(c['nees_inside'])} of {c['poses']} poses inside their 95 % bounds"
        )
    if "waypoints" in result:
        lines += ["", *_waypoints(result)]
    repeats = [
        f"{result[f'{who}_repeats']} in the {who}" for who in ("reference", "estimate") if result[f"{who}_repeats"]
    ]
    if repeats:
        lines += ["", f"note: poses that repeat a stamp: {', '.join(repeats)}"]
    return "\n".join(lines)


def _waypoints(result: Mapping[str, object]) -> list[str]:
    rows, total = result["waypoints"], _mapping(result["waypoint_summary"])
    assert isinstance(rows, list)
    keys = ("x_m", "y_m", "estimate_x_m", "estimate_y_m", "dx_m", "dy_m", "distance_m")
    lines = [_row("waypoint", [key.removesuffix("_m").replace("estimate_", "est. ") for key in keys])]
    for row in map(_mapping, rows):
        note = f"  ({row['why_not']})" if "why_not" in row else ""
        lines.append(_row(str(row["name"]), [_number(row[key]) for key in keys]) + note)
    for name in ("mean", "sd", "max"):
        cells = [_number(total[f"{name}_{key}_m"]) for key in ("dx", "dy", "distance")]
        lines.append(_row(f"{name} of |.|", ["", "", "", "", *cells]))
    return lines


def _row(title: str, cells: list[str]) -> str:
    return (f"{title:<14}" + "".join(f"{cell:>13}" for cell in cells)).rstrip()


def _number(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, int | float) else "-"


def _percent(value: object) -> str:
    return f"{100 * value:.1f} %" if isinstance(value, int | float) else "none"


def _mapping(value: object) -> Mapping[str, object]:
    assert isinstance(value, Mapping)
    return value
