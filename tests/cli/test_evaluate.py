"""What a user of ``logpose evaluate`` types and gets: figures, gates, every way to name a trajectory, bad files."""

import io
import json
import math

import numpy as np
import pytest

N = 101
HEAD = "stamp_ns,x_m,y_m,z_m,qx,qy,qz,qw"


def tum(xy, t0=1000):
    """Text of a TUM file: a pose every 0.1 s."""
    rows = (
        f"{t0 + i // 10}.{i % 10}00000000 {x!r} {y!r} 0 0 0 0 1" for i, (x, y) in enumerate(np.asarray(xy).tolist())
    )
    return "\n".join(rows) + "\n"


@pytest.fixture
def place(tmp_path, monkeypatch):
    """truth.tum: 10 m around a bend; off.tum: the same 0.3 m to the right and 0.4 m up; turned.tum: moved as a whole."""
    monkeypatch.chdir(tmp_path)
    angle = np.linspace(0, math.pi, N)
    truth = 10 / math.pi * np.column_stack([np.sin(angle), 1 - np.cos(angle)])
    turn = np.array([[math.cos(0.5), -math.sin(0.5)], [math.sin(0.5), math.cos(0.5)]])
    (tmp_path / "truth.tum").write_text(tum(truth))
    (tmp_path / "off.tum").write_text(tum(truth + np.array([0.3, 0.4])))
    (tmp_path / "turned.tum").write_text(tum(truth @ turn.T + np.array([5.0, -7.0])))
    return tmp_path


def test_figures_are_a_table_for_a_person(logpose, place):
    done = logpose("evaluate", "truth.tum", "off.tum")
    assert (done.status, done.err) == (0, "")
    lines = done.out.splitlines()
    # The truth is a polygon of 100 chords of a half circle of length 10 m.
    length = 100 * 2 * 10 / math.pi * math.sin(math.pi / 200)
    assert (
        lines[0]
        == f"101 pairs of 101 poses of the reference and 101 of the estimate, over 10 s and {length:.6g} m; aligned: none"
    )
    assert lines[2].split() == ["rmse", "mean", "median", "std", "min", "max"]
    assert lines[3].split()[:5] == ["ATE", "[m]", "0.5", "0.5", "0.5"], "0.3 and 0.4 are 0.5 m"
    assert lines[4].split()[:3] == ["ATE", "[rad]", "0"]
    assert lines[5].startswith("RPE 1f [m]")
    assert lines[-1] == "not lost: off by more than 1.0 m for at most 0 s"


def test_json_is_the_evaluation_1_of_the_design(logpose, place):
    done = logpose("evaluate", "truth.tum", "off.tum", "--json")
    assert (done.status, done.err) == (0, "")
    found = json.loads(done.out)
    assert found.keys() == {"schema", "result"}
    assert found["schema"] == "logpose.evaluation/1"
    result = found["result"]
    assert (result["matched"], result["reference_total"], result["estimate_total"]) == (N, N, N)
    assert {"rmse_m", "mean_m", "median_m", "max_m", "rmse_rad"} <= result["ate"].keys()
    assert result["ate"]["rmse_m"] == pytest.approx(0.5, abs=1e-12)
    assert result["ate"]["rmse_rad"] == 0
    assert result["rpe"]["delta"] == "1f"
    assert result["rpe"]["pairs"] == N - 1
    assert result["rpe"]["rmse_m"] == pytest.approx(0, abs=1e-12)
    assert "waypoints" not in result


def test_waypoints_are_tabulated_when_they_are_given(logpose, place):
    (place / "points.yaml").write_text(
        "logpose: waypoints/1\nwaypoints:\n  - {name: W1, x_m: 0.0, y_m: 0.0}\n  - {name: far, x_m: 50, y_m: 0}\n"
    )
    words = ("evaluate", "truth.tum", "off.tum", "--waypoints", "points.yaml")
    rows = json.loads(logpose(*words, "--json").out)["result"]["waypoints"]
    assert [row["name"] for row in rows] == ["W1", "far"]
    assert rows[0]["distance_m"] == pytest.approx(0.5, abs=1e-12)
    assert rows[1]["distance_m"] is None
    table = logpose(*words).out.splitlines()
    assert next(line for line in table if line.startswith("W1")).split()[-1] == "0.5"


