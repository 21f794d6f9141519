"""What a user of ``logpose stripe-pose`` types and gets: poses along logs and images."""

import json
import math

import cv2
import numpy as np
import pytest
import yaml

from logpose.cli.main import call
from logpose.formats.calibration import Calibration, write_calibration
from logpose.formats.events import CameraInfo, Image, JointState
from logpose.formats.maps.marks import write_marks
from logpose.formats.mark_poses import read_mark_poses
from logpose.formats.png import write_png
from logpose.formats.products import MarkMap, StripeMark
from logpose.formats.write_log import create_log

CAMERA = Calibration(640, 480, 800.0, 800.0, 319.5, 239.5)


def mark(identity, lines_mm, bar_mm=20.0, height=0.15):
    lines = np.array(lines_mm) / 1000
    return StripeMark(
        id=identity, lines=lines, bars=np.full(len(lines), bar_mm / 1000), pose=np.zeros(3), height=height
    )


# ---- a run ----------------------------------------------------------------------------------------------------

# phi [deg], D_x, D_y [m] of mark 2, and in the last image none.
POSES = [(20.0, 0.1, 1.5), (-35.0, 0.0, 0.9), (0.0, -0.2, 1.2), None]
STAMPS = [1_700_000_000_000_000_000 + 1_000_000_000 * i for i in range(4)]


