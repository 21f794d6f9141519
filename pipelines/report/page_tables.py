"""The tables of a page: way points, results, messages, warnings, inputs. Each is HTML, empty when there is nothing."""

import math
from collections.abc import Iterator, Mapping, Sequence

from .findings import Findings
from .markup import table
from .spread import spread
from .tables import Column
from .verdict import status_shares

UNITS = {
    "m": "m",
    "m2": "m²",
    "rad": "rad",
    "deg": "°",
    "s": "s",
    "ns": "ns",
    "px": "px",
    "mps": "m/s",
    "radps": "rad/s",
}
"""Last part of a key -> unit."""

_RUN_SHOWN_ELSEWHERE = {"pipeline", "messages", "inputs", "topics", "stages"}


def notices_table(findings: Findings) -> str:
    """Render what a person should know."""
    rows = [
        {"what": notice.message, "source": notice.source, "code": notice.code, "n": n, "loss": notice.is_loss}
        for notice, n in findings.notices
    ]
    return table(
        rows,
        [
            Column("what", "what"),
            Column("n", "times"),
            Column("loss", "data lost"),
            Column("source", "said by"),
            Column("code"),
        ],
    )


def waypoints_table(findings: Findings) -> str:
    """Render the error at each way point, then mean and standard deviation (n - 1) of the absolute errors."""
    points = findings.waypoints
    rows: list[dict[str, object]] = [
        {
            "name": p.name,
            "x": p.x,
            "y": p.y,
            "ex": p.estimate_x,
            "ey": p.estimate_y,
            "dx": p.dx,
            "dy": p.dy,
            "d": p.distance,
        }
        for p in points
    ]
    told = [p for p in points if math.isfinite(p.dx) and math.isfinite(p.dy) and math.isfinite(p.distance)]
    if told:
        sizes = [spread(abs(p.dx) for p in told), spread(abs(p.dy) for p in told), spread(p.distance for p in told)]
        for name, values in (
            ("mean of |error|", [s.mean for s in sizes]),
            ("standard deviation", [s.sd for s in sizes]),
        ):
            rows.append({"name": name, "is_sum": True} | dict(zip(("dx", "dy", "d"), values, strict=True)))
    heads = (("name", "way point"), ("x", "x [m]"), ("y", "y [m]"), ("ex", "estimate x [m]"), ("ey", "estimate y [m]"),
             ("dx", "dx [m]"), ("dy", "dy [m]"), ("d", "distance [m]"))  # fmt: skip
    return table(rows, [Column(key, title, 3 if key in {"x", "y", "ex", "ey"} else 4) for key, title in heads])


def evaluation_tables(findings: Findings) -> list[str]:
    """Render what the stages summed up, one table each, under the keys they have in ``report.json``."""
    found = [_status_table(findings)]
    for source, values in findings.results.items():
        if source == "run":
            continue
        rows = [
            {"key": key, "value": value, "unit": unit_of(key)}
            for key, value in flatten(values)
            if key != "waypoints" and key not in listed(values)
        ]
        found.append(table(rows, [Column("key", "key"), Column("value", "value"), Column("unit", "unit")], source))
        found += [_listed_table(f"{source}: {key}", rows) for key, rows in listed(values).items()]
    return found


def listed(values: Mapping[str, object]) -> dict[str, list[Mapping[str, object]]]:
    """Return the lists of mappings among a stage's values, each a table of its own; way points have theirs already."""
    found = {key: value for key, value in values.items() if isinstance(value, list | tuple) and key != "waypoints"}
    return {
        key: [row for row in value if isinstance(row, Mapping)]
        for key, value in found.items()
        if value and all(isinstance(row, Mapping) for row in value)
    }


def _listed_table(caption: str, values: Sequence[Mapping[str, object]]) -> str:
    rows = [dict(flatten(row)) for row in values]
    keys = dict.fromkeys(key for row in rows for key in row)
    units = {key: f" [{unit_of(key)}]" if unit_of(key) else "" for key in keys}
    return table(rows, [Column(key, key + units[key]) for key in keys], caption)


def counts_table(findings: Findings) -> str:
    """Render the messages of each topic: announced by the file, read, used, dropped, and why."""
    messages = findings.results.get("run", {}).get("messages")
    if not isinstance(messages, Mapping):
        return ""
    rows = []
    for topic, counts in messages.items():
        told = counts if isinstance(counts, Mapping) else {}
        why = told.get("why")
        reasons = ", ".join(f"{word}: {n}" for word, n in why.items()) if isinstance(why, Mapping) else ""
        rows.append({"topic": topic, **told, "why": reasons})
    return table(rows, [Column(key) for key in ("topic", "announced", "read", "used", "dropped", "why")])


def topics_table(findings: Findings) -> str:
    """Render which topic played which part."""
    topics = findings.results.get("run", {}).get("topics")
    if not isinstance(topics, Mapping):
        return ""
    return table([{"role": role, "topic": topic} for role, topic in topics.items()], [Column("role"), Column("topic")])


def inputs_table(findings: Findings) -> str:
    """Render what was read, and whatever else the run says of itself."""
    run = findings.results.get("run", {})
    inputs = run.get("inputs")
    rows = [{"key": "input", "value": name} for name in inputs] if isinstance(inputs, list) else []
    rest = {key: value for key, value in run.items() if key not in _RUN_SHOWN_ELSEWHERE}
    rows += [{"key": key, "value": value} for key, value in flatten(rest)]
    return table(rows, [Column("key", "what"), Column("value", "value")])


def flatten(values: Mapping[str, object], prefix: str = "") -> Iterator[tuple[str, object]]:
    """Yield the leaves of nested mappings under dotted keys; floats with six digits, short lists as text."""
    for key, value in values.items():
        name = f"{prefix}{key}"
        match value:
            case Mapping():
                yield from flatten(value, f"{name}.")
            case list() | tuple():
                is_short = len(value) <= 8 and not any(isinstance(item, Mapping | list | tuple) for item in value)
                text = ", ".join(f"{item:.6g}" if isinstance(item, float) else str(item) for item in value)
                yield name, text if is_short else f"{len(value)} entries"
            case float():
                yield name, float(f"{value:.6g}")
            case _:
                yield name, value


def unit_of(key: str) -> str:
    """Read the unit off a key such as ``ate.rmse_m``."""
    name = key.rsplit(".", 1)[-1]
    return UNITS.get(name.rsplit("_", 1)[-1], "") if "_" in name else ""


def _status_table(findings: Findings) -> str:
    track = findings.primary
    if track is None or not track.status_words:
        return ""
    rows = [{"status": word, "n": n, "share": 100 * share} for word, n, share in status_shares(track)]
    return table(
        rows, [Column("status"), Column("n", "poses"), Column("share", "share [%]", 1)], f"status of {track.source}"
    )
