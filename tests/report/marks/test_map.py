"""What marks add to the map."""

from dataclasses import replace

import numpy as np
import pytest

from logpose.formats.products import MarkMap
from logpose.pipelines.report.drawing import LIGHT, drawing
from logpose.pipelines.report.marks.kept import MarkFindings
from logpose.pipelines.report.marks.map import (
    DOTS,
    SIGHT_LINES,
    ellipse,
    ends_of_mark,
    evenly,
    lens_of,
    magnification,
    mark_places,
)
from logpose.pipelines.report.pictures import draw_map, draw_support, support_of, view_of

LENS = np.array([0.1, -0.05])


def legend_of(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


@pytest.fixture(scope="module")
def figure(mark_findings):
    with drawing():
        return draw_map(mark_findings)


def test_a_mark_lies_along_its_heading(marked):
    mark = marked.mark(1, 2.0, 3.0, 90.0, lines=(-0.1, 0.0, 0.2), bars=0.05)
    np.testing.assert_allclose(ends_of_mark(mark), [[2.0, 2.9], [2.0, 3.25]], atol=1e-12)


def test_the_lens_is_where_the_robot_carries_it(mark_findings):
    """The robot's pose of the sighting and its mount give the same place as the mark and its pose."""
    marks = mark_findings.of(MarkFindings)
    for i in np.flatnonzero(marks.is_used)[::10]:
        x, y, heading = marks.robot[i]
        c, s = np.cos(heading), np.sin(heading)
        wanted = [x + c * LENS[0] - s * LENS[1], y + s * LENS[0] + c * LENS[1]]
        np.testing.assert_allclose(lens_of(marks, int(i), marks.mark_of(int(marks.mark[i]))), wanted, atol=1e-9)


def test_the_arrow_points_to_where_the_mark_is_seen_from(figure, mark_findings):
    arrows = [c for c in figure.axes[0].collections if hasattr(c, "U")]
    assert len(arrows) == len(mark_findings.of(MarkFindings).marks)
    for arrow, mark in zip(arrows, mark_findings.of(MarkFindings).marks.marks, strict=True):
        toward = np.array([arrow.U[0], arrow.V[0]])
        seen_from = [
            lens_of(mark_findings.of(MarkFindings), int(i), mark)
            for i in np.flatnonzero(mark_findings.of(MarkFindings).mark == mark.id)
        ]
        assert all(toward @ (lens - mark.pose[:2]) > 0 for lens in seen_from)


def test_the_legend_counts_marks_and_images(figure, mark_findings):
    n = int(mark_findings.of(MarkFindings).is_used.sum())
    labels = legend_of(figure)
    assert {"mark, recognised (4 of 5)", "mark, never recognised", f"line of sight ({SIGHT_LINES} of {n})"} <= set(
        labels
    )
    assert f"by one image alone ({n})" in labels
    assert any(label.startswith("3σ of one image") for label in labels)
    assert {text.get_text() for text in figure.axes[0].texts} == {"1", "2", "3", "4", "7"}


def test_lines_of_sight_lead_from_the_lens_to_the_mark(figure, mark_findings):
    (line,) = [line for line in figure.axes[0].lines if line.get_label().startswith("line of sight")]
    ends = np.column_stack(line.get_data()).reshape(-1, 3, 2)[:, :2]
    places = np.array([mark.pose[:2] for mark in mark_findings.of(MarkFindings).marks.marks])
    assert len(ends) == SIGHT_LINES
    assert all(np.hypot(*(places - end[1]).T).min() < 1e-9 for end in ends)
    assert all(0.4 < np.hypot(*(end[0] - end[1])) < 1.8 for end in ends)


def test_marks_that_were_seen_are_in_the_view_however_far(collect, marked):
    mark = marked.mark(1, 0.0, 30.0, 0.0)
    robot = np.array([0.0, 0.0, np.pi])
    sighting = marked.sighting(1, mark, marked.level_pose(mark, robot))
    found = collect([sighting, marked.pose(1, robot, "stripe-pose")], None, MarkMap(marks=(mark,)))
    left, right, bottom, top = view_of(found)
    assert left < -0.1 < 0.1 < right
    assert bottom < 0
    assert top > 30
    far = MarkMap(marks=(mark, marked.mark(2, 0.0, 900.0, 0.0)))
    assert (
        view_of(replace(found, kept=[replace(found.of(MarkFindings), marks=far)]))[3] < 50
    )  # one that nobody saw is not


def test_places_of_marks_are_told_apart_by_being_seen(mark_findings):
    assert len(mark_places(mark_findings.of(MarkFindings), seen=True)) == 2 * 4
    assert len(mark_places(mark_findings.of(MarkFindings), seen=False)) == 2 * 1


def test_an_ellipse_holds_its_share_of_the_normal_distribution():
    cov = np.array([[4.0, 1.5], [1.5, 1.0]])
    curve = ellipse(np.array([5.0, -2.0]), cov, 3.0)
    away = curve - (5.0, -2.0)
    np.testing.assert_allclose(np.einsum("ni,ij,nj->n", away, np.linalg.inv(cov), away), 9.0)


@pytest.mark.parametrize(
    ("sd", "span", "factor"), [(0.001, 10.0, 100.0), (0.01, 10.0, 10.0), (0.5, 10.0, 1.0), (1e-6, 1.0, 200.0)]
)
def test_small_ellipses_are_enlarged_by_a_round_factor(sd, span, factor):
    # 3 sd times the factor is at most 5 % of the span
    assert magnification(np.tile(np.eye(2) * sd**2, (9, 1, 1)), span) == factor


def test_without_covariances_nothing_is_enlarged():
    assert magnification(np.full((3, 2, 2), np.nan), 10.0) == 1.0


def test_few_of_many_are_chosen_evenly_with_both_ends():
    assert evenly(np.arange(5), 9).tolist() == [0, 1, 2, 3, 4]
    some = evenly(np.arange(1001), 11)
    assert some.tolist() == list(range(0, 1001, 100))


def test_a_long_run_makes_no_long_drawing(collect, marked, mark_findings):
    found = mark_findings.of(MarkFindings)
    n = 40
    long = replace(
        found,
        stamps=np.concatenate([found.stamps + k * 10**12 for k in range(n)]),
        **{
            name: np.concatenate([getattr(found, name)] * n)
            for name in ("mark", "status", "pose", "cov", "robot", "robot_cov", "n_lines", "residual")
        },
    )
    assert long.is_used.sum() > DOTS
    with drawing():
        (dots,) = [
            line
            for line in draw_map(replace(mark_findings, kept=[long])).axes[0].lines
            if line.get_label().startswith("by one image")
        ]
    assert len(dots.get_xdata()) == DOTS


def test_poses_are_sorted_by_whether_an_image_supports_them(mark_findings):
    (rests, _, _, with_mark), (alone, _, _, without) = support_of(mark_findings).classes
    assert (with_mark, without) == ("a mark in the image", "odometry alone")
    np.testing.assert_array_equal(
        rests, np.isin(mark_findings.primary.stamps, mark_findings.of(MarkFindings).used_images)
    )
    np.testing.assert_array_equal(alone, ~rests)
    with drawing():
        labels = legend_of(draw_support(mark_findings))
    assert f"odometry alone: {alone.sum()} poses ({100 * alone.mean():.1f} %)" in labels


def test_without_odometry_every_pose_rests_on_its_image(collect, marked):
    found = collect(marked.drive(80, with_images=False, with_odometry=False), None, marked.room())
    with drawing():
        assert draw_support(found) is None


def test_no_line_is_drawn_through_a_time_without_poses(collect, marked):
    second = 10**9
    events = [marked.pose(round(t * second), (t, 0.0, 0.0), "stripe-pose") for t in (0, 0.1, 0.2, 9.0, 20.0, 20.1)]
    with drawing():
        lines = {line.get_label(): line for line in draw_map(collect(events)).axes[0].lines}
    assert np.isnan(lines["stripe-pose"].get_xdata()).tolist() == [False] * 3 + [True, False, True, False, False]
    (lonely,) = [line for line in lines.values() if line.get_marker() == "o" and line.get_color() == LIGHT["estimate"]]
    assert lonely.get_xdata().tolist() == [9.0]
