import numpy as np
import pytest

from logpose.pipelines.report.timeline import extremes, runs, stretches, with_pauses


def test_stretches_keep_mean_and_range():
    t, values = np.arange(1000.0), np.arange(1000.0) % 10
    middle, mean, low, high = stretches(t, values, 10)
    assert len(middle) == 10
    assert mean == pytest.approx(np.full(10, 4.5), abs=0.1)
    assert (low.tolist(), high.tolist()) == ([0.0] * 10, [9.0] * 10)


def test_extremes_lose_no_peak():
    rng = np.random.default_rng(1)
    values = rng.normal(size=100_000)
    chosen = extremes(np.arange(100_000.0), values, 200)
    assert len(chosen) <= 400
    assert (np.diff(chosen) > 0).all()
    assert (values[chosen].max(), values[chosen].min()) == (values.max(), values.min())


def test_extremes_keep_gaps():
    values = np.full(10_000, np.nan)
    values[:2000] = 1.0
    chosen = extremes(np.arange(10_000.0), values, 100)
    assert np.isnan(values[chosen]).any()
    assert np.isfinite(values[chosen]).any()


def test_a_line_ends_before_a_pause_and_begins_after_it():
    t, values = with_pauses(np.array([0.0, 1.0, 9.0, 10.0]), 2.0, np.array([1.0, 2.0, 3.0, 4.0]))
    assert t.tolist() == [0.0, 1.0, 1.0, 9.0, 10.0]
    assert np.isnan(values).tolist() == [False, False, True, False, False]


def test_runs_of_true_values_have_a_first_and_a_last():
    assert list(runs(np.array([True, True, False, True]))) == [(0, 1), (3, 3)]
    assert list(runs(np.zeros(3, dtype=bool))) == []
