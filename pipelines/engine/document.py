"""A pipeline file as written: which stages, which parameters, and on which line each of them stands.

::

    logpose: 1
    topics: {image: /ceiling/image_raw, odometry: auto}
    stages:
      - detect-circles: {lamp_diameter_m: 0.13, workers: 2}
      - localize-pf: {map: landmarks.yaml}
      - write-trajectory

Nothing is known here of what a stage is; ``pipeline.py`` checks the words against the stages.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from ...formats.errors import ConfigError, FormatError
from ...formats.text import read_text
from ...formats.yaml_file import YamlMapping, YamlSequence, parse_yaml

VERSION = 1


@dataclass(frozen=True, slots=True)
class Value:
    """One parameter as given, and where: ``p.yaml:3`` or ``--set``; files in it are relative to ``base``."""

    value: object
    where: str
    base: Path


@dataclass(frozen=True, slots=True)
class StageEntry:
    """One item of ``stages``."""

    name: str
    where: str
    values: Mapping[str, Value] = field(default_factory=dict)

    def with_values(self, values: Mapping[str, Value]) -> "StageEntry":
        """Return the entry with further parameters, which win over its own."""
        return replace(self, values={**self.values, **values})


@dataclass(frozen=True, slots=True)
class Document:
    """A whole pipeline file."""

    name: str
    topics: Mapping[str, str]
    stages: tuple[StageEntry, ...]


def read_document(path: Path, name: str | None = None) -> Document:
    """Read a pipeline file; ``name`` is what error messages call it (its path as given if None).

    Raises:
        FormatError: the file cannot be read.
        ConfigError: not YAML, not a pipeline, or of another version.
    """
    return parse_document(read_text(path), name or str(path), path.parent)


def parse_document(text: str, name: str, base: Path) -> Document:
    """Parse the text of a pipeline file; see ``read_document``."""
    try:
        root = parse_yaml(text, name)
    except FormatError as err:
        raise ConfigError(str(err)) from err
    if not isinstance(root, YamlMapping) or root.get("logpose") != VERSION:
        raise ConfigError(
            f"{name}:1: not a pipeline file of version {VERSION}. Its first line must be 'logpose: {VERSION}'."
        )
    for key in root:
        if key not in {"logpose", "topics", "stages"}:
            where = f"{name}:{root.lines[key]}"
            raise ConfigError(f"{where}: unknown key {key!r}. A pipeline file has logpose, topics and stages.")
    stages = root.get("stages")
    if not isinstance(stages, YamlSequence):
        raise ConfigError(f"{name}: no list of stages. Write 'stages:' and one '- stage-name: {{...}}' per line.")
    entries = (_stage(item, f"{name}:{line}", name, base) for item, line in zip(stages, stages.lines, strict=True))
    return Document(name, _topics(root, name), tuple(entries))


def _topics(root: YamlMapping, name: str) -> dict[str, str]:
    given = root.get("topics")
    if given is None:
        return {}
    if not isinstance(given, YamlMapping):
        raise ConfigError(f"{name}:{root.lines['topics']}: topics is no mapping. Write 'topics: {{image: /name}}'.")
    for role, topic in given.items():
        if not isinstance(topic, str):
            where = f"{name}:{given.lines[role]}"
            raise ConfigError(f"{where}: topic of {role!r} is {topic!r}. Give a topic name, 'auto' or 'none'.")
    return {str(role): str(topic) for role, topic in given.items()}


def _stage(item: object, where: str, name: str, base: Path) -> StageEntry:
    if isinstance(item, str):
        return StageEntry(item, where)
    if not isinstance(item, YamlMapping) or len(item) != 1:
        found = ", ".join(map(str, item)) if isinstance(item, YamlMapping) else repr(item)
        raise ConfigError(f"{where}: one stage per list item, '- stage-name: {{...}}'. Found {found}.")
    ((stage, body),) = item.items()
    if body is None:
        return StageEntry(str(stage), where)
    if not isinstance(body, YamlMapping):
        raise ConfigError(f"{where}: parameters of {stage} are no mapping. Write '- {stage}: {{key: value}}'.")
    values = {str(key): Value(value, f"{name}:{body.lines[key]}", base) for key, value in body.items()}
    return StageEntry(str(stage), where, values)
