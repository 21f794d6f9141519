import hashlib
import os
import signal
import subprocess
import sys
import textwrap

import numpy as np
import pytest

from logpose.formats.errors import ConfigError, FormatError
from logpose.formats.events import Odometry, Pose, Range, Summary
from logpose.formats.write_log import create_log

START = 1_700_000_000_000_000_000
UNIT = np.array([0.0, 0.0, 0.0, 1.0])


def write(path, events, **options):
    with create_log(path, **options) as writer:
        for event in events:
            writer.write(event)
    return path


@pytest.mark.parametrize(
    ("name", "compression"),
    [("a.mcap", "zstd"), ("a.mcap", "lz4"), ("a.mcap", "none"), ("a.bag", "zstd"), ("a.bag", "bz2"), ("a.bag", "none")],
)
def test_the_same_events_give_the_same_bytes(name, compression, tmp_path, recording):
    digests = set()
    for folder in ("one", "two"):
        path = write(tmp_path / folder / name, recording, compression=compression)
        digests.add(hashlib.sha256(path.read_bytes()).hexdigest())
    assert len(digests) == 1


@pytest.mark.parametrize("name", ["a.mcap", "a.bag"])
def test_an_error_inside_leaves_nothing_or_the_old_file(name, tmp_path, recording):
    path = tmp_path / name

    def fail():
        with create_log(path) as writer:
            writer.write(recording[0])
            raise RuntimeError("stop")

    with pytest.raises(RuntimeError, match="stop"):
        fail()
    assert list(tmp_path.iterdir()) == []
    write(path, recording)
    before = path.read_bytes()
    with pytest.raises(RuntimeError, match="stop"):
        fail()
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", ["a.mcap", "a.bag"])
def test_a_kill_leaves_no_file_under_the_name(name, tmp_path):
    script = f"""
        import os, signal
        from logpose.formats.write_log import create_log
        with create_log({str(tmp_path / name)!r}) as writer:
            for i in range(2000):
                writer.write_message("/a", "std_msgs/msg/String", i, {{"data": "x" * 2000}})
            os.kill(os.getpid(), signal.{"SIGKILL" if os.name == "posix" else "SIGTERM"})
    """
    status = subprocess.run([sys.executable, "-c", textwrap.dedent(script)], check=False).returncode
    assert status == -signal.SIGKILL
    assert not (tmp_path / name).exists()


@pytest.mark.parametrize("name", ["a.mcap", "a.bag"])
def test_rosbags_reads_what_we_write(name, tmp_path, recording):
    from rosbags.highlevel import AnyReader

    path = write(tmp_path / name, recording)
    with AnyReader([path]) as reader:
        assert {t: i.msgcount for t, i in reader.topics.items()} == {
            "/camera/camera_info": 1,
            "/camera/image_raw": 20,
            "/ground_truth/pose": 20,
            "/odom": 40,
            "/tf_static": 1,
        }
        for connection, log_time, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            if connection.topic == "/odom":
                assert log_time == message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
                assert message.twist.twist.angular.z == 0.25


def test_the_mcap_library_verifies_what_we_write(tmp_path, recording, some_sightings):
    from mcap.reader import make_reader

    path = tmp_path / "a.mcap"
    with create_log(path) as writer:
        for event in [*recording, some_sightings]:
            writer.write(event)
        writer.metadata("run", {"seed": "1"})
        writer.attach("map.json", b"{}")
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary.statistics.message_count == len(recording) + 1
        assert all(chunk.message_index_offsets for chunk in summary.chunk_indexes)
        assert [m.metadata for m in reader.iter_metadata()] == [{"seed": "1"}]
        assert [a.data for a in reader.iter_attachments()] == [b"{}"]
        for schema, channel, message in reader.iter_messages():
            assert message.log_time == message.publish_time
            if channel.topic == "/sightings":
                assert (schema.name, channel.message_encoding) == ("std_msgs/msg/String", "cdr")
                assert b'"id": 7' in message.data
            if channel.topic == "/tf_static":
                assert "durability: 1" in channel.metadata["offered_qos_profiles"]


