import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from logpose.formats.events import CameraInfo, Image, Odometry
from logpose.formats.trajectories.trajectory import read_trajectory

RUN_FOLDER = [
    "report.html",
    "report.json",
    "result.mcap",
    "run.yaml",
    "sightings.jsonl",
    "trajectory.csv",
    "trajectory.tum",
]


def names(folder):
    return sorted(p.name for p in folder.iterdir())


def test_one_command_leaves_the_whole_run_folder(logpose, drive, landmarks, tmp_path):
    out = tmp_path / "out"
    done = logpose("localize-pf", drive, "--map", landmarks, "-o", out)
    assert (done.status, done.out) == (0, "")
    assert f"results in {out}/, report {out}/report.html" in done.err
    assert names(out) == RUN_FOLDER
    report = json.loads((out / "report.json").read_text())
    assert report["result"]["localize-pf"]["status_share"]["tracking"] == 1.0
    # The start pose is wrong by a few centimetres and the map by 5 mm; after the first images the map holds the robot.
    assert report["result"]["evaluation"]["ate"]["rmse_m"] < 0.03
    assert report["result"]["evaluation"]["matched"] == report["messages"]["/ceiling/image_raw"]["read"]
    estimate = read_trajectory(out / "trajectory.tum")
    assert np.array_equal(estimate.stamps, read_trajectory(drive.with_suffix(".truth.tum")).stamps)


def test_threads_and_a_second_run_give_the_same_bytes(logpose, drive, landmarks, tmp_path):
    for name, words in {"a": [], "b": ["--workers", 4], "c": ["--seed", 0]}.items():
        assert logpose("localize-pf", drive, "--map", landmarks, "-q", "-o", tmp_path / name, *words).status == 0
    for name in RUN_FOLDER:
        if name != "report.json":
            first = (tmp_path / "a" / name).read_bytes()
            assert (tmp_path / "b" / name).read_bytes() == first, f"{name} differs with 4 workers"
            assert (tmp_path / "c" / name).read_bytes() == first, f"{name} differs in a second run"


def test_the_pipeline_left_behind_repeats_the_run(logpose, drive, landmarks, tmp_path):
    logpose("localize-pf", drive, "--map", landmarks, "--set", "localize-pf.particles=150", "-q", "-o", tmp_path / "a")
    done = logpose("run", tmp_path / "a" / "run.yaml", drive, "-q", "-o", tmp_path / "b")
    assert done.status == 0, done.err
    assert (tmp_path / "b" / "trajectory.csv").read_bytes() == (tmp_path / "a" / "trajectory.csv").read_bytes()
    assert "particles: 150" in (tmp_path / "b" / "run.yaml").read_text()


def test_both_containers_give_the_same_trajectory(logpose, world, drive, landmarks, tmp_path):
    from logpose.pipelines.simulate.write import write_simulation

    bag = tmp_path / "drive.bag"
    write_simulation(world, bag, 1)
    first = logpose("localize-pf", drive, "--map", landmarks, "-q", "-o", "-")
    second = logpose("localize-pf", bag, "--map", landmarks, "-q", "-o", "-")
    assert first.status == second.status == 0
    assert first.out == second.out != ""


def test_sightings_of_a_file_replace_the_images(logpose, drive, landmarks, tmp_path):
    logpose("detect-circles", drive, "--map", landmarks, "-q", "-o", tmp_path / "seen")
    direct = logpose("localize-pf", drive, "--map", landmarks, "-q", "-o", "-")
    done = logpose(
        "localize-pf", drive, "--sightings", tmp_path / "seen" / "sightings.jsonl", "--map", landmarks, "-q", "-o", "-"
    )
    assert done.status == 0
    assert done.out == direct.out


def test_the_papers_method_runs_and_says_so(logpose, drive, landmarks, tmp_path):
    done = logpose("localize-pf", drive, "--map", landmarks, "--method", "paper", "-q", "-o", tmp_path / "out")
    assert done.status == 0
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["result"]["localize-pf"]["method"] == "paper"
    text = (tmp_path / "out" / "run.yaml").read_text()
    assert text.count("method: paper") == 2


def test_show_pipeline_prints_what_would_run_and_runs_nothing(logpose, drive, landmarks):
    done = logpose("localize-pf", drive, "--map", landmarks, "--workers", 2, "--show-pipeline")
    assert done.status == 0
    assert "workers: 2" in done.out
    assert "logpose: 1" in done.out


def test_json_prints_the_report_and_the_depfile_names_every_input(logpose, drive, landmarks, tmp_path):
    out, dep = tmp_path / "out", tmp_path / "out.d"
    done = logpose("localize-pf", drive, "--map", landmarks, "-q", "-o", out, "--json", "--depfile", dep)
    assert json.loads(done.out)["schema"] == "logpose.report/1"
    assert dep.read_text() == f"{out}/report.json: {drive} {landmarks}\n"


