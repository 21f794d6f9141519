"""The JSON schema of a pipeline file, for editors that complete and check YAML."""

from typing import Any

from .stage import Table, load_stage


def pipeline_schema(table: Table) -> dict[str, Any]:
    """Describe every stage of the table with its parameters."""
    definitions: dict[str, Any] = {}
    items: list[dict[str, Any]] = [{"type": "string", "enum": sorted(table)}]
    for name in sorted(table):
        spec = load_stage(name, table[name])
        schema = spec.params.model_json_schema(ref_template="#/$defs/{model}")
        definitions |= schema.pop("$defs", {})
        if spec.takes is not None:
            schema.setdefault("properties", {})["workers"] = {
                "type": "integer",
                "minimum": 1,
                "default": 1,
                "description": "threads",
            }
        schema["description"] = spec.doc
        items.append(
            {
                "type": "object",
                "additionalProperties": False,
                "required": [name],
                "properties": {name: schema},
            }
        )
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "logpose pipeline",
        "type": "object",
        "additionalProperties": False,
        "required": ["logpose", "stages"],
        "properties": {
            "logpose": {"const": 1, "description": "version of this file format"},
            "topics": {
                "type": "object",
                "additionalProperties": {"type": "string"},
                "description": "role -> topic name, auto or none",
            },
            "stages": {"type": "array", "items": {"anyOf": items}},
        },
        "$defs": definitions,
    }
