import numpy as np
import pytest

from logpose.pipelines.report.drawing import drawing, to_svg
from logpose.pipelines.report.pictures import draw_map, draw_passes, draw_support, grid_step, line_styles, view_of


def legend_of(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_the_map_shows_all_tracks_with_equal_axes(findings):
    with drawing():
        figure = draw_map(findings)
    axes = figure.axes[0]
    assert axes.get_aspect() == 1.0
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [m]", "y [m]")
    assert {"truth", "localize-pf", "dead-reckon", "start", "end", "way point"} <= set(legend_of(figure))
    assert {text.get_text() for text in axes.texts} == {f"W{i}" for i in range(1, 8)}
    left, right = axes.get_xlim()
    bottom, top = axes.get_ylim()
    truth = findings.truth.xy
    assert (truth > (left, bottom)).all()
    assert (truth < (right, top)).all()


def test_the_truth_is_broader_and_lies_below_the_estimate(findings):
    with drawing():
        lines = {line.get_label(): line for line in draw_map(findings).axes[0].lines}
    assert lines["truth"].get_linewidth() > 3 * lines["localize-pf"].get_linewidth()
    assert lines["truth"].get_zorder() < lines["dead-reckon"].get_zorder() < lines["localize-pf"].get_zorder()
    assert lines["dead-reckon"].is_dashed()


def test_each_pose_is_in_one_class_of_support_and_the_legend_counts_them(findings):
    with drawing():
        labels = legend_of(draw_support(findings))
    n = findings.primary.n_seen
    for words, count in (("2 or more seen", (n >= 2).sum()), ("1 seen", (n == 1).sum()), ("none seen", (n == 0).sum())):
        assert f"{words}: {count} poses ({100 * count / len(n):.1f} %)" in labels


def test_poses_without_counts_have_no_picture_of_support(collect, make):
    with drawing():
        assert draw_support(collect([make.pose(i, float(i), 0.0, 0.0) for i in range(3)])) is None


def test_every_waypoint_is_drawn_with_its_error_inside(findings):
    with drawing():
        figure = draw_passes(findings)
    assert [axes.get_title().split(":")[0] for axes in figure.axes] == [f"W{i}" for i in range(1, 8)]
    for axes, point in zip(figure.axes, findings.waypoints, strict=True):
        assert axes.get_xlim()[0] < point.estimate_x < axes.get_xlim()[1]
        assert axes.get_ylim()[0] < point.estimate_y < axes.get_ylim()[1]


def test_dead_reckoning_that_runs_away_does_not_make_the_route_small(collect, make):
    route = [make.pose(i * 10**9, float(i), 0.0, 0.0) for i in range(10)]
    lost = [make.pose(i * 10**9, 1000.0 * i, 0.0, 0.0, "dead-reckon") for i in range(10)]
    left, right, _, _ = view_of(collect([*route, *lost]))
    assert right - left < 25.0  # the route's 9 m, at most half of it more at both sides, and a margin


def test_each_estimator_has_a_style_of_its_own(collect, odd_runs):
    styles = line_styles(collect(odd_runs["five estimators"]))
    assert styles["a"][0] == "estimate"
    assert len({styles[source][0] for source in "abcd"}) == 4


@pytest.mark.parametrize(("span", "step"), [(100.0, 10.0), (111.0, 20.0), (1.0, 0.1), (54.0, 5.0), (3e-3, 5e-4)])
def test_grid_squares_have_round_sides(span, step):
    assert grid_step(span) == pytest.approx(step)


def test_a_long_track_makes_no_long_drawing(collect, make):
    n = 50_000
    events = [make.pose(i * 10**7, 50 * np.cos(i / 4000), 20 * np.sin(i / 3000), 0.0) for i in range(n)]
    with drawing():
        assert len(to_svg(draw_map(collect(events)), "map")) < 200_000  # 50 000 points would be 1 MB
