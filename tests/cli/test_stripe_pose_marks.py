"""What a user of ``logpose stripe-pose`` types before the marks are hung: they are checked, and printed to scale."""

import json
import math

import numpy as np
import pytest

from logpose.formats.calibration import Calibration, write_calibration
from logpose.formats.maps.marks import write_marks
from logpose.formats.products import MarkMap, StripeMark

CAMERA = Calibration(640, 480, 800.0, 800.0, 319.5, 239.5)


def mark(identity, lines_mm, bar_mm=20.0, height=0.15):
    lines = np.array(lines_mm) / 1000
    return StripeMark(
        id=identity, lines=lines, bars=np.full(len(lines), bar_mm / 1000), pose=np.zeros(3), height=height
    )


@pytest.fixture
def marks(tmp_path):
    path = tmp_path / "marks.yaml"
    write_marks(MarkMap(marks=(mark(1, [-60, 0, 40, 120]), mark(2, [-60, 20, 80, 120]))), path)
    return path


@pytest.fixture
def camera(tmp_path):
    path = tmp_path / "camera.yaml"
    write_calibration(CAMERA, path)
    return path


# ---- --check-marks --------------------------------------------------------------------------------------------


def test_marks_are_checked_for_a_camera_and_a_working_area(logpose, marks, camera):
    done = logpose("stripe-pose", "--check-marks", marks, "--camera", camera, "--distance", "0.4,2")
    assert (done.status, done.err) == (0, "")
    first, *_ = done.out.splitlines()
    assert first.startswith("2 marks; an edge is found to 0.05 px in one row, and what fits to ")
    assert "smallest gap px at 2 m, 60 deg" in done.out
    assert "told apart [m], at 0, 20, 40, 60 deg" in done.out
    rows = [line.split()[0] for line in done.out.split("ahead [mm]\n")[1].splitlines()]
    assert rows == ["distance", "0.40", "0.80", "1.20", "1.60", "2.00"]


def test_the_check_as_json_says_what_the_table_says_and_the_bound_is_that_of_the_camera(logpose, marks, camera):
    words = ("stripe-pose", "--check-marks", marks, "--distance", "0.5,1", "--angle", "40", "--rows", 1, "--json")
    by_file = json.loads(logpose(*words, "--camera", camera).out)
    assert by_file["schema"] == "logpose.code-book/1"
    assert by_file["result"]["distances_m"] == [0.5, 0.625, 0.75, 0.875, 1.0]
    assert by_file["result"]["angles_rad"][-1] == pytest.approx(math.radians(40))
    assert {(p["seen"], p["taken_for"]) for p in by_file["result"]["pairs"]} == {(1, 1), (1, 2), (2, 1), (2, 2)}
    # Eight edges and one row: sigma_phi = sigma / fx * D^2 / sqrt(S) from the front and far away, S the scatter of X^2
    # that 1 and X do not explain.
    X = np.array([-60, -40, 0, 20, 40, 60, 120, 140.0]) / 1000
    A = np.stack([np.ones(8), X - 0.04], axis=1)
    S = float(np.linalg.lstsq(A, (X - 0.04) ** 2, rcond=None)[1][0])
    view = next(v for v in by_file["result"]["views"] if (v["mark"], v["distance_m"], v["angle_rad"]) == (1, 1.0, 0.0))
    assert view["sd_phi_rad"] == pytest.approx(0.05 / 800 / math.sqrt(S), rel=0.01)
    by_numbers = json.loads(logpose(*words, "--fx", 800, "--width", 640).out)
    assert by_numbers == by_file
    in_mm = json.loads(logpose(*words, "--focal-length", 16, "--pixel-pitch", 0.02, "--width", 640).out)
    assert in_mm == by_file


def test_finer_edges_give_better_poses_in_proportion(logpose, marks):
    words = ("stripe-pose", "--check-marks", marks, "--fx", 800, "--width", 640, "--json")
    fine, coarse = (json.loads(logpose(*words, "--edge-sigma", s).out)["result"]["views"] for s in (0.05, 0.3))
    for a, b in zip(fine, coarse, strict=True):
        if a["is_inside"]:
            assert b["sd_phi_rad"] == pytest.approx(6 * a["sd_phi_rad"])


def test_a_camera_so_wide_that_no_lens_covers_it_still_has_a_field(logpose, marks, tmp_path):
    # Beyond its turning point a lens polynomial means nothing; those columns see no direction.
    write_calibration(
        Calibration(640, 480, 300.0, 300.0, 319.5, 239.5, "plumb_bob", (-0.5, 0, 0, 0, 0)), tmp_path / "c"
    )
    done = logpose("stripe-pose", "--check-marks", marks, "--camera", tmp_path / "c", "--json")
    assert done.status == 0
    assert any(view["is_inside"] for view in json.loads(done.out)["result"]["views"])


