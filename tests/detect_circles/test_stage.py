"""The stages: one record per image, what it holds, and every mistake of a user in one line."""

import numpy as np
import pytest

from logpose.formats.calibration import Calibration, write_calibration
from logpose.formats.errors import ConfigError
from logpose.formats.events import NO_ID, Image, Mount, Notice, Odometry, Sightings
from logpose.formats.maps.landmarks import write_landmarks
from logpose.formats.products import LandmarkMap
from logpose.pipelines.detect_circles.overlay import draw_overlay
from logpose.pipelines.detect_circles.params import DetectCirclesParams, WriteOverlaysParams
from logpose.pipelines.detect_circles.stage import detect_circles, write_overlays
from logpose.pipelines.images.canvas import GREEN, ORANGE

CALIBRATION = Calibration(160, 120, 160.0, 160.0, 80.0, 60.0)


def image_event(pixels, *, stamp=7, calibration=CALIBRATION, mount=None, topic="/ceiling/image_raw"):
    height, width = pixels.shape
    return Image(
        stamp=stamp,
        source="image",
        topic=topic,
        encoding="mono8",
        data=pixels.reshape(-1),
        width=width,
        height=height,
        step=width,
        calibration=calibration,
        mount=mount,
    )


def run(event, **params):
    made = list(detect_circles(event, DetectCirclesParams(**params)))
    assert all(m.stamp == event.stamp and m.source == "detect-circles" for m in made)
    (sightings,) = [m for m in made if isinstance(m, Sightings)]
    return sightings, [m for m in made if isinstance(m, Notice)]


@pytest.fixture(scope="module")
def lamp(draw, shapes):
    disc, _ = shapes
    return draw([disc(100.0, 30.0, 12.0)])


def heights(tmp_path, *z):
    path = tmp_path / "map.yaml"
    positions = np.array([[float(i), 0.0, value] for i, value in enumerate(z)])
    write_landmarks(LandmarkMap(ids=np.arange(len(z)), positions=positions), path)
    return str(path)


@pytest.mark.parametrize(("method", "tolerance"), [("best", 0.001), ("paper", 0.03)])
def test_a_lamp_is_sighted_where_it_is(lamp, method, tolerance):
    sightings, _ = run(image_event(lamp), ceiling_m=2.0, method=method)
    # u = +20 is 0.25 m to the left, v = -30 is 0.375 m ahead, at h / f = 2 / 160 m per pixel
    np.testing.assert_allclose(sightings.xy, [[0.375, 0.25]], atol=tolerance)
    assert sightings.frame_id == "base_link"
    assert sightings.ids.tolist() == [NO_ID]
    assert sightings.cov.shape == (1, 2, 2)
    assert 0 < sightings.score[0] <= 1


@pytest.mark.parametrize("method", ["best", "paper"])
def test_an_empty_image_gives_an_empty_record(method):
    sightings, _ = run(image_event(np.full((120, 160), 80, np.uint8)), ceiling_m=2.0, method=method)
    assert sightings.xy.shape == (0, 2)
    assert sightings.cov.shape == (0, 2, 2)
    assert sightings.ids.dtype == np.int64


def test_the_mount_of_the_log_wins_over_the_parameters(lamp):
    half_turn = Mount(translation=np.array([0.1, 0.0, 0.5]), rotation=np.array([0.0, 0.0, -np.sqrt(0.5), np.sqrt(0.5)]))
    sightings, _ = run(image_event(lamp, mount=half_turn), ceiling_m=2.5, mount_x_m=9.0)
    np.testing.assert_allclose(sightings.xy, [[0.1 - 0.375, -0.25]], atol=0.001)


def test_mount_parameters_are_used_without_one(lamp):
    sightings, _ = run(image_event(lamp), ceiling_m=2.5, mount_x_m=0.1, mount_z_m=0.5, mount_yaw_deg=180.0)
    np.testing.assert_allclose(sightings.xy, [[0.1 - 0.375, -0.25]], atol=0.001)


def test_a_mirrored_image_is_mirrored_back(lamp):
    mirrored, _ = run(image_event(np.ascontiguousarray(lamp[:, ::-1])), ceiling_m=2.0, flip_x=True)
    straight, _ = run(image_event(lamp), ceiling_m=2.0)
    np.testing.assert_allclose(mirrored.xy, straight.xy, atol=2e-4)
    np.testing.assert_allclose(mirrored.uv[:, 0], 159 - straight.uv[:, 0], atol=0.02)


def test_tilt_widens_the_covariance(lamp):
    level, _ = run(image_event(lamp), ceiling_m=2.0)
    tilted, _ = run(image_event(lamp), ceiling_m=2.0, tilt_deg=0.5)
    grown = np.diag(tilted.cov[0] - level.cov[0])
    assert (grown > 0.9 * (2.0 * np.radians(0.5)) ** 2).all()


def test_the_height_comes_from_the_map(lamp, tmp_path):
    sightings, _ = run(image_event(lamp), map=heights(tmp_path, 2.0, 2.0, 2.01))
    np.testing.assert_allclose(sightings.xy, [[0.375, 0.25]], atol=0.001)
    higher, _ = run(image_event(lamp), map=heights(tmp_path, 2.0, 2.0, 2.01), ceiling_m=4.0)
    np.testing.assert_allclose(higher.xy, [[0.75, 0.5]], atol=0.002)


def test_a_calibration_file_wins_over_the_log(lamp, tmp_path):
    path = tmp_path / "camera.yaml"
    write_calibration(Calibration(160, 120, 80.0, 80.0, 80.0, 60.0), path)
    sightings, _ = run(image_event(lamp), ceiling_m=2.0, camera=str(path))
    np.testing.assert_allclose(sightings.xy, [[0.75, 0.5]], atol=0.002)


