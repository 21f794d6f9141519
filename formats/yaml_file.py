"""YAML files as mappings that know their lines, so that an error can name the line.

Read with PyYAML's composer and its safe rules for scalars only: tags make no objects, an alias is the same
object again (nothing is expanded), a key that stands twice is an error, and so is a document whose aliases would
expand to more than ``MAX_VALUES``.
"""

import json
from collections.abc import Hashable
from pathlib import Path

from .errors import FormatError
from .text import read_text

MAX_DEPTH = 50
MAX_VALUES = 1_000_000


class YamlMapping(dict[Hashable, object]):
    """A mapping that knows where it stands.

    Attributes:
        line: of the mapping itself, from 1.
        lines: line of each key.
    """

    def __init__(self, line: int) -> None:
        super().__init__()
        self.line = line
        self.lines: dict[Hashable, int] = {}


class YamlSequence(list[object]):
    """A sequence that knows where its items stand.

    Attributes:
        lines: line of each item, from 1.
    """

    def __init__(self) -> None:
        super().__init__()
        self.lines: list[int] = []


def read_yaml(path: str | Path) -> object:
    """Return the one document of a YAML file; mappings are ``YamlMapping``, sequences ``YamlSequence``.

    Raises:
        FormatError: the file cannot be read, is no YAML, or a key stands twice.
    """
    return parse_yaml(read_text(path), str(path))


def parse_yaml(text: str, name: str) -> object:
    """Return the one document of YAML text; ``name`` stands for the file in errors."""
    import yaml

    try:
        loader = yaml.SafeLoader(text)
        try:
            node = loader.get_single_node()
            value = None if node is None else _construct(loader, node, name, {}, 0)
        finally:
            loader.dispose()
    except yaml.MarkedYAMLError as err:
        line = err.problem_mark.line + 1 if err.problem_mark else 1
        raise FormatError(f"{name}:{line}: is no YAML ({err.problem}). Correct the line.") from err
    except (yaml.YAMLError, RecursionError, ValueError) as err:
        reason = str(err).splitlines()[0] if str(err) else "too deep"
        raise FormatError(f"{name}: is no YAML ({reason}). Correct the file.") from err
    if _size(value, {}) > MAX_VALUES:
        raise FormatError(f"{name}: its aliases expand to more than {MAX_VALUES:,} values. Write it without them.")
    return value


def yaml_float(value: float) -> str:
    """Write a float so that every YAML reader takes it as one: YAML 1.1 wants a point (``1.0e-07``)."""
    text = repr(float(value))
    return text.replace("e", ".0e") if "e" in text and "." not in text else text


def yaml_text(text: str) -> str:
    """Write text so that every YAML reader takes it as text: plain where it is a simple name, otherwise quoted."""
    is_word = text.lower() in {"null", "true", "false", "yes", "no", "on", "off", "y", "n"}
    is_name = text.replace("_", "").replace("/", "").isalnum() and text.isascii() and text[0].isalpha()
    return text if is_name and not is_word else json.dumps(text, ensure_ascii=False)


def _size(value: object, known: dict[int, int]) -> int:
    """Count the values a document would have with every alias written out, looking at each object once."""
    if not isinstance(value, dict | list):
        return 1
    if id(value) not in known:
        known[id(value)] = MAX_VALUES + 1  # an alias to what encloses it has no end
        items = value.values() if isinstance(value, dict) else value
        known[id(value)] = 1 + sum(_size(item, known) for item in items)
    return known[id(value)]


def _construct(loader: object, node: object, name: str, done: dict[int, object], depth: int) -> object:
    import yaml

    assert isinstance(loader, yaml.SafeLoader)
    assert isinstance(node, yaml.Node)
    where = f"{name}:{node.start_mark.line + 1}"
    if depth > MAX_DEPTH:
        raise FormatError(f"{where}: is nested deeper than {MAX_DEPTH} levels. Flatten the file.")
    if id(node) in done:
        return done[id(node)]
    if isinstance(node, yaml.MappingNode):
        mapping = YamlMapping(node.start_mark.line + 1)
        done[id(node)] = mapping
        for key_node, value_node in node.value:
            key = _construct(loader, key_node, name, done, depth + 1)
            line = key_node.start_mark.line + 1
            if not isinstance(key, Hashable):
                raise FormatError(f"{name}:{line}: a key is no scalar. Correct the line.")
            if key in mapping:
                raise FormatError(f"{name}:{line}: key {key!r} stands twice. Remove one.")
            mapping[key] = _construct(loader, value_node, name, done, depth + 1)
            mapping.lines[key] = line
        return mapping
    if isinstance(node, yaml.SequenceNode):
        items = YamlSequence()
        done[id(node)] = items
        for item in node.value:
            items.append(_construct(loader, item, name, done, depth + 1))
            items.lines.append(item.start_mark.line + 1)
        return items
    if node.tag.startswith("tag:yaml.org,2002:"):
        value: object = loader.construct_object(node)
        return value
    return str(node.value)