def test_a_reference_file_takes_the_place_of_the_truth_in_the_log(logpose, drive, landmarks, rewrite, tmp_path):
    blind = rewrite(lambda e: None if e.topic == "/ground_truth/pose" else e)
    truth = drive.with_suffix(".truth.tum")
    done = logpose("localize-pf", blind, "--map", landmarks, "-q", "-o", tmp_path / "o", "--reference", truth, "--json")
    assert json.loads(done.out)["result"]["evaluation"]["ate"]["rmse_m"] < 0.03
    without = logpose("localize-pf", blind, "--map", landmarks, "-q", "-o", tmp_path / "p", "--json")
    assert "evaluation" not in json.loads(without.out)["result"]


@pytest.fixture
def fails(logpose, landmarks, tmp_path):
    """Run a changed log and compare status and the last line of stderr word for word."""

    def check(log, status, line, *words):
        out = tmp_path / "out"
        done = logpose("localize-pf", log, "--map", landmarks, "-q", "-o", out, *words)
        said = done.err.splitlines()
        assert (said if status in {1, 2} else said[-1:]) == [line]
        assert done.status == status
        assert done.out == ""
        if status in {1, 2}:
            assert not out.exists(), "something was left behind"

    return check


def test_a_folder_without_a_log(fails, tmp_path):
    (tmp_path / "empty").mkdir()
    line = (
        f"{tmp_path}/empty: the folder is empty. Accepted are ROS 1 bags, ROS 2 bags (folder, .db3 or .mcap), MCAP files, "
        "images and folders of images."
    )
    fails(tmp_path / "empty", 1, line)


def test_a_topic_that_is_not_there(fails, drive):
    line = f"{drive}: no topic '/nowhere' of type Image. Topics of this type: /ceiling/image_raw."
    fails(drive, 2, line, "--topic", "image=/nowhere")


def test_no_calibration(fails, rewrite):
    line = (
        "detect-circles: there is no calibration for the images on /ceiling/image_raw (no CameraInfo in the log, "
        "or one with focal length 0: the camera is not calibrated). "
        "Pass one with --camera FILE."
    )
    fails(rewrite(lambda e: None if isinstance(e, CameraInfo) else e), 2, line)

    def blank(event):
        is_info = isinstance(event, CameraInfo)
        return replace(event, calibration=replace(event.calibration, fx=0.0, fy=0.0)) if is_info else event

    fails(rewrite(blank, "blank.mcap"), 2, line)


def test_images_of_another_size_than_the_calibration(fails, rewrite):
    def change(event):
        if isinstance(event, CameraInfo):
            return replace(event, calibration=replace(event.calibration, width=640, height=480))
        return event

    line = (
        "detect-circles: the images on /ceiling/image_raw are 480x360 px, their calibration is for 640x480 px. "
        "Give the calibration of this camera and image size with --camera FILE."
    )
    fails(rewrite(change), 2, line)


def test_a_map_in_other_units(logpose, drive, landmarks, tmp_path):
    from logpose.formats.maps.landmarks import read_landmarks, write_landmarks

    metres = read_landmarks(landmarks)
    scaled = metres.positions * np.array([1000.0, 1000.0, 1.0])
    write_landmarks(replace(metres, positions=scaled), tmp_path / "mm.yaml")
    done = logpose("localize-pf", drive, "--map", tmp_path / "mm.yaml", "-q", "-o", tmp_path / "out")
    assert done.status == 2
    assert re.fullmatch(
        rf"{tmp_path}/mm\.yaml: the nearest landmark is \d+\.\d m away, no sighting is farther than \d\.\d m and odometry "
        r"travels \d\.\d m\. Give the map in metres, in the frame of the start pose\.",
        done.err.splitlines()[-1],
    )


def test_no_images(fails, rewrite):
    line = (
        "localize-pf: no images and no sightings in the log. Name their topic with --topic image=/NAME or "
        "--topic sightings=/NAME, or pass --sightings FILE."
    )
    fails(rewrite(lambda e: None if isinstance(e, Image | CameraInfo) else e), 2, line)


def test_no_odometry(fails, rewrite):
    line = "localize-pf: no odometry in the log. Name its topic with --topic odometry=/NAME."
    fails(rewrite(lambda e: None if isinstance(e, Odometry) else e), 2, line)


def test_no_start_pose(fails, drive, rewrite):
    log = rewrite(lambda e: None if e.topic == "/initialpose" else e)
    line = (
        "localize-pf: no start pose. Pass --initial-pose X,Y,HEADING_DEG or log it on /initialpose; a logged one before "
        "--start is not seen."
    )
    fails(log, 2, line)
    fails(drive, 2, line, "--start", "1")


