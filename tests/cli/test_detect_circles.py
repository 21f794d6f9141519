"""What a user of ``logpose detect-circles`` types and gets: logs, folders of images, one image, streams, pictures."""

import json
import re

import cv2
import numpy as np
import pytest

from logpose.formats.calibration import write_calibration
from logpose.formats.events import CameraInfo, Image
from logpose.formats.maps.landmarks import read_landmarks
from logpose.formats.png import write_png

N_PHOTOS = 4
HEADER = {"logpose": "sightings/1"}


def records(text):
    """The lines of a sightings.jsonl after its header."""
    first, *lines = map(json.loads, text.splitlines())
    assert first == HEADER
    return lines


def centres(record):
    return np.array([[s["u_px"], s["v_px"]] for s in record["sightings"]]).reshape(-1, 2)


@pytest.fixture(scope="module")
def images(events):
    return [event for event in events if isinstance(event, Image)][:N_PHOTOS]


@pytest.fixture(scope="module")
def camera(events, tmp_path_factory):
    path = tmp_path_factory.mktemp("camera") / "camera.yaml"
    write_calibration(next(e for e in events if isinstance(e, CameraInfo)).calibration, path)
    return path


@pytest.fixture(scope="module")
def photos(images, tmp_path_factory):
    """The first images of the drive as PNGs that are named by their stamps, and one where nothing is to be seen."""
    folder = tmp_path_factory.mktemp("photos")
    for image in images:
        write_png(folder / f"{image.stamp}.png", image.data.reshape(image.height, image.width))
    dark = np.zeros((images[0].height, images[0].width), np.uint8)
    write_png(folder / f"{images[-1].stamp + 125_000_000}.png", dark)
    return folder


@pytest.fixture
def detect(logpose, camera):
    """Run over pictures, of which nothing else is known."""

    def run(source, *words):
        return logpose("detect-circles", source, "--camera", camera, "--ceiling", 2.74, "-q", *words)

    return run


