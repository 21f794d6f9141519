"""What a kind of world gives of its own, so that the loop in ``simulate`` stands once.

A scene is what there is to see, what the log says of each image beside its pixels, the sensors only this kind has, and
the maps that are written beside the log. A motion is where ``base_link`` is at any time.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol, TypeAlias

import numpy as np

from ...formats.events import Array, Event
from ...formats.products import LandmarkMap, MarkMap
from .pose import View
from .renderer import Patch

MAP, ODOM, BASE = "map", "odom", "base_link"

Maps: TypeAlias = Mapping[str, LandmarkMap | MarkMap]
"""Map by the end of its file's name (``.landmarks.yaml``)."""


class Cause(IntEnum):
    """What is random in a run: each has a stream of its own."""

    DRIVE = 1
    ODOMETRY = 2
    GAIN = 3
    NOISE = 4
    START = 5
    ABSTRACT = 6
    IMU = 7
    HEAD = 8
    PHASE = 9


def stream_of(seed: int, cause: Cause, *more: int) -> np.random.Generator:
    """Return the random numbers of a cause in the run of a seed."""
    return np.random.default_rng([seed, int(cause), *more])


class Motion(Protocol):
    """Where the robot truly is."""

    @property
    def duration(self) -> float:
        """Length of the run [s]."""

    def at(self, time: float) -> tuple[Array, float, Array]:
        """Return pose (3,) in the plane, distance driven [m] and tilt (2,) [rad] at a time [s] after the start."""

    def view(self, time: float) -> View:
        """Return map_T_base at a time [s], tilt included."""


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """One drive through a scene.

    Attributes:
        motion: where the robot truly is.
        start_ns: stamp of its first moment [ns].
        seed: everything random follows from it.
    """

    motion: Motion
    start_ns: int
    seed: int

    def stream(self, cause: Cause, *more: int) -> np.random.Generator:
        """Return the random numbers of a cause."""
        return stream_of(self.seed, cause, *more)

    def ticks(self, rate_hz: float) -> range:
        """Return the times after the start [ns] at which something happens so often, from the start to the end."""
        return range(0, int(self.motion.duration * 1e9) + 1, round(1e9 / rate_hz))


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """The instant of one image.

    Attributes:
        index: of the image.
        stamp: of the image [ns].
        pose: (3,) true pose of the robot in the plane [m, m, rad].
        map_t_base: likewise in space, tilt included.
        seed: of the run.
    """

    index: int
    stamp: int
    pose: Array
    map_t_base: View
    seed: int


class Scene(Protocol):
    """What a kind of world gives of its own."""

    @property
    def patches(self) -> Sequence[Patch]:
        """What there is to see; none where no images are rendered."""

    @property
    def maps(self) -> Maps:
        """The maps to write beside the log."""

    def motion(self, seed: int) -> Motion:
        """Return how the robot moves in the run of a seed."""

    def eye(self, time: float) -> View:
        """Return base_T_camera at a time [s]."""

    def of_image(self, moment: Moment) -> Iterator[Event]:
        """Yield what the log says of an image beside its pixels and the true pose."""

    def sensors(self, run: Run) -> Sequence[Iterator[Event]]:
        """Return the readings of further sensors, one stream in time order for each."""