@pytest.mark.parametrize(
    ("align", "rmse"), [("none", None), ("origin", None), ("se2", 0.0), ("se3", 0.0), ("sim3", 0.0)]
)
def test_alignment_takes_a_motion_of_the_whole_away(logpose, place, align, rmse):
    done = logpose("evaluate", "truth.tum", "turned.tum", "--align", align, "--json")
    result = json.loads(done.out)["result"]
    assert result["alignment"]["method"] == align
    if rmse is None:
        assert result["ate"]["rmse_m"] > 1
    else:
        assert result["ate"]["rmse_m"] == pytest.approx(rmse, abs=1e-9)
        assert result["alignment"]["scale"] == pytest.approx(1, abs=1e-9)


@pytest.mark.parametrize(
    ("gates", "status", "err"),
    [
        (["ate.rmse>0.10"], 4, "off.tum: ate.rmse_m is 0.5 (ate.rmse>0.10). The results above stand.\n"),
        (["ate.rmse_m > 0.6"], 0, ""),
        (
            ["ate.max>=0.4", "matched<200"], 4,
            "off.tum: ate.max_m is 0.5 (ate.max>=0.4); matched is 101 (matched<200). The results above stand.\n",
        ),
    ],
)  # fmt: skip
def test_a_gate_that_fails_is_exit_4_and_the_figures_are_printed(logpose, place, gates, status, err):
    words = [word for gate in gates for word in ("--fail-if", gate)]
    done = logpose("evaluate", "truth.tum", "off.tum", *words)
    assert (done.status, done.err) == (status, err)
    assert done.out.startswith("101 pairs of")


def test_a_gate_that_fails_leaves_one_json_object_on_stdout(logpose, place):
    done = logpose("evaluate", "truth.tum", "off.tum", "--json", "--fail-if", "ate.rmse>0.1")
    assert done.status == 4
    assert json.loads(done.out)["result"]["matched"] == N


def test_a_topic_of_a_log_is_a_reference(logpose, drive, place):
    done = logpose("evaluate", f"{drive}:/ground_truth/pose", drive.with_suffix(".truth.tum"), "--json")
    result = json.loads(done.out)["result"]
    assert (done.status, result["matched"]) == (0, 35)
    assert result["ate"]["max_m"] < 2e-9, "the file has nine decimals"


def test_a_topic_that_is_not_there_says_which_are(logpose, drive, place):
    done = logpose("evaluate", f"{drive}:/nowhere", "truth.tum")
    assert done.status == 2
    assert done.err.startswith(f"{drive}: no topic '/nowhere'"), done.err
    assert "/ground_truth/pose" in done.err


@pytest.mark.parametrize("words", [["-", "off.tum"], ["off.tum", "-"]])
def test_a_dash_is_standard_input(logpose, place, monkeypatch, words):
    monkeypatch.setattr("sys.stdin", io.StringIO((place / "truth.tum").read_text()))
    done = logpose("evaluate", *words, "--json")
    assert (done.status, done.err) == (0, "")
    assert json.loads(done.out)["result"]["ate"]["rmse_m"] == pytest.approx(0.5, abs=1e-12)


def test_interpolation_and_the_largest_difference_decide_what_is_paired(logpose, place):
    lines = (place / "off.tum").read_text().splitlines()
    shifted = [line.replace("00000000 ", "40000000 ", 1) for line in lines]
    (place / "late.tum").write_text("\n".join(shifted))  # 40 ms after each pose of the truth
    result = json.loads(logpose("evaluate", "truth.tum", "late.tum", "--max-diff", "0.05", "--json").out)["result"]
    assert result["matched"] == N
    result = json.loads(logpose("evaluate", "truth.tum", "late.tum", "--interpolate", "--json").out)["result"]
    assert result["matched"] == N - 1, "the last pose lies behind the truth"