def test_a_start_pose_of_other_words(fails, drive):
    line = "initial pose '1,2': is not three numbers. Write X,Y,HEADING_DEG [m, m, deg], as in 1.5,2,90."
    fails(drive, 2, line, "--initial-pose", "1,2")


@pytest.mark.parametrize(("field", "n"), [("position", 3), ("orientation", 4), ("linear", 3)])
def test_odometry_that_is_no_number(fails, rewrite, field, n):
    def change(event):
        if isinstance(event, Odometry) and event.stamp > 1451606402_000000000:
            return replace(event, **{field: np.array([np.nan, 0, 0, 1])[:n]})
        return event

    log = rewrite(change)
    fails(log, 3, "/odom: 45 of 86 messages lost: 45 x a value is not a finite number.")


def test_a_gap_in_the_odometry_is_said_and_no_loss(logpose, rewrite, landmarks, tmp_path):
    t0 = 1451606400_000000000

    def change(event):
        return None if isinstance(event, Odometry) and 5e8 < event.stamp - t0 < 2e9 else event

    done = logpose("localize-pf", rewrite(change), "--map", landmarks, "-q", "-o", tmp_path / "out")
    assert done.status == 0
    assert done.err.splitlines()[-1] == "localize-pf: odometry is silent for 1.500 s; the pose is uncertain there."


def test_sightings_that_go_back_in_time(fails, drive, landmarks, logpose, tmp_path):
    logpose("detect-circles", drive, "--map", landmarks, "-q", "-o", tmp_path / "seen")
    lines = (tmp_path / "seen" / "sightings.jsonl").read_text().splitlines()
    swapped = tmp_path / "swapped.jsonl"
    swapped.write_text("\n".join([*lines[:3], lines[5], lines[4]]))
    stamps = [json.loads(line)["stamp_ns"] for line in (lines[4], lines[5])]
    fails(
        drive,
        1,
        f"{swapped}:5: stamp_ns {stamps[0]} comes after {stamps[1]}. Sort the lines by time.",
        "--sightings",
        swapped,
    )


def test_an_empty_map_and_a_map_with_a_point_twice(logpose, drive, tmp_path):
    empty = tmp_path / "empty.yaml"
    empty.write_text("logpose: landmarks/1\nframe: map\nlandmarks: []\n")
    assert logpose("localize-pf", drive, "--map", empty, "-q", "-o", tmp_path / "o").err == (
        f"{empty}: the map has no landmarks. Give at least one.\n"
    )
    twice = tmp_path / "twice.csv"
    twice.write_text("id,x_m,y_m,z_m\n0,1.0,2.0,2.74\n1,1.0,2.01,2.74\n")
    assert logpose("localize-pf", drive, "--map", twice, "-q", "-o", tmp_path / "o").err == (
        f"{twice}:3: landmarks 0 and 1 are 0.010 m apart. Remove one; landmarks must be at least 0.05 m apart.\n"
    )


def test_a_forgotten_map_is_asked_for_by_its_flag(logpose, drive):
    line = "localize_pf.yaml:5: localize-pf needs 'map': landmark map, landmarks.yaml or CSV. Give it with --map.\n"
    done = logpose("localize-pf", drive)
    assert (done.status, done.err) == (2, line)


def test_waypoints_are_read_before_the_log(fails, drive, tmp_path):
    fails(drive, 1, f"{tmp_path}/none.yaml: no such file. Check the path.", "--waypoints", tmp_path / "none.yaml")


def test_waypoints_without_truth_are_said(logpose, drive, landmarks, rewrite, tmp_path):
    blind = rewrite(lambda e: None if e.topic == "/ground_truth/pose" else e)
    places = drive.with_suffix(".waypoints.yaml")
    done = logpose("localize-pf", blind, "--map", landmarks, "-q", "-o", tmp_path / "o", "--waypoints", places)
    assert done.status == 0
    assert done.err.splitlines()[-1] == (
        "evaluate: waypoints are given, but there is no truth to find their passes in. Pass --reference FILE."
    )


def test_a_reader_that_goes_away_in_the_middle_ends_the_run_quietly(drive, landmarks):
    words = [sys.executable, "-m", "logpose", "detect-circles", str(drive), "--map", str(landmarks), "-q", "-o", "-"]
    read_end, write_end = os.pipe()
    os.close(read_end)
    done = subprocess.run(words, stdout=write_end, stderr=subprocess.PIPE, text=True, check=False)
    os.close(write_end)
    assert (done.returncode, done.stderr) == (141, "")


def test_a_full_disk_is_said_in_one_line(drive, landmarks):
    words = [sys.executable, "-m", "logpose", "detect-circles", str(drive), "--map", str(landmarks), "-q", "-o", "-"]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 1
    assert "No space left on device" in done.stderr
    assert done.stderr.count("\n") == 1
