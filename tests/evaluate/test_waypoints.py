import numpy as np
import pytest

from logpose.pipelines.evaluate.associate import Track
from logpose.pipelines.evaluate.waypoints import Pass, passes, summary


def track(stamps, xy):
    n = len(stamps)
    return Track(np.array(stamps), np.column_stack([np.array(xy, float), np.zeros(n)]), np.tile(np.eye(3), (n, 1, 1)))


TRUTH = track([0, 100, 200], [[0, 0], [10, 0], [10, 10]])


def test_both_are_taken_at_the_moment_of_the_nearest_pass():
    estimate = track([0, 50, 200], [[0.1, 0], [5.1, 0.2], [10.1, 10.2]])
    (found,) = passes(TRUTH, estimate, [("A", 2.5, 0.3)], 1.0)
    assert found.stamp == 25
    np.testing.assert_allclose(found.truth, [2.5, 0])
    np.testing.assert_allclose(found.estimate, [2.6, 0.1])
    row = found.to_json()
    assert row["name"] == "A"
    assert row["dx_m"] == pytest.approx(0.1)
    assert row["dy_m"] == pytest.approx(0.1)
    assert row["distance_m"] == pytest.approx(np.sqrt(0.02))
    assert (row["x_m"], row["estimate_x_m"]) == pytest.approx((2.5, 2.6))


def test_a_corner_is_passed_at_its_pose():
    (found,) = passes(TRUTH, TRUTH, [("corner", 10.2, -0.2)], 1.0)
    assert (found.stamp, found.truth.tolist()) == (100, [10, 0])


def test_what_was_not_passed_or_not_covered_has_no_error_and_says_why():
    sparse = track([0, 50], [[0, 0], [5, 0]])
    far, late = passes(TRUTH, sparse, [("far", 5, 3), ("late", 10, 5)], 1.0)
    assert far.why_not == "the reference stays 3 m away"
    assert late.why_not == "the estimate does not cover this moment"
    assert late.to_json()["distance_m"] is None
    assert summary([far, late])["n_missed"] == 2
    assert summary([far, late])["mean_distance_m"] is None
    gap = track([0, 2_000_000_000], [[0, 0], [10, 0]])
    (found,) = passes(gap, gap, [("A", 5, 0)], 1.0)
    assert found.why_not == "the estimate has a gap of 2 s here"


# The paper's Table 4 with W1's estimated y as it was meant, and the averages that its Table 5 prints (with x and y
# exchanged): papers/ceiling/paper_tables.yaml.
TABLE_4 = [
    (30.38, 27.20, 30.33, 27.26), (37.47, 27.32, 37.47, 27.40), (75.11, 27.63, 75.01, 27.59),
    (75.03, 38.85, 75.06, 38.90), (36.13, 39.01, 36.20, 39.00), (19.87, 38.49, 19.88, 38.53),
    (18.81, 27.56, 18.79, 27.58),
]  # fmt: skip


def test_the_averages_are_those_of_the_paper():
    rows = [Pass(f"W{i}", i, np.array([x, y]), np.array([u, v])) for i, (x, y, u, v) in enumerate(TABLE_4, 1)]
    distances = [row.to_json()["distance_m"] for row in rows]
    printed = [0.078102, 0.08, 0.107703, 0.05831, 0.070711, 0.041231, 0.028284]
    np.testing.assert_allclose(distances, printed, atol=5.1e-7)
    found = summary(rows)
    assert found["n"] == 7
    expected = {
        "mean_dx_m": 0.04, "sd_dx_m": 0.03559, "mean_dy_m": 0.042857, "sd_dy_m": 0.023604,
        "mean_distance_m": 0.066334, "sd_distance_m": 0.026452, "max_distance_m": 0.107703,
    }  # fmt: skip
    for key, value in expected.items():
        assert found[key] == pytest.approx(value, abs=5.1e-7), key
