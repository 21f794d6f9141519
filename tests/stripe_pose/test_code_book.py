"""Marks compared before they are printed. Numbers of the paper's camera: f = 16 mm, 512 columns on 8.8 mm."""

import math

import numpy as np
import pytest

from logpose.formats.products import StripeMark
from logpose.pipelines.geometry.camera import Camera
from logpose.pipelines.stripe_pose.code_book import Optics, code_book, pose_at, view
from logpose.pipelines.stripe_pose.code_book_table import as_mapping, table
from logpose.pipelines.stripe_pose.gaps import cross_ratio_sigma, log_cross_ratios, template_gaps
from logpose.pipelines.stripe_pose.pairings import hidden, whole
from logpose.pipelines.stripe_pose.pose import bearings

FX = 16.0 / (8.8 / 512)
HALF = 255.5 / FX
BAR = (1, -1)


def mark(identity, lines_mm, bars_mm=None, height=None):
    bars = None if bars_mm is None else np.broadcast_to(np.array(bars_mm) / 1000, (len(lines_mm),)).copy()
    return StripeMark(id=identity, lines=np.array(lines_mm) / 1000, bars=bars, pose=np.zeros(3), height=height)


def optics(**changes):
    fixed = {
        "fx": FX,
        "fy": FX,
        "field": (-HALF, HALF),
        "height": 480,
        "tolerance": 0.3,
        "part_tolerance": 0.12,
        "tolerance_share": 1.0,
        "part_share": 1.0,
    }
    return Optics(**fixed | changes)


def book_of(*marks, far=1.5, near=0.3, angle=60.0, **changes):
    distances = np.linspace(near, far, 5).tolist()
    return code_book(marks, optics(**changes), distances, np.radians([0.0, angle / 2, angle]).tolist())


def pair(book, seen, taken):
    return next(c for c in book.confusions if (c.seen, c.taken) == (seen, taken))


# ---- residuals ------------------------------------------------------------------------------------------------


def test_every_view_of_the_same_lines_has_no_gap():
    rng = np.random.default_rng(0)
    X = np.sort(rng.uniform(-0.1, 0.1, (20, 6)), axis=1)
    for row in X:
        pose = np.array([rng.uniform(-1.2, 1.2), rng.uniform(-0.1, 0.1), rng.uniform(0.3, 2.0)])
        assert template_gaps(row, FX * bearings(pose, row)) < 1e-9


def test_the_gap_is_that_of_the_best_projectivity():
    from scipy.optimize import least_squares

    X = np.array([-0.06, -0.03, 0.0, 0.03, 0.06, 0.12])
    other = np.array([-0.06, -0.03, 0.002, 0.03, 0.061, 0.12])
    u = FX * bearings(np.array([0.9, 0.0, 0.8]), other)

    def residual(h):
        return (h[0] * X + h[2]) / (h[1] * X + 1) - u

    # scipy's minimum over all projectivities, from the true one of the other mark.
    best = least_squares(residual, [FX * np.cos(0.9) / 0.8, np.sin(0.9) / 0.8, 0.0], x_scale="jac", xtol=1e-14).fun
    assert template_gaps(X, u) == pytest.approx(np.sqrt(np.mean(best**2)), rel=0.01)


def test_four_equally_spaced_lines_have_the_cross_ratio_3_and_so_has_their_reverse():
    assert np.exp(log_cross_ratios(np.array([-60.0, 0, 60, 120]))) == pytest.approx(3)
    assert np.exp(log_cross_ratios(np.array([-60.0, 0, 40, 120]))) == pytest.approx(1.5)
    assert np.exp(log_cross_ratios(np.array([-120.0, -40, 0, 60]))) == pytest.approx(1.5)
    assert np.exp(log_cross_ratios(np.array([150.0, 262, 361, 449]))) == pytest.approx(3.003348214286)


