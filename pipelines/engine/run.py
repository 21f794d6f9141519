"""One run: a pipeline over logs, from opening them to the report of what came out.

Result files hold no wall-clock time, so the same input gives the same bytes; how long each stage took stands in
``report.json`` alone.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

from ...formats.errors import ConfigError, ExitStatus
from ...formats.events import Event, Notice, Summary
from ...formats.files import replacing_text
from ...formats.log import Log, open_log
from ...formats.process import peak_memory_mib
from ...formats.window import Window
from .allocator import keep_buffers
from .chain import Chain
from .document import Document
from .dump import dump_pipeline
from .pipeline import NONE, Pipeline, bind
from .report import Result, messages_json, report_json
from .stage import Table

Watch = Callable[[Event, Log], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """What to run on what.

    Attributes:
        command: the words that asked for it, for the report.
        document: the pipeline, with everything laid over it.
        logs: files or folders; several are merged by time.
        out: the run folder; None when the result goes to standard output and nothing is left behind.
        stamp: which time orders the log.
        window: which part of the log.
        flags: ``stage.parameter`` -> the flag that gives it, for messages.
    """

    command: Sequence[str]
    document: Document
    logs: Sequence[str]
    out: Path | None
    stamp: Literal["header", "log"] = "header"
    window: Window | None = None
    flags: Mapping[str, str] = field(default_factory=dict)


def run(request: Request, table: Table, watch: Watch | None = None) -> Result:
    """Run a pipeline over logs and leave the run folder behind.

    Args:
        request: what to run on what.
        table: stage name -> ``module:function``.
        watch: called with every event that leaves the last stage (progress, notices).

    Raises:
        LogposeError: nothing usable was written.
    """
    keep_buffers()
    out = request.out or Path()
    pipeline = bind(request.document, table, out, request.flags)
    if not request.logs:
        raise ConfigError(f"{pipeline.name}: no log given. Name a bag, an MCAP file or a folder of images.")
    topics = {role: topic for role, topic in pipeline.topics.items() if topic != NONE}
    if not topics:
        raise ConfigError(
            f"{pipeline.name}: no topics to read. Add 'topics: {{image: auto, odometry: auto}}' or --topic."
        )
    log = open_log(request.logs, topics, stamp=request.stamp, window=request.window)
    pipeline = replace(pipeline, topics={role: log.chosen.get(role, NONE) for role in pipeline.topics})
    chain = Chain(pipeline, _with_provenance(log, pipeline, out))
    was_there = out.exists()
    try:
        results, notices = _drain(chain, log, watch)
    except BaseException as err:
        if not was_there and out.is_dir() and not any(out.iterdir()):
            out.rmdir()
        if isinstance(err, ConfigError) and log.has_loss and log.problems:  # a log without images may be one cut short
            raise ConfigError(f"{err} Note that {log.problems[0]}.") from err
        raise
    lost = log.has_loss or any(notice.is_loss for notice, _ in notices.values())
    result = Result(
        status=ExitStatus.LOSS if lost else ExitStatus.DONE,
        pipeline=pipeline,
        log=log,
        chain=chain,
        results=results,
        notices=notices,
        out=request.out,
        peak_memory_mib=peak_memory_mib(),
    )
    if request.out is not None:
        with replacing_text(out / "run.yaml") as file:
            file.write(dump_pipeline(pipeline, out, out))
        with replacing_text(out / "report.json") as file:
            file.write(report_json(result, request.command))
    return result


def _with_provenance(log: Log, pipeline: Pipeline, out: Path) -> Iterator[Event]:
    """Append to the log what a report says of the run itself; known only when all is read."""
    stamp = 0
    for event in log:
        stamp = event.stamp
        yield event
    yield Summary(
        stamp=stamp,
        source="run",
        values={
            "pipeline": dump_pipeline(pipeline, out, out),
            "inputs": [Path(item.path).name for item in log.inputs],
            "topics": dict(pipeline.topics),
            "messages": messages_json(log),
        },
    )


def _drain(
    chain: Chain, log: Log, watch: Watch | None
) -> tuple[dict[str, Mapping[str, object] | Sequence[object]], dict[str, tuple[Notice, int]]]:
    results: dict[str, Mapping[str, object] | Sequence[object]] = {}
    notices: dict[str, tuple[Notice, int]] = {}
    for event in chain:
        if isinstance(event, Summary):
            results[event.source] = event.values
        elif isinstance(event, Notice):
            first, n = notices.get(event.code, (event, 0))
            notices[event.code] = (first, n + 1)
        if watch is not None:
            watch(event, log)
    return results, notices
