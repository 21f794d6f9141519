import json

import numpy as np
import pytest

from logpose.formats.errors import FormatError
from logpose.formats.maps.waypoints import Waypoint
from logpose.formats.products import Trajectory
from logpose.pipelines.evaluate.evaluation import EvaluateParams, evaluate
from logpose.pipelines.evaluate.table import table
from logpose.pipelines.geometry import so3

SECOND = 1_000_000_000


def drive(n=50, *, rate=10, offset=(0.0, 0.0), start=0, covariance=None):
    """A circle of radius 5 m at 1 rad / 10 s, poses at ``rate`` Hz, moved by ``offset``."""
    t = np.arange(n) / rate
    heading = 0.1 * t
    xy = 5 * np.column_stack([np.sin(heading), 1 - np.cos(heading)]) + offset
    return Trajectory(
        stamps=start + (t * SECOND).astype(np.int64),
        positions=np.column_stack([xy, np.zeros(n)]),
        orientations=so3.exp(np.multiply.outer(heading, [0.0, 0.0, 1.0])),
        covariances=None if covariance is None else np.tile(covariance, (n, 1, 1)),
    )


def test_a_constant_offset_is_the_absolute_error_and_no_relative_one():
    result = evaluate(drive(), drive(offset=(0.3, 0.4)), EvaluateParams()).result
    assert (result["matched"], result["reference_total"], result["estimate_total"]) == (50, 50, 50)
    for key in ("rmse_m", "mean_m", "median_m", "max_m", "min_m"):
        assert result["ate"][key] == pytest.approx(0.5)
    assert result["ate"]["std_m"] == pytest.approx(0, abs=1e-12)
    assert result["ate"]["rmse_rad"] == pytest.approx(0, abs=1e-9)
    assert result["rpe"]["rmse_m"] == pytest.approx(0, abs=1e-12)
    assert result["rpe"]["pairs"] == 49
    assert result["duration_s"] == pytest.approx(4.9)


@pytest.mark.parametrize("method", ["origin", "se2", "se3", "sim3"])
def test_alignment_takes_a_constant_offset_away(method):
    result = evaluate(drive(), drive(offset=(0.3, 0.4)), EvaluateParams(align=method)).result
    assert result["ate"]["rmse_m"] == pytest.approx(0, abs=1e-9)
    assert result["alignment"]["method"] == method
    np.testing.assert_allclose(result["alignment"]["translation_m"], [-0.3, -0.4, 0], atol=1e-9)


def test_only_poses_within_max_diff_count():
    estimate = drive(start=4_000_000)
    assert evaluate(drive(), estimate, EvaluateParams()).result["matched"] == 50
    with pytest.raises(FormatError):
        evaluate(drive(), estimate, EvaluateParams(max_diff_s=0.003))


def test_interpolation_removes_the_error_of_unequal_stamps():
    truth, estimate = drive(500, rate=100), drive(40, start=0)
    late = Trajectory(
        stamps=estimate.stamps + 5_000_000, positions=estimate.positions, orientations=estimate.orientations
    )
    # 5 ms at 0.5 m/s is 2.5 mm; both estimates are right for the unshifted stamps.
    found = evaluate(truth, late, EvaluateParams(interpolate=True)).result["ate"]["rmse_m"]
    assert found == pytest.approx(0.0025, rel=1e-3)
    assert evaluate(truth, estimate, EvaluateParams(interpolate=True)).result["ate"]["rmse_m"] < 1e-9


def test_no_match_names_both_time_ranges():
    with pytest.raises(FormatError) as caught:
        evaluate(drive(), drive(start=100 * SECOND), EvaluateParams())
    assert str(caught.value) == (
        "evaluate: no poses match within 0.01 s: the reference goes from 0.000 to 4.900 s, the estimate from 100.000 to "
        "104.900 s. Check both trajectories."
    )


def changed(**changes):
    from dataclasses import replace

    return replace(drive(), **changes)


def with_value(array, index, value):
    array = array.copy()
    array[index] = value
    return array


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        (
            changed(positions=with_value(drive().positions, 7, np.nan)),
            "the estimate: pose 7: position [nan, nan, nan] is not finite",
        ),
        (
            changed(stamps=with_value(drive().stamps, 7, 0)),
            "the estimate: pose 7: stamp 0 does not follow 600000000",
        ),
        (
            changed(orientations=with_value(drive().orientations, 3, 0)),
            "the estimate: pose 3: the quaternion has length 0, not 1",
        ),
        (drive(0), "the estimate has no poses"),
    ],
)
def test_a_bad_trajectory_is_an_error_and_not_a_statistic(bad, message):
    with pytest.raises(FormatError) as caught:
        evaluate(drive(), bad, EvaluateParams())
    assert str(caught.value) == f"evaluate: {message}. Check both trajectories."


