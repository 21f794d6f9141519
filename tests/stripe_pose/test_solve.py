"""Pose, tilt and roll from lines and ends: exact without noise, honest with it."""

import numpy as np
import pytest

from logpose.pipelines.stripe_pose.levelling import levelling_matrix, line_of_bearing
from logpose.pipelines.stripe_pose.model import end_model, line_model
from logpose.pipelines.stripe_pose.pose import bearings, pose_covariance
from logpose.pipelines.stripe_pose.solve import Attitude, Ends, Lines, lines_attitude, solve

from .conftest import mark_of

X = mark_of().edges
FREE = Attitude(0.0, 0.0, np.inf, np.inf)
TRUTH = np.array([0.5, 0.05, 1.0, 0.06, 0.02, -0.1])


def lines_of(values, *, z=0.03, place_sd=1e-5, slope_sd=1e-3, noise=None):
    x, slope = line_of_bearing(bearings(values[:3], X), values[3], values[4], z)
    if noise is not None:
        x = x + place_sd * noise.standard_normal(len(X))
        slope = slope + slope_sd * noise.standard_normal(len(X))
    n = len(X)
    return Lines(X, x, slope, np.full(n, z), np.eye(n) * place_sd**2, np.full(n, slope_sd**2))


def ends_of(values, sd=1e-4):
    """Ends of four bars, projected here by hand."""
    phi, dx, dy, tilt, roll, dz = values
    middles = 0.5 * (X[::2] + X[1::2])
    points = [(m, h) for m in middles for h in (0.05, -0.05)]
    out = []
    for m, h in points:
        level = np.array([np.cos(phi) * m + dx, np.sin(phi) * m + dy, dz + h])
        right, ahead, up = levelling_matrix(tilt, roll) @ level
        out.append((m, h, right / ahead, up / ahead, sd**2))
    return Ends(*np.array(out).T)


@pytest.mark.parametrize("attitude", [FREE, Attitude(0.06, 0.02), Attitude(0.06, 0.02, 0.01, 0.01)])
@pytest.mark.parametrize("has_ends", [False, True])
def test_without_noise_the_truth_comes_back(attitude, has_ends):
    found = solve(lines_of(TRUTH), attitude, ends_of(TRUTH) if has_ends else None)
    expected = TRUTH if has_ends else TRUTH[:5]
    assert found.values == pytest.approx(expected, abs=1e-9)
    assert found.chi2 == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("tilt", [-0.7, -0.3, 0.4, 0.7])
def test_the_lines_alone_level_a_camera_that_is_tilted_by_forty_degrees(tilt):
    values = np.array([-0.4, 0.02, 0.6, tilt, 0.3])
    lines = lines_of(values)
    assert lines_attitude(lines) == pytest.approx((tilt, 0.3), abs=1e-9)
    assert solve(lines, FREE).values == pytest.approx(values, abs=1e-9)


def test_an_attitude_that_is_exact_is_not_changed():
    found = solve(lines_of(TRUTH), Attitude(0.05, 0.0))
    assert found.values[3:] == pytest.approx([0.05, 0.0], abs=0)
    assert np.all(found.cov[3:] == 0.0)


def test_a_level_camera_has_the_bound_of_the_closed_form():
    values = np.array([0.5, 0.05, 1.0, 0.0, 0.0])
    found = solve(lines_of(values, z=0.0), Attitude())
    assert found.cov[:3, :3] == pytest.approx(pose_covariance(values[:3], X, 1e-5), rel=1e-3)


@pytest.mark.parametrize("has_ends", [False, True])
def test_errors_are_as_large_as_the_covariance_says(has_ends):
    rng = np.random.default_rng(4)
    truth = TRUTH if has_ends else TRUTH[:5]
    attitude = Attitude(0.06, 0.02, 0.05, 0.05)
    squares, chi2 = [], []
    for _ in range(300):
        known = Attitude(*(np.array([0.06, 0.02]) + 0.05 * rng.standard_normal(2)), 0.05, 0.05)
        ends = ends_of(TRUTH, sd=1e-4) if has_ends else None
        if ends is not None:
            ends = Ends(ends.X, ends.half, ends.x, ends.z + 1e-4 * rng.standard_normal(len(ends.z)), ends.var)
        found = solve(lines_of(truth, noise=rng), known, ends)
        error = found.values - truth
        squares.append(error @ np.linalg.solve(found.cov, error))
        chi2.append(found.chi2 / found.dof)
    n = len(truth)
    # Mean of 300 chi-squares of n degrees: sd sqrt(2 n / 300); four of them.
    assert np.mean(squares) == pytest.approx(n, abs=4 * np.sqrt(2 * n / 300))
    assert np.mean(chi2) == pytest.approx(1.0, abs=0.1)
    assert attitude.tilt_sd == 0.05


def test_models_have_the_derivatives_they_say():
    ends = ends_of(TRUTH)
    z = np.full(len(X), 0.03)

    def all_of(values):
        place, slope, height = np.empty((8, 6)), np.empty((8, 6)), np.empty((8, 7))
        line_model(values, X, z, place, slope)
        end_model(values, ends.X.copy(), ends.half.copy(), height)
        return place, slope, height

    at = TRUTH + 0.01
    exact = all_of(at)
    for k in range(6):
        h = np.zeros(6)
        h[k] = 1e-6
        for model, up, down in zip(exact, all_of(at + h), all_of(at - h), strict=True):
            if k + 1 < model.shape[1]:
                assert model[:, 1 + k] == pytest.approx((up[:, 0] - down[:, 0]) / 2e-6, rel=1e-6, abs=1e-8)


def test_ends_fix_the_distance_of_a_turned_mark():
    values = np.array([1.1, 0.0, 1.0, 0.0, 0.0, 0.05])
    without = solve(lines_of(values[:5]), Attitude(0, 0, 0.01, 0.01))
    with_ends = solve(lines_of(values[:5]), Attitude(0, 0, 0.01, 0.01), ends_of(values, sd=1e-4))
    assert np.sqrt(with_ends.cov[2, 2]) < 0.5 * np.sqrt(without.cov[2, 2])


def test_two_lines_are_refused_and_three_in_one_place_have_no_pose():
    few = Lines(X[:2], np.zeros(2), np.zeros(2), np.zeros(2), np.eye(2), np.ones(2))
    with pytest.raises(ValueError, match="2 lines; a pose needs at least three"):
        solve(few, Attitude())
    same = Lines(X[:3], np.zeros(3), np.zeros(3), np.zeros(3), np.eye(3), np.ones(3))
    with pytest.raises((ValueError, np.linalg.LinAlgError)):
        solve(same, Attitude())
