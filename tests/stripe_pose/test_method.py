"""Marks found in images that are drawn by formula: where they are, how sure, and what is no mark."""

import numpy as np
import pytest

from logpose.formats.products import StripeMark
from logpose.pipelines.stripe_pose.method import find_marks
from logpose.pipelines.stripe_pose.scene import Scene, Search
from logpose.pipelines.stripe_pose.solve import Attitude

from .conftest import GAPS, eye_of, mark_of, picture

PRIOR = {"tilt_sd": np.radians(4), "roll_sd": np.radians(2)}
OTHER = (0.020, 0.032, 0.036, 0.020, 0.028, 0.024, 0.040)


def scene_of(image, eye):
    from logpose.pipelines.stripe_pose.edges import filter_taps

    return Scene(image, eye, Search(), filter_taps(), 1.0)


def found_in(image, marks, **search):
    return find_marks(image, eye_of(**PRIOR), marks, Search(**search))


@pytest.mark.parametrize("phi", [-60, -30, 0, 40, 65])
@pytest.mark.parametrize("distance", [0.5, 1.0])
def test_a_mark_is_where_it_is_drawn(phi, distance):
    pose = np.array([np.radians(phi), 0.03, distance])
    (found,) = found_in(picture(mark_of(), pose, tilt=0.03, roll=0.005, noise=2.0, seed=1), [mark_of()])
    assert (found.mark, found.status, len(found.members)) == (0, "ok", 8)
    error = found.pose - pose
    assert error @ np.linalg.solve(found.cov[:3, :3], error) < 21.1  # chi-square of 3, one in ten thousand
    assert found.attitude == pytest.approx([0.03, 0.005], abs=0.02)


def test_the_columns_are_those_of_the_middle_row():
    pose = np.array([0.3, 0.05, 0.8])
    (found,) = found_in(picture(mark_of(), pose, dz=0.15, roll=0.03), [mark_of()])
    u = (np.cos(0.3) * mark_of().edges + 0.05) / (np.sin(0.3) * mark_of().edges + 0.8)
    assert found.lines[:, 0] == pytest.approx(319.5 + 600 * u / np.cos(0.03), abs=0.15)  # at the row of the axis
    assert found.lines[:, 1] == pytest.approx(np.tan(0.03), rel=0.05)
    assert np.all(found.lines[:, 2] < found.lines[:, 3])


def test_marks_are_told_apart_by_their_gaps():
    pose = np.array([-0.3, -0.05, 0.9])
    marks = [mark_of(GAPS, id=3), mark_of(OTHER, id=8)]
    assert [f.mark for f in found_in(picture(marks[0], pose), marks)] == [3]
    assert [f.mark for f in found_in(picture(marks[1], pose), marks)] == [8]


def test_two_marks_in_one_image_are_both_found():
    a, b = mark_of(GAPS, id=1), mark_of(OTHER, id=2)
    left = picture(a, np.array([0.2, -0.2, 1.0]), noise=1.0)
    right = picture(b, np.array([-0.2, 0.2, 1.0]), noise=1.0)
    image = np.hstack([left[:, :320], right[:, 320:]])
    assert [(f.mark, f.status) for f in found_in(image, [a, b])] == [(1, "ok"), (2, "ok")]


def test_two_marks_that_look_alike_are_ambiguous():
    marks = [mark_of(id=1), mark_of(id=2)]
    found = found_in(picture(marks[0], np.array([0.2, 0.0, 0.8])), marks)
    assert [(f.mark, f.status) for f in found] == [(1, "ambiguous"), (2, "ambiguous")]
    assert np.all(np.isfinite(found[0].pose))


def test_an_identity_that_is_given_settles_it():
    marks = [mark_of(id=1), mark_of(id=2)]
    image = picture(marks[0], np.array([0.2, 0.0, 0.8]))
    assert [(f.mark, f.status) for f in found_in(image, marks, given=2)] == [(2, "ok")]


def test_a_mirrored_image_is_said_to_be_one():
    image = picture(mark_of(), np.array([0.3, 0.0, 0.8]))
    (found,) = found_in(np.ascontiguousarray(image[:, ::-1]), [mark_of()])
    assert found.status == "mirrored_or_back"
    assert np.all(np.isnan(found.pose))


def test_a_mark_far_away_is_poor_geometry_or_none():
    image = picture(mark_of(), np.array([0.0, 0.0, 6.0]), height=0.3)
    assert all(f.status == "poor_geometry" for f in found_in(image, [mark_of()]))