def test_a_log_gives_one_record_per_image_on_standard_output(logpose, drive, landmarks, images, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = logpose("detect-circles", drive, "--map", landmarks, "--duration", "0.5", "-q", "-o", "-")
    assert done.status == 0
    found = records(done.out)
    assert [r["stamp_ns"] for r in found] == [image.stamp for image in images]
    assert {r["frame_id"] for r in found} == {"base_link"}
    assert list(tmp_path.iterdir()) == [], "-o - leaves nothing behind"


def test_what_is_found_in_a_log_is_where_the_map_says(logpose, drive, landmarks, images):
    done = logpose("detect-circles", drive, "--map", landmarks, "--duration", "0.1", "-q", "-o", "-")
    # The robot starts in A (2, 1.8) and looks at B, along x; a lamp that is wholly in view scores high.
    sure = [s for s in records(done.out)[0]["sightings"] if s["score"] > 0.9]
    seen = np.array([[s["x_m"], s["y_m"]] for s in sure]) + np.array([2.0, 1.8])
    distances = np.linalg.norm(seen[:, None] - read_landmarks(landmarks).positions[None, :, :2], axis=2).min(axis=1)
    # 5 mm of survey and 0.2 deg of tilt (10 mm at 2.74 m), both 3 sigma.
    assert len(sure) >= 2
    assert np.sort(distances)[: len(sure) - 1].max() < 0.04, distances


def test_a_folder_of_images_gives_what_the_log_gives(detect, logpose, drive, landmarks, photos):
    log = records(logpose("detect-circles", drive, "--map", landmarks, "--duration", "0.5", "-q", "-o", "-").out)
    folder = records(detect(photos, "-o", "-").out)
    assert len(folder) == N_PHOTOS + 1
    for a, b in zip(log, folder, strict=False):
        assert a["stamp_ns"] == b["stamp_ns"]
        # The file holds the calibration as decimals, and the wide angle that search depends on the mount: not bit by bit.
        assert centres(a) == pytest.approx(centres(b), abs=2e-3)


def test_an_image_with_nothing_in_it_has_a_record_too(detect, photos):
    assert records(detect(photos, "-o", "-").out)[-1]["sightings"] == []


def test_one_image_file_works_and_has_stamp_0(detect, photos, images, tmp_path):
    pixels = cv2.imread(str(photos / f"{images[0].stamp}.png"), cv2.IMREAD_GRAYSCALE)
    for name in ("ceiling.png", "ceiling.jpg"):
        cv2.imwrite(str(tmp_path / name), pixels)
        (record,) = records(detect(tmp_path / name, "-o", "-").out)
        assert record["stamp_ns"] == 0
        assert len(record["sightings"]) >= 3


def test_the_run_folder_holds_sightings_report_and_pipeline(detect, photos, tmp_path):
    out = tmp_path / "out"
    done = detect(photos, "-o", out, "--json")
    assert done.status == 0
    assert sorted(p.name for p in out.iterdir()) == ["report.json", "result.mcap", "run.yaml", "sightings.jsonl"]
    assert len(records((out / "sightings.jsonl").read_text())) == N_PHOTOS + 1
    report = json.loads(done.out)
    assert report == json.loads((out / "report.json").read_text())
    assert report["messages"]["/image"] == {
        "announced": N_PHOTOS + 1, "read": N_PHOTOS + 1, "used": N_PHOTOS + 1, "dropped": 0, "why": {}
    }  # fmt: skip


def test_the_run_folder_is_named_after_log_and_command_if_it_is_not_named(
    detect, photos, images, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    assert detect(photos / f"{images[0].stamp}.png").status == 0
    assert [p.name for p in tmp_path.iterdir()] == [f"{images[0].stamp}.detect-circles"]


def test_four_threads_write_the_same_bytes_as_one(logpose, drive, landmarks):
    one, four = (logpose("detect-circles", drive, "--map", landmarks, "-q", "-o", "-", "--workers", n) for n in (1, 4))
    assert one.status == four.status == 0
    assert one.out == four.out
    assert len(records(one.out)) == 35


def test_overlays_are_a_picture_per_image_with_colour_where_circles_are(detect, photos, images, tmp_path):
    out = tmp_path / "out"
    assert detect(photos, "--overlays", "pictures", "-o", out).status == 0
    drawn = sorted((out / "pictures").glob("*.png"))
    assert [p.name for p in drawn] == sorted(p.name for p in photos.iterdir())
    picture = cv2.imread(str(drawn[0])).astype(int)
    assert picture.shape == (images[0].height, images[0].width, 3)
    record = records((out / "sightings.jsonl").read_text())[0]
    u, v = centres(record)[np.argmax([s["score"] for s in record["sightings"]])].round().astype(int)
    assert np.ptp(picture[v, u]) > 50, "no cross on the best circle"
    nothing = cv2.imread(str(drawn[-1]))
    assert np.ptp(nothing) == 0, "something is drawn where nothing was found"


def test_overlays_are_written_also_beside_a_stream(detect, photos, tmp_path):
    done = detect(photos, "--overlays", tmp_path / "pictures", "-o", "-")
    assert len(records(done.out)) == len(list((tmp_path / "pictures").glob("*.png"))) == N_PHOTOS + 1


def test_the_papers_method_finds_the_big_lamps_too(detect, photos):
    paper = records(detect(photos, "--method", "paper", "--lamp-diameter", "0.15", "-o", "-").out)
    best = records(detect(photos, "-o", "-").out)
    assert [r["stamp_ns"] for r in paper] == [r["stamp_ns"] for r in best]
    assert paper[0]["sightings"], "nothing found"
    # HoughCircles gives centres on half pixels and errs by a pixel or two; each must be one that the other finds too.
    for a, b in zip(paper, best, strict=True):
        if a["sightings"]:
            apart = np.linalg.norm(centres(a)[:, None] - centres(b)[None], axis=2).min(axis=1)
            assert np.median(apart) < 2.0


def test_a_radius_range_that_nobody_gave_is_said_once(logpose, photos, camera):
    done = logpose("detect-circles", photos, "--camera", camera, "--ceiling", 2.74, "-o", "-")
    assert done.err == (
        "detect-circles: the size of the lamps is not known, so circles of 6 to 48 px radius are looked for; "
        "--lamp-diameter M narrows that.\n"
    )


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (
            ["--ceiling", "2.74"],
            "detect-circles: there is no calibration for the images on /image (no CameraInfo in the log, "
            "or one with focal length 0: the camera is not calibrated). "
            "Pass one with --camera FILE.\n",
        ),
        (
            ["--camera", "CAMERA"],
            "detect-circles: the height of the ceiling is not known. Pass it with --ceiling M (above base_link), "
            "or a landmark map with --map FILE.\n",
        ),
        (
            ["--camera", "CAMERA", "--ceiling", "0"],
            "--ceiling: detect-circles cannot take ceiling_m = 0.0: input should be greater than 0. "
            "ceiling_m is: height of the features above base_link [m].\n",
        ),
        (
            ["--camera", "nowhere.yaml", "--ceiling", "2.74"],
            "nowhere.yaml: no such file. Check the path.\n",
        ),
        (
            ["--camera", "CAMERA", "--ceiling", "2.74", "--json"],
            "--json: -o - leaves no report, only the result. Name a folder with -o DIR.\n",
        ),
        (
            ["--camera", "CAMERA", "--ceiling", "2.74", "--depfile", "x.d"],
            "--depfile: -o - leaves no report, only the result. Name a folder with -o DIR.\n",
        ),
        (
            ["--method", "hough"],
            "logpose detect-circles: invalid value for '--method': 'hough' is not one of 'best', 'paper'. "
            "See logpose detect-circles --help.\n",
        ),
    ],
)  # fmt: skip
def test_what_is_missing_or_wrong_is_one_line(logpose, photos, camera, words, line):
    done = logpose("detect-circles", photos, "-q", "-o", "-", *(camera if w == "CAMERA" else w for w in words))
    assert done.err == line
    assert done.status == (1 if "no such file" in line else 2)
    assert '"sightings":' not in done.out