BAD = [
    ("", "{}: has no poses. Name a file with at least one.\n"),
    ("# only a comment\n\n", "{}: has no poses. Name a file with at least one.\n"),
    ("1 0 0 0 0 0 0 1\n2 nan 0 0 0 0 0 1\n", "{}:2: x is 'nan'. Every value must be finite; remove the line.\n"),
    ("1 0 0 0 0 0 0 1\n2 0 inf 0 0 0 0 1\n", "{}:2: y is 'inf'. Every value must be finite; remove the line.\n"),
    (
        "1 0 0 0 0 0 0 1\n# note\n3 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n",
        "{}:4: the stamp is before that of line 3. Sort the file by time, one pose per stamp.\n",
    ),
    ("1 0 0 0 0 0 0 1\n2 0 0 0 0 0 1\n", "{}:2: has 7 columns, not 8. A TUM line is 't x y z qx qy qz qw'.\n"),
    ("1 0 0 0 0 0 0 2\n", "{}:1: the quaternion has length 2, not 1. Check the order of the columns.\n"),
    ("1 0 0 0 0 0 0 0\n", "{}:1: the quaternion has length 0, not 1. Check the order of the columns.\n"),
    ("x 0 0 0 0 0 0 1\n", "{}:1: the stamp is 'x', not a number. Correct or remove the line.\n"),
    ("1 2 3\n", "{}:1: has 3 columns. A trajectory has 8 (TUM), 12 (KITTI), or commas (EuRoC, trajectory.csv).\n"),
    (f"{HEAD}\n1,0,0,0,0,0,0,1\n2,,0,0,0,0,0,1\n", "{}:3: x_m is '', not a number. Correct or remove the line.\n"),
]


@pytest.mark.parametrize(("text", "line"), BAD)
@pytest.mark.parametrize("is_reference", [True, False])
def test_a_bad_file_is_an_error_that_names_the_line_and_no_statistic(logpose, place, text, line, is_reference):
    (place / "bad.tum").write_text(text)
    pair = ("bad.tum", "truth.tum") if is_reference else ("truth.tum", "bad.tum")
    done = logpose("evaluate", *pair)
    assert (done.status, done.out, done.err) == (1, "", line.format("bad.tum"))


def test_trajectories_that_never_meet_say_where_each_of_them_is(logpose, place):
    (place / "other.tum").write_text(tum(np.zeros((11, 2)), t0=2000))
    done = logpose("evaluate", "truth.tum", "other.tum")
    assert (done.status, done.out) == (1, "")
    assert done.err == (
        "evaluate: no poses match within 0.01 s: the reference goes from 1000.000 to 1010.000 s, "
        "the estimate from 2000.000 to 2001.000 s. Check both trajectories.\n"
    )


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (
            ["--delta", "far"],
            "--delta: evaluate cannot take delta = 'far': the step 'far' is neither frames, like '1f', nor metres, "
            "like '10m'. delta is: step of the relative error: frames, like 1f, or metres of path, like 10m.\n",
        ),
        (
            ["--max-diff", "-1"],
            "--max-diff: evaluate cannot take max_diff_s = -1.0: input should be greater than or equal to 0. "
            "max_diff_s is: largest difference of the stamps of a pair [s].\n",
        ),
        (["--fail-if", "ate.rmse"], "--fail-if: 'ate.rmse' is no condition. Write one like 'ate.rmse>0.10'.\n"),
        (
            ["--align", "se4"],
            "logpose evaluate: invalid value for '--align': 'se4' is not one of 'none', 'origin', 'se2', 'se3', 'sim3'. "
            "See logpose evaluate --help.\n",
        ),
    ],
)
def test_a_wrong_word_is_one_line(logpose, place, words, line):
    done = logpose("evaluate", "truth.tum", "off.tum", *words)
    assert (done.status, done.out, done.err) == (2, "", line)


def test_a_gate_on_a_figure_that_is_not_there_lists_those_that_are(logpose, place):
    done = logpose("evaluate", "truth.tum", "off.tum", "--fail-if", "ate.rms>0.1")
    assert done.status == 2
    assert done.err.startswith("--fail-if: there is no figure 'ate.rms'. There are: matched, reference_total, ")
    assert "ate.rmse_m" in done.err