def test_an_unknown_lamp_size_is_said_and_a_known_one_is_not(lamp):
    _, notices = run(image_event(lamp), ceiling_m=2.0)
    assert [n.message for n in notices] == [
        "the size of the lamps is not known, so circles of 4 to 16 px radius are looked for; "
        "--lamp-diameter M narrows that."
    ]
    assert notices[0].code == "radius-range"
    sightings, notices = run(image_event(lamp), ceiling_m=2.0, lamp_diameter_m=0.3)
    assert (len(sightings.xy), notices) == (1, [])
    sightings, _ = run(image_event(lamp), ceiling_m=2.0, lamp_diameter_m=0.6)
    assert len(sightings.xy) == 0


@pytest.mark.parametrize(
    ("change", "params", "message"),
    [
        (
            {"calibration": None},
            {"ceiling_m": 2.0},
            "detect-circles: there is no calibration for the images on /ceiling/image_raw (no CameraInfo in the log, "
            "or one with focal length 0: the camera is not calibrated). "
            "Pass one with --camera FILE.",
        ),
        (
            {"calibration": Calibration(640, 480, 160.0, 160.0, 80.0, 60.0)},
            {"ceiling_m": 2.0},
            "detect-circles: the images on /ceiling/image_raw are 160x120 px, their calibration is for 640x480 px. "
            "Give the calibration of this camera and image size with --camera FILE.",
        ),
        (
            {"calibration": Calibration(160, 120, 0.0, 160.0, 80.0, 60.0)},
            {"ceiling_m": 2.0},
            "detect-circles: the focal lengths are fx=0.0, fy=160.0 px; both must be positive.",
        ),
        (
            {},
            {},
            "detect-circles: the height of the ceiling is not known. Pass it with --ceiling M (above base_link), "
            "or a landmark map with --map FILE.",
        ),
        (
            {},
            {"ceiling_m": 0.3, "mount_z_m": 0.32},
            "detect-circles: the ceiling, 0.3 m above base_link, is not above the lens, 0.32 m above it.",
        ),
        (
            {},
            {"ceiling_m": 2.0, "min_radius_px": 20.0, "max_radius_px": 10.0},
            "detect-circles: the radius range is 20 to 10 px; "
            "the smallest must be at least 1.5 px and below the greatest.",
        ),
    ],
)
def test_every_mistake_is_one_line(lamp, change, params, message):
    with pytest.raises(ConfigError) as caught:
        run(image_event(lamp, **change), **params)
    assert str(caught.value) == message


def test_a_map_that_gives_no_height_is_an_error(lamp, tmp_path):
    mixed = heights(tmp_path, 2.4, 2.5)
    with pytest.raises(ConfigError) as caught:
        run(image_event(lamp), map=mixed)
    assert str(caught.value) == (
        f"detect-circles: the landmarks of {mixed} lie at heights from 2.4 to 2.5 m, not on one ceiling. "
        "Pass the height of the features to look for with --ceiling M."
    )
    (tmp_path / "flat").mkdir()
    flat = heights(tmp_path / "flat", 0.0, 0.0)
    with pytest.raises(ConfigError) as caught:
        run(image_event(lamp), map=flat)
    assert (
        str(caught.value) == f"detect-circles: the landmarks of {flat} have no height (z_m). Pass it with --ceiling M."
    )


def test_overlays_are_written_for_every_nth_image_and_all_events_forwarded(lamp, tmp_path):
    events = []
    for stamp in range(5):
        image = image_event(lamp, stamp=stamp)
        events += [image, *detect_circles(image, DetectCirclesParams(ceiling_m=2.0)), Odometry(stamp=stamp)]
    folder = tmp_path / "pictures"
    passed = list(write_overlays(iter(events), WriteOverlaysParams(path=str(folder), every=2)))
    assert passed == events
    assert sorted(p.name for p in folder.iterdir()) == ["0.png", "2.png", "4.png"]
    assert (folder / "0.png").read_bytes()[:4] == b"\x89PNG"


def test_an_overlay_marks_whole_lamps_green_and_cut_ones_orange(lamp):
    uv, radius, score = np.array([[100.0, 30.0], [3.0, 80.0], [np.nan, 5.0]]), np.array([12.0, 9.0, 5.0]), np.ones(3)
    before = lamp.copy()
    picture = draw_overlay(lamp, uv, radius, score)
    assert picture.shape == (120, 160, 3)
    for (u, v), colour in (((88, 30), GREEN), ((12, 80), ORANGE)):  # on the outlines, smoothed into their ground
        assert np.abs(picture[v, u].astype(int) - colour).sum() < 0.5 * np.abs(lamp[v, u] - np.array(colour)).sum()
    np.testing.assert_array_equal(lamp, before)


@pytest.mark.parametrize("method", ["best", "paper"])
def test_a_picture_of_which_nothing_is_known_has_circles_in_the_image_only(lamp, method):
    seen, (notice,) = run(image_event(lamp, calibration=None), method=method)
    assert np.abs(seen.uv - [100.0, 30.0]).max() < (0.1 if method == "best" else 2.0)  # Hough counts in whole pixels
    assert np.isnan(seen.xy).all()
    assert np.isnan(seen.cov).all()
    assert notice.message == (
        "neither camera nor ceiling is known: circles of 4 to 16 px radius are given in the image, without a place on "
        "the robot. Pass --camera FILE and --ceiling M for that."
    )
