"""The stage: events in, events out, and every complaint word for word."""

import re

import numpy as np
import pytest

from logpose.formats.calibration import Calibration, write_calibration
from logpose.formats.errors import ConfigError, FormatError
from logpose.formats.events import Image, Imu, JointState, MarkSighting, Mount, Notice, Odometry, Summary
from logpose.formats.maps.marks import write_marks
from logpose.formats.products import MarkMap, StripeMark
from logpose.pipelines.stripe_pose.params import StripePoseParams
from logpose.pipelines.stripe_pose.stage import stripe_pose

from .conftest import mark_of, picture

CAMERA = Calibration(640, 480, 600.0, 600.0, 319.5, 239.5)
AHEAD = Mount(translation=np.array([0.2, 0.0, 0.5]), rotation=np.array([-0.5, 0.5, -0.5, 0.5]))
POSE = np.array([0.3, 0.05, 0.9])


def image_of(pixels, stamp=10**9, calibration=CAMERA, mount=AHEAD, topic="/camera/image_raw"):
    return Image(
        stamp=stamp, source="image", topic=topic, encoding="mono8", data=pixels.ravel(), width=pixels.shape[1],
        height=pixels.shape[0], step=pixels.shape[1], calibration=calibration, mount=mount,
    )  # fmt: skip


@pytest.fixture(scope="module")
def picture_of_mark():
    return picture(mark_of(), POSE)


@pytest.fixture
def marks(tmp_path):
    path = tmp_path / "marks.yaml"
    write_marks(MarkMap(marks=(mark_of(id=7, pose=(10.0, 5.0, -np.pi / 2)),)), path)
    return str(path)


def run(events, marks, **params):
    return list(stripe_pose(iter(events), StripePoseParams(marks=marks, **params)))


def sightings(out):
    return [event for event in out if isinstance(event, MarkSighting)]


def notices(out):
    return {event.code: event.message for event in out if isinstance(event, Notice)}


def test_an_image_becomes_a_sighting_with_the_robot_s_pose(marks, picture_of_mark):
    (seen,) = sightings(run([image_of(picture_of_mark)], marks))
    assert (seen.mark, seen.status, seen.stamp, seen.frame_id, seen.source) == (7, "ok", 10**9, "map", "stripe-pose")
    assert seen.pose == pytest.approx(POSE, abs=2e-3)
    # By hand: theta = psi - phi + 90 deg; the lens behind the mark by D, the robot 0.2 m behind the lens.
    theta = -np.pi / 2 - 0.3 + np.pi / 2
    a = -np.pi / 2 - 0.3
    lens = np.array([10.0, 5.0]) - np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) @ POSE[1:]
    assert seen.robot == pytest.approx([*(lens - 0.2 * np.array([np.cos(theta), np.sin(theta)])), theta], abs=3e-3)
    assert np.all(np.linalg.eigvalsh(seen.robot_cov) > 0)
    assert len(seen.lines) == len(seen.members) == 8


def test_everything_is_forwarded_in_its_order_and_sightings_follow_their_image(marks, picture_of_mark):
    events = [Odometry(stamp=1), image_of(picture_of_mark, 2), Odometry(stamp=2), image_of(picture_of_mark, 3)]
    out = run(events, marks)
    assert [e for e in out if not isinstance(e, MarkSighting | Notice | Summary)] == events
    assert [type(e).__name__ for e in out[1:3]] == ["Image", "MarkSighting"]
    assert [e.stamp for e in out] == sorted(e.stamp for e in out)


def test_an_image_without_a_mark_says_so_and_the_end_sums_up(marks, picture_of_mark):
    empty = np.full((480, 640), 100, np.uint8)
    out = run([image_of(empty, 1), image_of(picture_of_mark, 2)], marks)
    assert [(s.mark, s.status) for s in sightings(out)] == [(-1, "no_mark"), (7, "ok")]
    assert np.all(np.isnan(sightings(out)[0].pose))
    (summary,) = (e for e in out if isinstance(e, Summary))
    assert summary.values == {"images": 2, "sightings": {"no_mark": 1, "ok": 1}, "marks": {"7": 1}}
    assert "no-mark" not in notices(out)