@pytest.mark.parametrize(("distance", "expected"), [(300, 0.0046), (500, 0.0077), (1000, 0.0155), (1500, 0.0232)])
def test_the_error_of_the_cross_ratio_grows_with_distance(distance, expected):
    # 60 mm spaces, 0.29 px, from the front.
    x = FX * np.array([-90.0, -30, 30, 90]) / distance
    assert cross_ratio_sigma(x, 0.29) == pytest.approx(expected, abs=6e-5)


def test_the_error_of_the_cross_ratio_is_its_derivative():
    x = np.array([150.0, 262, 361, 449])
    gradient = [(log_cross_ratios(x + step) - log_cross_ratios(x - step)) / 2e-3 for step in 1e-3 * np.eye(4)]
    assert cross_ratio_sigma(x, 0.5) == pytest.approx(0.5 * np.linalg.norm(gradient), rel=1e-6)


# ---- ways to take one mark for another ------------------------------------------------------------------------


def test_a_whole_mark_is_found_among_more_edges_if_two_at_most_are_between():
    pairs = {tuple(row) for pairing in whole((1,) * 6, (1,) * 4, is_same=False) for row in pairing.seen.tolist()}
    assert (0, 1, 2, 3) in pairs
    assert (0, 2, 4, 5) in pairs
    assert len(pairs) == 15  # four of six always have two between them at most


def test_polarities_agree_in_every_pair():
    pairings = whole(BAR * 5, BAR * 4, is_same=False) + hidden(BAR * 5, BAR * 4, 2, is_same=False)
    assert {pairing.taken.shape[1] for pairing in pairings} == {6, 7, 8}
    for pairing in pairings:
        assert pairing.seen.shape == pairing.taken.shape
        assert np.array_equal(pairing.seen % 2, pairing.taken % 2)
        assert (np.diff(pairing.seen) > 0).all()
        assert (np.diff(pairing.taken) > 0).all()


def test_each_edge_for_itself_is_no_mistake():
    assert whole(BAR * 4, BAR * 4, is_same=True) == ()
    for pairing in hidden(BAR * 4, BAR * 4, 2, is_same=True):
        assert not (pairing.seen == pairing.taken).all(axis=1).any()


def test_three_lines_alone_tell_no_mark_from_another():
    assert whole((1,) * 3, (1,) * 3, is_same=False) == ()
    assert pair(book_of(mark(1, [-60, 0, 60]), mark(2, [-60, 0, 50])), 1, 2).whole is None


# ---- the book -------------------------------------------------------------------------------------------------


def test_marks_that_differ_by_a_stretch_are_the_same():
    # One is the other at another distance.
    c = pair(book_of(mark(1, [-60, 0, 40, 120], 20), mark(2, [-90, 0, 60, 180], 30)), 1, 2)
    assert c.whole < 1e-9
    assert c.cross_ratio < 1e-6
    assert c.is_cross_ratio_same
    assert c.apart_to == (0.0, 0.0, 0.0)


def test_marks_that_differ_much_are_told_apart_everywhere_and_not_when_turned():
    c = pair(book_of(mark(1, [-60, 0, 40, 120], 20), mark(2, [-60, 20, 80, 120], 20)), 1, 2)
    assert c.whole > 1.0
    assert c.apart_to == (1.5, 1.5, 1.5)
    # CR 1.5 and 3.375: ln differs by 0.81, and the error of either is below 0.02 there.
    assert c.cross_ratio > 40
    assert not c.is_cross_ratio_same


def test_a_mark_and_its_reverse_have_one_cross_ratio_and_are_one_when_turned():
    one = mark(1, [-60, 0, 40, 120], 20)
    reverse = StripeMark(
        id=2, lines=-one.edges[::-1][::2], bars=one.bars, pose=np.zeros(3)
    )  # bars begin where they ended
    c = pair(book_of(one, reverse), 1, 2)
    assert c.turned < 1e-9
    assert c.is_cross_ratio_same
    assert c.whole > 1.0
    assert "the same when turned upside down" in table(book_of(one, reverse), optics(), [one, reverse])


def test_a_palindrome_is_the_same_upside_down():
    book = book_of(mark(1, [-90, -30, 10, 70], 20), mark(2, [-90, -30, 20, 70], 20))
    assert pair(book, 1, 1).turned < 1e-9
    assert pair(book, 2, 2).turned > 0.3
    assert "palindrome" in table(book, optics(), [mark(1, [-90, -30, 10, 70], 20)])


