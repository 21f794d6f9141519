import numpy as np
import pytest

from logpose.formats.events import Notice, Odometry, Pose, Summary
from logpose.pipelines.evaluate.evaluation import EvaluateParams
from logpose.pipelines.evaluate.stage import evaluate

UP = np.array([0.0, 0, 0, 1])


def pose(k, source, x, covariance=None):
    return Pose(
        stamp=k * 100_000_000,
        source=source,
        position=np.array([x, 0.1 * k, 0.0]),
        orientation=UP,
        covariance=covariance,
    )


def stream(n=10, **offsets):
    for k in range(n):
        yield Odometry(stamp=k * 100_000_000, source="odometry")
        for source, offset in offsets.items():
            yield pose(k, source.replace("_", "-"), offset)


def run(events, **params):
    events = list(events)
    out = list(evaluate(iter(events), EvaluateParams(**params)))
    assert out[: len(events)] == events  # everything is forwarded, in order
    return out[len(events) :]


def test_the_first_estimator_is_scored_at_the_end():
    (summary,) = run(stream(truth=0.0, localize_pf=0.5, dead_reckon=2.0))
    assert isinstance(summary, Summary)
    assert (summary.source, summary.stamp) == ("evaluation", 900_000_000)
    assert summary.values["source"] == "localize-pf"
    assert summary.values["matched"] == 10
    assert summary.values["ate"]["rmse_m"] == pytest.approx(0.5)


def test_another_estimator_can_be_named():
    (summary,) = run(stream(truth=0.0, localize_pf=0.5, dead_reckon=2.0), source="dead-reckon")
    assert summary.values["ate"]["rmse_m"] == pytest.approx(2.0)


def test_a_log_without_truth_says_nothing():
    assert run(stream(localize_pf=0.5)) == []


def test_start_poses_are_no_estimates():
    events = [pose(0, "initial_pose", 9.0), *stream(truth=0.0, localize_pf=0.5)]
    (summary,) = run(events)
    assert summary.values["source"] == "localize-pf"


def test_a_truth_without_an_estimate_is_noticed():
    (notice,) = run(stream(truth=0.0))
    assert isinstance(notice, Notice)
    assert notice.message == "there is a truth but no pose to compare with it"
    (notice,) = run(stream(truth=0.0, localize_pf=0.5), source="slam")
    assert notice.message == "there is a truth but no pose of 'slam' to compare with it"


def test_trajectories_that_do_not_meet_are_noticed_and_the_run_goes_on():
    (notice,) = run([pose(0, "truth", 0.0), pose(900, "localize-pf", 0.0)])
    assert notice.code == "evaluate-failed"
    assert "no poses match within 0.01 s: the reference goes from 0.000 to 0.000 s" in notice.message
    assert notice.is_loss


def test_poses_with_and_without_covariance_are_told_apart():
    covariance = np.diag([0.25, 1, 0, 0, 0, 1])
    events = [pose(0, "truth", 0), pose(0, "pf", 1), pose(1, "truth", 0), pose(1, "pf", 1, covariance)]
    (summary,) = run(events)
    assert summary.values["consistency"]["poses"] == 1
    assert summary.values["consistency"]["nees_mean"] == pytest.approx(4.0)