@pytest.mark.parametrize("columns", [(0, 12), (0, 30)])
def test_a_post_before_an_end_of_the_mark_hides_edges_and_no_more(columns):
    mark, pose = mark_of(height=0.1), np.array([0.1, 0.0, 0.6])
    image = picture(mark, pose, noise=1.0)
    left = int(319.5 + 600 * (mark.edges[0] / 0.6)) - 4
    image[:, left + columns[0] : left + columns[1]] = 150
    (found,) = found_in(image, [mark])
    assert (found.mark, found.status) == (0, "ok")
    error = found.pose - pose
    assert error @ np.linalg.solve(found.cov[:3, :3], error) < 21.1


def test_skipped_edges_inside_the_mark_do_no_harm():
    mark, pose = mark_of(), np.array([0.0, 0.0, 0.6])
    image = picture(mark, pose)
    middle = int(319.5 + 600 * 0.5 * (mark.edges[3] + mark.edges[4]) / 0.6)
    image[:, middle - 3 : middle + 3] = 90  # a wire before a dark gap
    (found,) = found_in(image, [mark])
    assert found.status == "ok"
    assert np.abs(found.pose - pose).max() < 2e-3


def test_three_lines_tell_no_mark_but_give_a_pose_of_a_given_one():
    mark = StripeMark(id=0, lines=np.array([-0.06, 0.0, 0.06]), bars=None, pose=np.zeros(3))
    shown = StripeMark(id=0, lines=np.array([-0.06, 0.0, 0.06]), bars=np.full(3, 0.03), pose=np.zeros(3))
    pose = np.array([0.4, 0.02, 0.7])
    (found,) = found_in(picture(shown, pose, wall=40.0), [mark], given=0)
    assert found.status == "unverified"
    assert found.pose == pytest.approx(pose, abs=2e-3)


def test_three_lines_alone_are_nothing():
    mark = StripeMark(id=0, lines=np.array([-0.06, 0.0, 0.06]), bars=None, pose=np.zeros(3))
    shown = StripeMark(id=0, lines=np.array([-0.06, 0.0, 0.06]), bars=np.full(3, 0.03), pose=np.zeros(3))
    assert found_in(picture(shown, np.array([0.4, 0.02, 0.7]), wall=40.0), [mark]) == []


def test_three_lines_of_a_level_camera_have_a_covariance():
    mark = StripeMark(id=0, lines=np.array([-0.06, 0.0, 0.06]), bars=None, pose=np.zeros(3))
    shown = StripeMark(id=0, lines=np.array([-0.06, 0.0, 0.06]), bars=np.full(3, 0.03), pose=np.zeros(3))
    image = picture(shown, np.array([0.4, 0.02, 0.7]), wall=40.0, noise=1.0)
    (found,) = find_marks(image, eye_of(), [mark], Search(given=0))
    assert found.status == "unverified"
    assert np.all(np.isfinite(found.cov))


def test_a_mark_that_hangs_in_two_places_is_disputed():
    left = picture(mark_of(), np.array([0.2, -0.2, 1.0]), noise=1.0)
    right = picture(mark_of(), np.array([-0.2, 0.2, 1.0]), noise=1.0)
    found = found_in(np.hstack([left[:, :320], right[:, 320:]]), [mark_of()])
    assert [f.status for f in found] == ["ambiguous", "ambiguous"]


@pytest.mark.parametrize("lens", [None, (-0.3, 0.08, 0.0, 0.0, 0.0)])
@pytest.mark.parametrize("place", [0.0, 0.35])
def test_a_lens_that_bends_lines_moves_no_edge_of_a_fine_mark(lens, place):
    """Tilted and rolled, with gaps of 6 px, taken apart by their brightness over all rows."""
    mark, pose = mark_of(), np.array([0.3, place, 1.75])
    eye = eye_of(tilt=0.15, roll=0.1, tilt_sd=0.02, roll_sd=0.02, lens=lens)
    for seed in range(3):
        image = picture(mark, pose, tilt=0.15, roll=0.1, height=0.3, noise=1.0, seed=seed, lens=lens)
        (found,) = find_marks(image, eye, [mark], Search())
        assert found.gap_px < 7.0
        error = found.pose - pose
        assert error @ np.linalg.solve(found.cov[:3, :3], error) < 21.1


