"""``logpose inspect``."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import click

from .main import COMMANDS
from .options import traceback_option

if TYPE_CHECKING:
    from ..formats.survey import Survey


@click.command(
    "inspect",
    help=COMMANDS["inspect"],
    epilog="""
    \b
    logpose inspect sample_logs/ceiling.mcap
    logpose inspect drive_0.db3 drive_1.db3 --json
    """,
)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@click.option("--json", "as_json", is_flag=True, help="Print everything as JSON.")
@traceback_option
def command(logs: tuple[str, ...], as_json: bool) -> int:
    """Survey the logs and print what is in them."""
    from ..formats.errors import ExitStatus
    from ..formats.survey import survey
    from ..pipelines.catalog import SUITS
    from ..pipelines.engine.report import dump_json

    found = survey(logs)
    suits = {name: missing(found, roles) for name, roles in SUITS.items()}
    if as_json:
        click.echo(dump_json({"schema": "logpose.survey/1", "result": as_mapping(found, suits)}))
    else:
        for line in lines(found, suits):
            click.echo(line)
    has_loss = found.has_loss or any((topic.announced or 0) > topic.count for topic in found.topics)
    return ExitStatus.LOSS if has_loss else ExitStatus.DONE


def missing(found: "Survey", roles: tuple[str, ...]) -> list[str]:
    """Return the roles a log cannot fill; alternatives are separated by a bar."""
    there = {role for topic in found.topics for role in topic.roles if topic.count > topic.undecodable}
    return [role for role in roles if not there & set(role.split("|"))]


def as_mapping(found: "Survey", suits: Mapping[str, list[str]]) -> dict[str, object]:
    """Return everything that was found."""
    return {
        "inputs": [{"path": file.path, "bytes": file.size, "blake2b": file.digest} for file in found.inputs],
        "first_ns": found.first_ns,
        "last_ns": found.last_ns,
        "topics": [asdict(topic) for topic in found.topics],
        "problems": list(found.problems),
        "has_loss": found.has_loss,
        "suits": {name: {"missing": roles} for name, roles in suits.items()},
    }


def lines(found: "Survey", suits: Mapping[str, list[str]]) -> list[str]:
    """Return what a person reads."""
    rows = [["topic", "type", "count", "Hz", "gap s", "lag s", "frame", "images"]]
    for topic in found.topics:
        size = topic.image_size
        pixels = f"{size[0]}x{size[1]} " if size and all(size) else ""
        rows.append(
            [
                topic.name,
                topic.type,
                str(topic.count),
                _number(topic.rate_hz, 1),
                _number(topic.largest_gap_s, 2),
                _number(topic.median_lag_s, 3),
                ", ".join(topic.frame_ids),
                pixels + topic.image_encoding,
            ]
        )
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    out = [f"{file.path}: {file.size:,} bytes" for file in found.inputs]
    seconds = ((found.last_ns or 0) - (found.first_ns or 0)) / 1e9
    out += [f"{seconds:.1f} s, {sum(topic.count for topic in found.topics)} messages", ""]
    out += ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    out += ["", *found.problems]
    for name, roles in suits.items():
        verdict = "yes" if not roles else "no: nothing for " + ", ".join(role.replace("|", " or ") for role in roles)
        out.append(f"suits {name}: {verdict}")
    return out


def _number(value: Any, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f}"
