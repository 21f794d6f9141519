"""How a pipeline subcommand becomes a run: its bundled pipeline, with its options laid over it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import click

from ..formats.errors import ConfigError
from ..formats.events import INITIAL_POSE, TRUTH
from ..formats.topics import ROLES
from ..formats.window import parse_window
from ..pipelines.catalog import PIPELINES, STAGES
from ..pipelines.engine.document import Document, StageEntry, Value, read_document
from ..pipelines.engine.dump import dump_pipeline
from ..pipelines.engine.pipeline import assign, bind, overlay
from ..pipelines.engine.report import report_json
from ..pipelines.engine.run import Request, run
from ..pipelines.engine.stage import load_stage
from .options import flag_of, setting
from .talk import Talk, depfile


@dataclass(frozen=True, slots=True, kw_only=True)
class Call:
    """What a pipeline subcommand was asked for: the shared options, and what its own flags add.

    Attributes:
        name: of the bundled pipeline, or of the pipeline file for ``run``.
        options: the values of ``run_options``.
        flags: option -> the parameters (``stage.key``) its value goes to, if it is given.
        stream: writer that stays, with its path on standard output, under ``-o -``.
        overlays: stage that draws what was found over the images, if ``--overlays`` asks for it.
        swaps: stage -> stage that takes its place, with its parameters.
        topics: roles whose topic the subcommand's flags decide.
    """

    name: str
    options: Mapping[str, Any]
    flags: Mapping[str, Sequence[str]] = field(default_factory=dict)
    stream: str | None = None
    overlays: str | None = None
    swaps: Mapping[str, tuple[str, Mapping[str, object]]] = field(default_factory=dict)
    topics: Mapping[str, str] = field(default_factory=dict)


def execute(call: Call) -> int:
    """Build the document of a call, run it, say what came out, and return the exit status."""
    options = call.options
    bundled = PIPELINES.get(call.name)
    document = read_document(bundled, bundled.name) if bundled else read_document(Path(call.name))
    document = _dressed(document, call)
    is_stream = options["output"] == "-"
    if is_stream:
        _refuse_with_stream(options)
        document = _stream_only(document, call)
    out = Path() if is_stream else Path(options["output"] or _default_folder(call))
    flags = {target: flag_of(option) for option, targets in call.flags.items() for target in targets}
    if options["show_pipeline"]:
        click.echo(dump_pipeline(bind(document, STAGES, out, flags), Path(), out, with_workers=True), nl=False)
        return 0
    talk = Talk(quiet=options["quiet"])
    request = Request(
        command=click.get_current_context().find_root().obj or [call.name],
        document=document,
        logs=options["logs"],
        out=None if is_stream else out,
        stamp=options["stamp"] or "header",
        window=parse_window(options["start"], options["end"], options["duration"]),
        flags=flags,
    )
    with talk:
        result = run(request, STAGES, talk.watch)
    talk.conclude(result)
    if options["as_json"]:
        click.echo(report_json(result, request.command), nl=False)
    if options["depfile"]:
        depfile(options["depfile"], result)
    return int(result.status)


def _dressed(document: Document, call: Call) -> Document:
    """Lay ``-c`` files, ``--set`` and flags over the bundled pipeline, in this order."""
    options = call.options
    for path in options["config"]:
        document = overlay(document, read_document(Path(path)))
    stages = [_entry(*call.swaps[entry.name]) if entry.name in call.swaps else entry for entry in document.stages]
    reference, overlays = options.get("reference"), options.get("overlays")
    if reference:
        stages.insert(0, _entry("read-truth", {"path": reference}))
    if call.overlays is not None and overlays:
        stages.append(_entry(call.overlays, {"path": overlays}))
    document = replace(document, stages=tuple(stages))
    given = (setting(text) for text in options["settings"])
    settings = [(key, Value(value, "--set", Path())) for key, value in given]
    settings += _flags(document, call)
    settings += _everywhere(document, "seed", options["seed"])
    settings += _everywhere(document, "workers", options["workers"])
    return replace(assign(document, settings), topics={**document.topics, **_topics(call)})


def _topics(call: Call) -> dict[str, str]:
    """Return the topics that flags decide; what is named with ``--topic`` wins."""
    topics = dict(call.topics)
    if _is_topic(call.options.get("initial_pose")):
        topics[INITIAL_POSE] = call.options["initial_pose"]
    if call.options.get("reference") is not None:
        topics[TRUTH] = "none"
    return topics | dict(_topic(text) for text in call.options["topics"])


def _is_topic(initial_pose: str | None) -> bool:
    """Tell whether ``--initial-pose`` says where a start pose is logged, instead of what it is."""
    return initial_pose is not None and (initial_pose.startswith("/") or initial_pose == "none")


def _flags(document: Document, call: Call) -> list[tuple[str, Value]]:
    """Lay the subcommand's own flags on the stages that are there."""
    names = {entry.name for entry in document.stages}
    settings = []
    for option, targets in call.flags.items():
        value, flag = call.options.get(option), flag_of(option)
        if value is None or (option == "initial_pose" and _is_topic(value)):
            continue
        there = [target for target in targets if target.rpartition(".")[0] in names]
        if not there:
            raise ConfigError(f"{flag}: no stage of this run takes it ({', '.join(targets)}). Leave it out.")
        settings += [(target, Value(value, flag, Path())) for target in there]
    return settings


def _everywhere(document: Document, key: str, value: object | None) -> list[tuple[str, Value]]:
    """Lay one value on every stage that has such a parameter."""
    specs = [load_stage(entry.name, STAGES[entry.name]) for entry in document.stages if entry.name in STAGES]
    takers = [spec.name for spec in specs if key in spec.params.model_fields or (key == "workers" and spec.takes)]
    return [] if value is None else [(f"{name}.{key}", Value(value, f"--{key}", Path())) for name in takers]


def _entry(name: str, values: Mapping[str, object]) -> StageEntry:
    where = "the command line"
    return StageEntry(name, where, {key: Value(value, where, Path()) for key, value in values.items()})


def _topic(text: str) -> tuple[str, str]:
    role, equals, name = text.partition("=")
    if not equals:
        raise ConfigError(f"--topic {text}: no role. Write ROLE=/NAME, like image=/camera/image_raw.")
    if role not in ROLES:
        raise ConfigError(f"--topic {text}: no role {role!r}. There is: {', '.join(sorted(ROLES))}.")
    return role, name


def _stream_only(document: Document, call: Call) -> Document:
    """Keep the computing stages, those that were asked for, and the writer whose result goes to standard output."""
    if call.stream is None:
        raise ConfigError(f"{call.name}: several results, none of them a stream. Name a folder with -o DIR.")
    stages = [e for e in document.stages if e.name == call.overlays or not e.name.startswith("write-")]
    writer = next(entry for entry in document.stages if entry.name == call.stream)
    return replace(document, stages=(*stages, writer.with_values({"path": Value("-", "-o", Path())})))


def _refuse_with_stream(options: Mapping[str, Any]) -> None:
    """Refuse what else would go to standard output, or names a file that ``-o -`` does not leave."""
    for option, flag in (("as_json", "--json"), ("depfile", "--depfile")):
        if options[option]:
            raise ConfigError(f"{flag}: -o - leaves no report, only the result. Name a folder with -o DIR.")


def _default_folder(call: Call) -> str:
    first = Path(call.options["logs"][0]) if call.options["logs"] else Path("logpose")
    return f"{first.resolve().name.split('.')[0] or 'logpose'}.{Path(call.name).stem}"