def test_an_edge_that_the_lens_brings_into_the_image_is_hidden_by_something():
    """Where the camera without a lens would not see the last edges, this one does; so a part is not merely cut off."""
    from logpose.pipelines.stripe_pose.measure import measure
    from logpose.pipelines.stripe_pose.plausible import is_cut_off
    from logpose.pipelines.stripe_pose.solve import solve

    mark, pose = mark_of(), np.array([0.0, 0.222, 0.6])
    lens = (-0.3, 0.0, 0.0, 0.0, 0.0)
    u = 319.5 + 600 * (mark.edges + 0.222) / 0.6
    assert u[-1] > 640
    verdicts = []
    for bent in (lens, None):
        eye = eye_of(lens=bent)
        r = (mark.edges + 0.222) / 0.6
        columns = u if bent is None else 319.5 + 600 * r * (1 + lens[0] * r**2)
        columns[-1] = np.nan
        image = picture(mark, pose, lens=bent)
        scene = scene_of(image, eye)
        measured = measure(scene, mark, 240, columns)
        assert measured.members.tolist() == list(range(7))
        verdicts.append(is_cut_off(measured, mark, solve(measured.lines, eye.attitude), scene))
    assert verdicts == [False, True]


def test_the_height_of_the_bars_fixes_the_distance_of_a_turned_mark():
    pose = np.array([np.radians(55), 0.0, 1.0])
    image = picture(mark_of(), pose, noise=3.0, seed=5)
    (plain,) = found_in(image, [mark_of()])
    (better,) = found_in(image, [mark_of(height=0.1)])
    assert better.cov[2, 2] < 0.5 * plain.cov[2, 2]
    assert abs(better.pose[2] - 1.0) < 4 * np.sqrt(better.cov[2, 2])


@pytest.mark.parametrize("image", [np.full((480, 640), 128, np.uint8), np.zeros((480, 640), np.uint8)])
def test_an_empty_image_has_no_mark(image):
    assert found_in(image, [mark_of()]) == []


def test_noise_has_no_mark():
    rng = np.random.default_rng(6)
    image = np.clip(128 + 30 * rng.standard_normal((480, 640)), 0, 255).astype(np.uint8)
    assert found_in(image, [mark_of(), mark_of(OTHER, id=1)]) == []


@pytest.mark.parametrize("period", [8, 11, 16, 23, 40])
def test_a_fence_is_no_mark(period):
    u = np.arange(640)
    row = np.where((u // period) % 2 == 0, 60, 190).astype(np.uint8)
    assert found_in(np.tile(row, (480, 1)), [mark_of(), mark_of(OTHER, id=1)]) == []


def test_brighter_light_and_a_larger_world_change_nothing_that_counts():
    pose = np.array([0.35, 0.02, 0.9])
    (dim,) = found_in(picture(mark_of(), pose, black=20, white=100), [mark_of()])
    (bright,) = found_in(picture(mark_of(), pose, black=40, white=240), [mark_of()])
    assert dim.pose == pytest.approx(bright.pose, abs=2e-3)
    twice = mark_of(tuple(2 * g for g in GAPS))
    (large,) = found_in(picture(twice, pose * [1, 2, 2], height=0.2, margin=0.06), [twice])
    (small,) = found_in(picture(mark_of(), pose), [mark_of()])
    assert large.pose == pytest.approx(small.pose * [1, 2, 2], abs=1e-3)


def test_the_paper_s_leaning_mark_is_another_model():
    pose = np.array([0.6, 0.0, 0.7])
    image = picture(mark_of(), pose, tilt=0.15)
    eye = eye_of(tilt=0.15)
    (camera,) = find_marks(image, eye, [mark_of()], Search())
    (paper,) = find_marks(image, eye, [mark_of()], Search(is_leaning=True))
    assert camera.pose == pytest.approx(pose, abs=1e-3)
    # tan(estimate) = tan(phi) / cos(tilt): what the paper's model makes of a tilted camera.
    assert np.tan(paper.pose[0]) == pytest.approx(np.tan(0.6) / np.cos(0.15), rel=2e-3)


def test_a_camera_that_is_not_level_leans_its_lines():
    image = picture(mark_of(), np.array([0.2, 0.0, 0.7]), roll=0.05)
    (trusting,) = find_marks(image, eye_of(), [mark_of()], Search())
    assert trusting.lean == pytest.approx(0.05, abs=0.005)
    (told,) = find_marks(image, eye_of(roll=0.05), [mark_of()], Search())
    assert told.lean < 0.005
    assert eye_of().attitude == Attitude()


def test_a_part_of_equally_spaced_bars_is_ambiguous():
    even = mark_of((0.03,) * 7)
    pose = np.array([0.1, 0.0, 0.6])
    image = picture(even, pose, noise=1.0)
    left = int(319.5 + 600 * (even.edges[0] / 0.6))
    image[:, left - 40 : left + 45] = 150  # a post hides the first bar, and which bar is the first
    found = found_in(image, [even])
    assert found
    assert all(item.status == "ambiguous" for item in found)
