"""A checked pipeline: every stage known, every parameter valid, every file resolved.

Precedence: built-in defaults < bundled YAML < ``-c FILE`` < ``--set`` and flags. A layer that does not mention a
parameter never changes it.
"""

import json
import typing
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from pydantic import ValidationError

from ...formats.errors import ConfigError
from .document import Document, StageEntry, Value
from .params import Params, PathRole
from .stage import StageSpec, Table, closest, load_stage

AUTO, NONE = "auto", "none"


@dataclass(frozen=True, slots=True)
class BoundStage:
    """A stage with its parameters.

    Attributes:
        spec: what runs.
        params: its parameters, files resolved.
        where: file and line that named it.
        workers: threads, for a ``@per_message`` stage.
    """

    spec: StageSpec
    params: Params
    where: str
    workers: int = 1


@dataclass(frozen=True, slots=True)
class Pipeline:
    """What would run: topics by role, and the stages in order."""

    name: str
    topics: Mapping[str, str]
    stages: tuple[BoundStage, ...]


def overlay(document: Document, over: Document) -> Document:
    """Lay the file given with ``-c`` over a pipeline: topics and parameters of stages that are there."""
    names = [entry.name for entry in document.stages]
    entries = list(document.stages)
    for entry in over.stages:
        if entry.name not in names:
            raise ConfigError(
                f"{entry.where}: {document.name} has no stage {entry.name!r}. {closest(entry.name, names)}"
            )
        i = names.index(entry.name)
        entries[i] = entries[i].with_values(entry.values)
    return replace(document, topics={**document.topics, **over.topics}, stages=tuple(entries))


def assign(document: Document, settings: Sequence[tuple[str, Value]]) -> Document:
    """Lay single settings ``stage.parameter`` over a pipeline.

    Raises:
        ConfigError: no such stage in the pipeline.
    """
    entries = list(document.stages)
    names = [entry.name for entry in entries]
    for target, value in settings:
        stage, dot, key = target.rpartition(".")
        if not dot:
            raise ConfigError(f"{value.where} {target}: no stage named. Write STAGE.PARAMETER=VALUE.")
        if stage not in names:
            raise ConfigError(
                f"{value.where} {target}: {document.name} has no stage {stage!r}. {closest(stage, names)}"
            )
        i = names.index(stage)
        entries[i] = entries[i].with_values({key: value})
    return replace(document, stages=tuple(entries))


def bind(document: Document, table: Table, out: Path, flags: Mapping[str, str] | None = None) -> Pipeline:
    """Check every word of a document and build its parameters.

    Args:
        document: as read, with everything laid over it.
        table: stage name -> ``module:function``.
        out: the run folder, for the files that stages write.
        flags: ``stage.parameter`` -> the flag of the command line that gives it, for the cure.

    Raises:
        ConfigError: with file, line, and what was probably meant.
    """
    return Pipeline(
        document.name, document.topics, tuple(_bind(entry, table, out, flags or {}) for entry in document.stages)
    )


def _bind(entry: StageEntry, table: Table, out: Path, flags: Mapping[str, str]) -> BoundStage:
    if entry.name not in table:
        raise ConfigError(f"{entry.where}: no stage {entry.name!r}. {closest(entry.name, table)}")
    spec = load_stage(entry.name, table[entry.name])
    values = dict(entry.values)
    workers = _workers(spec, values.pop("workers", None))
    raw = {key: value.value for key, value in values.items()}
    try:
        params = spec.params.model_validate_json(json.dumps(raw, allow_nan=False, default=str), strict=True)
    except ValidationError as err:
        raise ConfigError(_explain(err, entry, spec, flags)) from err
    except ValueError as err:  # nan and inf are no JSON
        raise ConfigError(f"{entry.where}: {entry.name} has a parameter that is not finite. Give numbers.") from err
    return BoundStage(spec, _resolve_paths(params, values, out), entry.where, workers)


def _workers(spec: StageSpec, value: Value | None) -> int:
    if value is None:
        return 1
    if spec.takes is None:
        raise ConfigError(
            f"{value.where}: {spec.name} takes no workers, it keeps state from message to message. Remove it."
        )
    if not isinstance(value.value, int) or isinstance(value.value, bool) or value.value < 1:
        raise ConfigError(f"{value.where}: workers = {value.value!r}. Give a whole number of threads, 1 or more.")
    return value.value


def _explain(err: ValidationError, entry: StageEntry, spec: StageSpec, flags: Mapping[str, str]) -> str:
    """Turn the first complaint into one line: where, what is wrong, what to do."""
    problem = err.errors()[0]
    key = str(problem["loc"][0]) if problem["loc"] else ""
    where = entry.values[key].where if key in entry.values else entry.where
    fields = spec.params.model_fields
    match problem["type"]:
        case "extra_forbidden":
            known = [*fields, *(["workers"] if spec.takes else [])]
            return f"{where}: {entry.name} has no parameter {key!r}. {closest(key, known)}"
        case "missing":
            what = (fields[key].description or "").rstrip(".")
            flag = flags.get(f"{entry.name}.{key}", f"--set {entry.name}.{key}=VALUE")
            return f"{where}: {entry.name} needs {key!r}: {what}. Give it with {flag}."
        case _:
            what = ((fields[key].description if key in fields else None) or "").rstrip(".")
            message = problem["msg"].removeprefix("Value error, ").rstrip(".")
            message = message[:1].lower() + message[1:]
            hint = f" {key} is: {what}." if what else ""
            given = entry.values[key].value if key in entry.values else problem["input"]
            return f"{where}: {entry.name} cannot take {key} = {given!r}: {message}.{hint}"


def path_role(annotation: object) -> PathRole | None:
    """Find the file mark in a (possibly optional) parameter type."""
    for item in (annotation, *typing.get_args(annotation)):
        for mark in getattr(item, "__metadata__", ()):
            if isinstance(mark, PathRole):
                return mark
    return None


def field_role(params: type[Params], key: str) -> PathRole | None:
    """Tell whether a parameter is a file, and which way it goes."""
    field = params.model_fields[key]
    marks = [mark for mark in field.metadata if isinstance(mark, PathRole)]
    return marks[0] if marks else path_role(field.annotation)


def _resolve_paths(params: Params, values: Mapping[str, Value], out: Path) -> Params:
    """Make files absolute in effect: inputs beside what named them, outputs in the run folder."""
    changed: dict[str, str] = {}
    for key in type(params).model_fields:
        role, value = field_role(type(params), key), getattr(params, key)
        if role is None or value is None or value == "-":
            continue
        if role.kind == "output":
            changed[key] = str(out / value)
        elif key in values:
            changed[key] = str(values[key].base / value)
    return params.model_copy(update=changed) if changed else params