def test_a_log_without_any_mark_is_an_error(marks):
    with pytest.raises(ConfigError, match=re.escape(
        f"{marks}: no_mark: none of its marks was recognised in the image. Name the marks that hang there; --check-marks "
        "tells what they need to be read."
    )):  # fmt: skip
        run([image_of(np.full((480, 640), 100, np.uint8))], marks)


def test_a_log_of_mirrored_marks_is_warned_of(marks, picture_of_mark):
    out = run([image_of(np.ascontiguousarray(picture_of_mark[:, ::-1]))], marks)
    assert notices(out)["no-mark"] == (
        f"no mark of {marks} is sure in the image: 1 mirrored_or_back. Those are seen in a mirror, or the image is "
        "flipped or upside down."
    )
    (seen,) = sightings(out)
    assert seen.members.tolist() == list(range(8))[::-1]


def test_no_images_are_an_error(marks):
    with pytest.raises(ConfigError, match=re.escape(
        "stripe-pose: there are no images in this log, or in this part of it. Name their topic with --topic image=/NAME."
    )):  # fmt: skip
        run([Odometry(stamp=1)], marks)


def test_no_calibration_is_an_error(marks, picture_of_mark):
    with pytest.raises(ConfigError, match=re.escape(
        "stripe-pose: there is no calibration for the images on /camera/image_raw (no CameraInfo in the log, or one with "
        "focal length 0: the camera is not calibrated). Pass one with --camera FILE, or --fx PX."
    )):  # fmt: skip
        run([image_of(picture_of_mark, calibration=None)], marks)


def test_an_image_of_another_size_is_an_error(marks, picture_of_mark):
    with pytest.raises(ConfigError, match=re.escape(
        "stripe-pose: the images on /camera/image_raw are 640x480 px, their calibration is for 320x240 px. Give the "
        "calibration of this camera and image size with --camera FILE."
    )):  # fmt: skip
        run([image_of(picture_of_mark, calibration=Calibration(320, 240, 300.0, 300.0, 159.5, 119.5))], marks)


def test_a_mark_that_is_not_in_the_map_is_an_error(marks, picture_of_mark):
    with pytest.raises(ConfigError, match=re.escape(
        f"{marks}: has no mark 9. It has 7; name one of them with --mark."
    )):  # fmt: skip
        run([image_of(picture_of_mark)], marks, mark=9)


def test_a_camera_that_looks_at_the_floor_is_an_error(marks, picture_of_mark):
    down = Mount(translation=np.zeros(3), rotation=np.array([1.0, 0.0, 0.0, 0.0]))
    with pytest.raises(ConfigError, match=r"beyond 45 deg it sees no upright marks\. Correct the mount"):
        run([image_of(picture_of_mark, mount=down)], marks)


def test_the_paper_needs_marks_of_four_lines(tmp_path, picture_of_mark):
    path = tmp_path / "three.yaml"
    three = StripeMark(id=1, lines=np.array([-0.06, 0.0, 0.06]), bars=None, pose=np.zeros(3))
    write_marks(MarkMap(marks=(three,)), path)
    with pytest.raises(ConfigError, match=re.escape(
        f"{path}: no mark has four lines, by whose cross ratio the paper tells marks. Use --method best, or marks of "
        "four lines."
    )):  # fmt: skip
        run([image_of(picture_of_mark)], str(path), method="paper")


def test_a_damaged_image_is_a_loss_and_the_others_are_not(marks, picture_of_mark):
    broken = Image(stamp=1, source="image", topic="/c", encoding="jpeg", data=np.zeros(9, np.uint8), calibration=CAMERA)
    out = run([broken, image_of(picture_of_mark, 2)], marks)
    assert [s.stamp for s in sightings(out)] == [2]
    (notice,) = (e for e in out if isinstance(e, Notice))
    assert notice.is_loss
    assert notice.code == "damaged-image"