@pytest.mark.parametrize("words", [["-o", "-"], ["-o", "OUT"]])
def test_a_log_without_images_says_so_and_leaves_nothing(logpose, rewrite, landmarks, tmp_path, words):
    log = rewrite(lambda e: None if isinstance(e, Image) else e)
    out = tmp_path / "out"
    done = logpose("detect-circles", log, "--map", landmarks, *(out if w == "OUT" else w for w in words))
    assert (done.status, done.out) == (2, "")
    assert done.err == (
        "detect-circles: there are no images in this log, or in this part of it. "
        "Name their topic with --topic image=/NAME.\n"
    )
    assert not out.exists() or list(out.iterdir()) == []


def test_an_image_of_another_size_is_refused_by_name(logpose, camera, photos, images, tmp_path):
    small = tmp_path / "small.png"
    cv2.imwrite(str(small), np.zeros((240, 320), np.uint8))
    done = logpose("detect-circles", small, "--camera", camera, "--ceiling", 2.74, "-q", "-o", "-")
    assert done.status == 2
    assert done.err == (
        "detect-circles: the images on /image are 320x240 px, their calibration is for 480x360 px. "
        "Give the calibration of this camera and image size with --camera FILE.\n"
    )


def test_a_picture_cut_short_is_lost_and_the_others_are_not(detect, photos, images, tmp_path):
    folder = tmp_path / "photos"
    folder.mkdir()
    for path in photos.iterdir():
        (folder / path.name).write_bytes(path.read_bytes())
    cut = folder / f"{images[1].stamp}.png"
    cut.write_bytes(cut.read_bytes()[:200])
    done = detect(folder, "-o", tmp_path / "out")
    assert done.status == 3
    assert "detect-circles: /image holds a damaged png image; it is skipped.\n" in done.err
    records = (tmp_path / "out" / "sightings.jsonl").read_text().splitlines()[1:]
    assert [json.loads(line)["stamp_ns"] for line in records] == sorted(int(p.stem) for p in folder.iterdir())
    assert json.loads(records[1])["sightings"] == []


def test_a_log_cut_short_of_its_first_image_says_so(logpose, drive, tmp_path):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(drive.read_bytes()[:3000])
    done = logpose("detect-circles", cut, "--ceiling", "2.74", "-o", tmp_path / "out")
    assert (done.status, done.out) == (2, "")
    assert "there are no images in this log" in done.err
    assert re.search(r" Note that .*cut\.mcap: the file is cut off at byte \d+ of 3000; [^\n]*\.\n$", done.err)
    assert done.err.count("\n") == 1
    assert not (tmp_path / "out").exists()