def photo(pose, hung):
    """What a level camera with a soft lens sees: the share of each pixel that bars cover, on the mark's plane."""
    if pose is None:
        return np.full((CAMERA.height, CAMERA.width), 40, np.uint8)
    phi, dx, dy = math.radians(pose[0]), pose[1], pose[2]
    u = (np.arange(CAMERA.width + 1) - 0.5 - CAMERA.cx) / CAMERA.fx
    X = (u * dy - dx) / (math.cos(phi) - u * math.sin(phi))  # where the borders of the columns meet the plane
    bars = [np.clip(X, left, left + width) for left, width in zip(hung.lines, hung.bars, strict=True)]
    covered = sum(np.diff(bar) for bar in bars) / np.diff(X)
    half = CAMERA.fy * 0.5 * hung.height / (math.sin(phi) * X[1:] + dy)  # rows from the middle to the end of a bar
    rows = np.clip(half - np.abs(np.arange(CAMERA.height) - CAMERA.cy)[:, None] + 0.5, 0.0, 1.0)
    bright = cv2.GaussianBlur(rows * covered, (0, 0), 1.0)
    noise = np.random.default_rng(0).normal(0.0, 1.0, bright.shape)
    return np.clip(40 + 180 * bright + noise, 0, 255).round().astype(np.uint8)


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A map of two marks, a camera and photos named by their stamps."""
    folder = tmp_path_factory.mktemp("scene")
    one, two = mark(1, [-60, 0, 40, 120]), mark(2, [-60, 20, 80, 120])
    hung = StripeMark(id=2, lines=two.lines, bars=two.bars, pose=np.array([10.0, 5.0, math.radians(-60)]), height=0.15)
    write_marks(MarkMap(marks=(one, hung)), folder / "marks.yaml")
    write_calibration(CAMERA, folder / "camera.yaml")
    for i, pose in enumerate(POSES):
        write_png(folder / "photos" / f"{STAMPS[i]}.png", photo(pose, hung))
    return folder


@pytest.fixture
def find(logpose, scene):
    """Run over the photos, or over what is named instead."""

    def run(*words, source=None):
        where = ("--marks", scene / "marks.yaml", "--camera", scene / "camera.yaml")
        return logpose("stripe-pose", source or scene / "photos", *where, "-q", *words)

    return run


def lines_of(text):
    header, *lines = map(json.loads, text.splitlines())
    assert header == {"logpose": "mark-poses/1"}
    return lines


def test_photos_give_a_pose_each_on_standard_output_and_one_line_where_there_is_none(find, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = find("-o", "-", "--tilt", "0", "--roll", "0")
    assert (done.status, done.err) == (0, "")
    lines = lines_of(done.out)
    assert [line["stamp_ns"] for line in lines] == STAMPS
    assert [(line["mark"], line["status"]) for line in lines] == [(2, "ok")] * 3 + [(None, "no_mark")]
    for line, (phi, dx, dy) in zip(lines[:3], POSES[:3], strict=True):
        # Five times the bound at 1.5 m for 0.05 px in each of eighty rows: 0.05 deg, 0.1 and 0.6 mm.
        assert math.degrees(line["phi_rad"]) == pytest.approx(phi, abs=0.25)
        assert line["dx_m"] == pytest.approx(dx, abs=0.5e-3)
        assert line["dy_m"] == pytest.approx(dy, abs=3e-3)
    assert lines[3]["phi_rad"] is lines[3]["robot"] is lines[3]["cov"] is None
    assert list(tmp_path.iterdir()) == [], "-o - leaves nothing behind"


def test_the_robot_is_where_mark_and_mount_say(find):
    # The mark hangs at (10, 5), -60 deg; the lens is 0.25, 0.03 m from base_link and looks 15 deg to the left.
    done = find("-o", "-", "--mount", "0.25,0.03,1.1", "--pan", "15", "--tilt", "0", "--roll", "0")
    robot = lines_of(done.out)[0]["robot"]
    assert robot["x_m"] == pytest.approx(8.253760205910, abs=0.01)
    assert robot["y_m"] == pytest.approx(4.829911603545, abs=0.01)
    assert math.degrees(robot["heading_rad"]) == pytest.approx(-5.0, abs=0.25)


@pytest.fixture(scope="module")
def ran(scene, tmp_path_factory):
    """A run folder."""
    out = tmp_path_factory.mktemp("run") / "out"
    marks, camera = str(scene / "marks.yaml"), str(scene / "camera.yaml")
    words = ["--marks", marks, "--camera", camera, "-q", "-o", str(out), "--overlays", "pictures"]
    assert call(["stripe-pose", str(scene / "photos"), "--json", *words]) == 0
    return out


def test_the_run_folder_holds_everything(ran):
    assert sorted(p.name for p in ran.iterdir()) == [
        "pictures", "poses.jsonl", "report.html", "report.json", "result.mcap", "run.yaml", "trajectory.csv",
        "trajectory.tum",
    ]  # fmt: skip
    lines = lines_of((ran / "poses.jsonl").read_text())
    result = json.loads((ran / "report.json").read_text())["result"]
    assert result["poses"] == [{k: v for k, v in line.items() if k != "edges"} for line in lines]
    assert [s.mark for s in read_mark_poses(ran / "poses.jsonl")] == [2, 2, 2, -1]
    assert sorted(p.name for p in (ran / "pictures").iterdir()) == [f"{stamp}.png" for stamp in STAMPS]
    drawn = cv2.imread(str(ran / "pictures" / f"{STAMPS[0]}.png"))
    assert np.ptp(drawn.astype(int), axis=2).max() > 100, "no colour on the mark"


def test_a_run_can_be_repeated_from_its_folder_and_json_prints_its_report(ran, logpose, scene, tmp_path):
    again = tmp_path / "again"
    done = logpose("run", ran / "run.yaml", scene / "photos", "-o", again, "-q", "--json")
    assert json.loads(done.out) == json.loads((again / "report.json").read_text())
    for name in ("poses.jsonl", "trajectory.tum", "trajectory.csv"):
        assert (ran / name).read_bytes() == (again / name).read_bytes()


def test_a_log_with_its_own_calibration_gives_what_photos_give(find, logpose, scene, tmp_path):
    log = tmp_path / "drive.mcap"
    with create_log(log) as writer:
        writer.write(CameraInfo(stamp=STAMPS[0], topic="/front/camera_info", frame_id="camera", calibration=CAMERA))
        for stamp in STAMPS:
            pixels = cv2.imread(str(scene / "photos" / f"{stamp}.png"), cv2.IMREAD_GRAYSCALE)
            writer.write(
                Image(
                    stamp=stamp, topic="/front/image_raw", frame_id="camera", encoding="mono8",
                    data=pixels.ravel(), width=CAMERA.width, height=CAMERA.height, step=CAMERA.width,
                )
            )  # fmt: skip
    by_log = lines_of(logpose("stripe-pose", log, "--marks", scene / "marks.yaml", "-q", "-o", "-").out)
    by_photo = lines_of(find("-o", "-").out)
    for a, b in zip(by_log, by_photo, strict=True):
        assert a["stamp_ns"] == b["stamp_ns"]
        assert a["mark"] == b["mark"]
        assert [a[key] for key in ("phi_rad", "dx_m", "dy_m")] == [b[key] for key in ("phi_rad", "dx_m", "dy_m")]


def test_every_flag_finds_its_parameter(logpose, scene):
    words = (
        "--method", "paper", "--mark", 2, "--tilt", 5, "--roll", "-1", "--pan", 15, "--mount", "0.25,-0.03,1.1",
        "--tilt-model", "paper", "--tilt-joint", "neck", "--pan-joint", "head", "--initial-pose", "1,2,30", "--smooth",
        "--waypoints", "w.yaml", "--reference", "truth.tum", "--overlays", "pictures",
    )  # fmt: skip
    done = logpose("stripe-pose", "x.mcap", "--marks", scene / "marks.yaml", *words, "--show-pipeline")
    assert done.status == 0, done.err
    shown = yaml.safe_load(done.out)
    stages = {name: values or {} for entry in shown["stages"] for name, values in [_item(entry)]}
    expected = {
        "method": "paper", "mark": 2, "tilt_deg": 5.0, "roll_deg": -1.0, "pan_deg": 15.0, "mount_x_m": 0.25,
        "mount_y_m": -0.03, "mount_z_m": 1.1, "tilt_model": "paper", "tilt_joint": "neck", "pan_joint": "head",
    }  # fmt: skip
    assert {key: stages["stripe-pose"][key] for key in expected} == expected
    assert stages["fuse-poses"]["smooth"] is True
    assert stages["fuse-poses"]["initial_pose"] == stages["dead-reckon"]["initial_pose"] == "1,2,30"
    assert stages["evaluate"]["waypoints"].endswith("w.yaml")
    assert stages["read-truth"]["path"].endswith("truth.tum")
    assert shown["topics"]["truth"] == "none"
    assert "pictures" in stages["write-mark-overlays"]["path"]
    for stage, key in (
        ("stripe-pose", "marks"),
        ("fuse-poses", "map"),
        ("write-log", "marks"),
        ("write-report", "marks"),
    ):
        assert stages[stage][key].endswith("marks.yaml")


def _item(entry):
    return (entry, None) if isinstance(entry, str) else next(iter(entry.items()))


def test_a_start_pose_may_be_a_topic_or_none(logpose, scene):
    for word in ("/start", "none"):
        done = logpose(
            "stripe-pose", "x.mcap", "--marks", scene / "marks.yaml", "--initial-pose", word, "--show-pipeline"
        )
        assert yaml.safe_load(done.out)["topics"]["initial_pose"] == word


# ---- bad input ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (
            ["--tilt", "46"],
            "--tilt: stripe-pose cannot take tilt_deg = 46.0: input should be less than or equal to 45. "
            "tilt_deg is: {tilt_deg}.",
        ),
        (
            ["--roll", "-60"],
            "--roll: stripe-pose cannot take roll_deg = -60.0: input should be greater than or equal to -45. "
            "roll_deg is: {roll_deg}.",
        ),
        (["--mark", "9"], "{scene}/marks.yaml: has no mark 9. It has 1, 2; name one of them with --mark."),
    ],
)
def test_a_run_that_cannot_be_is_one_line_and_status_2(find, scene, words, line):
    from logpose.pipelines.stripe_pose.params import StripePoseParams

    fields = StripePoseParams.model_fields
    said = {key: fields[key].description for key in ("tilt_deg", "roll_deg")}
    done = find("-o", "-", *words)
    assert (done.status, done.out) == (2, "")
    assert done.err == line.format(scene=scene, **said) + "\n"


def test_a_run_without_marks_says_what_it_needs(logpose, scene):
    done = logpose("stripe-pose", scene / "photos", "--camera", scene / "camera.yaml", "-o", "-")
    assert (done.status, done.out) == (2, "")
    assert done.err == (
        "stripe_pose.yaml:5: stripe-pose needs 'marks': map of the stripe marks, marks.yaml. Give it with --marks.\n"
    )


def test_photos_without_a_calibration_say_so(logpose, scene):
    done = logpose("stripe-pose", scene / "photos", "--marks", scene / "marks.yaml", "-o", "-")
    assert (done.status, done.out) == (2, "")
    assert done.err == (
        "stripe-pose: there is no calibration for the images on /image (no CameraInfo in the log, or one with focal "
        "length 0: the camera is not calibrated). Pass one with --camera FILE, or --fx PX.\n"
    )


@pytest.mark.parametrize(("width", "height"), [(1280, 480), (320, 240)])
def test_images_of_another_size_than_the_calibration_are_refused(find, tmp_path, width, height):
    write_png(tmp_path / "photo.png", np.zeros((height, width), np.uint8))
    done = find("-o", "-", source=tmp_path / "photo.png")
    assert (done.status, done.out) == (2, "")
    assert done.err == (
        f"stripe-pose: the images on /image are {width}x{height} px, their calibration is for 640x480 px. "
        "Give the calibration of this camera and image size with --camera FILE.\n"
    )


@pytest.mark.parametrize(
    ("numbers", "line"),
    [
        ([0.0, 800.0], "{p}: focal length 0.0, 800.0 px. Both must be positive."),
        ([-800.0, 800.0], "{p}: focal length -800.0, 800.0 px. Both must be positive."),
        ([".nan", 800.0], "{p}: camera_matrix is 'nan'. Every value must be finite; remove the line."),
        ([".inf", 800.0], "{p}: camera_matrix is 'inf'. Every value must be finite; remove the line."),
    ],
)
def test_a_calibration_that_no_camera_has_is_one_line(logpose, scene, tmp_path, numbers, line):
    path = tmp_path / "bad.yaml"
    fx, fy = numbers
    path.write_text(
        "image_width: 640\nimage_height: 480\ndistortion_model: plumb_bob\n"
        f"camera_matrix: {{rows: 3, cols: 3, data: [{fx}, 0.0, 320.0, 0.0, {fy}, 240.0, 0.0, 0.0, 1.0]}}\n"
    )
    marks = scene / "marks.yaml"
    for words in ([scene / "photos", "--marks", marks, "-q", "-o", "-"], ["--check-marks", marks]):
        done = logpose("stripe-pose", *words, "--camera", path)
        assert (done.status, done.out, done.err) == (1, "", line.format(p=path) + "\n")


def test_a_joint_that_is_not_in_the_log_is_named_with_those_that_are(logpose, scene, tmp_path):
    log = tmp_path / "drive.mcap"
    pixels = cv2.imread(str(scene / "photos" / f"{STAMPS[0]}.png"), cv2.IMREAD_GRAYSCALE)
    with create_log(log) as writer:
        writer.write(JointState(stamp=1, topic="/joint_states", names=("pan", "tilt"), positions=np.zeros(2)))
        writer.write(CameraInfo(stamp=1, topic="/camera_info", calibration=CAMERA))
        writer.write(
            Image(
                stamp=2, topic="/image_raw", encoding="mono8", data=pixels.ravel(), width=640, height=480, step=640
            )
        )  # fmt: skip
    done = logpose("stripe-pose", log, "--marks", scene / "marks.yaml", "--tilt-joint", "neck", "-q", "-o", "-")
    assert (done.status, done.out) == (2, "")
    assert done.err == "stripe-pose: /joint_states has no joint 'neck'. It has pan, tilt.\n"