# ---- --print-marks --------------------------------------------------------------------------------------------


def test_marks_are_printed_and_the_files_named(logpose, marks, tmp_path):
    done = logpose("stripe-pose", "--marks", marks, "--print-marks", tmp_path / "wall.pdf")
    assert (done.status, done.out, done.err) == (0, f"{tmp_path / 'wall.pdf'}\n", "")
    assert (tmp_path / "wall.pdf").read_bytes().startswith(b"%PDF")
    done = logpose("stripe-pose", "--marks", marks, "--print-marks", tmp_path / "wall.svg", "--json")
    files = json.loads(done.out)["result"]["files"]
    assert files == [str(tmp_path / f"wall.{i}.svg") for i in (1, 2)]


def test_a_check_may_print_what_it_checked(logpose, marks, camera, tmp_path):
    done = logpose("stripe-pose", "--check-marks", marks, "--camera", camera, "--print-marks", tmp_path / "a.svg")
    assert done.status == 0
    assert done.out.startswith("2 marks;")
    assert done.err.split() == [str(tmp_path / f"a.{i}.svg") for i in (1, 2)]


def test_no_camera_has_a_billion_columns(logpose, marks):
    done = logpose("stripe-pose", "--check-marks", marks, "--fx", 800, "--width", 1e9)
    line = "--width 1e+09: no camera has so many pixels. Give the width of the images.\n"
    assert (done.status, done.out, done.err) == (2, "", line)


@pytest.mark.filterwarnings("error")
def test_a_check_from_so_near_that_the_mark_is_behind_the_lens_says_nothing_of_it(logpose, marks):
    done = logpose("stripe-pose", "--check-marks", marks, "--fx", 800, "--width", 640, "--distance", "0.001,0.01")
    assert (done.status, done.err) == (0, "")


# ---- bad input ------------------------------------------------------------------------------------------------

