"""What a user of ``logpose inspect`` types and gets, and that what it says a log suits runs on that log."""

import json

import pytest

from logpose.formats.events import Image, Odometry
from logpose.formats.png import write_png
from logpose.pipelines.catalog import SUITS


@pytest.fixture
def photos(events, tmp_path):
    folder = tmp_path / "photos"
    for image in [event for event in events if isinstance(event, Image)][:3]:
        write_png(folder / f"{image.stamp}.png", image.data.reshape(image.height, image.width))
    return folder


@pytest.fixture
def without_images(rewrite):
    return rewrite(lambda e: None if isinstance(e, Image) else e, "blind.mcap")


def rows(text):
    """topic -> the words of its row."""
    lines = text.split("topic  ")[1].split("\n\n")[0].splitlines()[1:]
    return {words[0]: words[1:] for words in map(str.split, lines)}


def verdicts(text):
    return dict(line.removeprefix("suits ").split(": ", 1) for line in text.splitlines() if line.startswith("suits "))


def test_a_log_is_told_topic_by_topic(logpose, drive):
    done = logpose("inspect", drive)
    assert (done.status, done.err) == (0, "")
    lines = done.out.splitlines()
    assert lines[0] == f"{drive}: {drive.stat().st_size:,} bytes"
    assert lines[1] == "4.2 s, 228 messages"
    found = rows(done.out)
    frame = "ceiling_camera_optical_frame"
    assert found["/ceiling/image_raw"] == [
        "sensor_msgs/msg/Image", "35", "8.0", "0.12", "0.000", frame, "480x360", "mono8"
    ]  # fmt: skip
    assert found["/odom"] == ["nav_msgs/msg/Odometry", "86", "20.0", "0.05", "0.000", "odom"]
    assert found["/tf_static"][:2] == ["tf2_msgs/msg/TFMessage", "1"]
    assert sum(int(words[1]) for words in found.values()) == 228
    assert verdicts(done.out) == dict.fromkeys(SUITS, "yes")


def test_json_holds_the_same(logpose, drive):
    done = logpose("inspect", drive, "--json")
    found = json.loads(done.out)
    assert (done.status, found["schema"]) == (0, "logpose.survey/1")
    result = found["result"]
    topics = {topic["name"]: topic for topic in result["topics"]}
    assert topics.keys() == rows(logpose("inspect", drive).out).keys()
    image = topics["/ceiling/image_raw"]
    assert (image["count"], image["announced"], image["undecodable"]) == (35, 35, 0)
    assert (image["image_size"], image["image_encoding"], image["rate_hz"]) == ([480, 360], "mono8", 8.0)
    assert "image" in image["roles"]
    assert result["last_ns"] - result["first_ns"] == 4_250_000_000
    assert result["suits"] == {name: {"missing": []} for name in SUITS}
    assert result["problems"] == []
    assert len(result["inputs"][0]["blake2b"]) == 64


def test_both_containers_tell_the_same(logpose, drive, rewrite):
    bag = rewrite(lambda e: e, "drive.bag")
    first, second = (rows(logpose("inspect", log).out) for log in (drive, bag))
    assert first == second


def test_a_log_without_images_says_what_is_missing(logpose, without_images):
    done = logpose("inspect", without_images)
    assert done.status == 0
    assert "/ceiling/image_raw" not in rows(done.out)
    verdict = verdicts(done.out)
    assert verdict["detect-circles"] == "no: nothing for image"
    # The simulator's log holds true sightings; they are the truth, and no estimator is to take them unasked.
    result = json.loads(logpose("inspect", without_images, "--json").out)["result"]
    assert result["suits"]["detect-circles"] == {"missing": ["image"]}


def test_a_log_without_odometry_suits_what_needs_images_alone(logpose, rewrite):
    log = rewrite(lambda e: None if isinstance(e, Odometry) else e)
    verdict = verdicts(logpose("inspect", log).out)
    assert verdict == {"detect-circles": "yes", "localize-pf": "no: nothing for odometry", "stripe-pose": "yes"}


def test_images_alone_suit_what_needs_images_alone(logpose, photos):
    done = logpose("inspect", photos)
    assert done.status == 0
    assert done.out.splitlines()[3] == "0.2 s, 3 messages"
    assert rows(done.out)["/image"][:4] == ["image", "file", "3", "8.0"]
    assert verdicts(done.out) == {
        "detect-circles": "yes", "localize-pf": "no: nothing for odometry", "stripe-pose": "yes"
    }  # fmt: skip


@pytest.mark.parametrize("kind", ["drive", "photos", "without_images"])
def test_every_command_a_log_suits_runs_and_the_others_end_with_one_line(logpose, request, landmarks, kind, tmp_path):
    log = request.getfixturevalue(kind)
    suits = json.loads(logpose("inspect", log, "--json").out)["result"]["suits"]
    camera = tmp_path / "camera.yaml"
    if kind == "photos":
        from logpose.formats.calibration import Calibration, write_calibration

        write_calibration(Calibration(480, 360, 480.0, 480.0, 239.5, 179.5), camera)
    marks = tmp_path / "marks.yaml"
    marks.write_text("logpose: marks/1\nmarks: [{id: 1, lines_m: [0, 0.1, 0.3], x_m: 0, y_m: 0, heading_rad: 0}]\n")
    for name, verdict in suits.items():
        where = ["--marks", marks, "--tilt", 0] if name == "stripe-pose" else ["--map", landmarks]
        words = [*where, "-q", "-o", "-", *(["--camera", camera] if kind == "photos" else [])]
        done = logpose(name, log, *words)
        if verdict["missing"]:
            assert done.status == 2, (name, done)
            assert len([line for line in done.err.splitlines() if "the size of the lamps" not in line]) == 1
            assert done.out == ""
        elif name == "stripe-pose":  # it runs, and sees that no such mark hangs there
            assert done.status == 2, done.err
            assert "no_mark" in done.err.splitlines()[-1]
            assert len(done.out.splitlines()) >= 3
        else:
            assert done.status == 0, (name, done.err)
            assert len(done.out.splitlines()) >= 3


def test_several_logs_are_surveyed_together(logpose, drive, photos):
    done = logpose("inspect", drive, photos)
    assert done.status == 0
    assert {"/image", "/odom"} <= rows(done.out).keys()


def test_a_log_that_is_cut_ends_with_3_and_says_why(logpose, drive, tmp_path):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(drive.read_bytes()[: drive.stat().st_size // 2])
    done = logpose("inspect", cut)
    assert done.status == 3, done.out
    assert f"{cut}: the file is cut off at byte " in done.out
    assert json.loads(logpose("inspect", cut, "--json").out)["result"]["has_loss"] is True


@pytest.mark.parametrize(
    ("content", "line"),
    [
        (None, "{}: no such file or folder. Check the path.\n"),
        (b"", None),
        (b"hello, this is no log\n", None),
    ],
)
def test_what_is_no_log_is_one_line(logpose, tmp_path, content, line):
    path = tmp_path / "thing.mcap"
    if content is not None:
        path.write_bytes(content)
    done = logpose("inspect", path)
    assert (done.status, done.out) == (1, "")
    assert done.err.count("\n") == 1
    assert done.err == line.format(path) if line else done.err.startswith(f"{path}: ")


def test_no_log_is_a_usage_error(logpose):
    done = logpose("inspect")
    assert (done.status, done.err) == (2, "logpose inspect: missing argument 'LOG...'. See logpose inspect --help.\n")
