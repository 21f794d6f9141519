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
from typing import Literal, Self, TypeAlias

from pydantic import ValidationError, model_validator

from ...formats.errors import ConfigError, FormatError
from ...formats.text import read_text
from ...formats.yaml_file import YamlMapping, parse_yaml
from ..engine.params import Field, Params
from .camera import CameraParams
from .ceiling import CeilingParams
from .explain import explain, line_of
from .odometry import OdometryParams
from .robot import RobotParams
from .sensor import SensorParams

SCHEMA = "world/1"
START_NS = 1_451_606_400_000_000_000


class InitialPoseParams(Params):
    """What the robot is told of its start; the error is drawn with these standard deviations."""

    topic: str = Field("/initialpose", description="topic of the start pose")
    position_sd_m: float = Field(0.05, ge=0, description="error in x and in y [m]")
    heading_sd_deg: float = Field(2.0, ge=0, description="error of the heading [deg]")


class AbstractParams(Params):
    """Sightings without images: for Monte-Carlo tests of filters only, never for a result that is called measured."""

    topic: str = Field("/sightings", description="topic of the sightings")
    pixel_sd_px: float = Field(1.0, ge=0, description="error of a centre in u and in v [px]")
    detection_probability: float = Field(0.95, ge=0, le=1, description="that a landmark wholly in view is seen [1]")
    false_per_image: float = Field(0.0, ge=0, description="mean number of false sightings, anywhere in the image [1]")


class WorldParts(Params):
    """What every world has."""

    logpose: Literal["world/1"] = Field(description="schema of the file")
    start_stamp_ns: int = Field(START_NS, gt=0, description="stamp of the first message [ns]")
    robot: RobotParams = Field(description="the route and how it is driven")
    odometry: OdometryParams = Field(OdometryParams(), description="wheel odometry")
    initial_pose: InitialPoseParams = Field(InitialPoseParams(), description="the start pose in the log")


class CeilingWorld(WorldParts):
    """A hall with landmarks on its ceiling, and a robot with a camera that looks up."""

    kind: Literal["ceiling"] = Field(description="what there is to see")
    ceiling: CeilingParams = Field(description="the building")
    camera: CameraParams = Field(CameraParams(), description="lens, place and topics of the camera")
    sensor: SensorParams = Field(SensorParams(), description="the imager behind the lens")
    images: bool = Field(True, description="render images; otherwise abstract sightings, for Monte-Carlo tests only")
    sightings: AbstractParams = Field(AbstractParams(), description="used where images is false")

    @model_validator(mode="after")
    def _lens_is_below_ceiling(self) -> Self:
        if self.ceiling.height_m - self.camera.mount.z_m < 0.1:
            raise ValueError(
                f"ceiling.height_m is {self.ceiling.height_m}, the lens is at {self.camera.mount.z_m} m. "
                "The ceiling must be at least 0.1 m above the lens."
            )
        return self


World: TypeAlias = CeilingWorld
KINDS: dict[str, type[CeilingWorld]] = {"ceiling": CeilingWorld}


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
    if kind not in KINDS:
        where = f"{name}:{document.lines.get('kind', 1)}"
        raise ConfigError(f"{where}: there is no kind of world {kind!r}. Write 'kind: {' or '.join(KINDS)}'.")
    model = KINDS[str(kind)]
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
