import numpy as np
import pytest

from logpose.pipelines.fuse.params import FuseParams
from logpose.pipelines.geometry.motion import Increment, twist_increment
from logpose.pipelines.localize_pf.params import LocalizePfParams
from logpose.pipelines.odometry.noise import OdometryErrors, noise_variances


def variances(u):
    return noise_variances(np.array(u), OdometryErrors())


def test_noise_does_not_depend_on_the_rate_of_the_log():
    whole = twist_increment((0.4, 0.0, 0.0), 10.0)
    parts = twist_increment((0.4, 0.0, 0.0), 0.1)
    assert variances(whole) == pytest.approx(100 * variances(parts))


def test_standing_still_has_a_noise_floor_and_a_gap_far_more():
    floor = variances(Increment(dt=1.0))
    assert floor[0] > 0.0
    assert floor[2] > 0.0
    gap = variances(Increment(dt=5.0, gap=5.0))
    assert np.sqrt(gap[0]) > 1.0  # 0.3 m/s for 5 s


@pytest.mark.parametrize(
    ("params", "first", "before", "after"),
    [
        (FuseParams, ["map", "smooth", "initial_pose"], "lost_window_s", None),
        (LocalizePfParams, ["method", "map", "particles"], "news_s", "kernel_m"),
    ],
)
def test_the_errors_of_odometry_stand_together_in_the_parameters_of_a_stage(params, first, before, after):
    keys, shared = list(params.model_fields), list(OdometryErrors.model_fields)
    assert keys[: len(first)] == first
    start = keys.index(shared[0])
    assert keys[start : start + len(shared)] == shared
    assert keys[start - 1] == before
    assert (keys[start + len(shared) :] or [None])[0] == after
