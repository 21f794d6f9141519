from dataclasses import replace

import numpy as np
import pytest

from logpose.formats.errors import ConfigError, FormatError
from logpose.formats.events import CameraInfo, Image, Imu, JointState, Odometry, Pose, Range, Transform
from logpose.formats.log import open_log
from logpose.formats.window import Bound, Window
from logpose.formats.write_log import create_log

S = 1_000_000_000
START = 1_700_000_000 * S
ROLES = {"image": "auto", "odometry": "auto", "truth": "auto", "camera_info": "auto"}
UNIT = np.array([0.0, 0.0, 0.0, 1.0])


def drive(stamps, topic="/odom", x=0.0):
    return [
        Odometry(
            stamp=s,
            topic=topic,
            frame_id="odom",
            position=np.array([x, 0, 0]),
            orientation=UNIT,
            linear=np.zeros(3),
            angular=np.zeros(3),
        )
        for s in stamps
    ]


def write(path, events, log_times=None):
    with create_log(path) as writer:
        for event, log_time in zip(events, log_times or [e.stamp for e in events], strict=True):
            if log_time == event.stamp:
                writer.write(event)
            else:
                from logpose.formats.encode import as_message

                kind, fields = as_message(event)
                writer.write_message(event.topic, kind, log_time, fields)
    return path


def test_every_container_gives_every_event_in_time_order(any_log, recording):
    log = open_log([any_log], ROLES)
    read = list(log)
    expected = [e for e in recording if not isinstance(e, Transform)]
    assert [e.stamp for e in read] == [e.stamp for e in expected]
    assert [e.topic for e in read] == [e.topic for e in expected]
    assert not log.has_loss, (log.counts, log.problems)
    assert {n: (c.announced, c.read, c.dropped, dict(c.why)) for n, c in log.counts.items()} == {
        "/camera/camera_info": (1, 1, 0, {}),
        "/camera/image_raw": (20, 20, 0, {}),
        "/ground_truth/pose": (20, 20, 0, {}),
        "/odom": (40, 40, 0, {}),
        "/tf_static": (1, 1, 0, {}),
    }


def test_every_container_gives_the_content_of_every_event(any_log, recording):
    for event, original in zip(
        open_log([any_log], ROLES), (e for e in recording if not isinstance(e, Transform)), strict=True
    ):
        assert event.frame_id == original.frame_id
        match original:
            case Image():
                assert event.source == "image"
                assert bytes(event.data) == bytes(original.data)
                assert (event.width, event.height, event.step, event.encoding) == (8, 6, 8, "mono8")
                assert event.calibration.fx == 10.0
                assert event.calibration.distortion == (0.1, 0.0, 0.0, 0.0, 0.0)
                np.testing.assert_array_equal(event.mount.translation, [0.1, 0.2, 0.3])
            case CameraInfo():
                assert event.calibration == original.calibration
            case Odometry():
                assert event.child_frame_id == "base_link"
                np.testing.assert_array_equal(event.position, original.position)
                np.testing.assert_array_equal(event.angular, original.angular)
            case Pose():
                assert event.source == "truth"
                np.testing.assert_array_equal(event.position, original.position)
                np.testing.assert_array_equal(event.orientation, original.orientation)


def test_a_log_can_be_read_twice(any_log):
    log = open_log([any_log], ROLES)
    assert [e.stamp for e in log] == [e.stamp for e in log]
    assert log.counts["/odom"].read == 40


def test_images_do_not_keep_the_file_in_memory_and_are_read_only(any_log):
    image = next(e for e in open_log([any_log], {"image": "auto"}) if isinstance(e, Image))
    assert image.data.base is None
    with pytest.raises(ValueError, match="read-only"):
        image.data[0] = 1


def test_only_the_roles_that_were_asked_for_come_out(any_log):
    assert {e.source for e in open_log([any_log], {"image": "auto"})} == {"image"}


def test_a_role_that_the_log_cannot_fill_yields_nothing(tmp_path):
    path = write(tmp_path / "a.mcap", drive([1, 2]))
    log = open_log([path], {"odometry": "auto", "image": "auto", "truth": "auto", "imu": "auto"})
    assert log.chosen == {"odometry": "/odom"}
    assert [e.source for e in log] == ["odometry", "odometry"]


