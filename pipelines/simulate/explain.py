"""Why a world file was refused: pydantic's errors as one line with the key, the value and the cure."""

import difflib
import json
import re
from collections.abc import Sequence
from typing import Any

from pydantic import BaseModel

from ...formats.yaml_file import YamlMapping


def line_of(document: YamlMapping, loc: Sequence[int | str]) -> int:
    """Return the line of what ``loc`` leads to, or of the innermost mapping or key on the way that exists."""
    line, here = document.line, document  # type: int, object
    for key in loc:
        if isinstance(here, YamlMapping):
            if key not in here:
                return line
            line, here = here.lines[key], here[key]
        elif isinstance(here, list) and isinstance(key, int) and key < len(here):
            here = here[key]
            line = here.line if isinstance(here, YamlMapping) else line
    return line


def explain(model: type[BaseModel], error: Any) -> str:
    """Return what is wrong with a value and what to do, from one of pydantic's errors."""
    loc = [key for key in error["loc"] if isinstance(key, int) or key]
    dotted = ".".join(str(key) for key in loc)
    if not loc:
        return str(error["msg"]).removeprefix("Value error, ")
    if error["type"] == "missing":
        return f"{dotted} is missing ({_described(model, loc)}). Add it."
    if error["type"] == "extra_forbidden":
        keys = sorted(_fields(model, loc[:-1]))
        close = difflib.get_close_matches(str(loc[-1]), keys, n=1)
        cure = f"Did you mean {close[0]!r}?" if close else f"Known keys: {', '.join(keys)}."
        return f"unknown key {dotted!r}. {cure}"
    reason = re.sub(r"^(Input|Tuple|Value error,) | after validation", "", error["msg"])
    if error["type"] == "value_error" and reason.endswith("."):  # it brings its own cure
        return f"{dotted}: {reason}"
    cure = "Correct it."
    if isinstance(error["input"], str) and re.fullmatch(r"[-+]?\d+e[-+]?\d+", error["input"]):
        cure = "YAML wants a point and a sign before an exponent: 1.0e-3, 1.0e+3."
    shown = json.dumps(error["input"]) if not isinstance(error["input"], dict | list) else "what is given"
    return f"{dotted}: {shown} {reason} ({_described(model, loc)}). {cure}"


def _fields(model: type[BaseModel], loc: Sequence[int | str]) -> dict[str, Any]:
    """Return the fields of the model that ``loc`` leads to."""
    fields: dict[str, Any] = dict(model.model_fields)
    for key in loc:
        if isinstance(key, int):
            continue
        inner = _model_in(fields[key].annotation) if key in fields else None
        fields = dict(inner.model_fields) if inner else {}
    return fields


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for inner in getattr(annotation, "__args__", ()):
        if found := _model_in(inner):
            return found
    return None


def _described(model: type[BaseModel], loc: Sequence[int | str]) -> str:
    names = [key for key in loc if isinstance(key, str)]
    fields = _fields(model, names[:-1])
    return str(fields[names[-1]].description) if names and names[-1] in fields else "a value"
