"""A simulated run as files: the log, and its maps and truth beside it.

Next to ``run.mcap`` stand ``run.landmarks.yaml`` (the map the robot is given, with the errors of its survey),
``run.landmarks.true.yaml``, ``run.truth.tum`` (a pose per image) and ``run.waypoints.yaml``.
"""

from itertools import chain
from pathlib import Path

import numpy as np

from ...formats.errors import ConfigError
from ...formats.events import Pose
from ...formats.landmarks import write_landmarks
from ...formats.products import Trajectory
from ...formats.tum import write_tum
from ...formats.waypoints import Waypoint, write_waypoints
from ...formats.write_log import create_log
from .simulate import MAP, TRUE_POSE, maps_of, simulate
from .world import World


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
        surveyed, true = maps_of(world)
        events = simulate(world, seed)
        first = next(events)
    except ValueError as err:
        raise ConfigError(f"{log}: not simulated, {err}. Change the world.") from err
    with create_log(log) as writer:
        for event in chain([first], events):
            writer.write(event)
            if isinstance(event, Pose) and event.topic == TRUE_POSE:
                stamps.append(event.stamp)
                poses.append(np.concatenate([event.position, event.orientation]))
    beside = [log.with_name(log.stem + end) for end in (".landmarks.yaml", ".landmarks.true.yaml", ".truth.tum")]
    write_landmarks(surveyed, beside[0])
    write_landmarks(true, beside[1])
    table = np.array(poses)
    write_tum(
        Trajectory(stamps=np.array(stamps, np.int64), positions=table[:, :3], orientations=table[:, 3:], frame_id=MAP),
        beside[2],
    )
    waypoints = log.with_name(log.stem + ".waypoints.yaml")
    write_waypoints([Waypoint(w.name, w.x_m, w.y_m) for w in world.robot.waypoints], waypoints)
    return [log, *beside, waypoints]
