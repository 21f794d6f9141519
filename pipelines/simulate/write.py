"""A simulated run as files: the log, and its maps and truth beside it.

Next to ``run.mcap`` stand ``run.landmarks.yaml`` or ``run.marks.yaml`` (the map the robot is given, with the errors of
its survey), the same with ``.true.yaml``, ``run.truth.tum`` (a pose per image) and, where the robot drives along a
route, ``run.waypoints.yaml``.
"""

from itertools import chain
from pathlib import Path

import numpy as np

from ...formats.beside import beside, write_beside
from ...formats.errors import ConfigError
from ...formats.events import Pose
from ...formats.maps.waypoints import write_waypoints
from ...formats.products import Trajectory
from ...formats.write_log import create_log
from .scene import MAP
from .sensors.truth import TRUE_POSE
from .simulate import events_of
from .worlds.base import World


def write_simulation(world: World, out_path: str | Path, seed: int) -> list[Path]:
    """Simulate one run and write it; the same world and seed give the same bytes.

    Args:
        world: what to simulate.
        out_path: the log; its suffix (``.mcap``, ``.bag``) says which kind.
        seed: of the run.

    Returns:
        The files written, the log first.

    Raises:
        FormatError: a file cannot be written.
        ConfigError: the world cannot be built or driven.
    """
    log = Path(out_path)
    stamps, poses = [], []
    try:
        scene = world.build()
        events = events_of(scene, seed)
        first = next(events)
    except ValueError as err:
        raise ConfigError(f"{log}: not simulated, {err}. Change the world.") from err
    with create_log(log) as writer:
        for event in chain([first], events):
            writer.write(event)
            if isinstance(event, Pose) and event.topic == TRUE_POSE:
                stamps.append(event.stamp)
                poses.append(np.concatenate([event.position, event.orientation]))
    table = np.array(poses)
    truth = Trajectory(
        stamps=np.array(stamps, np.int64), positions=table[:, :3], orientations=table[:, 3:], frame_id=MAP
    )
    files = [log, *write_beside(log, scene.maps, truth)]
    if scene.waypoints:
        files.append(beside(log, ".waypoints.yaml"))
        write_waypoints(scene.waypoints, files[-1])
    return files
