"""What every map in YAML shares: ``logpose: NAME/VERSION``, a frame, and a list of entries under that name."""

from ..errors import FormatError
from ..text import parse_number
from ..yaml_file import YamlMapping, parse_yaml

_LARGEST_M = 1e9


def map_entries(text: str, name: str, schema: str, *, noun: str, short: str) -> tuple[str, list[object]]:
    """Return the frame of a map and its entries, as they stand in the file.

    Args:
        text: the file.
        name: of the file, for errors.
        schema: ``landmarks/1``: the part before the version is the key of the list.
        noun: what the file should be.
        short: the same in a sentence that names it already.

    Raises:
        FormatError: no YAML, another schema or version, a frame that is no name, or no list.
    """
    document = parse_yaml(text, name)
    if not isinstance(document, YamlMapping):
        raise FormatError(f"{name}: is no {noun}. It must begin with 'logpose: {schema}'.")
    if (found := document.get("logpose")) != schema:
        where = f"{name}:{document.lines.get('logpose', 1)}"
        if found is None:
            raise FormatError(f"{where}: key 'logpose' is missing. Write 'logpose: {schema}' into the first line.")
        raise FormatError(f"{where}: the file is {found!r}, not {schema!r}. Name a {short} of this version.")
    frame = document.get("frame", "map")
    if not isinstance(frame, str):
        raise FormatError(f"{name}:{document.lines['frame']}: frame is {frame!r}. It must be a name.")
    items = schema.partition("/")[0]
    if items not in document:
        raise FormatError(f"{name}: key {items!r} is missing. Give a list of {items}.")
    entries = [] if document[items] is None else document[items]
    if not isinstance(entries, list):
        raise FormatError(f"{name}:{document.lines[items]}: {items} is no list. Give one entry each.")
    return frame, entries


def map_id(value: object, where: str) -> int:
    """Return a value as the id of an entry.

    Raises:
        FormatError: it is no integer from 0; ``where`` says of what.
    """
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < 2**63:
        raise FormatError(f"{where}: id is {value!r}. It must be an integer from 0.")
    return value


def map_number(value: object, where: str, key: str, item: str) -> float:
    """Return a value as a finite number.

    Raises:
        FormatError: it is none; ``where``, ``key`` and ``item`` (a landmark, a mark) say of what.
    """
    # YAML 1.1 reads 1e-3 (without a point) as a string: taken as the number that was meant.
    if isinstance(value, str):
        return parse_number(value, where, key)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise FormatError(f"{where}: {key} is {value!r}, not a number. Correct or remove the {item}.")
    return parse_number(repr(value), where, key)


def in_metres(value: float, where: str, key: str) -> float:
    """Return a coordinate [m].

    Raises:
        FormatError: it is so large that it cannot be metres.
    """
    if not abs(value) < _LARGEST_M:
        raise FormatError(f"{where}: {key} is {value!r} m. No map is that large; the unit is metres.")
    return value
