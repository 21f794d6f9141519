"""The reference of all stages and their parameters as Markdown; ``docs/stages.md`` is its output."""

import typing

from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from .params import PathRole
from .stage import Table, load_stage


def reference(table: Table) -> str:
    """Render one section per stage, one row per parameter."""
    parts = ["# Stages", "", "Made by `make reference` from the code; do not edit.", ""]
    for name in sorted(table):
        spec = load_stage(name, table[name])
        parts += [f"## {name}", "", _one_line(spec.doc), ""]
        if spec.takes is not None:
            parts += [
                f"Works on single messages ({spec.takes.__name__}): takes `workers`, a number of threads.",
                "",
            ]
        parts += ["| parameter | type | default | what it is |", "|---|---|---|---|"]
        parts += [_row(key, field) for key, field in spec.params.model_fields.items()]
        parts += [""]
    return "\n".join(parts)


def _row(key: str, field: FieldInfo) -> str:
    default = "needed" if field.default is PydanticUndefined else f"`{_value(field.default)}`"
    bounds = ", ".join(_bound(mark) for mark in field.metadata if _bound(mark))
    kind = type_words(field.annotation, field.metadata) + (f", {bounds}" if bounds else "")
    return f"| `{key}` | {kind} | {default} | {_one_line(field.description or '')} |"


def _value(value: object) -> str:
    return "null" if value is None else str(value).lower() if isinstance(value, bool) else str(value)


def _bound(mark: object) -> str:
    signs = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
    return " ".join(f"{sign} {getattr(mark, name)}" for name, sign in signs.items() if hasattr(mark, name))


def type_words(annotation: object, metadata: typing.Sequence[object] = ()) -> str:
    """Say a type in words a user knows."""
    roles = [mark for mark in metadata if isinstance(mark, PathRole)]
    if roles:
        return f"{roles[0].kind} file"
    origin, args = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is typing.Annotated:
        return type_words(args[0], args[1:])
    if origin is typing.Literal:
        return " or ".join(f"`{arg}`" for arg in args)
    if origin is tuple:
        return f"{len(args)} x {type_words(args[0])}" if Ellipsis not in args else f"list of {type_words(args[0])}"
    if args:
        return " or ".join("null" if arg is type(None) else type_words(arg) for arg in args)
    words = {float: "number", int: "whole number", str: "text", bool: "true or false"}
    return words.get(typing.cast("type", annotation), str(getattr(annotation, "__name__", annotation)))


def _one_line(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")