def test_a_row_of_black_and_white_is_warned_of_once(marks):
    image = picture(mark_of(), POSE, black=-100, white=400, wall=300)
    out = run([image_of(image, 1), image_of(image, 2)], marks)
    assert sum(isinstance(e, Notice) and e.code == "saturated" for e in out) == 1
    assert "of the middle row of an image on /camera/image_raw are black or white" in notices(out)["saturated"]


@pytest.mark.parametrize("levelling", ["given", "best"])
def test_a_camera_that_is_not_level_and_says_nothing_is_warned_of(marks, levelling):
    out = run([image_of(picture(mark_of(), POSE, roll=0.06), mount=None)], marks, levelling=levelling)
    what = "taken as given" if levelling == "given" else "not known, and found from the lines alone"
    assert notices(out)["not-level"] == (
        "the lines of a mark lean by up to 6.0 % against those of a level camera, whose tilt and roll are "
        f"{what}. Pass --tilt DEG and --roll DEG, or log them (imu, joints, tf_static)."
    )


def test_a_level_camera_is_not_warned_of(marks, picture_of_mark):
    assert "not-level" not in notices(run([image_of(picture_of_mark, mount=None)], marks))


def test_tilt_comes_from_options_joints_and_the_inertial_unit(marks):
    image = picture(mark_of(), POSE, tilt=0.1)
    joints = JointState(stamp=1, topic="/joint_states", names=("pan", "tilt"), positions=np.array([0.4, 0.1]))
    nose_up = np.array([0.0, np.sin(-0.05), 0.0, np.cos(-0.05)])
    imu = Imu(stamp=1, angular=np.zeros(3), acceleration=np.zeros(3), orientation=nose_up)
    exact = {"levelling": "given"}
    by_option = run([image_of(image, 2)], marks, tilt_deg=np.degrees(0.1), roll_deg=0.0, **exact)
    by_joint = run([joints, image_of(image, 2)], marks, tilt_joint="tilt", pan_joint="pan", **exact)
    by_imu = run([imu, image_of(image, 2)], marks, **exact)
    for out in (by_option, by_joint, by_imu):
        assert sightings(out)[0].attitude == pytest.approx([0.1, 0.0], abs=1e-9)
        assert sightings(out)[0].pose == pytest.approx(POSE, abs=2e-3)
    # A head that is panned to the left by 0.4 has the robot turned to the right of what it would be.
    turn = sightings(by_joint)[0].robot[2] - sightings(by_option)[0].robot[2]
    assert turn == pytest.approx(-0.4, abs=1e-9)


def test_an_old_attitude_is_not_used(marks, picture_of_mark):
    joints = JointState(stamp=1, topic="/joint_states", names=("tilt",), positions=np.array([0.3]))
    (seen,) = sightings(run([joints, image_of(picture_of_mark, 10**9)], marks, tilt_joint="tilt", levelling="given"))
    assert seen.attitude == pytest.approx([0.0, 0.0], abs=1e-12)


@pytest.mark.parametrize(("joint", "is_lost", "what"), [
    ("pan_joint", True, "it tells where the camera is, and not where the robot is"),
    ("tilt_joint", False, "its tilt is found by the lines alone"),
])  # fmt: skip
def test_where_a_head_is_turned_nobody_knows_while_its_joints_are_silent(marks, picture_of_mark, joint, is_lost, what):
    joints = JointState(stamp=1, topic="/joint_states", names=("head",), positions=np.array([0.0]))
    images = [image_of(picture_of_mark, 2), image_of(picture_of_mark, 10**9)]
    out = run([joints, *images], marks, **{joint: "head"})
    fresh, late = sightings(out)
    assert np.all(np.isfinite(fresh.robot))
    assert (late.status, np.all(np.isfinite(late.pose)), np.all(np.isnan(late.robot))) == ("ok", True, is_lost)
    assert fresh.attitude[0] == pytest.approx(late.attitude[0], abs=0.01)
    assert notices(out)["joints-silent"] == (
        f"no joint states came within 0.5 s before an image on /camera/image_raw, and maybe others; {what}."
    )


