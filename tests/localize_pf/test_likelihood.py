import numpy as np
import pytest

from logpose.pipelines.geometry.motion import Increment
from logpose.pipelines.geometry.se2 import compose, exp, inverse, transform
from logpose.pipelines.localize_pf.likelihood import innovations, map_noise, novelty, sensitivity
from logpose.pipelines.localize_pf.params import LocalizePfParams

PARAMS = LocalizePfParams(map="-", map_length_m=2.0, news_length_m=0.5)
FIRST = Increment(dt=np.inf)


def test_innovation_is_what_was_seen_minus_what_was_expected():
    pose, landmark, z = np.array([1.0, 2.0, 0.7]), np.array([2.0, 3.0]), np.array([0.9, 0.4])
    seen = transform(pose[None], z)
    d = innovations(seen, pose[None, 2], landmark[None])[0, 0]
    assert d == pytest.approx(z - transform(inverse(pose), landmark), abs=1e-12)


def test_sensitivity_is_the_derivative_of_the_innovation():
    pose, landmark = np.array([1.0, 2.0, 0.7]), np.array([2.0, 3.0])
    z = transform(inverse(pose), landmark)
    H = sensitivity(z)
    for j, step in enumerate(1e-6 * np.eye(3)):
        # the true pose is off by the step: what is seen moves, the estimate stays
        seen = transform(inverse(compose(pose, exp(step))), landmark)
        assert (seen - z) / 1e-6 == pytest.approx(H[:, j], abs=1e-5)
    assert np.array_equal(H[:, 6:], np.eye(2))


def test_survey_error_counts_once_for_images_far_apart_and_less_and_less_for_the_same():
    assert map_noise(0.01, FIRST, PARAMS) == pytest.approx(0.01)
    near, nearer = (map_noise(0.01, Increment(length=s), PARAMS) for s in (0.02, 0.01))
    # coth(p/2) -> 2/p: n images on a way of one length weigh as much as two independent ones
    assert near == pytest.approx(0.01 * 2 / (0.02 / 2.0), rel=1e-3)
    assert nearer == pytest.approx(2 * near, rel=1e-3)
    assert np.isfinite(map_noise(0.01, Increment(), PARAMS))


def test_survey_errors_are_new_after_way_turn_or_time_alike():
    params = LocalizePfParams(map="-", map_length_m=2.0, map_turn_rad=0.5, map_s=30.0)
    half = [Increment(length=1.0), Increment(turn=0.25), Increment(dt=15.0)]
    expected = 0.01 / np.tanh(0.25)
    assert [map_noise(0.01, since, params) for since in half] == pytest.approx([expected] * 3)


def test_an_image_is_news_after_some_way_and_none_at_rest():
    assert novelty(FIRST, PARAMS) == 1.0
    assert novelty(Increment(), PARAMS) == 0.0
    assert novelty(Increment(length=0.05), PARAMS) == pytest.approx(np.tanh(0.1))
