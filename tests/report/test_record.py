import json

import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from logpose.formats.events import Notice, Summary
from logpose.formats.maps.landmarks import write_landmarks
from logpose.pipelines.report.record import WriteLogParams, write_log


@pytest.fixture(scope="module")
def events(make):
    rows = []
    for event in make.drive(120):
        if event.source == "truth":
            x, y = event.position[:2]
            for later in (-40_000_000, -10_000_000):
                rows.append(make.odometry(event.stamp + later, x - 30.0 + later * 1e-9, y - 27.0, 0.1))
        rows.append(event)
    end = rows[-1].stamp
    rows.append(make.odometry(end + 20_000_000, 0.0, 0.0, 0.1))
    return [*rows, Notice(stamp=end, source="localize-pf", code="gap", message="a gap", is_loss=True)]


@pytest.fixture(scope="module")
def log(tmp_path_factory, events, landmarks):
    folder = tmp_path_factory.mktemp("log")
    write_landmarks(landmarks, folder / "landmarks.yaml")
    path = folder / "result.mcap"
    params = WriteLogParams(path=str(path), map=str(folder / "landmarks.yaml"), path_poses=50)
    assert list(write_log(iter(events), params)) == events
    return path


def messages(path, topic):
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        chosen = [c for c in reader.connections if c.topic == topic]
        found = reader.messages(chosen) if chosen else []  # rosbags takes an empty list for all topics
        return [(stamp, reader.deserialize(raw, c.msgtype)) for c, stamp, raw in found]


def test_every_estimate_is_a_pose_with_its_covariance(log, events):
    wanted = [e for e in events if e.source == "localize-pf" and hasattr(e, "position")]
    found = messages(log, "/localize-pf/pose")
    assert [stamp for stamp, _ in found] == [e.stamp for e in wanted]
    for (stamp, message), event in zip(found, wanted, strict=True):
        assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == stamp
        assert message.header.frame_id == "map"
        assert message.pose.pose.position.x == event.position[0]
        assert message.pose.covariance.reshape(6, 6) == pytest.approx(event.covariance)


def test_the_frames_multiply_to_the_estimate(log):
    poses = {stamp: message.pose.pose for stamp, message in messages(log, "/localize-pf/pose")}
    found = messages(log, "/tf")
    assert len(found) == len(poses)
    for stamp, message in found:
        outer, inner = message.transforms
        assert (outer.header.frame_id, outer.child_frame_id) == ("map", "odom")
        assert (inner.header.frame_id, inner.child_frame_id) == ("odom", "base_link")
        angle = 2 * np.arctan2(outer.transform.rotation.z, outer.transform.rotation.w)
        x, y = inner.transform.translation.x, inner.transform.translation.y
        c, s = np.cos(angle), np.sin(angle)
        shift = outer.transform.translation
        assert shift.x + c * x - s * y == pytest.approx(poses[stamp].position.x, abs=1e-9)
        assert shift.y + s * x + c * y == pytest.approx(poses[stamp].position.y, abs=1e-9)


def test_a_path_stands_at_the_end_and_is_thinned_evenly(log, events):
    ((stamp, path),) = messages(log, "/localize-pf/path")
    poses = [e for e in events if e.source == "localize-pf" and hasattr(e, "position")]
    assert stamp == poses[-1].stamp
    assert 25 <= len(path.poses) <= 50
    assert path.poses[0].pose.position.x == poses[0].position[0]
    assert path.poses[-1].pose.position.x == poses[-1].position[0]
    stamps = np.array([p.header.stamp.sec * 10**9 + p.header.stamp.nanosec for p in path.poses])
    assert len(set(np.diff(stamps)[:-1])) == 1


def test_circles_have_diameters_and_the_origin_of_foxglove(log, events):
    event = next(e for e in events if e.source == "detect-circles" and len(e.xy))
    annotations = dict(messages(log, "/detect-circles/annotations"))
    circle = annotations[event.stamp].circles[0]
    assert circle.diameter == 2 * event.radius[0]
    assert (circle.position.x, circle.position.y) == (event.uv[0, 0] + 0.5, event.uv[0, 1] + 0.5)
    assert circle.timestamp.sec * 10**9 + circle.timestamp.nanosec == event.stamp
    first = min(e.stamp for e in events if e.source == "detect-circles" and len(e.xy))
    wanted = [e.stamp for e in events if e.source == "detect-circles" and e.stamp >= first]
    assert list(annotations) == wanted  # also empty ones, to clear the circles of the image before


def test_map_notices_sightings_and_summaries_are_in_the_log(log, landmarks, events):
    ((_, scene),) = messages(log, "/landmarks")
    assert len(scene.entities[0].spheres) == len(landmarks)
    ((_, notice),) = messages(log, "/notices")
    assert (notice.message, notice.level) == ("gap: a gap", 4)
    lines = [json.loads(message.data) for _, message in messages(log, "/detect-circles/sightings")]
    wanted = [e for e in events if e.source == "detect-circles"]
    assert [len(line["sightings"]) for line in lines] == [len(e.xy) for e in wanted]
    with log.open("rb") as stream:
        records = {m.name: json.loads(m.metadata["json"]) for m in make_reader(stream).iter_metadata()}
    assert records["logpose.evaluation"]["matched"] == 120


def test_all_channels_have_one_encoding(log):
    with log.open("rb") as stream:
        channels = make_reader(stream).get_summary().channels.values()
    assert {channel.message_encoding for channel in channels} == {"cdr"}  # ros2 bag play refuses a mixture


def test_the_same_run_gives_the_same_bytes(log, events, tmp_path):
    params = WriteLogParams(path=str(tmp_path / "b.mcap"), map=str(log.parent / "landmarks.yaml"), path_poses=50)
    list(write_log(iter(events), params))
    assert (tmp_path / "b.mcap").read_bytes() == log.read_bytes()


def test_a_ros_1_bag_holds_all_but_the_summaries(events, tmp_path):
    list(write_log(iter(events), WriteLogParams(path=str(tmp_path / "a.bag"))))
    assert len(messages(tmp_path / "a.bag", "/localize-pf/pose")) == 120


def test_sightings_without_an_image_have_no_annotations(make, tmp_path):
    from dataclasses import replace

    seen = make.sightings(10, [[1.0, 2.0]])
    seen = replace(seen, uv=np.full((1, 2), np.nan), radius=np.full(1, np.nan))
    list(write_log(iter([seen]), WriteLogParams(path=str(tmp_path / "a.mcap"))))
    assert messages(tmp_path / "a.mcap", "/detect-circles/annotations") == []
    assert len(messages(tmp_path / "a.mcap", "/detect-circles/sightings")) == 1


def test_an_empty_run_is_a_log_without_messages(tmp_path):
    list(write_log(iter([]), WriteLogParams(path=str(tmp_path / "a.mcap"))))
    with (tmp_path / "a.mcap").open("rb") as stream:
        assert make_reader(stream).get_summary().statistics.message_count == 0


def test_numbers_that_do_not_exist_are_null_in_summaries(tmp_path):
    values = {"rmse_m": float("nan"), "n": np.int64(3)}
    list(write_log(iter([Summary(stamp=1, source="x", values=values)]), WriteLogParams(path=str(tmp_path / "a.mcap"))))
    with (tmp_path / "a.mcap").open("rb") as stream:
        (record,) = make_reader(stream).iter_metadata()
    assert json.loads(record.metadata["json"]) == {"n": 3, "rmse_m": None}
