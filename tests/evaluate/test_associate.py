import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from logpose.pipelines.evaluate.associate import Track, associate, interpolate, nearest
from logpose.pipelines.geometry import so3

STAMPS = st.lists(st.integers(0, 1000), max_size=30).map(lambda v: np.array(sorted(v), dtype=np.int64))


def track(stamps, x=None, yaw=None):
    n = len(stamps)
    x = np.zeros(n) if x is None else np.asarray(x, dtype=float)
    rotations = so3.as_matrix(so3.exp(np.multiply.outer(np.zeros(n) if yaw is None else yaw, [0.0, 0.0, 1.0])))
    return Track(np.array(stamps, dtype=np.int64), np.column_stack([x, np.zeros(n), np.zeros(n)]), rotations)


def test_each_takes_its_nearest_within_the_limit():
    i, j = nearest(np.array([0, 100, 205, 400]), np.array([1, 98, 103, 200, 300]), 10)
    assert i.tolist() == [0, 1, 2]
    assert j.tolist() == [0, 1, 3]


def test_two_do_not_share_a_partner_the_nearer_one_gets_it():
    i, j = nearest(np.array([90, 103]), np.array([100, 1000]), 20)
    assert (i.tolist(), j.tolist()) == ([1], [0])


def test_poses_that_share_a_stamp_are_both_scored():
    i, j = nearest(np.array([90, 103, 103]), np.array([100, 1000]), 20)
    assert (i.tolist(), j.tolist()) == ([1, 2], [0, 0])


def test_of_partners_that_share_a_stamp_the_last_one_is_taken_from_both_sides():
    i, j = nearest(np.array([203, 204]), np.array([204, 204]), 1)
    assert (i.tolist(), j.tolist()) == ([1], [1])
    i, j = nearest(np.array([203]), np.array([204, 204]), 1)
    assert (i.tolist(), j.tolist()) == ([0], [1])


def test_of_equally_near_partners_the_nearer_in_floating_point_seconds_is_taken():
    # 1.65 ms to both in nanoseconds, but not in floats, which round these stamps to 2.4e-7 s: evo takes the later one.
    others = np.array([1311868226309300000, 1311868226312600000])
    i, j = nearest(np.array([1311868226310950000]), others, 10_000_000)
    assert (i.tolist(), j.tolist()) == ([0], [1])
    i, j = nearest(np.array([2]) * 10**9, np.array([1, 3]) * 10**9, 10**9)
    assert (i.tolist(), j.tolist()) == ([0], [0])


@given(STAMPS, STAMPS, st.integers(0, 50))
def test_pairs_are_one_to_one_in_stamps_sorted_and_near(stamps, others, limit):
    i, j = nearest(stamps, others, limit)
    assert (np.diff(i) > 0).all()
    assert (np.diff(j) >= 0).all()
    assert (np.abs(stamps[i] - others[j]) <= limit).all()
    pairs = set(zip(stamps[i].tolist(), others[j].tolist(), strict=True))
    assert len({a for a, _ in pairs}) == len({b for _, b in pairs}) == len(pairs)
    # Whoever goes without has no one in reach that someone nearer has not.
    left = np.setdiff1d(np.arange(len(stamps)), i)
    for k in left:
        in_reach = np.abs(others - stamps[k]) <= limit
        if in_reach.any():
            best = others[in_reach][np.argmin(np.abs(others[in_reach] - stamps[k]))]
            assert any(abs(a - b) <= abs(int(stamps[k]) - int(best)) for a, b in pairs)


def test_the_shorter_one_is_gone_through():
    reference, estimate = track(range(0, 1000, 10)), track([1, 52, 997])
    ref, est = associate(reference, estimate, 5)
    assert (ref.stamps.tolist(), est.stamps.tolist()) == ([0, 50, 990][:2], [1, 52])
    est, ref = associate(estimate, reference, 5)
    assert (ref.stamps.tolist(), est.stamps.tolist()) == ([0, 50], [1, 52])


def test_interpolation_goes_along_the_line_and_the_shortest_turn():
    reference = track([0, 100, 200, 900], x=[0, 1, 3, 4], yaw=[3.0, -3.0, 0, 0])
    ref, est = interpolate(reference, track([-1, 0, 25, 150, 200, 500, 900, 901]), 300)
    assert est.stamps.tolist() == ref.stamps.tolist() == [0, 25, 150, 200, 900]
    np.testing.assert_allclose(ref.positions[:, 0], [0, 0.25, 2, 3, 4])
    yaw = so3.log(so3.from_matrix(ref.rotations))[:, 2]
    quarter = 3.0 + 0.25 * (2 * np.pi - 6.0)
    np.testing.assert_allclose(yaw[:2], [3.0, quarter], atol=1e-12)


def test_nothing_in_reach_gives_no_pairs():
    ref, est = associate(track([0, 1]), track([100]), 5)
    assert len(ref.stamps) == len(est.stamps) == 0
    ref, est = interpolate(track([0, 1]), track([100]), 5)
    assert len(ref.stamps) == len(est.stamps) == 0


@pytest.mark.parametrize("empty", ["stamps", "others"])
def test_empty_is_no_pairs(empty):
    one, none = np.array([1]), np.zeros(0, np.int64)
    i, j = nearest(none if empty == "stamps" else one, none if empty == "others" else one, 5)
    assert len(i) == len(j) == 0
