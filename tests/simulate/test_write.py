"""The files of a run: complete, repeatable, and read by the project's own readers."""

import numpy as np
import pytest

from logpose.formats.errors import ConfigError
from logpose.formats.log import open_log
from logpose.formats.maps.landmarks import read_landmarks
from logpose.formats.trajectories.tum import read_tum
from logpose.pipelines.simulate.simulate import simulate
from logpose.pipelines.simulate.worlds.ceiling import build_ceiling
from logpose.pipelines.simulate.write import write_simulation


@pytest.mark.parametrize("suffix", [".mcap", ".bag"])
def test_a_run_is_written_twice_with_the_same_bytes(small, tmp_path, suffix):
    world = small(camera__encoding="jpeg", camera__rate_hz=2.0)
    first = write_simulation(world, tmp_path / "a" / f"run{suffix}", 1)
    again = write_simulation(world, tmp_path / "b" / f"run{suffix}", 1)
    names = ["landmarks.yaml", "landmarks.true.yaml", "truth.tum", "waypoints.yaml"]
    assert [p.name for p in first] == [f"run{suffix}", *(f"run.{n}" for n in names)]
    for one, other in zip(first, again, strict=True):
        assert one.read_bytes() == other.read_bytes(), one.name


@pytest.mark.parametrize("suffix", [".mcap", ".bag"])
def test_what_is_written_is_what_was_simulated(small, tmp_path, suffix):
    world = small(camera__rate_hz=2.0)
    log, given, true, truth, waypoints = write_simulation(world, tmp_path / f"run{suffix}", 1)
    topics = {"image": "/ceiling/image_raw", "odometry": "/odom", "truth": "/ground_truth/pose"}
    read = [e for e in open_log([log], topics) if e.source in topics]
    made = [e for e in simulate(world, 1) if e.source in topics]
    assert len(read) == len(made)
    for role in topics:
        a, b = ([e for e in events if e.source == role] for events in (read, made))
        assert [e.stamp for e in a] == [e.stamp for e in b]
        if role == "image":
            assert [e.data.tobytes() for e in a] == [e.data.tobytes() for e in b]
            assert a[0].calibration == b[0].calibration
            np.testing.assert_allclose(a[0].mount.rotation, b[0].mount.rotation, atol=1e-12)
        else:
            np.testing.assert_array_equal([e.position for e in a], [e.position for e in b])
    built = build_ceiling(world.ceiling, world.robot.route)
    np.testing.assert_array_equal(read_landmarks(given).positions, built.surveyed)
    np.testing.assert_array_equal(read_landmarks(true).positions, built.landmarks)
    table = read_tum(truth)
    assert table.frame_id == "map"
    assert table.stamps.tolist() == [e.stamp for e in made if e.source == "truth"]
    assert waypoints.read_text() == (
        "logpose: waypoints/1\nwaypoints:\n  - {name: A, x_m: 1.5, y_m: 1.5}\n  - {name: B, x_m: 3.0, y_m: 1.5}\n"
    )


def test_a_world_that_cannot_be_built_leaves_no_file(small, tmp_path):
    world = small(ceiling__landmarks__count=99, ceiling__landmarks__near_route=99)
    with pytest.raises(ConfigError, match=r"run\.mcap: not simulated, no room for 99 landmarks"):
        write_simulation(world, tmp_path / "run.mcap", 1)
    assert list(tmp_path.iterdir()) == []


def test_a_lens_that_folds_over_is_told_before_a_file_is_made(small, tmp_path):
    world = small(camera__fx_px=80.0, camera__distortion=[-0.6, 0.0, 0.0, 0.0, 0.0])
    with pytest.raises(ConfigError) as caught:
        write_simulation(world, tmp_path / "run.mcap", 1)
    assert str(caught.value) == (
        f"{tmp_path / 'run.mcap'}: not simulated, the lens (-0.6, 0.0, 0.0, 0.0, 0.0) folds over inside the image; "
        "some pixels see nothing. Change the world."
    )
    assert list(tmp_path.iterdir()) == []
