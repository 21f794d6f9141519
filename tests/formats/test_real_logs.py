"""Recordings of others: every message that rosbags 0.11.9 counts is found, and what it refuses is read or refused in one line."""

from pathlib import Path

import numpy as np
import pytest

from logpose.formats.errors import FormatError
from logpose.formats.events import Image, Odometry, Pose
from logpose.formats.images import grey
from logpose.formats.log import open_log
from logpose.formats.survey import survey


def expectations(recordings: Path) -> dict[str, int | None]:
    """Return path -> number of messages, None where rosbags refuses the file."""
    found: dict[str, int | None] = {}
    for line in (recordings / "bag_fixtures/READERS_RESULT_rosbags_0.11.9.txt").read_text().splitlines():
        words = line.split()
        if words[:1] == ["OK"] and (recordings / words[1]).exists():
            found[words[1]] = int(words[3])
        elif words[:1] == ["ERR"] and (recordings / words[1]).exists():
            found[words[1]] = None
    return found


def test_every_fixture_gives_every_message(recordings):
    expected = expectations(recordings)
    assert len(expected) > 30
    wrong = {}
    for name, count in expected.items():
        try:
            found = survey([recordings / name])
        except FormatError as err:
            if count is not None or "\n" in str(err):
                wrong[name] = str(err)
            continue
        read = sum(topic.count for topic in found.topics)
        announced = sum(topic.announced or 0 for topic in found.topics)
        if read != announced or (count is not None and read != count):
            wrong[name] = f"{read} read, {announced} announced, {count} expected"
    assert wrong == {}


@pytest.mark.parametrize(
    ("name", "count"),
    [
        # No definitions in the file; the counts are those of metadata.yaml.
        ("bag_fixtures/plotjuggler/rosbag2_test", 4695),
        ("bag_fixtures/rosbag2/rosbag2_py/test/resources/sqlite3/wbag", 6074),
        ("bag_fixtures/rosbag2/ros2bag/test/resources/empty_bag", 0),
    ],
)
def test_databases_without_definitions_open(recordings, name, count):
    found = survey([recordings / name])
    assert sum(topic.count for topic in found.topics) == count
    assert sum(topic.undecodable for topic in found.topics) == 0


def test_an_empty_file_and_a_text_are_refused(recordings):
    with pytest.raises(FormatError, match="the file is empty"):
        survey([recordings / "bag_fixtures/rosbagjs/empty-file.bag"])
    with pytest.raises(FormatError, match="is not a log, it starts with"):
        survey([recordings / "bag_fixtures/rosbagjs/asci-file.txt"])


def test_chunks_out_of_order_are_read_in_order(recordings):
    found = survey([recordings / "bag_fixtures/rosbagjs/example-unsorted-chunks.bag"])
    (topic,) = found.topics
    assert topic.count == 3
    assert topic.first_log_ns < topic.last_log_ns


def test_a_turtlebot_is_read_by_header_stamps(recordings):
    log = open_log([recordings / "evo/nav2_turtlebot.mcap"], {"odometry": "auto", "pose": "/amcl_pose"})
    events = list(log)
    assert sum(isinstance(e, Odometry) for e in events) == 2639
    assert sum(isinstance(e, Pose) for e in events) == 135
    assert [e.stamp for e in events] == sorted(e.stamp for e in events)
    assert not log.has_loss


def test_a_husky_is_read(recordings):
    log = open_log([recordings / "bag_fixtures/robot_localization/test1.bag"], {"odometry": "auto", "imu": "auto"})
    events = list(log)
    assert {n: c.read for n, c in log.counts.items()} == {"/husky_velocity_controller/odom": 3952, "/imu/data": 11865}
    assert all(np.isfinite(e.linear).all() for e in events if isinstance(e, Odometry))
    assert not log.has_loss


def test_poses_without_leading_slashes_are_found(recordings):
    log = open_log([recordings / "evo/ROS_example.bag"], {"truth": "groundtruth", "pose": "/S-PTAM"})
    events = list(log)
    assert sum(e.source == "truth" for e in events) == 12765
    assert sum(e.source == "pose" for e in events) == 5439


def test_a_compressed_image_is_decoded_with_its_calibration(recordings):
    (image,) = open_log([recordings / "bag_fixtures/fiducials/aruco_images.bag"], {"image": "auto"})
    assert isinstance(image, Image)
    pixels = grey(image)
    assert pixels.shape == (image.calibration.height, image.calibration.width)
    assert pixels.std() > 20
