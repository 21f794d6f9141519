"""What a user of ``logpose convert`` types and gets: trajectories and landmark maps, there and back."""

import json

import numpy as np
import pytest

from logpose.formats.maps.landmarks import read_landmarks
from logpose.formats.trajectories.trajectory import read_trajectory


@pytest.fixture
def place(drive, landmarks, tmp_path, monkeypatch):
    """truth.tum and map.yaml of the drive."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "truth.tum").write_bytes(drive.with_suffix(".truth.tum").read_bytes())
    (tmp_path / "map.yaml").write_bytes(landmarks.read_bytes())
    return tmp_path


@pytest.fixture
def convert(logpose):
    def run(*words):
        done = logpose("convert", *words)
        assert (done.status, done.out, done.err) == (0, "", "")

    return run


def test_tum_to_csv_and_back_is_the_same_file(convert, place):
    convert("trajectory", "truth.tum", "-o", "truth.csv")
    convert("trajectory", "truth.csv", "-o", "again.tum")
    assert (place / "again.tum").read_bytes() == (place / "truth.tum").read_bytes()
    assert (place / "truth.csv").read_text().splitlines()[:2] == ["# logpose: trajectory/1", "# frame: map"]


def test_kitti_has_its_stamps_beside_it_and_comes_back_to_its_rounding(convert, place):
    convert("trajectory", "truth.tum", "-o", "truth.kitti")
    assert sorted(p.name for p in place.glob("truth.*")) == ["truth.kitti", "truth.times.txt", "truth.tum"]
    convert("trajectory", "truth.kitti", "-o", "again.csv")
    before, after = read_trajectory("truth.tum"), read_trajectory("again.csv")
    assert np.array_equal(after.stamps, before.stamps), "stamps are integers all the way"
    # KITTI is written with 12 decimals; a quaternion comes out of a matrix of such numbers.
    assert after.positions == pytest.approx(before.positions, abs=1e-11)
    assert after.orientations == pytest.approx(before.orientations, abs=1e-9)


def test_a_topic_of_a_log_becomes_a_file(convert, place, drive):
    convert("trajectory", f"{drive}:/ground_truth/pose", "-o", "logged.tum")
    logged, truth = read_trajectory("logged.tum"), read_trajectory("truth.tum")
    assert np.array_equal(logged.stamps, truth.stamps)
    assert np.array_equal(logged.positions, truth.positions), "both are written with nine decimals"


def test_landmarks_to_csv_and_back_are_the_same_map(convert, place):
    convert("landmarks", "map.yaml", "-o", "map.csv")
    convert("landmarks", "map.csv", "-o", "again.yaml")
    before, after = read_landmarks("map.yaml"), read_landmarks("again.yaml")
    assert np.array_equal(after.ids, before.ids)
    assert np.array_equal(after.positions, before.positions), "every bit of every float"
    assert after.frame_id == before.frame_id
    assert (place / "map.csv").read_text().splitlines()[1] == "id,x_m,y_m,z_m"


def test_a_dash_is_standard_input_and_output(logpose, place, monkeypatch):
    import io

    monkeypatch.setattr("sys.stdin", io.StringIO((place / "truth.tum").read_text()))
    done = logpose("convert", "trajectory", "-", "-o", "-")
    assert (done.status, done.out) == (0, (place / "truth.tum").read_text())
    done = logpose("convert", "landmarks", "map.yaml", "-o", "-")
    assert (done.status, done.out) == (0, (place / "map.yaml").read_text())


@pytest.mark.parametrize(
    ("words", "status", "line"),
    [
        (
            ["trajectory", "truth.tum", "-o", "truth.xyz"], 2,
            "truth.xyz: no trajectory format has the suffix '.xyz'. Use .tum, .csv or .kitti.",
        ),
        (
            ["landmarks", "map.yaml", "-o", "map.json"], 2,
            "map.json: no landmark map has the suffix '.json'. Use .yaml or .csv.",
        ),
        (
            ["map", "map.yaml", "-o", "map.csv"], 2,
            "logpose convert: invalid value for 'KIND': 'map' is not one of 'trajectory', 'landmarks', 'mrclam', "
            "'dlr-circles'. See logpose convert --help.",
        ),
        (["trajectory", "nowhere.tum", "-o", "x.csv"], 1, "nowhere.tum: no such file. Check the path."),
        (["landmarks", "nowhere.yaml", "-o", "x.csv"], 1, "nowhere.yaml: no such file. Check the path."),
        (
            ["trajectory", "truth.tum"], 2,
            "logpose convert: missing option '-o' / '--output'. See logpose convert --help.",
        ),
    ],
)  # fmt: skip
def test_a_wrong_word_is_one_line_and_writes_nothing(logpose, place, words, status, line):
    done = logpose("convert", *words)
    assert (done.status, done.out, done.err) == (status, "", line + "\n")
    assert sorted(p.name for p in place.iterdir()) == ["map.yaml", "truth.tum"]


def test_a_trajectory_that_repeats_a_stamp_is_not_written_as_if_it_did_not(logpose, place):
    (place / "twice.tum").write_text("1 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n")
    done = logpose("convert", "trajectory", "twice.tum", "-o", "twice.csv")
    assert done.status == 1
    assert done.err == "twice.tum:2: the stamp repeats that of line 1. Sort the file by time, one pose per stamp.\n"
    assert not (place / "twice.csv").exists()


def test_a_data_set_that_is_not_there_is_one_line(logpose, place):
    for kind in ("mrclam", "dlr-circles"):
        done = logpose("convert", kind, "nowhere", "-o", "x.mcap")
        assert done.status == 1
        assert done.err.startswith("nowhere")
        assert done.err.count("\n") == 1
        assert not (place / "x.mcap").exists()


def test_json_names_the_file(logpose, place):
    done = logpose("convert", "landmarks", "map.yaml", "-o", "map.csv", "--json")
    assert json.loads(done.out) == {"schema": "logpose.files/1", "result": {"files": ["map.csv"], "counts": {}}}