CHECK = ["--check-marks", "MARKS"]
SEE = "See logpose stripe-pose --help."


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ([*CHECK, "--fx", "nan", "--width", "640"], f"logpose stripe-pose: invalid value for '--fx': 'nan' is not finite. {SEE}"),
        ([*CHECK, "--fx", "inf", "--width", "640"], f"logpose stripe-pose: invalid value for '--fx': 'inf' is not finite. {SEE}"),
        ([*CHECK, "--fx", "0", "--width", "640"], f"logpose stripe-pose: invalid value for '--fx': '0' is not greater than 0. {SEE}"),
        ([*CHECK, "--fx", "wide", "--width", "640"], f"logpose stripe-pose: invalid value for '--fx': 'wide' is not a number. {SEE}"),
        (
            [*CHECK, "--focal-length", "-16", "--pixel-pitch", "0.01", "--width", "640"],
            f"logpose stripe-pose: invalid value for '--focal-length': '-16' is not greater than 0. {SEE}",
        ),
        (
            [*CHECK, "--focal-length", "16", "--pixel-pitch", "nan", "--width", "640"],
            f"logpose stripe-pose: invalid value for '--pixel-pitch': 'nan' is not finite. {SEE}",
        ),
        (
            [*CHECK, "--focal-length", "16", "--pixel-pitch", "0", "--width", "640"],
            f"logpose stripe-pose: invalid value for '--pixel-pitch': '0' is not greater than 0. {SEE}",
        ),
        ([*CHECK, "--fx", "800", "--width", "-1"], f"logpose stripe-pose: invalid value for '--width': '-1' is not greater than 0. {SEE}"),
        ([*CHECK, "--fx", "800", "--width", "nan"], f"logpose stripe-pose: invalid value for '--width': 'nan' is not finite. {SEE}"),
        ([*CHECK, "--fx", "800", "--width", "640.5"], "--width 640.5: is no whole number of pixels. Give the width of the images."),
        (
            [*CHECK, "--fx", "800", "--width", "640", "--edge-sigma", "0"],
            f"logpose stripe-pose: invalid value for '--edge-sigma': '0' is not greater than 0. {SEE}",
        ),
        (
            [*CHECK, "--fx", "800", "--width", "640", "--rows", "0"],
            f"logpose stripe-pose: invalid value for '--rows': 0 is not in the range x>=1. {SEE}",
        ),
        (CHECK, "--check-marks: no camera. Name its calibration with --camera FILE, or give --fx PX and --width PX."),
        ([*CHECK, "--fx", "800"], "--check-marks: no camera. Name its calibration with --camera FILE, or give --fx PX and --width PX."),
        ([*CHECK, "--focal-length", "16", "--width", "640"], "--focal-length: in mm needs the pitch of the pixels in mm. Add --pixel-pitch MM."),
        ([*CHECK, "--pixel-pitch", "0.01", "--width", "640"], "--pixel-pitch: in mm needs the focal length in mm. Add --focal-length MM."),
        (
            [*CHECK, "--fx", "800", "--focal-length", "16", "--pixel-pitch", "0.01", "--width", "640"],
            "--fx: --focal-length and --pixel-pitch say it already. Leave one of them out.",
        ),
        ([*CHECK, "--camera", "CAMERA", "--fx", "800"], "--fx: --camera says it already. Leave one of them out."),
        ([*CHECK, "--camera", "CAMERA", "--distance", "1"], "--distance 1: is not NEAR,FAR. Give 2 finite numbers."),
        ([*CHECK, "--camera", "CAMERA", "--distance", "1,nan"], "--distance 1,nan: is not NEAR,FAR. Give 2 finite numbers."),
        ([*CHECK, "--camera", "CAMERA", "--distance", "2,1"], "--distance 2,1: is no working area. Give 0 < NEAR < FAR."),
        ([*CHECK, "--camera", "CAMERA", "--angle", "90"], "--angle 90: from there no mark is seen. Give less than 90 degrees."),
        ([*CHECK, "--camera", "CAMERA", "drive.bag"], "--check-marks: reads no log. Leave drive.bag out."),
        ([*CHECK, "--camera", "CAMERA", "--tilt", "3"], "--tilt: has no meaning with --check-marks. Leave it out."),
        ([*CHECK, "--camera", "CAMERA", "--set", "a.b=1"], "--set: has no meaning with --check-marks. Leave it out."),
        ([*CHECK, "--camera", "CAMERA", "--marks", "MARKS"], "--marks: --check-marks names the map already. Leave it out."),
        (["--print-marks", "OUT.pdf"], "--print-marks: no marks. Name their map with --marks FILE."),
        (["--print-marks", "OUT.pdf", "--marks", "MARKS", "--fx", "800"], "--fx: has no meaning with --print-marks. Leave it out."),
        (
            ["--print-marks", "OUT.png", "--marks", "MARKS"],
            "{out}.png: marks are printed as SVG or PDF. Name a file that ends in .svg or .pdf.",
        ),
        (["photos", "--marks", "MARKS", "--width", "800"], "--width: belongs to --check-marks FILE. Add that, or leave it out."),
        (["photos", "--marks", "MARKS", "--tilt", "nan"], f"logpose stripe-pose: invalid value for '--tilt': 'nan' is not finite. {SEE}"),
        (["photos", "--marks", "MARKS", "--mount", "1,2"], "--mount 1,2: is not X,Y,Z. Give 3 finite numbers."),
        (["photos", "--marks", "MARKS", "--mark", "-1"], f"logpose stripe-pose: invalid value for '--mark': -1 is not in the range x>=0. {SEE}"),
    ],
)  # fmt: skip
def test_a_wrong_word_is_one_line_and_status_2(logpose, marks, camera, tmp_path, words, line):
    places = {"MARKS": marks, "CAMERA": camera}
    out = tmp_path / "OUT"
    done = logpose("stripe-pose", *(places.get(w, str(w).replace("OUT", str(out))) for w in words))
    assert done.err == line.format(out=out) + "\n"
    assert (done.status, done.out) == (2, "")
    assert not list(tmp_path.glob("OUT*"))


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (
            "- {id: 1, lines_m: [0.0, -0.06, 0.06], x_m: 0, y_m: 0, heading_rad: 0}\n",
            "{p}:3: lines_m does not increase: -0.06 follows 0.0. List the rising edges from left to right.",
        ),
        ("", "{p}: the map has no marks. Give at least one."),
        (
            "- {id: 1, lines_m: [-60, 0, 60], x_m: 0, y_m: 0, heading_rad: 0}\n",
            "{p}:3: the mark is 120 m wide. No mark is that large; the unit is metres.",
        ),
    ],
)
def test_a_wrong_map_is_one_line_and_status_1(logpose, tmp_path, text, line):
    path = tmp_path / "m.yaml"
    path.write_text("logpose: marks/1\nmarks:\n" + text)
    for words in (
        ["--check-marks", path, "--fx", 800, "--width", 640],
        ["--marks", path, "--print-marks", tmp_path / "o.svg"],
    ):
        done = logpose("stripe-pose", *words)
        assert (done.status, done.out, done.err) == (1, "", line.format(p=path) + "\n")


def test_a_wrong_word_is_json_too_where_json_was_asked_for(logpose, marks):
    done = logpose("stripe-pose", "--check-marks", marks, "--json")
    assert json.loads(done.out)["error"]["exit_status"] == 2