def test_a_log_without_joint_states_tells_no_joint(marks, picture_of_mark):
    with pytest.raises(ConfigError, match=re.escape(
        "stripe-pose: there are no joint states in this log that tell of 'head'. Name their topic with --topic "
        "joints=/NAME, or leave the joint out."
    )):  # fmt: skip
        run([image_of(picture_of_mark)], marks, pan_joint="head")


def test_a_pan_joint_measures_no_tilt(marks, picture_of_mark):
    joints = JointState(stamp=1, topic="/joint_states", names=("head",), positions=np.array([0.0]))
    panned, plain = (run([joints, image_of(picture_of_mark, 2)], marks, **p) for p in ({"pan_joint": "head"}, {}))
    assert sightings(panned)[0].cov == pytest.approx(sightings(plain)[0].cov)


def test_a_tilt_that_nobody_stated_is_no_leaning_robot(marks):
    """The lens of a robot that leans by 0.2 rad would be 0.1 m ahead of where it stands."""
    image = image_of(picture(mark_of(), POSE, tilt=0.2), mount=None)
    mount = {"mount_x_m": 0.2, "mount_y_m": 0.0, "mount_z_m": 0.5}
    (level,) = sightings(run([image_of(picture(mark_of(), POSE))], marks))
    for how in ({"levelling": "lines"}, {"tilt_sd_deg": 20.0}):
        (seen,) = sightings(run([image], marks, **mount, **how))
        assert seen.attitude[0] == pytest.approx(0.2, abs=0.02)
        assert seen.robot[:2] == pytest.approx(level.robot[:2], abs=5e-3)


def test_the_paper_finds_no_tilt_by_lines(marks, picture_of_mark):
    for how in ({"method": "paper"}, {"tilt_model": "paper"}):
        with pytest.raises(ConfigError, match=re.escape(
            "stripe-pose: levelling: lines finds tilt and roll, which the paper takes as given. Leave it out, or use "
            "method: best with tilt_model: camera."
        )):  # fmt: skip
            run([image_of(picture_of_mark)], marks, levelling="lines", **how)


def test_nothing_but_damaged_images_is_an_error(marks, picture_of_mark):
    image = image_of(picture_of_mark)
    broken = Image(
        stamp=1, source="image", topic="/camera/image_raw", encoding="png", data=image.data[:100], calibration=CAMERA
    )
    with pytest.raises(FormatError, match=re.escape(
        "stripe-pose: all images of this log are damaged (1). Record them again."
    )):  # fmt: skip
        run([broken], marks)


def test_a_joint_that_is_not_there_is_an_error(marks, picture_of_mark):
    joints = JointState(stamp=1, topic="/joint_states", names=("pan", "lift"), positions=np.zeros(2))
    with pytest.raises(ConfigError, match=re.escape(
        "stripe-pose: /joint_states has no joint 'tilt'. It has pan, lift."
    )):  # fmt: skip
        run([joints, image_of(picture_of_mark, 2)], marks, tilt_joint="tilt")


def test_a_calibration_file_wins_over_the_log(marks, tmp_path, picture_of_mark):
    path = tmp_path / "camera.yaml"
    write_calibration(Calibration(640, 480, 1200.0, 1200.0, 319.5, 239.5), path)
    (seen,) = sightings(run([image_of(picture_of_mark)], marks, camera=str(path)))
    assert seen.pose[2] > 1.5  # twice the focal length, about twice the distance


def test_a_focal_length_is_camera_enough(marks, picture_of_mark):
    (seen,) = sightings(run([image_of(picture_of_mark, calibration=None)], marks, fx_px=600.0))
    assert seen.pose == pytest.approx(POSE, abs=2e-3)
    with pytest.raises(ConfigError, match="camera and fx_px both say what the camera is"):
        run([image_of(picture_of_mark)], marks, fx_px=600.0, camera="camera.yaml")


def test_the_mount_can_be_given(marks, picture_of_mark):
    (logged,) = sightings(run([image_of(picture_of_mark)], marks))
    (given,) = sightings(run([image_of(picture_of_mark, mount=None)], marks, mount_x_m=0.2, mount_y_m=0.0, pan_deg=0.0))
    assert given.robot == pytest.approx(logged.robot, abs=1e-4)
