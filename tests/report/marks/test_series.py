"""Pictures of marks over time and over distance."""

from dataclasses import replace

import numpy as np
import pytest

from logpose.formats.events import Pose
from logpose.formats.products import MarkMap
from logpose.pipelines.report.drawing import LIGHT, drawing, to_svg
from logpose.pipelines.report.marks.kept import MarkFindings
from logpose.pipelines.report.marks.series import (
    LEAST_IN_BIN,
    MOST_IDS,
    STATUS_ROLES,
    by_distance,
    by_distance_caption,
    draw_by_distance,
    draw_strip,
    strip_caption,
)

SECOND = 1_000_000_000


@pytest.fixture(scope="module")
def strip(mark_findings):
    with drawing():
        return draw_strip(mark_findings)


def bars(axes, role):
    """The bars of a colour: (row, from, to)."""
    from matplotlib.colors import to_rgba

    found = []
    for collection in axes.collections:
        if tuple(collection.get_facecolor()[0]) == to_rgba(LIGHT[role]):
            for path in collection.get_paths():
                (x0, y0), (x1, y1) = path.vertices.min(axis=0), path.vertices.max(axis=0)
                found.append((round((y0 + y1) / 2), x0, x1))
    return sorted(found)


def test_every_mark_has_a_row_and_so_have_no_mark_and_odometry(strip):
    names = [label.get_text() for label in strip.axes[0].get_yticklabels()]
    assert names == ["mark 1", "mark 2", "mark 3", "mark 4", "mark 7", "none", "odometry"]
    assert [axes.get_ylabel() for axes in strip.axes[1:]] == ["distance [m]", "angle φ [°]", "residual [px]"]
    assert strip.axes[-1].get_xlabel() == "time since the start [s]"


def test_a_bar_lasts_as_long_as_the_mark_was_seen(strip, mark_findings):
    marks = mark_findings.of(MarkFindings)
    half = 0.5 * marks.period / 1e9
    seen = (marks.stamps[marks.mark == 3] - mark_findings.start) / 1e9
    ((_, start, end),) = [bar for bar in bars(strip.axes[0], "estimate") if bar[0] == 2]
    assert start == pytest.approx(seen.min() - half)
    assert end == pytest.approx(seen.max() + half)


def test_the_bars_of_odometry_lie_between_images_that_are_used(strip, mark_findings):
    used = (mark_findings.of(MarkFindings).used_images - mark_findings.start) / 1e9
    found = bars(strip.axes[0], "none")
    assert {row for row, _, _ in found} == {6}
    for _, start, end in found:
        assert not ((used > start + 1e-6) & (used < end - 1e-6)).any()


def test_every_sighting_with_a_pose_is_a_dot(strip, mark_findings):
    marks = mark_findings.of(MarkFindings)
    drawn = [line.get_ydata() for line in strip.axes[1].lines if line.get_marker() == "."]
    has_pose = np.isfinite(marks.pose).all(axis=1)
    np.testing.assert_allclose(np.sort(np.concatenate(drawn)), np.sort(marks.distance[has_pose]))


def test_every_status_has_a_colour_of_its_own(collect, marked):
    mark, pose = marked.room().marks[0], np.array([0.3, 0.1, 1.2])
    words = [*STATUS_ROLES, "of another version"]
    events = [marked.sighting(i * SECOND, *(() if w == "no_mark" else (mark, pose, w))) for i, w in enumerate(words)]
    with drawing():
        figure = draw_strip(collect(events))
    assert [text.get_text() for text in figure.legends[0].get_texts()] == words
    assert len(set(STATUS_ROLES.values())) == len(STATUS_ROLES)


def test_images_without_any_pose_have_the_strip_alone(collect, marked):
    with drawing():
        figure = draw_strip(collect([marked.sighting(i * SECOND) for i in range(5)]))
    assert len(figure.axes) == 1


def test_one_image_has_no_picture_over_time(collect, marked):
    with drawing():
        assert draw_strip(collect([marked.sighting(1)])) is None
        assert draw_strip(collect([])) is None


