"""``report.json``: what was read, what came out, how long it took, with what it was made."""

import importlib.metadata
import json
import math
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ... import __version__
from ...formats.containers.inputs import InputFile
from ...formats.errors import ExitStatus
from ...formats.events import Notice
from ...formats.log import Log
from .chain import Chain
from .pipeline import Pipeline, field_role

SCHEMA = "logpose.report/1"
LIBRARIES = ("mcap", "numba", "numpy", "opencv-python-headless", "rosbags", "scipy")


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """A run that came to its end.

    Attributes:
        status: DONE, or LOSS when data was lost, skipped or salvaged.
        pipeline: what ran, topics as chosen.
        log: what was read, with its counts.
        chain: the stages, with their times.
        results: what each stage summed up, by source.
        notices: by code, the first one and how often.
        out: the run folder, or None.
        peak_memory_mib: largest resident size when the run had ended [MiB].
    """

    status: ExitStatus
    pipeline: Pipeline
    log: Log
    chain: Chain
    results: Mapping[str, Mapping[str, object] | Sequence[object]]
    notices: Mapping[str, tuple[Notice, int]]
    out: Path | None
    peak_memory_mib: float = 0.0


def messages_json(log: Log) -> dict[str, object]:
    """Say of each topic how many messages were announced, read, used and dropped, and why."""
    return {
        topic: {
            "announced": count.announced,
            "read": count.read + count.outside,
            "used": count.read,
            "dropped": count.dropped,
            "why": dict(sorted(count.why.items()))
            | ({"outside the time window": count.outside} if count.outside else {}),
        }
        for topic, count in sorted(log.counts.items())
    }


def report_json(result: Result, command: Sequence[str]) -> str:
    """Render ``report.json``."""
    content = {
        "schema": SCHEMA,
        "logpose": __version__,
        "command": list(command),
        "status": result.status.name.lower(),
        "warnings": [
            {
                "code": code,
                "message": notice.message,
                "source": notice.source,
                "count": n,
                "first_at_ns": notice.stamp,
            }
            for code, (notice, n) in result.notices.items()
        ],
        "inputs": [
            {"path": str(file.path), "bytes": file.size, "blake2b": file.digest} for file in input_files(result)
        ],
        "problems": list(result.log.problems),
        "topics": dict(result.pipeline.topics),
        "messages": messages_json(result.log),
        "stages": [
            {
                "name": tally.name,
                "seconds": round(seconds, 4),
                "events_in": tally.events_in,
                "events_out": tally.events_out,
                "workers": tally.workers,
            }
            for tally, seconds in zip(
                [result.chain.source, *result.chain.tallies], result.chain.seconds().values(), strict=True
            )
        ],
        "peak_memory_mib": round(result.peak_memory_mib, 1),
        "versions": {
            "python": platform.python_version(),
            **{name: importlib.metadata.version(name) for name in LIBRARIES},
        },
        "result": {key: values for key, values in result.results.items() if key != "run"},
    }
    return dump_json(content) + "\n"


def input_files(result: Result) -> list[InputFile]:
    """Return the files that were read, logs first and then those of stages, each once."""
    found = {str(file.path): file for file in result.log.inputs}
    for stage in result.pipeline.stages:
        for key in type(stage.params).model_fields:
            role, value = field_role(type(stage.params), key), getattr(stage.params, key)
            if role is not None and role.kind == "input" and value not in {None, "-"} and Path(value).is_file():
                found[value] = InputFile(value, Path(value).stat().st_size)
    return list(found.values())


def dump_json(value: object) -> str:
    """Dump JSON with numbers that do not exist as null."""
    return json.dumps(_finite(value), indent=1, ensure_ascii=False, allow_nan=False)


def _finite(value: object) -> object:
    match value:
        case float():
            return value if math.isfinite(value) else None
        case Mapping():
            return {str(key): _finite(item) for key, item in value.items()}
        case list() | tuple():
            return [_finite(item) for item in value]
        case _:
            return value.item() if hasattr(value, "item") else value
