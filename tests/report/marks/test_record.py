"""Stripe marks in the log of a run."""

import json
from dataclasses import replace

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from logpose.formats.events import MarkSighting
from logpose.formats.maps.marks import write_marks
from logpose.formats.mark_poses import mark_pose_line
from logpose.pipelines.report.marks.record import mark_covariance
from logpose.pipelines.report.record import WriteLogParams, write_log

SECOND = 1_000_000_000


@pytest.fixture(scope="module")
def events(make, marked):
    """A drive with odometry, and in one image two marks at once."""
    rows = []
    for event in marked.drive(80, with_images=False):
        if event.source == "truth":
            rows.append(make.odometry(event.stamp, *event.position[:2], 0.3))
        rows.append(event)
    marks, stamp = marked.room().marks, rows[-1].stamp + SECOND
    poses = np.array([[0.3, -0.2, 1.2], [-0.2, 0.3, 1.0]])
    return rows + [marked.sighting(stamp, mark, pose) for mark, pose in zip(marks[:2], poses, strict=True)]


@pytest.fixture(scope="module")
def log(tmp_path_factory, events, marked):
    folder = tmp_path_factory.mktemp("log")
    write_marks(marked.room(), folder / "marks.yaml")
    params = WriteLogParams(path=str(folder / "result.mcap"), marks=str(folder / "marks.yaml"))
    assert list(write_log(iter(events), params)) == events
    return folder / "result.mcap"


def messages(path, topic):
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        chosen = [c for c in reader.connections if c.topic == topic]
        found = reader.messages(chosen) if chosen else []  # rosbags takes an empty list for all topics
        return [(stamp, reader.deserialize(raw, c.msgtype)) for c, stamp, raw in found]


def sightings_of(events):
    return [event for event in events if isinstance(event, MarkSighting)]


def test_every_sighting_is_a_line_of_json(log, events):
    lines = [(stamp, json.loads(message.data)) for stamp, message in messages(log, "/stripe-pose/sightings")]
    assert lines == [(event.stamp, json.loads(mark_pose_line(event))) for event in sightings_of(events)]


def test_the_map_is_a_scene_at_the_start(log, events, marked):
    ((stamp, scene),) = messages(log, "/marks")
    assert stamp == events[0].stamp
    assert [entity.id for entity in scene.entities] == ["mark_1", "mark_2", "mark_3", "mark_4", "mark_7"]
    assert {entity.frame_id for entity in scene.entities} == {"map"}


def test_each_image_has_one_message_with_all_its_edges(log, events, marked):
    found = messages(log, "/stripe-pose/annotations")
    assert [stamp for stamp, _ in found] == sorted({event.stamp for event in sightings_of(events)})
    by_stamp = dict(found)
    first = next(event for event in sightings_of(events) if event.status == "ok")
    edges = by_stamp[first.stamp].points[0]
    assert edges.type == edges.LINE_LIST
    points = np.array([(point.x, point.y) for point in edges.points]).reshape(-1, 2, 2)
    np.testing.assert_allclose(points, first.ends + 0.5)  # Foxglove counts from the corner of the first pixel
    assert len(edges.outline_colors) == len(first.lines)
    assert len({(c.r, c.g, c.b) for c in edges.outline_colors[::2]}) == 1
    assert (edges.outline_colors[0].r, edges.outline_colors[0].b) != (
        edges.outline_colors[1].r,
        edges.outline_colors[1].b,
    )
    assert [text.text.split(":")[0] for text in by_stamp[events[-1].stamp].texts] == ["1", "2"]


def test_an_image_without_marks_clears_the_edges_of_the_one_before(log, events):
    empty = next(event for event in sightings_of(events) if event.status == "no_mark")
    message = dict(messages(log, "/stripe-pose/annotations"))[empty.stamp]
    assert (message.points, message.texts) == ([], [])


def test_each_mark_has_its_pose_before_the_robot(log, events, marked):
    """The robot's pose in the map, times the mark's in the robot's frame, is the mark's in the map."""
    for mark in marked.room().marks[:2]:
        seen = {e.stamp: e for e in sightings_of(events) if e.mark == mark.id and e.status == "ok"}
        found = messages(log, f"/stripe-pose/mark_{mark.id}/pose")
        assert [stamp for stamp, _ in found] == list(seen)
        for stamp, message in found:
            assert message.header.frame_id == "base_link"
            x, y, heading = seen[stamp].robot
            p, q = message.pose.pose.position, message.pose.pose.orientation
            c, s = np.cos(heading), np.sin(heading)
            np.testing.assert_allclose([x + c * p.x - s * p.y, y + s * p.x + c * p.y], mark.pose[:2], atol=1e-9)
            turn = heading + 2 * np.arctan2(q.z, q.w) - mark.pose[2]
            assert np.cos(turn) == pytest.approx(1.0)
    assert messages(log, "/stripe-pose/mark_7/pose") == []


