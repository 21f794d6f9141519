"""Which edges of a row are a mark's: found under any view, among others, and in part."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logpose.pipelines.stripe_pose.matching import NONE, fitted, match_part, match_row, projectivity
from logpose.pipelines.stripe_pose.pose import bearings, homography, is_ahead, plane_distance

from .conftest import GAPS, mark_of

X, POLARITY = mark_of().edges, mark_of().polarity
GATES = np.array([np.radians(80), 0.05, 50.0])
TOLERANCE = 0.5 / 600

views = st.tuples(st.floats(-1.2, 1.2), st.floats(-0.4, 0.4), st.floats(0.4, 3.0)).map(np.array)


def row_of(u, strengths):
    places, sizes = np.zeros(512), np.zeros(512)
    order = np.argsort(u)
    places[: len(u)], sizes[: len(u)] = np.asarray(u)[order], np.asarray(strengths)[order]
    return places, sizes, len(u)


def whole(u, strengths, X=X, polarity=POLARITY):
    places, sizes, n = row_of(u, strengths)
    matches, errors = np.empty((16, len(X)), np.int64), np.empty(16)
    count = match_row(places, sizes, n, X, polarity, 2, TOLERANCE, GATES, matches, errors)
    return [places[matches[i]] for i in range(count)], errors[:count]


def part(u, strengths, least=6):
    places, sizes, n = row_of(u, strengths)
    best, trial = np.empty(len(X), np.int64), np.empty(len(X), np.int64)
    members = match_part(places, sizes, n, X, POLARITY, least, TOLERANCE, GATES, best, trial)
    return members, np.array([places[k] if k != NONE else np.nan for k in best]) if members else best


def is_seen(view):
    u = bearings(view, X)
    return bool(is_ahead(view, X) and plane_distance(view) > 0.1 and np.min(np.diff(u)) > 4 / 600)


@settings(max_examples=150, deadline=None)
@given(views)
def test_a_mark_is_found_under_any_view(view):
    if not is_seen(view):
        return
    u = bearings(view, X)
    found, errors = whole(u, POLARITY.astype(float))
    assert len(found) == 1
    assert found[0] == pytest.approx(u)
    assert errors[0] < 1e-9


@settings(max_examples=100, deadline=None)
@given(views, st.lists(st.floats(-0.6, 0.6), max_size=12), st.integers(0, 2**32 - 1))
def test_other_edges_beside_it_do_not_matter(view, others, seed):
    if not is_seen(view):
        return
    u = bearings(view, X)
    others = [v for v in others if v < u[0] - 0.01 or v > u[-1] + 0.01]
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], len(others))
    found, _ = whole([*u, *others], [*POLARITY.astype(float), *signs])
    assert any(match == pytest.approx(u) for match in found)


@settings(max_examples=100, deadline=None)
@given(views, st.integers(0, 6))
def test_one_edge_of_something_else_within_it_is_skipped(view, gap):
    if not is_seen(view):
        return
    u = bearings(view, X)
    middle = 0.5 * (u[gap] + u[gap + 1])
    found, _ = whole([*u, middle], [*POLARITY.astype(float), 1.0])
    assert any(match == pytest.approx(u) for match in found)


@pytest.mark.parametrize("hidden", [(0,), (7,), (0, 1), (6, 7), (3,), (3, 4)])
def test_a_part_is_found_with_its_edges_where_they_belong(hidden):
    u = bearings(np.array([0.4, 0.05, 0.9]), X)
    keep = np.delete(np.arange(8), hidden)
    members, found = part(u[keep], POLARITY[keep].astype(float))
    assert members == len(keep)
    assert found[keep] == pytest.approx(u[keep])
    assert np.all(np.isnan(found[list(hidden)]))


def test_two_holes_are_no_part():
    u = bearings(np.array([0.4, 0.05, 0.9]), X)
    keep = np.delete(np.arange(8), (1, 5))
    assert part(u[keep], POLARITY[keep].astype(float))[0] == 0


def test_the_other_polarity_is_no_mark():
    u = bearings(np.array([0.4, 0.05, 0.9]), X)
    assert whole(u, -POLARITY.astype(float))[0] == []


@pytest.mark.parametrize("n", [0, 1, 2, 3, 7])
def test_too_few_edges_are_no_mark(n):
    u = bearings(np.array([0.0, 0.0, 1.0]), X)
    assert whole(u[:n], POLARITY[:n].astype(float))[0] == []


def test_equal_spacing_is_no_mark():
    u = np.linspace(-0.2, 0.2, 30)
    signs = np.tile([1.0, -1.0], 15)
    assert whole(u, signs)[0] == []


@settings(max_examples=100, deadline=None)
@given(views)
def test_the_small_fits_are_those_of_the_closed_form(view):
    if not is_seen(view):
        return
    u = bearings(view, X)
    expected = homography(X, u)
    assert fitted(X, u, 8) == pytest.approx(expected, rel=1e-6, abs=1e-7)
    three = np.ascontiguousarray(X[[0, 4, 7]])
    found = projectivity(tuple(three), tuple(bearings(view, three)))
    assert found == pytest.approx(homography(three, bearings(view, three)), rel=1e-6, abs=1e-7)
    assert len(GAPS) == 7
