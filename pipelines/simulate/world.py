"""World files: what a YAML says of the building, the robot, its sensors and their errors.

::

    logpose: world/1
    kind: ceiling
    robot:
      waypoints: [{name: A, x_m: 2.0, y_m: 2.0}, {name: B, x_m: 6.0, y_m: 2.0}]
    ceiling: {height_m: 2.74, size_m: [10.0, 6.0]}

The parts (robot, odometry, camera, sensor) are the same in every world and live in files of their own; the kind says
what there is to see. What is not given has a default. A wrong key is answered with its line and the keys that there
are.
"""

import json
from collections.abc import Sequence
from pathlib import Path

from pydantic import ValidationError

from ...formats.errors import ConfigError, FormatError
from ...formats.text import read_text
from ...formats.yaml_file import YamlMapping, parse_yaml
from .explain import explain, line_of
from .worlds.base import World
from .worlds.bench import BenchWorld
from .worlds.ceiling_world import CeilingWorld
from .worlds.stripe_world import StripeWorld

SCHEMA = "world/1"

WORLDS: dict[str, type[World]] = {"ceiling": CeilingWorld, "stripe": StripeWorld, "stripe-bench": BenchWorld}


def read_world(path: str | Path, settings: Sequence[tuple[str, object]] = ()) -> World:
    """Read a world file; ``settings`` are values that replace the file's, by dotted key (``camera.rate_hz``).

    Raises:
        FormatError: the file cannot be read.
        ConfigError: it is no world, of another version, or a value is missing, unknown or out of its range.
    """
    return parse_world(read_text(path), str(path), settings)


def parse_world(text: str, name: str, settings: Sequence[tuple[str, object]] = ()) -> World:
    """Parse the text of a world file; ``name`` stands for the file in errors."""
    try:
        document = parse_yaml(text, name)
    except FormatError as err:
        raise ConfigError(str(err)) from err
    if not isinstance(document, YamlMapping) or document.get("logpose") != SCHEMA:
        line = document.lines.get("logpose", 1) if isinstance(document, YamlMapping) else 1
        raise ConfigError(f"{name}:{line}: is no world of this version. Its first line must be 'logpose: {SCHEMA}'.")
    for key, value in settings:
        _set(document, key, value)
    kind = document.get("kind")
    if kind not in WORLDS:
        where = f"{name}:{document.lines.get('kind', 1)}"
        raise ConfigError(f"{where}: there is no kind of world {kind!r}. Known kinds: {', '.join(WORLDS)}.")
    model = WORLDS[str(kind)]
    try:
        # Through JSON, where lists may be tuples, but strict in everything else.
        return model.model_validate_json(json.dumps(document))
    except ValidationError as err:
        # A misspelt key is the cause of a missing one.
        first = min(err.errors(), key=lambda error: error["type"] != "extra_forbidden")
        place = ".".join(map(str, first["loc"])) + "."
        keys = [key for key, _ in settings if place.startswith(f"{key}.") or f"{key}.".startswith(place)]
        where = f"--set {keys[0]}" if keys else f"{name}:{line_of(document, first['loc'])}"
        raise ConfigError(f"{where}: {explain(model, first)}") from err
    except (TypeError, ValueError, RecursionError) as err:
        raise ConfigError(f"{name}: holds a value that is no number, text or list ({err}). Correct it.") from err


def _set(document: YamlMapping, key: str, value: object) -> None:
    """Put a value where a dotted key points to; what is missing on the way is made, what is wrong is found later."""
    here: object = document
    *way, last = [int(word) if word.isdecimal() else word for word in key.split(".")]
    for word in way:
        if isinstance(here, YamlMapping):
            here.lines.setdefault(word, here.line)
            here = here.setdefault(word, YamlMapping(here.line))
            continue
        here = here[word] if isinstance(here, list) and isinstance(word, int) and word < len(here) else None
    if isinstance(here, YamlMapping):
        here[last] = value
        here.lines.setdefault(last, here.line)
    elif isinstance(here, list) and isinstance(last, int) and last < len(here):
        here[last] = value
    else:
        raise ConfigError(f"--set {key}: there is no such place in the world. Name a key as in the file, dots between.")