def test_one_topic_plays_two_roles(tmp_path):
    log = open_log([write(tmp_path / "a.bag", drive([5]))], {"odometry": "/odom", "truth": "/odom"})
    assert [type(e) for e in log] == [Odometry, Pose]
    assert log.counts["/odom"].read == 1


def test_header_stamps_are_put_in_order_within_the_look_ahead(tmp_path):
    stamps = [START + k * S // 10 for k in range(30)]
    shuffled = stamps[:]
    for i in range(0, 30, 5):  # up to 0.4 s late
        shuffled[i : i + 5] = reversed(stamps[i : i + 5])
    path = write(tmp_path / "a.mcap", drive(shuffled), stamps)
    log = open_log([path], {"odometry": "/odom"})
    assert [e.stamp for e in log] == stamps
    assert not log.has_loss


def test_a_stamp_that_goes_back_further_is_dropped_and_counted(tmp_path):
    stamps = [START + k * S // 2 for k in range(20)]
    log_times = stamps[:]
    stamps[10] -= 3 * S
    log = open_log([write(tmp_path / "a.mcap", drive(stamps), log_times)], {"odometry": "/odom"})
    assert len(list(log)) == 19
    count = log.counts["/odom"]
    assert (count.announced, count.read, count.dropped) == (20, 19, 1)
    assert count.why == {"stamp goes back by more than 1 s": 1}
    assert log.has_loss


def test_one_wild_stamp_in_the_future_loses_nothing(tmp_path):
    log_times = [START + k * S // 2 for k in range(20)]
    stamps = log_times[:]
    stamps[3] += 10_000 * S
    log = open_log([write(tmp_path / "a.mcap", drive(stamps), log_times)], {"odometry": "/odom"})
    assert [e.stamp for e in log] == sorted(stamps)
    assert not log.has_loss


def test_log_time_is_used_on_request_and_for_header_stamps_of_zero(tmp_path):
    path = write(tmp_path / "a.mcap", drive([0, 7]), [START, START + 1])
    assert [e.stamp for e in open_log([path], {"odometry": "/odom"}, stamp="log")] == [START, START + 1]
    log = open_log([path], {"odometry": "/odom"}, stamp="header")
    assert [e.stamp for e in log] == [7, START]
    assert log.counts["/odom"].why == {"no header stamp, log time used": 1}
    assert not log.has_loss


@pytest.mark.parametrize("kind", ["bag-none", "mcap-none", "mcap-unchunked", "ros2-sqlite", "mcap-lz4"])
def test_equal_stamps_keep_the_order_of_the_file(kind, log_of, tmp_path):
    events = [e for i in range(60) for e in drive([START + (i // 30) * S], f"/odom{i % 3}", float(i))]
    path = log_of(kind, tmp_path, events)
    log = open_log([path], {"odometry": "/odom0", "truth": "/odom1", "pose": "/odom2"})
    assert [e.position[0] for e in log] == list(range(60))


def test_several_inputs_merge_by_time_then_by_their_order(tmp_path):
    first = write(tmp_path / "b.mcap", drive([10, 30], x=1.0))
    second = write(tmp_path / "a.bag", drive([10, 20, 40], x=2.0))
    log = open_log([first, second], {"odometry": "auto"})
    assert [(e.stamp, e.position[0]) for e in log] == [(10, 1), (10, 2), (20, 2), (30, 1), (40, 2)]
    assert log.counts["/odom"].announced == 5
    assert [f.path for f in log.inputs] == [str(first), str(second)]


def test_recordings_of_one_time_that_were_logged_years_apart_meet(tmp_path):
    stamps = [START + k * S for k in range(10)]
    sensors = write(tmp_path / "a.mcap", drive(stamps))
    truth = write(tmp_path / "b.mcap", drive(stamps, "/gt"), [s + 10**8 * S for s in stamps])
    log = open_log([sensors, truth], {"odometry": "/odom", "truth": "/gt"})
    assert [(e.stamp, e.source) for e in log] == [(s, r) for s in stamps for r in ("odometry", "truth")]
    assert not log.has_loss


def test_a_window_is_half_open_and_relative_to_the_first_stamp(tmp_path):
    path = write(tmp_path / "a.mcap", drive([START + k * S for k in range(10)]))
    log = open_log([path], {"odometry": "/odom"}, window=Window(Bound(2 * S), Bound(5 * S)))
    assert [(e.stamp - START) // S for e in log] == [2, 3, 4]
    count = log.counts["/odom"]
    assert (count.announced, count.read, count.outside, count.dropped) == (10, 3, 7, 0)
    assert not log.has_loss


def test_a_window_of_stamps_is_absolute(tmp_path):
    path = write(tmp_path / "a.bag", drive([START + k * S for k in range(10)]))
    window = Window(Bound(START + 8 * S, is_relative=False), None)
    assert [(e.stamp - START) // S for e in open_log([path], {"odometry": "/odom"}, window=window)] == [8, 9]


def test_calibration_and_mount_are_known_however_the_window_lies(any_log):
    window = Window(Bound(S), None)
    images = list(open_log([any_log], {"image": "auto"}, window=window))
    assert len(images) == 10
    assert all(image.calibration.fx == 10.0 and image.mount is not None for image in images)


def test_an_image_before_the_first_camera_info_has_its_calibration(tmp_path, recording):
    info, image = recording[1], recording[2]
    path = write(tmp_path / "a.mcap", [image, replace(info, stamp=image.stamp + 5 * S)])
    assert next(iter(open_log([path], {"image": "auto"}))).calibration == info.calibration


def test_the_latest_camera_info_holds(tmp_path, recording):
    info, image = recording[1], recording[2]
    other = replace(info, stamp=info.stamp + 2 * S, calibration=replace(info.calibration, fx=99.0))
    events = [info, image, other, replace(image, stamp=image.stamp + 3 * S)]
    images = list(open_log([write(tmp_path / "a.mcap", events)], {"image": "auto"}))
    assert [i.calibration.fx for i in images] == [10.0, 99.0]


def test_ranges_get_their_mount(tmp_path, recording):
    event = Range(
        stamp=START, topic="/sonar", frame_id="/camera", range=1.5, min_range=0.1, max_range=5.0, field_of_view=0.4
    )
    path = write(tmp_path / "a.bag", [recording[0], event])
    (read,) = open_log([path], {"range": "auto"})
    assert (read.range, read.frame_id) == (1.5, "camera")
    np.testing.assert_array_equal(read.mount.translation, [0.1, 0.2, 0.3])


@pytest.mark.parametrize("name", ["a.mcap", "a.bag"])
def test_inertial_sensors_get_their_mount(tmp_path, recording, name):
    event = Imu(stamp=START, topic="/imu", frame_id="camera", angular=np.zeros(3), acceleration=np.ones(3))
    path = write(tmp_path / name, [recording[0], event, replace(event, stamp=START + 1, frame_id="elsewhere")])
    on_robot, lost = open_log([path], {"imu": "auto"})
    np.testing.assert_array_equal(on_robot.mount.translation, [0.1, 0.2, 0.3])
    assert lost.mount is None


@pytest.mark.parametrize("name", ["a.mcap", "a.bag"])
def test_joints_come_back_from_both_containers(tmp_path, name):
    event = JointState(
        stamp=START, topic="/joint_states", frame_id="head", names=("pan", "tilt"), positions=np.array([0.1, -0.2])
    )
    (read,) = open_log([write(tmp_path / name, [event])], {"joints": "auto"})
    assert (read.stamp, read.source, read.frame_id, read.names) == (START, "joints", "head", ("pan", "tilt"))
    np.testing.assert_array_equal(read.positions, [0.1, -0.2])


def test_sightings_come_back_from_both_containers(tmp_path, some_sightings):
    for name in ("a.mcap", "a.bag"):
        path = write(tmp_path / name, [some_sightings])
        (read,) = open_log([path], {"sightings": "auto"})
        assert (read.stamp, read.source, read.topic) == (some_sightings.stamp, "sightings", "/sightings")
        for field in ("xy", "cov", "uv", "radius", "score", "ids"):
            np.testing.assert_array_equal(getattr(read, field), getattr(some_sightings, field))


def test_true_sightings_never_pass_for_sightings(tmp_path, some_sightings):
    path = write(tmp_path / "a.mcap", [replace(some_sightings, topic="/ground_truth/sightings")])
    assert open_log([path], {"sightings": "auto"}).chosen == {}
    assert open_log([path], {"true_sightings": "auto"}).chosen == {"true_sightings": "/ground_truth/sightings"}


def test_messages_that_say_nothing_usable_are_counted_and_skipped(tmp_path, recording):
    bad = replace(recording[4], orientation=np.zeros(4))
    log = open_log([write(tmp_path / "a.mcap", [bad, recording[8]])], {"truth": "auto"})
    assert len(list(log)) == 1
    assert log.counts["/ground_truth/pose"].why == {"a quaternion is all zeros, no rotation": 1}
    assert log.has_loss


@pytest.mark.parametrize("field", ["position", "orientation", "linear"])
def test_odometry_that_is_no_number_is_lost_wherever_it_is(tmp_path, field):
    bad, *good = drive([START, START + 1, START + 2])
    value = np.array([0.0, 0.0, np.nan, 1.0])[: len(getattr(bad, field))]
    log = open_log([write(tmp_path / "a.mcap", [replace(bad, **{field: value}), *good])], {"odometry": "auto"})
    assert len(list(log)) == 2
    assert log.counts["/odom"].why == {"a value is not a finite number": 1}
    assert log.has_loss


def test_messages_that_cannot_be_decoded_are_counted_and_skipped(tmp_path, some_sightings):
    from logpose.formats.topics import STRING

    path = tmp_path / "a.mcap"
    with create_log(path) as writer:
        writer.write(some_sightings)
        writer.write_message(some_sightings.topic, STRING, START + 1, {"data": "{"})
    log = open_log([path], {"sightings": "/sightings"})
    assert len(list(log)) == 1
    (why,) = log.counts["/sightings"].why
    assert why.startswith("cannot be decoded (Expecting property name")


def test_a_camera_that_is_not_calibrated_gives_no_calibration_and_says_so(tmp_path, recording):
    info, image = recording[1], recording[2]
    blank = replace(info, calibration=replace(info.calibration, fx=0.0, fy=0.0))
    log = open_log([write(tmp_path / "a.mcap", [blank, image])], {"image": "auto"})
    assert [i.calibration for i in log] == [None]
    assert log.counts["/camera/camera_info"].why == {"the camera is not calibrated (focal length 0)": 1}


def test_a_missing_file_says_so(tmp_path):
    with pytest.raises(FormatError) as error:
        open_log(["x.mcap"], {"image": "auto"})
    assert str(error.value) == "x.mcap: no such file or folder. Check the path."


def test_an_unknown_topic_lists_those_of_the_type(tmp_path):
    path = write(tmp_path / "a.mcap", [*drive([1], "/b"), *drive([2], "/a")])
    with pytest.raises(ConfigError) as error:
        open_log([path], {"odometry": "/x"})
    assert str(error.value) == f"{path}: no topic '/x' of type Odometry. Topics of this type: /a, /b."


def test_a_topic_of_another_type_lists_those_of_the_type(tmp_path):
    path = write(tmp_path / "a.mcap", drive([1]))
    with pytest.raises(ConfigError) as error:
        open_log([path], {"image": "/odom"})
    assert str(error.value) == f"{path}: no topic '/odom' of type Image. Topics of this type: none."


def test_an_ambiguous_topic_says_how_to_choose(tmp_path):
    path = write(tmp_path / "a.mcap", [*drive([1], "/b"), *drive([2], "/a")])
    with pytest.raises(ConfigError) as error:
        open_log([path], {"odometry": "auto"})
    assert str(error.value) == (
        f"{path}: several topics of type Odometry: /a, /b. Choose one with --topic odometry=/a."
    )


def test_an_empty_window_says_what_the_log_holds(tmp_path):
    path = write(tmp_path / "a.mcap", drive([START, START + S]))
    with pytest.raises(ConfigError) as error:
        list(open_log([path], {"odometry": "auto"}, window=Window(Bound(100 * S), None)))
    assert str(error.value) == (
        f"{path}: no message in the window 100.000000000 s to the end. "
        f"The log has stamps {START} ns to {START + S} ns. Change the window."
    )
