from hypothesis import given
from hypothesis import strategies as st

from logpose.formats import reorder
from logpose.formats.reorder import Message, in_stamp_order


def messages(pairs):
    return [Message(stamp, order, log_time, 1, "/t", ()) for order, (log_time, stamp) in enumerate(sorted(pairs))]


@given(st.lists(st.tuples(st.integers(0, 50), st.integers(0, 50))), st.integers(0, 60))
def test_what_leaves_is_in_order_and_nothing_vanishes(pairs, look_ahead):
    late: list[Message] = []
    came = messages(pairs)
    left = list(in_stamp_order(came, late.append, look_ahead))
    assert [m.stamp for m in left] == sorted(m.stamp for m in left)
    assert sorted([*left, *late], key=lambda m: m.order) == came


@given(st.lists(st.tuples(st.integers(0, 500), st.integers(-10, 0))))
def test_lags_within_the_look_ahead_lose_nothing(pairs):
    late: list[Message] = []
    came = messages([(log_time, log_time + lag) for log_time, lag in pairs])
    left = list(in_stamp_order(came, late.append, 10))
    assert not late
    # equal stamps leave as they came
    assert left == sorted(came, key=lambda m: (m.stamp, m.order))


def test_what_waits_is_bounded(monkeypatch):
    monkeypatch.setattr(reorder, "MAX_WAITING", 10)
    came = messages([(0, stamp) for stamp in range(100)])
    taken = 0

    def count():
        nonlocal taken
        for message in came:
            taken += 1
            yield message

    first = next(in_stamp_order(count(), lambda _: None, 5))
    assert first.stamp == 0
    assert taken == 11