def test_very_many_marks_share_a_row(collect, marked):
    many = MarkMap(marks=tuple(marked.mark(i, float(i), 0.0, 180.0) for i in range(MOST_IDS + 1)))
    events = [marked.sighting(i * SECOND, many.marks[i], np.array([0.3, 0.1, 1.2])) for i in range(3)]
    with drawing():
        axes = draw_strip(collect(events, None, many)).axes[0]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["any mark"]


def test_a_long_run_makes_no_long_drawing(collect, marked):
    """Twenty thousand images with a mark in every second one; each dot would take 60 bytes three times: 3.6 MB."""
    seen, unseen = marked.sighting(0, marked.room().marks[0], np.array([0.3, 0.1, 1.2])), marked.sighting(0)
    events = (replace((seen, unseen)[i % 2], stamp=i * SECOND // 10) for i in range(20_000))
    with drawing():
        assert len(to_svg(draw_strip(collect(events)), "strip")) < 500_000


def test_the_caption_names_the_longest_time_of_odometry_alone(mark_findings):
    assert "The longest time that odometry carried alone is " in strip_caption(mark_findings)


# ---- over distance --------------------------------------------------------------------------------------------


def single_images(marked, n, turn=0.0, shift=0.0, wild=0):
    """Yield sightings of a mark from growing distances, and the truth, from which they are off by given amounts."""
    mark = marked.mark(1, 0.0, 0.0, 180.0)
    for i in range(n):
        robot = np.array([0.0, 0.5 + 0.01 * i, 0.0])
        event = marked.sighting(i * SECOND // 10, mark, marked.level_pose(mark, robot))
        off = robot + np.array([0.0, shift, np.radians(90.0 if i < wild else turn)])
        yield replace(event, robot=off, robot_cov=np.diag([0.01, 0.01, np.radians(0.5)]) ** 2)
        yield marked.pose(event.stamp, robot, "truth")


def test_errors_are_compared_with_what_was_predicted_at_each_distance(collect, marked):
    told = by_distance(collect(single_images(marked, 40, turn=1.0, shift=0.03)))
    assert told.distance[[0, -1]] == pytest.approx([0.5, 0.89], abs=0.06)  # the lens is 0.05 m to the right
    np.testing.assert_allclose(told.errors[0], 1.0)
    np.testing.assert_allclose(told.sigmas[0], 0.5)
    np.testing.assert_allclose(told.errors[1], 0.03)
    np.testing.assert_allclose(told.sigmas[1], 0.01 * np.sqrt(2))


def test_the_caption_says_how_honest_the_covariance_is(collect, marked):
    words = by_distance_caption(collect(single_images(marked, 40, turn=1.0, shift=0.03)))
    assert "is 2.00 for the angle and 2.12 for the position" in words  # 1 / 0.5 and 0.03 / 0.01414
    assert "Known for 40 sightings" in words
    assert "off by more than" not in words


def test_a_mark_taken_for_another_is_counted(collect, marked):
    assert "The angle of one of them is off by more than 8" in by_distance_caption(
        collect(single_images(marked, 40, wild=1))
    )


def test_lines_join_no_distances_at_which_nothing_was_seen(collect, marked):
    mark = marked.mark(1, 0.0, 0.0, 180.0)
    events = []
    for i in range(60):
        robot = np.array([0.0, (0.5 if i < 30 else 1.5) + 0.002 * i, 0.0])
        event = marked.sighting(i * SECOND // 10, mark, marked.level_pose(mark, robot))
        events += [event, marked.pose(event.stamp, robot + np.array([0.0, 0.01, 0.002]), "truth")]
    with drawing():
        axes = draw_by_distance(collect(events)).axes[0]
    (line,) = [line for line in axes.lines if line.get_label() == "root mean square of it"]
    at = line.get_xdata()
    assert np.isnan(at[1:-1]).any()
    assert not ((at > 0.65) & (at < 1.5)).any()


def test_truth_is_needed_and_enough_sightings(collect, marked):
    few = list(single_images(marked, LEAST_IN_BIN - 1, turn=1.0))
    without = [event for event in single_images(marked, 40) if not isinstance(event, Pose)]
    with drawing():
        assert draw_by_distance(collect(few)) is None
        assert draw_by_distance(collect(without)) is None
        assert draw_by_distance(collect([])) is None
    assert by_distance_caption(collect(without)) == ""
