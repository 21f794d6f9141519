"""What a user of ``logpose simulate`` types and gets."""

import json

import numpy as np
import pytest
import yaml

from logpose.formats.events import Image
from logpose.formats.images import grey
from logpose.formats.log import open_log
from logpose.formats.maps.landmarks import read_landmarks
from logpose.formats.trajectories.trajectory import read_trajectory

BESIDE = ["drive.landmarks.true.yaml", "drive.landmarks.yaml", "drive.mcap", "drive.truth.tum", "drive.waypoints.yaml"]


@pytest.fixture
def place(root, tmp_path, monkeypatch):
    """A folder to work in, with a world of one second: a short way in the sample room."""
    world = yaml.safe_load((root / "sample_logs" / "ceiling.world.yaml").read_text())
    world["robot"]["waypoints"] = [{"name": "A", "x_m": 2.0, "y_m": 1.8}, {"name": "B", "x_m": 2.2, "y_m": 1.8}]
    world["robot"]["is_closed"] = False
    world["ceiling"]["landmarks"]["near_route"] = 2
    world["camera"] |= {"rate_hz": 4.0, "width_px": 240, "height_px": 180, "fx_px": 240.0, "fy_px": 240.0}
    world["sensor"]["blur_samples"] = 1
    (tmp_path / "world.yaml").write_text(yaml.safe_dump(world, sort_keys=False))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def images(log):
    return [event for event in open_log([log], {"image": "auto"}) if isinstance(event, Image)]


def test_a_log_its_maps_and_its_truth_stand_side_by_side(logpose, place):
    done = logpose("simulate", "world.yaml", "-o", "logs/drive.mcap")
    assert (done.status, done.err) == (0, "")
    assert sorted(done.out.split()) == [f"logs/{name}" for name in BESIDE], "stdout names the files"
    assert done.out.split()[0] == "logs/drive.mcap"
    assert sorted(p.name for p in (place / "logs").iterdir()) == BESIDE
    given, true = (read_landmarks(place / "logs" / f"drive.landmarks{end}.yaml") for end in ("", ".true"))
    off = np.linalg.norm(given.positions - true.positions, axis=1)
    assert 0 < off.max() < 6 * 0.005, "the map that is given has the errors of its survey, survey_sd_m 5 mm"
    truth = read_trajectory(place / "logs" / "drive.truth.tum")
    assert [image.stamp for image in images("logs/drive.mcap")] == truth.stamps.tolist()
    assert truth.positions[[0, -1], :2] == pytest.approx(np.array([[2.0, 1.8], [2.2, 1.8]]), abs=0.05)
    # The topic of the log holds floats and the file nine decimals.
    logged = read_trajectory("logs/drive.mcap:/ground_truth/pose")
    assert logged.positions == pytest.approx(truth.positions, abs=1e-9)


def test_a_seed_gives_the_same_bytes_and_another_seed_others(logpose, place):
    for name, seed in (("a", 0), ("b", 0), ("c", 1)):
        assert logpose("simulate", "world.yaml", "-o", f"{name}/drive.mcap", "--seed", seed, "-q").status == 0
    for name in BESIDE:
        assert (place / "a" / name).read_bytes() == (place / "b" / name).read_bytes(), name
    assert (place / "a" / "drive.mcap").read_bytes() != (place / "c" / "drive.mcap").read_bytes()


def test_no_seed_means_seed_0_and_quiet_says_nothing(logpose, place):
    first = logpose("simulate", "world.yaml", "-o", "a/drive.mcap", "-q")
    logpose("simulate", "world.yaml", "-o", "b/drive.mcap", "--seed", 0)
    assert (first.status, first.out, first.err) == (0, "", "")
    assert (place / "a" / "drive.mcap").read_bytes() == (place / "b" / "drive.mcap").read_bytes()


def test_set_changes_one_value_and_the_suffix_the_container(logpose, place):
    done = logpose("simulate", "world.yaml", "-o", "drive.bag", "--set", "camera.encoding=mono8", "-q")
    assert done.status == 0
    assert (place / "drive.bag").read_bytes().startswith(b"#ROSBAG V2.0")
    logpose("simulate", "world.yaml", "-o", "drive.mcap", "--set", "camera.encoding=mono8", "--set", "camera.rate_hz=8")
    assert (place / "drive.mcap").read_bytes().startswith(b"\x89MCAP0")
    bag, mcap = images("drive.bag"), images("drive.mcap")
    assert {(i.encoding, i.width, i.height) for i in bag + mcap} == {("mono8", 240, 180)}
    assert len(mcap) in (2 * len(bag) - 1, 2 * len(bag)), "8 Hz instead of 4"
    assert np.array_equal(grey(bag[0]), images("drive.bag")[0].data.reshape(180, 240))


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (
            ["--set", "odometry.scale=1.02"],
            "--set odometry.scale: unknown key 'odometry.scale'. Known keys: gyro_bias_degps, rate_hz, speed_scale_pct, "
            "speed_sd_mps, topic, turn_scale_pct, turn_sd_radps.\n",
        ),
        (
            ["--set", "odometry.rate_hz=0"],
            "--set odometry.rate_hz: odometry.rate_hz: 0 should be greater than 0 (readings per second [Hz]). "
            "Correct it.\n",
        ),
        (["--set", "odometry.rate_hz"], "--set odometry.rate_hz: no value. Write KEY=VALUE.\n"),
        (["--set", "odometry.rate_hz=[1"], "--set odometry.rate_hz=[1: the value is not YAML. Quote it.\n"),
        (["-o", "drive.txt"], "drive.txt: the suffix says neither MCAP nor ROS 1 bag. Name it .mcap or .bag.\n"),
    ],
)
def test_a_wrong_word_is_one_line_and_writes_nothing(logpose, place, words, line):
    done = logpose("simulate", "world.yaml", *([] if "-o" in words else ["-o", "drive.mcap"]), *words)
    assert (done.status, done.out, done.err) == (2, "", line)
    assert [p.name for p in place.iterdir()] == ["world.yaml"]


def test_a_wrong_key_in_the_world_is_named_with_its_line(logpose, place):
    text = (place / "world.yaml").read_text().splitlines()
    number = next(i for i, line in enumerate(text) if "cruise_mps" in line)
    text[number] = text[number].replace("cruise_mps", "cruise_kmh")
    (place / "world.yaml").write_text("\n".join(text))
    done = logpose("simulate", "world.yaml", "-o", "drive.mcap")
    assert done.status == 2
    assert done.err == f"world.yaml:{number + 1}: unknown key 'robot.cruise_kmh'. Did you mean 'cruise_mps'?\n"


def test_a_world_that_is_not_there(logpose, place):
    done = logpose("simulate", "nowhere.yaml", "-o", "drive.mcap")
    assert (done.status, done.err) == (1, "nowhere.yaml: no such file. Check the path.\n")


def test_a_log_must_be_named(logpose, place):
    done = logpose("simulate", "world.yaml")
    assert done.status == 2
    assert done.err == "logpose simulate: missing option '-o' / '--output'. See logpose simulate --help.\n"


def test_json_names_the_files(logpose, place):
    done = logpose("simulate", "world.yaml", "-o", "drive.mcap", "--json")
    assert sorted(json.loads(done.out)["result"]["files"]) == BESIDE
