"""Let a robot move through a world and yield the messages of its log, with the truth beside them.

Topics: ``/tf_static`` and the start pose first, then in time order what the sensors say and, at each image, the
calibration, the true pose, what else the kind of world knows of the image, and the image itself. Everything random
comes from the run's seed, a stream of its own for each cause, so that another camera leaves the odometry as it was; the
building comes from the world's own seed.
"""

import heapq
from collections.abc import Iterator

from ...formats.events import Event
from .scene import Run, Scene
from .worlds.base import World


def simulate(world: World, seed: int) -> Iterator[Event]:
    """Yield the messages of one run in time order; the same world and seed give the same messages.

    Raises:
        ValueError: the world cannot be built or driven (no room for the landmarks, a lens that folds over).
    """
    yield from events_of(world.build(), seed)


def events_of(scene: Scene, seed: int) -> Iterator[Event]:
    """Yield the messages of one run in a scene that is built."""
    run = Run(scene.motion(seed), scene.start_ns, seed)
    # Asks each sensor for its first message before it gives one, so what cannot be simulated is found before the log.
    yield from heapq.merge(*(sensor(run) for sensor in scene.sensors), key=lambda event: event.stamp)
