"""Runs the command line in process and gives back status, stdout and stderr."""

from dataclasses import dataclass

import pytest

from logpose.cli.main import call


@dataclass
class Done:
    status: int
    out: str
    err: str


@pytest.fixture
def logpose(capsys):
    def run(*words):
        status = call([str(word) for word in words])
        captured = capsys.readouterr()
        return Done(status, captured.out, captured.err)

    return run


TINY = [
    ("robot.waypoints", [{"name": "A", "x_m": 2.0, "y_m": 1.8}, {"name": "B", "x_m": 3.2, "y_m": 1.8}]),
    ("robot.is_closed", False),
    ("camera.encoding", "mono8"),
    ("sensor.blur_samples", 1),
    ("ceiling.landmarks.near_route", 4),
]


@pytest.fixture(scope="session")
def world(root):
    """The sample room, with a short drive along one wall."""
    from logpose.pipelines.simulate.world import read_world

    return read_world(root / "sample_logs" / "ceiling.world.yaml", TINY)


@pytest.fixture(scope="session")
def drive(world, tmp_path_factory):
    """A log of some seconds; its map and truth lie beside it."""
    from logpose.pipelines.simulate.write import write_simulation

    path = tmp_path_factory.mktemp("drive") / "drive.mcap"
    write_simulation(world, path, 1)
    return path


@pytest.fixture(scope="session")
def landmarks(drive):
    return drive.with_suffix(".landmarks.yaml")


@pytest.fixture(scope="session")
def events(world):
    """What the simulator wrote into the drive."""
    from logpose.pipelines.simulate.simulate import simulate

    return list(simulate(world, 1))


@pytest.fixture
def rewrite(events, tmp_path):
    """Write the drive anew with each event changed: a function of an event to an event, or None to leave it out."""
    from logpose.formats.write_log import create_log

    def write(change, name="changed.mcap"):
        path = tmp_path / name
        with create_log(path) as writer:
            for made in map(change, events):
                if made is not None:
                    writer.write(made)
        return path

    return write
