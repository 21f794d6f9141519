import math

import pytest

from logpose.pipelines.report.spread import spread


def test_five_values_have_mean_standard_deviation_and_students_interval():
    found = spread([1.0, 2.0, 3.0, 4.0, 5.0])
    assert (found.n, found.mean) == (5, 3.0)
    assert found.sd == pytest.approx(math.sqrt(2.5), abs=1e-15)
    # t(4, 0.975) = 2.7764451, from any table of Student's distribution
    assert found.high - found.mean == pytest.approx(2.7764451 * math.sqrt(2.5 / 5), rel=1e-7)
    assert found.mean - found.low == pytest.approx(found.high - found.mean, rel=1e-12)


def test_one_value_has_no_spread_and_none_has_no_mean():
    assert (spread([2.0]).mean, spread([2.0]).sd, spread([2.0]).low) == (2.0, None, None)
    assert (spread([]).n, spread([]).mean) == (0, None)


def test_a_value_that_is_no_number_is_refused():
    with pytest.raises(ValueError, match="a value is not finite"):
        spread([1.0, math.nan])
