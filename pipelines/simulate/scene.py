"""A world as built, and one run through it.

A world builds a scene: how the robot moves, and the sensors that write into the log. A sensor is a function of a run,
with its parameters bound: it yields its messages in time order and knows no other sensor. Whatever stands in the log is
said by one of them, also the truth. A motion is where ``base_link`` is at any time.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol, TypeAlias

import numpy as np

from ...formats.events import Array, Event
from ...formats.maps.waypoints import Waypoint
from ...formats.products import LandmarkMap, MarkMap
from .pose import View

MAP, ODOM, BASE = "map", "odom", "base_link"


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


Sensor: TypeAlias = Callable[[Run], Iterator[Event]]
"""What a sensor says during a run, in time order."""


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A world as built.

    Attributes:
        start_ns: stamp of the first moment of a run [ns].
        motion: how the robot moves in the run of a seed.
        sensors: who writes into the log; messages of one stamp come in this order.
        maps: the maps that are written beside the log, by the end of the file's name (``.landmarks.yaml``).
        waypoints: of the route, if there is one.
    """

    start_ns: int
    motion: Callable[[int], Motion]
    sensors: Sequence[Sensor]
    maps: Mapping[str, LandmarkMap | MarkMap]
    waypoints: Sequence[Waypoint] = ()