def test_equally_spaced_lines_are_a_fence():
    fences = book_of(
        mark(1, [-60, 0, 60, 120], 20),
        mark(2, [-60, 0, 40, 120], 20),
        mark(3, [-60, 0, 60, 120], [20, 10, 20, 30]),  # its rising edges
        mark(4, [-60, 0, 60], 20),
        mark(5, [-60, 0, 60], [20, 10, 40]),
    ).fences
    assert fences == (1, 3, 4)


def test_a_fence_is_itself_one_bar_on_when_an_end_is_hidden():
    c = pair(book_of(mark(1, [-90, -30, 30, 90, 150], 20, height=0.2)), 1, 1)
    assert c.whole is None
    assert c.hidden < 1e-9
    assert c.apart_to_hidden == (0.0, 0.0, 0.0)


def test_hidden_edges_make_marks_alike_that_share_the_others():
    # All but the last bar.
    one, other = mark(1, [-60, 0, 40, 120], 20, height=0.2), mark(2, [-60, 0, 40, 100], 20, height=0.2)
    c = pair(book_of(one, other), 1, 2)
    assert c.hidden < 1e-9
    assert c.whole > 0.3


def test_of_a_mark_of_unknown_height_one_edge_may_be_hidden_and_of_another_two():
    one = mark(1, [-60, 0, 40, 120], 20)
    bare, high = (mark(2, [-60, 0, 40, 100], 20, height=h) for h in (None, 0.2))
    assert pair(book_of(one, bare), 1, 2).hidden > 0.1  # seven of eight: the last rising edge is 20 mm off
    assert pair(book_of(one, high), 1, 2).hidden < 1e-9


def test_far_away_the_gap_must_exceed_less_because_edges_are_nearer():
    # 0.3 px, or a hundredth of the smallest gap: 20 mm are 12.4 px from the front at 1.5 m, and 0.124 px its share.
    marks = [mark(1, [-60, 0, 40, 120], 20), mark(2, [-60, 0, 40.6, 120], 20)]
    strict, lax = (pair(book_of(*marks, tolerance_share=s), 1, 2) for s in (0.01, 1.0))
    assert strict.whole == lax.whole
    assert strict.apart_to[0] > lax.apart_to[0]


def test_the_gap_shrinks_with_distance_and_angle():
    # Marks nearly alike: 1 mm of one bar, which at 0.3 m and 1.5 m is 3.1 and 0.6 px before the fit takes its share.
    marks = [mark(1, [-60, 0, 40, 120], 20), mark(2, [-60, 0, 41, 120], 20)]
    near, far = (pair(book_of(*marks, near=d, far=d + 1e-9), 1, 2).whole for d in (0.6, 1.2))
    assert far == pytest.approx(near / 2, rel=0.1)
    c = pair(book_of(*marks), 1, 2)
    assert c.apart_to[0] > c.apart_to[-1]


def test_a_gap_is_what_a_noiseless_view_leaves_of_the_other_template():
    one, other = mark(1, [-60, 0, 40, 120], 20), mark(2, [-60, 0, 44, 120], 20)
    seen = FX * bearings(pose_at(one, 0.9, 0.0), one.edges)
    c = pair(book_of(one, other, near=0.9, far=0.9 + 1e-9, angle=1e-9), 1, 2)
    assert c.whole == pytest.approx(template_gaps(other.edges, seen), rel=1e-6)


# ---- the bound ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("distance", "angle", "expected"),
    [(0.5, 0.0, (0.2617, 0.0269, 0.1582)), (1.0, 0.0, (1.0470, 0.0537, 0.633)), (1.5, 40.0, (2.357, 0.081, 51.7))],
)
def test_the_error_is_the_bound_of_three_lines(distance, angle, expected):
    v = view(mark(1, [-60, 0, 60]), optics(field=(-1, 1)), distance, math.radians(angle))
    assert math.degrees(v.sd[0]) == pytest.approx(expected[0], rel=1e-3)
    assert 1000 * v.sd[1:] == pytest.approx(expected[1:], rel=1e-2)


