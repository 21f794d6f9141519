"""A pipeline as YAML, complete and repeatable: what ``--show-pipeline`` prints and ``run.yaml`` holds."""

import os
from pathlib import Path
from typing import Any

import yaml

from ...formats.errors import ConfigError
from .document import VERSION
from .pipeline import BoundStage, Pipeline, field_role


def dump_pipeline(pipeline: Pipeline, base: Path, out: Path, *, with_workers: bool = False) -> str:
    """Write every parameter of every stage.

    Threads change how long a run takes and nothing else, so what a run leaves behind does not mention them.

    Args:
        pipeline: what would run.
        base: input files are written relative to this folder (where the YAML will stand).
        out: the run folder; output files are written relative to it.
        with_workers: also write how many threads a stage was given.
    """
    lines = [f"logpose: {VERSION}", f"topics: {_flow(dict(pipeline.topics))}", "stages:"]
    for stage in pipeline.stages:
        values = _values(stage, base, out)
        if with_workers and stage.workers != 1:
            values["workers"] = stage.workers
        lines.append(f"  - {stage.spec.name}:" + ("" if values else " {}"))
        lines += [f"      {key}: {_flow(value)}" for key, value in values.items()]
    return "\n".join(lines) + "\n"


def _values(stage: BoundStage, base: Path, out: Path) -> dict[str, Any]:
    params = type(stage.params)
    values = stage.params.model_dump(mode="json")
    for key, value in values.items():
        role = field_role(params, key)
        if role is None or value is None or value == "-":
            continue
        values[key] = _relative(value, out if role.kind == "output" else base)
    return values


def _relative(path: str, base: Path) -> str:
    try:
        return Path(os.path.relpath(path, base)).as_posix()
    except ValueError as err:  # another drive on Windows
        raise ConfigError(f"{path}: not on the drive of the run folder {base}. Put them on one drive.") from err


def _flow(value: object) -> str:
    text = yaml.safe_dump(value, default_flow_style=True, sort_keys=False, width=10**6, allow_unicode=True)
    return text.removesuffix("\n").removesuffix("\n...")