def test_the_covariance_of_a_mark_is_that_of_its_pose_turned_into_the_robots_frame(marked):
    """Against differences: how x, y, yaw in the robot's frame follow from phi, D_x, D_y."""
    mark, robot = marked.room().marks[0], np.array([1.9, 1.2, 0.2])
    event = marked.sighting(1, mark, marked.level_pose(mark, robot))

    def in_robot(pose):
        x, y, heading = marked.robot(mark, pose)
        away = mark.pose[:2] - (x, y)
        c, s = np.cos(heading), np.sin(heading)
        return np.array([c * away[0] + s * away[1], -s * away[0] + c * away[1], mark.pose[2] - heading])

    steps = 1e-6 * np.eye(3)
    jacobian = np.stack([(in_robot(event.pose + d) - in_robot(event.pose - d)) / 2e-6 for d in steps], axis=1)
    found = mark_covariance(event, in_robot(event.pose)[2])
    np.testing.assert_allclose(found[np.ix_([0, 1, 5], [0, 1, 5])], jacobian @ event.cov @ jacobian.T, rtol=1e-6)


def test_a_sighting_that_is_not_used_has_no_pose(tmp_path, marked):
    mark = marked.room().marks[0]
    write_marks(marked.room(), tmp_path / "marks.yaml")
    events = [marked.sighting(i, mark, np.array([0.3, 0.1, 1.2]), s) for i, s in enumerate(["ambiguous", "unverified"])]
    params = WriteLogParams(path=str(tmp_path / "a.mcap"), marks=str(tmp_path / "marks.yaml"))
    list(write_log(iter(events), params))
    assert [stamp for stamp, _ in messages(tmp_path / "a.mcap", "/stripe-pose/mark_1/pose")] == [1]


def test_without_a_map_there_are_edges_and_lines_but_no_poses(tmp_path, marked):
    event = marked.sighting(1, marked.room().marks[0], np.array([0.3, 0.1, 1.2]))
    list(write_log(iter([event]), WriteLogParams(path=str(tmp_path / "a.mcap"))))
    assert len(messages(tmp_path / "a.mcap", "/stripe-pose/sightings")) == 1
    assert len(messages(tmp_path / "a.mcap", "/stripe-pose/annotations")) == 1
    assert messages(tmp_path / "a.mcap", "/stripe-pose/mark_1/pose") == []


def test_log_times_never_go_back(log):
    with AnyReader([log], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        stamps = [stamp for _, stamp, _ in reader.messages()]
    assert stamps == sorted(stamps)


def test_a_ros_1_bag_takes_them_too(events, tmp_path, marked):
    write_marks(marked.room(), tmp_path / "marks.yaml")
    params = WriteLogParams(path=str(tmp_path / "a.bag"), marks=str(tmp_path / "marks.yaml"))
    list(write_log(iter(events), params))
    assert len(messages(tmp_path / "a.bag", "/stripe-pose/sightings")) == len(sightings_of(events))
    assert len(messages(tmp_path / "a.bag", "/marks")) == 1


def test_a_smoothers_poses_stand_in_the_tree_without_odometry(make, marked, tmp_path):
    """They come when the log has ended, and the odometry of their time is gone."""
    events = [make.odometry(i * SECOND // 10, 0.1 * i, 0.0, 0.0) for i in range(30)]
    events += [marked.pose(i * SECOND // 10, (0.1 * i, 1.0, 0.0), "stripe-pose") for i in range(30)]
    list(write_log(iter(events), WriteLogParams(path=str(tmp_path / "a.mcap"))))
    found = messages(tmp_path / "a.mcap", "/tf")
    assert len(found) == 30
    for stamp, message in found:
        (transform,) = message.transforms
        assert (transform.header.frame_id, transform.child_frame_id) == ("map", "base_link")
        assert transform.transform.translation.x == pytest.approx(stamp / SECOND)


def test_sightings_of_two_images_without_an_event_between_them_stay_apart(tmp_path, marked):
    seen = marked.sighting(1, marked.room().marks[0], np.array([0.3, 0.1, 1.2]))
    list(write_log(iter([seen, replace(seen, stamp=2)]), WriteLogParams(path=str(tmp_path / "a.mcap"))))
    assert [stamp for stamp, _ in messages(tmp_path / "a.mcap", "/stripe-pose/annotations")] == [1, 2]