def test_a_mark_twice_as_high_is_crossed_by_twice_the_rows_and_half_as_uncertain_by_four_times():
    bare = view(mark(1, [-60, 0, 60]), optics(), 1.0, 0.0)
    low, high = (view(mark(1, [-60, 0, 60], height=h), optics(), 1.0, 0.0) for h in (0.1, 0.4))
    assert (bare.rows, low.rows, high.rows) == (1, 93, 372)  # fy h / d
    assert low.sd == pytest.approx(2 * high.sd)
    assert bare.sd[0] == pytest.approx(np.sqrt(93) * low.sd[0])
    assert view(mark(1, [-60, 0, 60], height=5.0), optics(), 1.0, 0.0).rows == 480
    assert view(mark(1, [-60, 0, 60], height=0.1), optics(rows=7), 1.0, 0.0).rows == 7


def test_a_mark_wider_than_the_image_is_outside():
    # The paper's eq. (20): D_min = 2 W f / (N dx) = 218 mm for W = 60 mm.
    assert not view(mark(1, [-60, 0, 60]), optics(), 0.217, 0.0).is_inside
    assert view(mark(1, [-60, 0, 60]), optics(), 0.220, 0.0).is_inside
    assert np.isnan(view(mark(1, [-60, 0, 60]), optics(), 0.1, 0.0).gap)


def test_the_smallest_gap_is_that_of_the_two_nearest_edges():
    v = view(mark(1, [-60, 0, 40], [20, 10, 30]), optics(), 1.0, 0.0)
    assert v.gap == pytest.approx(FX * 0.010, rel=1e-6)


def test_the_lens_says_how_wide_the_field_is():
    limits = {"tolerance": 0.3, "part_tolerance": 0.1, "tolerance_share": 1.0, "part_share": 1.0}
    wide = Optics.of(Camera(400.0, 400.0, 319.5, 239.5, "plumb_bob", (-0.1, 0, 0, 0, 0)), 640, 480, **limits)
    straight = Optics.of(Camera(400.0, 400.0, 319.5, 239.5), 640, 480, **limits)
    assert straight.field == pytest.approx((-319.5 / 400, 319.5 / 400))
    assert wide.field[1] > straight.field[1]  # a barrel sees more


# ---- what is printed ------------------------------------------------------------------------------------------


def test_everything_stands_in_the_json():
    book = book_of(mark(1, [-60, 0, 40, 120], 20), mark(2, [-60, 0, 50, 120], 20))
    result = as_mapping(book, optics())["result"]
    assert result["distances_m"] == pytest.approx([0.3, 0.6, 0.9, 1.2, 1.5])
    assert len(result["views"]) == 2 * 5 * 3
    assert [(p["seen"], p["taken_for"]) for p in result["pairs"]] == [(1, 1), (1, 2), (2, 1), (2, 2)]
    assert result["pairs"][1]["whole_px"] == pair(book, 1, 2).whole


def test_the_table_names_the_nearest_pair_first():
    # 1 and 2 differ by a millimetre; 3 equals 1 but for its last bar, so hidden edges make them one.
    marks = [
        mark(i, lines, 20, height=0.2)
        for i, lines in ((1, [-60, 0, 40, 120]), (2, [-60, 0, 41, 120]), (3, [-60, 0, 40, 100]))
    ]
    lines = table(book_of(*marks), optics(), marks).splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("seen"))
    first, second = (line.split()[:2] for line in lines[start + 1 : start + 3])
    assert {*first} == {"1", "3"}
    assert {*second} == {"1", "2"}
    assert lines[start + 1].endswith("never never never")


def test_a_long_list_of_pairs_is_cut_and_says_so():
    marks = [mark(i, [-60, 0, 20 + 6 * i, 120], 10) for i in range(7)]
    book = book_of(*marks)
    assert "and 8 more that are farther apart" in table(book, optics(), marks)  # 28 pairs with themselves
