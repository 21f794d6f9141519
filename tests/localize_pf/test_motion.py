import numpy as np
import pytest

from logpose.pipelines.estimation.weights import uniform
from logpose.pipelines.geometry.motion import Increment, twist_increment
from logpose.pipelines.geometry.se2 import between, compose, exp, log
from logpose.pipelines.localize_pf.motion import N_AUX, Cloud, drive, start_covariance
from logpose.pipelines.localize_pf.params import LocalizePfParams

QUIET = dict.fromkeys(("along_per_sqrt_m", "along_per_sqrt_s", "cross_per_sqrt_m", "heading_per_sqrt_rad", "heading_per_sqrt_m", "heading_per_sqrt_s", "scale_walk_per_sqrt_s", "bias_walk_rad_s_per_sqrt_s"), 0.0)  # fmt: skip


def params(**changes):
    return LocalizePfParams(map="-", **changes)


def one(pose, aux=(0.0,) * N_AUX, P=None):
    return Cloud(np.array([pose]), np.array([aux]), uniform(1), np.zeros((8, 8)) if P is None else P)


def test_without_noise_and_bias_a_particle_follows_the_arc():
    cloud = one([1.0, 2.0, 0.3])
    drive(cloud, twist_increment((0.36, 0.0, 0.5), 380 / 4400), params(**QUIET, shift_sigma_m=0.0))
    assert cloud.poses[0] == pytest.approx([1.029494703699, 2.009826336299, 0.343181818182], abs=1e-9)
    assert np.abs(cloud.P).max() == 0.0


def test_scale_and_bias_change_way_and_turn():
    cloud = one([0.0, 0.0, 0.0], (0.1, 0.2, 0.01, 0.0, 0.0))
    drive(cloud, Increment(dx=1.0, dtheta=0.5, dt=2.0), params(**QUIET))
    assert cloud.poses[0, 2] == pytest.approx(0.5 * 1.2 + 0.02)
    assert np.hypot(*cloud.poses[0, :2]) == pytest.approx(1.1)


def test_errors_move_as_the_linearisation_says():
    """Central differences over every state, against the way P moves."""
    u = twist_increment((0.4, 0.05, 0.7), 0.25)
    state = np.array([0.0, 0.0, 0.0, 0.05, -0.04, 0.01, 0.02, -0.01])
    start = np.array([3.0, -1.0, 2.0])
    quiet = params(**QUIET, shift_sigma_m=0.0)

    def after(error):
        cloud = one(compose(start, exp(error[:3])), state[3:] + error[3:])
        drive(cloud, u, quiet)
        return cloud

    centre, h = after(np.zeros(8)), 1e-6
    F = np.zeros((8, 8))
    for j in range(8):
        step = h * np.eye(8)[j]
        plus, minus = after(step), after(-step)
        pose = [log(between(centre.poses[0], c.poses[0])) for c in (plus, minus)]
        F[:3, j] = (pose[0] - pose[1]) / (2 * h)
        F[3:, j] = (plus.aux[0] - minus.aux[0]) / (2 * h)
    A = np.random.default_rng(0).normal(0, 1, (8, 8))
    P = A @ A.T
    cloud = one(start, state[3:], P)
    drive(cloud, u, quiet)
    # the half-turn in the noise of the arc is to first order in the scales
    assert pytest.approx(F @ P @ F.T, abs=2e-3 * np.abs(P).max()) == cloud.P


def test_common_shift_forgets_and_keeps_its_size():
    P = start_covariance(np.zeros((3, 3)), params())
    cloud = one([0.0, 0.0, 0.0], (0.0, 0.0, 0.0, 0.02, 0.0), P.copy())
    for _ in range(50):
        drive(cloud, Increment(dt=0.1), params())
    assert cloud.aux[0, 3] == pytest.approx(0.02 * np.exp(-5.0))
    assert cloud.P[6, 6] == pytest.approx(P[6, 6])