def test_one_pose_has_an_absolute_error_but_no_relative_one():
    result = evaluate(drive(1), drive(1, offset=(1, 0)), EvaluateParams()).result
    assert result["ate"]["rmse_m"] == 1
    assert result["rpe"] == {
        "delta": "1f", "pairs": 0, **dict.fromkeys(result["rpe"].keys() - {"delta", "pairs"})
    }  # fmt: skip


def test_a_long_error_is_a_loss_and_a_short_one_is_not():
    positions = drive(400).positions.copy()
    positions[100:180, 0] += 2
    estimate = Trajectory(stamps=drive(400).stamps, positions=positions, orientations=drive(400).orientations)
    lost = evaluate(drive(400), estimate, EvaluateParams()).result["lost"]
    assert lost == {"threshold_m": 1.0, "after_s": 10.0, "longest_s": pytest.approx(8.0), "is_lost": False}
    assert evaluate(drive(400), estimate, EvaluateParams(lost_s=7.0)).result["lost"]["is_lost"] is True


def test_consistency_is_there_where_covariances_are():
    covariance = np.diag([0.01, 0.01, 0, 0, 0, 0.01])
    result = evaluate(drive(), drive(offset=(0.1, 0.2), covariance=covariance), EvaluateParams()).result
    assert result["consistency"]["nees_mean"] == pytest.approx(5.0)
    assert "consistency" not in evaluate(drive(), drive(), EvaluateParams()).result
    aligned = evaluate(drive(), drive(covariance=covariance), EvaluateParams(align="se2")).result
    assert "consistency" not in aligned


@pytest.fixture
def with_waypoints():
    waypoints = [Waypoint("A", *drive().positions[20, :2]), Waypoint("far", 90.0, 0.0)]
    return evaluate(drive(), drive(offset=(0.3, -0.4)), EvaluateParams(), waypoints)


def test_waypoints_are_tabulated(with_waypoints):
    first, far = with_waypoints.result["waypoints"]
    assert (first["name"], first["stamp_ns"]) == ("A", 2 * SECOND)
    assert first["distance_m"] == pytest.approx(0.5, abs=1e-4)
    assert far["distance_m"] is None
    assert with_waypoints.result["waypoint_summary"]["n"] == 1


def test_json_is_the_documented_object_without_nan(with_waypoints):
    value = with_waypoints.to_json()
    assert list(value) == ["schema", "result"]
    assert value["schema"] == "logpose.evaluation/1"
    assert {"matched", "reference_total", "estimate_total", "ate", "rpe", "waypoints"} <= set(value["result"])
    assert {"rmse_m", "mean_m", "median_m", "max_m", "rmse_rad"} <= set(value["result"]["ate"])
    assert json.loads(json.dumps(value, allow_nan=False)) == value


def test_the_table_says_what_a_person_wants_to_know(with_waypoints):
    lines = table(with_waypoints).splitlines()
    assert lines[0].startswith("50 pairs of 50 poses of the reference and 50 of the estimate, over 4.9 s and ")
    row = next(line.split() for line in lines if line.startswith("ATE [m]"))
    assert float(row[2]) == pytest.approx(0.5)
    assert any(line.startswith("not lost: off by more than 1.0 m for at most 0 s") for line in lines)
    assert any(line.startswith("far") and line.endswith("m away)") for line in lines)


@pytest.mark.parametrize("delta", ["1", "0f"])
def test_a_step_that_is_none_is_an_error(delta):
    with pytest.raises(ValueError, match="is neither frames"):
        EvaluateParams(delta=delta)


def test_the_result_does_not_depend_on_where_the_world_is():
    rng = np.random.default_rng(0)
    truth, guess = drive(), drive()
    noisy = Trajectory(
        stamps=guess.stamps, positions=guess.positions + rng.normal(0, 0.1, (50, 3)), orientations=guess.orientations
    )
    motion = so3.exp(np.array([0.1, 0.2, 0.3]))

    def move(trajectory):
        positions = so3.apply(motion, trajectory.positions) + np.array([100, 200, 5])
        return Trajectory(
            stamps=trajectory.stamps, positions=positions, orientations=so3.compose(motion, trajectory.orientations)
        )

    for method in ("none", "origin", "se3", "sim3"):
        params = EvaluateParams(align=method)
        here, there = evaluate(truth, noisy, params).result, evaluate(move(truth), move(noisy), params).result
        assert there["ate"]["rmse_m"] == pytest.approx(here["ate"]["rmse_m"], rel=1e-9)
        assert there["rpe"]["rmse_m"] == pytest.approx(here["rpe"]["rmse_m"], rel=1e-9)