@pytest.mark.parametrize("name", ["a.mcap", "a.bag"])
def test_fields_may_be_given_in_part(name, tmp_path):
    from rosbags.highlevel import AnyReader

    path = tmp_path / name
    with create_log(path) as writer:
        writer.write_message(
            "/path",
            "nav_msgs/msg/Path",
            START,
            {"header": {"frame_id": "map"}, "poses": [{"pose": {"position": {"x": 1.5}}}, {}]},
        )
    with AnyReader([path]) as reader:
        ((connection, _, data),) = list(reader.messages())
        message = reader.deserialize(data, connection.msgtype)
    assert message.header.frame_id == "map"
    assert [p.pose.position.x for p in message.poses] == [1.5, 0.0]


@pytest.mark.parametrize(
    ("kind", "fields", "message"),
    [
        ("nav_msgs/msg/Nothing", {}, "type 'nav_msgs/msg/Nothing' is not known. Check the event."),
        ("std_msgs/msg/String", {"dat": 1}, "std_msgs/msg/String has no field 'dat'. Check the event."),
    ],
)
def test_a_wrong_message_is_one_line(kind, fields, message, tmp_path):
    path = tmp_path / "a.mcap"
    with pytest.raises(FormatError) as error, create_log(path) as writer:
        writer.write_message("/a", kind, START, fields)
    assert str(error.value) == f"{path}: {message}"
    assert not path.exists()


@pytest.mark.parametrize(
    ("name", "stamp", "message"),
    [
        ("a.bag", 2**32 * 10**9, "stamp 4294967296.000000000 s cannot be written by ros1. Check the event."),
        ("a.mcap", 2**31 * 10**9, "stamp 2147483648.000000000 s cannot be written by ros2. Check the event."),
        ("a.mcap", -1, "stamp -1.999999999 s cannot be written by ros2. Check the event."),
    ],
)
def test_a_stamp_that_ros_cannot_hold_is_refused(name, stamp, message, tmp_path):
    event = Pose(stamp=stamp, topic="/p", position=np.zeros(3), orientation=UNIT)
    with pytest.raises(FormatError) as error:
        write(tmp_path / name, [event])
    assert str(error.value) == f"{tmp_path / name}: {message}"


def test_events_without_a_topic_or_message_are_refused(tmp_path):
    event = Range(stamp=0, range=1, min_range=0, max_range=2, field_of_view=1)
    with pytest.raises(FormatError, match="a Range has no topic"):
        write(tmp_path / "a.mcap", [event])
    with pytest.raises(FormatError, match="Summary has no ROS message"):
        write(tmp_path / "a.mcap", [Summary(stamp=0, topic="/s", values={})])


def test_a_bag_takes_no_metadata(tmp_path):
    with pytest.raises(FormatError, match="holds no metadata records"), create_log(tmp_path / "a.bag") as writer:
        writer.metadata("a", {})


@pytest.mark.parametrize(
    ("name", "compression", "message"),
    [
        ("a.txt", "zstd", "a.txt: the suffix says neither MCAP nor ROS 1 bag. Name it .mcap or .bag."),
        ("a.mcap", "bz2", "a.mcap: MCAP knows no bz2. Choose none, lz4 or zstd."),
    ],
)
def test_a_wrong_name_or_compression_is_a_usage_error(name, compression, message):
    with pytest.raises(ConfigError) as error, create_log(name, compression=compression):
        pass
    assert str(error.value) == message


def test_an_empty_log_is_a_log(tmp_path):
    from logpose.formats.survey import survey

    for name in ("a.mcap", "a.bag"):
        path = write(tmp_path / name, [])
        assert survey(path).topics == ()
        assert survey(path).first_ns is None


def test_velocities_alone_stay_velocities_alone(tmp_path):
    from logpose.formats.log import open_log

    path = write(tmp_path / "a.bag", [Odometry(stamp=START, topic="/v", linear=np.ones(3), angular=np.zeros(3))])
    (read,) = open_log(path, {"odometry": "auto"})
    assert read.position is None
    assert read.orientation is None
    np.testing.assert_array_equal(read.linear, np.ones(3))
