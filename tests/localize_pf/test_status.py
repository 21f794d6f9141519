import numpy as np

from logpose.pipelines.localize_pf.params import LocalizePfParams
from logpose.pipelines.localize_pf.status import Judge, honest_covariance

PARAMS = LocalizePfParams(map="-", lost_window_s=3.0, lost_window_m=1.0, lost_count=4)
YES, NO = np.array([True, True]), np.array([False, False])


def drive(judge, n, surprise, matched, first=0):
    return [judge.look((k * 500_000_000, 0.2 * k), np.array(surprise), matched, 0.0) for k in range(first, first + n)]


def test_good_sightings_are_tracking_and_none_dead_reckoning():
    judge = Judge(PARAMS)
    assert set(drive(judge, 20, [3.0, 2.0], YES)) == {"tracking"}
    nothing = np.array([], dtype=bool)
    assert judge.look((10_000_000_000, 4.0), np.array([]), nothing, 0.0) == "dead-reckoning"
    assert judge.unseen() == "dead-reckoning"


def test_other_places_are_ambiguous():
    assert Judge(PARAMS).look((0, 0.0), np.array([3.0, 3.0]), YES, 0.3) == "ambiguous"


def test_sightings_worse_than_clutter_over_the_window_are_lost_and_better_ones_end_it():
    judge = Judge(PARAMS)
    drive(judge, 10, [3.0, 2.0], YES)
    status = drive(judge, 10, [-2.0, -2.0], YES, 10)
    assert status[0] == "tracking"
    assert status[-1] == "lost"
    assert judge.unseen() == "lost"
    assert drive(judge, 10, [3.0, 3.0], YES, 20)[-1] == "tracking"


def test_too_many_without_landmark_are_lost():
    assert drive(Judge(PARAMS), 12, [1.0, 1.0], NO)[-1] == "lost"


def test_a_robot_that_stands_before_something_unknown_is_not_lost():
    judge = Judge(PARAMS)
    drive(judge, 10, [3.0, 2.0], YES)
    waiting = [judge.look(((10 + k) * 500_000_000, 2.0), np.array([-2.0, -2.0]), NO, 0.0) for k in range(4)]
    assert set(waiting) == {"dead-reckoning"}


def test_a_pose_while_lost_is_never_confident():
    cov = honest_covariance(np.zeros((3, 3)), "lost")
    assert np.sqrt(np.diag(cov)).tolist() == [1.0, 1.0, 0.5]
    assert np.diag(honest_covariance(np.zeros((3, 3)), "tracking")).max() < 1e-7
