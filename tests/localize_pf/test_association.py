import numpy as np
import pytest

from logpose.pipelines.localize_pf.association import CLUTTER, candidates, draw, forbid_used, vote


def test_candidates_are_all_in_reach_of_any_particle_and_few_others():
    landmarks = np.array([[0.0, 0.0], [1.0, 0.0], [5.0, 0.0]])
    near = candidates(np.array([[0.1, 0.0], [0.9, 0.0]]), landmarks, 0.01 * np.eye(2))
    assert near.tolist() == [0, 1]
    assert candidates(np.array([[50.0, 0.0]]), landmarks, 0.01 * np.eye(2)).size == 0


def test_draws_follow_the_probabilities():
    p = np.array([0.7, 0.3, 0.0])
    with np.errstate(divide="ignore"):
        log_p = np.tile(np.log(p), (20000, 1)) - 700.0
    drawn = draw(log_p, np.array([CLUTTER, 4, 9]), np.random.default_rng(0))
    assert np.mean(drawn == 4) == pytest.approx(0.3, abs=0.017)  # 5 sigma of 20 000
    assert not np.any(drawn == 9)


def test_a_landmark_is_used_once_per_particle_but_clutter_often():
    options = np.array([CLUTTER, 3, 4])
    log_p = np.zeros((2, 3))
    forbid_used(log_p, options, np.array([[3, CLUTTER], [CLUTTER, CLUTTER]]))
    assert log_p.tolist() == [[0.0, -np.inf, 0.0], [0.0, 0.0, 0.0]]


def test_the_cloud_reports_only_what_holds_more_than_half():
    answers = np.array([2, 2, 5, CLUTTER])
    assert vote(answers, np.array([0.4, 0.2, 0.3, 0.1])) == 2
    assert vote(answers, np.array([0.3, 0.2, 0.4, 0.1])) == CLUTTER
    assert vote(answers, np.array([0.1, 0.1, 0.1, 0.7])) == CLUTTER
