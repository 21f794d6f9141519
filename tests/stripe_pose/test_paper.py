"""The paper's own forms and its way from the image to them."""

import numpy as np
import pytest

from logpose.formats.products import StripeMark
from logpose.pipelines.stripe_pose.levelling import leaning_pose
from logpose.pipelines.stripe_pose.paper import (
    PaperSearch,
    cross_ratio,
    find_marks_paper,
    general_pose,
    least_distance,
    pixel_pose,
    rising_edges,
    simplified_pose,
)
from logpose.pipelines.stripe_pose.pose import bearings, level_pose

from .conftest import eye_of, picture

X = np.array([0.0, -0.06, 0.06])
F = 16.0


def test_the_general_forms_are_the_closed_form_wherever_they_are_defined():
    rng = np.random.default_rng(0)
    for _ in range(500):
        phi_x, phi_y = rng.uniform(-0.3, 0.3, 2)
        u = bearings(np.array([rng.uniform(-1.2, 1.2), rng.uniform(-0.2, 0.2), rng.uniform(0.4, 1.5)]), X)
        if abs(u[0]) < 0.01:
            continue
        expected = leaning_pose(X, u, phi_x, phi_y)
        if abs(expected[0]) > 1.4:
            continue
        assert general_pose(X, F * u, F, phi_x, phi_y) == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_the_simplified_forms_are_the_closed_form_of_a_level_camera():
    for pose in ([0.35, 0.04, 0.6], [-0.8, -0.05, 0.9], [0.0, 0.06, 1.0]):
        u = bearings(np.array(pose), X)
        assert simplified_pose(X, F * u, F) == pytest.approx(level_pose(X, u), rel=1e-9, abs=1e-12)


def test_the_general_forms_fail_where_the_paper_recommends_to_stand():
    u = bearings(np.array([0.35, 0.0, 0.5]), X)  # the middle line on the optical axis
    with np.errstate(all="ignore"):
        assert not np.all(np.isfinite(general_pose(X, F * u, F, 0.0, 0.0)))
    assert level_pose(X, u) == pytest.approx([0.35, 0.0, 0.5], abs=1e-12)


def test_whole_pixels_by_equations_23_to_25():
    found = pixel_pose(X, np.array([256.0, 149.0, 359.0]), F / (8.8 / 512), 255.5)
    assert (np.degrees(found[0]), *(1e3 * found[1:])) == pytest.approx(
        (9.587801979982, 0.281799971424, 524.660310433479)
    )


def test_the_cross_ratio_of_equal_spacing_is_minus_three_and_a_mirror_keeps_it():
    lines = np.array([-0.06, 0.0, 0.06, 0.12])
    assert cross_ratio(lines) == pytest.approx(-3.0)
    assert cross_ratio(np.array([-0.06, 0.0, 0.04, 0.12])) == pytest.approx(-1.5)
    assert cross_ratio(np.array([150.0, 262.0, 361.0, 449.0])) == pytest.approx(-3.003348214286, abs=1e-12)
    assert cross_ratio(np.array([0.0, -0.06, 0.06, 0.12])) == pytest.approx(4.0)  # in the paper's own labels
    assert cross_ratio(-lines[::-1]) == pytest.approx(cross_ratio(lines))
    for pose in ([0.9, 0.1, 0.7], [-0.4, 0.0, 2.0]):
        assert cross_ratio(bearings(np.array(pose), lines)) == pytest.approx(-3.0, rel=1e-11)


@pytest.mark.parametrize(
    ("phi", "millimetres"),
    [(0, 218.18), (10, 225.29), (20, 225.55), (30, 218.95), (40, 205.70), (50, 186.21), (60, 161.05), (70, 131.0), (80, 96.98)],
)  # fmt: skip
def test_the_least_distance_of_a_turned_mark(phi, millimetres):
    assert 1e3 * least_distance(0.06, 16.0, 8.8, np.radians(phi)) == pytest.approx(millimetres, abs=0.006)


def test_edges_are_whole_columns_from_dark_to_bright():
    row = np.full(60, 30, np.uint8)
    row[20:30] = 220
    row[40:50] = 200
    assert rising_edges(row, 40.0).tolist() in ([19, 39], [20, 40])


@pytest.fixture
def paper_mark():
    lines = np.array([-0.06, 0.0, 0.06, 0.12])
    return StripeMark(id=4, lines=lines, bars=np.full(4, 0.03), pose=np.zeros(3))


def test_the_paper_finds_its_mark_within_the_error_of_a_pixel(paper_mark):
    pose = np.array([np.radians(20.0), 0.0, 0.6])
    image = picture(paper_mark, pose)
    (found,) = find_marks_paper(image, eye_of(), [paper_mark], PaperSearch())
    assert (found.mark, found.status) == (4, "ok")
    # Half a pixel on three lines, at worst: Fig. 7 (3.32 deg, 8.2 mm) grows with the square and the cube of the distance.
    worse = (0.6 / 0.436) ** 2 * 931.0 / 600.0
    assert abs(found.pose[0] - pose[0]) < np.radians(3.32) * worse
    assert abs(found.pose[2] - pose[2]) < 0.0082 * worse * 0.6 / 0.436
    assert np.all(np.isfinite(found.cov))


def test_the_paper_finds_nothing_where_there_is_nothing(paper_mark):
    assert find_marks_paper(np.full((480, 640), 90, np.uint8), eye_of(), [paper_mark], PaperSearch()) == []


def test_another_spacing_is_another_mark(paper_mark):
    image = picture(paper_mark, np.array([0.2, 0.0, 0.6]))
    other = StripeMark(id=5, lines=np.array([-0.06, 0.0, 0.04, 0.12]), bars=None, pose=np.zeros(3))
    assert find_marks_paper(image, eye_of(), [other], PaperSearch()) == []
