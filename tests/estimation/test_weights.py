import numpy as np
import pytest

from logpose.pipelines.estimation.weights import effective_sample_size, log_sum_exp, normalise, uniform


def test_weights_sum_to_one_even_where_densities_underflow():
    log_w, log_sum = normalise(np.array([-2000.0, -2001.0, -np.inf]))
    assert np.exp(log_w).sum() == pytest.approx(1.0, abs=1e-12)  # 2000 eps
    assert np.exp(log_w[1] - log_w[0]) == pytest.approx(np.exp(-1.0))
    assert log_sum == pytest.approx(-2000.0 + np.log1p(np.exp(-1.0)))


def test_all_zero_weights_become_equal_and_say_so():
    log_w, log_sum = normalise(np.full(4, -np.inf))
    assert np.allclose(np.exp(log_w), 0.25)
    assert log_sum == -np.inf


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_weight_that_is_none_is_refused(bad):
    with pytest.raises(ValueError, match="is not a weight"):
        normalise(np.array([0.0, bad]))


def test_effective_sample_size_runs_from_one_to_n():
    assert effective_sample_size(uniform(7)) == pytest.approx(7.0)
    assert effective_sample_size(np.array([0.0, -np.inf, -np.inf])) == pytest.approx(1.0)


def test_log_sum_exp_takes_an_axis_of_nothing():
    rows = np.array([[0.0, np.log(3.0)], [-np.inf, -np.inf]])
    assert log_sum_exp(rows) == pytest.approx([np.log(4.0), -np.inf])
