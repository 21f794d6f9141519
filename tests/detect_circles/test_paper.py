"""The paper's equations on exact vectors, and its detector."""

import numpy as np
import pytest

from logpose.pipelines.detect_circles import paper
from logpose.pipelines.detect_circles.sighting import View
from logpose.pipelines.geometry.camera import Camera
from logpose.pipelines.geometry.mount import upward

F, H = 645.333333333333, 2.42
# u, v, P, r [m], theta, elevation [deg], x, y [m]; computed independently from the corrected equations (1)-(3)
VECTORS = [
    (100, 0, 2.448882398156, 0.375, 90.0, 81.191579075734, 0.0, 0.375),
    (0, -100, 2.448882398156, 0.375, 0.0, 81.191579075734, 0.375, 0.0),
    (-100, 0, 2.448882398156, 0.375, -90.0, 81.191579075734, 0.0, -0.375),
    (0, 100, 2.448882398156, 0.375, 180.0, 81.191579075734, -0.375, 0.0),
    (200, -150, 2.595246857237, 0.9375, 53.130102354156, 68.823796923524, 0.5625, 0.75),
    (-320, 240, 2.847174037533, 1.5, -126.869897645844, 58.207928462779, -0.9, -1.2),
    (0, 0, 2.42, 0.0, 0.0, 90.0, 0.0, 0.0),
]


@pytest.mark.parametrize("row", VECTORS, ids=str)
def test_equations_give_the_known_vectors(row):
    u, v, *expected = (float(value) for value in row)
    got = [
        paper.slant_range(u, v, F, H),
        paper.horizontal_range(u, v, F, H),
        np.degrees(paper.azimuth(u, v)),
        np.degrees(paper.elevation(u, v, F)),
        *paper.to_robot(u, v, F, H),
    ]
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-9)


def test_horizontal_range_is_slant_range_times_cosine_of_elevation():
    u, v = np.random.default_rng(1).uniform(-320, 320, (2, 100))
    P, phi = paper.slant_range(u, v, F, H), paper.elevation(u, v, F)
    np.testing.assert_allclose(P * np.cos(phi), paper.horizontal_range(u, v, F, H), atol=1e-12)


def test_azimuth_is_zero_at_the_principal_point_whatever_the_sign_of_zero():
    for zero in (0.0, -0.0):
        assert paper.azimuth(np.array(0.0), np.array(zero)) == 0.0


def test_turning_left_moves_features_clockwise():
    # The robot turns left by 10 deg; a fixed feature's azimuth must fall by 10 deg.
    c, s = np.cos(np.radians(10)), np.sin(np.radians(10))
    before = np.array([1.0, 0.5])
    after = np.array([[c, s], [-s, c]]) @ before
    angles = [np.arctan2(p[1], p[0]) for p in (before, after)]
    uv = [(F / H) * np.array([p[1], -p[0]]) for p in (before, after)]
    np.testing.assert_allclose([paper.azimuth(*p) for p in uv], angles, atol=1e-12)
    assert angles[1] - angles[0] == pytest.approx(-np.radians(10))


@pytest.mark.parametrize("is_flipped", [False, True])
@pytest.mark.parametrize("yaw", [0.0, 0.4, np.pi, -2.0])
def test_the_paper_agrees_with_the_general_view_for_a_level_camera(yaw, is_flipped):
    view = View(
        Camera(F, F, 310.0, 250.0, "plumb_bob", (-0.2, 0.03, 0.0, 0.0)),
        640,
        480,
        upward(yaw),
        np.array([0.1, -0.05, 0.3]),
        2.72,
        is_flipped,
    )
    uv = np.random.default_rng(2).uniform((0, 0), (639, 479), (50, 2))
    np.testing.assert_allclose(paper.sight(uv, view), view.to_robot(uv), atol=1e-12)


def test_hough_finds_lamps_to_about_a_pixel(draw, shapes):
    disc, _ = shapes
    image = draw([disc(50.3, 60.8, 17.0), disc(110.0, 40.0, 14.0)])
    found = paper.find_circles_hough(image, paper.HoughSearch(8.0, 30.0))
    assert len(found) == 2
    np.testing.assert_allclose(found.uv, [[110.0, 40.0], [50.3, 60.8]], atol=2.0)
    np.testing.assert_allclose(found.radius, [14.0, 17.0], atol=2.5)
    assert (found.score == 1).all()


def test_hough_finds_dark_ones_only_when_asked(draw, shapes):
    disc, _ = shapes
    image = draw([disc(50.3, 60.8, 17.0)], ground=200.0, value=60.0)
    assert len(paper.find_circles_hough(image, paper.HoughSearch(8.0, 30.0, polarity="dark"))) == 1
    both = paper.find_circles_hough(image, paper.HoughSearch(8.0, 30.0, polarity="both", threshold=None))
    assert both.is_dark.any()


def test_an_image_without_lamps_has_none():
    found = paper.find_circles_hough(np.full((100, 100), 60, np.uint8), paper.HoughSearch(8.0, 30.0))
    assert len(found) == 0
    assert found.uv.shape == (0, 2)
    assert found.cov.shape == (0, 2, 2)
    assert len(paper.find_circles_hough(np.zeros((1, 1), np.uint8), paper.HoughSearch(8.0, 30.0))) == 0
