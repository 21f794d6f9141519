import numpy as np
import pytest

from logpose.formats.events import Pose
from logpose.pipelines.report.deviation import deviation
from logpose.pipelines.report.track import TrackBuilder

SECOND = 1_000_000_000


def track(rows, covariance=None):
    builder = TrackBuilder("x")
    for stamp, x, y, heading in rows:
        orientation = np.array([0.0, 0.0, np.sin(heading / 2), np.cos(heading / 2)])
        position = np.array([x, y, 0.0])
        builder.add(Pose(stamp=int(stamp * SECOND), position=position, orientation=orientation, covariance=covariance))
    return builder.build()


def test_the_truth_is_interpolated_to_the_estimate():
    truth = track([(0.0, 0.0, 0.0, 3.1), (1.0, 2.0, 4.0, -3.1)])
    error = deviation(track([(0.25, 0.8, 0.6, 3.0)]), truth)
    # At a quarter: (0.5, 1.0); the heading goes the short way over pi: 3.1 + 0.25 (2 pi - 6.2)
    assert (error.dx[0], error.dy[0]) == (pytest.approx(0.3), pytest.approx(-0.4))
    assert error.distance[0] == pytest.approx(0.5)
    assert error.turn[0] == pytest.approx(3.0 - (3.1 + 0.25 * (2 * np.pi - 6.2)))


def test_nothing_is_said_outside_the_truth_and_over_its_gaps():
    truth = track([(t, 0.0, 0.0, 0.0) for t in (0.0, 1.0, 2.1, 3.0)])
    error = deviation(track([(t, 1.0, 0.0, 0.0) for t in (-0.1, 0.0, 0.5, 1.0, 1.5, 2.1, 3.0, 3.1)]), truth)
    assert np.isfinite(error.distance).tolist() == [False, True, True, True, False, True, True, False]


def test_without_truth_nothing_is_known():
    error = deviation(track([(0.0, 1.0, 1.0, 0.0)]), track([]))
    assert not error.is_known
    assert error.share_within(3.0) is None


def test_the_share_within_three_sigma_counts_all_three_errors_at_once():
    covariance = np.diag([0.01, 0.01, 1, 1, 1, 0.01])  # sigma 0.1 m, 0.1 m, 0.1 rad
    truth = track([(float(t), 0.0, 0.0, 0.0) for t in range(4)])
    rows = [(0.0, 0.29, 0.0, 0.0), (1.0, 0.31, 0.0, 0.0), (2.0, 0.0, 0.0, 0.31), (3.0, 0.2, -0.2, 0.2)]
    assert deviation(track(rows, covariance), truth).share_within(3.0) == 0.5
    assert deviation(track(rows), truth).share_within(3.0) is None
