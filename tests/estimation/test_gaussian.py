import numpy as np
import pytest

from logpose.pipelines.estimation.gaussian import (
    LOST,
    largest_variance,
    log_density,
    pose_covariance,
    pose_moments,
    sample,
    split,
)


def test_moments_of_a_cloud_over_the_seam():
    poses = np.array([[0.0, 1.0, np.pi - 0.1], [2.0, 1.0, -np.pi + 0.1]])
    mean, cov = pose_moments(poses, np.array([0.5, 0.5]))
    assert mean[:2] == pytest.approx([1.0, 1.0])
    assert abs(mean[2]) == pytest.approx(np.pi, abs=1e-12)
    assert np.diag(cov) == pytest.approx([1.0, 0.0, 0.01])
    assert cov[0, 2] == pytest.approx(0.1)


def test_covariance_of_a_cloud_is_symmetric_and_not_negative():
    rng = np.random.default_rng(0)
    _, cov = pose_moments(rng.normal(0, 1, (30, 3)), rng.dirichlet(np.ones(30)))
    assert np.array_equal(cov, cov.T) or np.allclose(cov, cov.T, atol=1e-15)
    assert np.linalg.eigvalsh(cov).min() >= 0.0


def test_splitting_keeps_the_distribution():
    rng = np.random.default_rng(0)
    A = rng.normal(0, 1, (5, 5))
    P = A @ A.T
    kernel = 0.04 * np.eye(3)
    n = 200_000
    offsets, narrow = split(P, kernel, n, rng)
    whole = offsets.T @ offsets / n + narrow
    # the sample covariance of n draws is off by sqrt(2 / n) = 0.003 of the variances, 1 sigma
    assert whole == pytest.approx(P, abs=5 * 0.0032 * np.diag(P).max())
    assert np.all(np.diag(narrow)[:3] < 0.04)
    assert np.linalg.eigvalsh(narrow).min() > 0.0


def test_splitting_a_certain_pose_does_nothing():
    offsets, narrow = split(np.zeros((5, 5)), np.eye(3), 10, np.random.default_rng(0))
    assert np.abs(offsets).max() == 0.0
    assert np.abs(narrow).max() == 0.0


def test_sampling_a_singular_covariance_stays_in_its_plane():
    cov = np.array([[1.0, 1.0], [1.0, 1.0]])
    drawn = sample(cov, 1000, np.random.default_rng(0))
    assert np.abs(drawn[:, 0] - drawn[:, 1]).max() < 1e-4
    assert drawn[:, 0].std() == pytest.approx(1.0, abs=0.12)  # 5 sigma of 1000 draws


def test_density_is_the_formula_and_integrates_to_one():
    S = np.array([[0.04, 0.01], [0.01, 0.02]])
    x = np.linspace(-1.5, 1.5, 301)
    grid = np.stack(np.meshgrid(x, x, indexing="ij"), axis=-1)
    p = np.exp(log_density(grid, S))
    assert p.sum() * 0.01**2 == pytest.approx(1.0, abs=1e-6)
    assert float(log_density(np.zeros(2), np.eye(2))) == pytest.approx(-np.log(2 * np.pi))


def test_largest_variance_is_the_eigenvalue():
    S = np.array([[2.0, 0.7], [0.7, 1.0]])
    assert largest_variance(S) == pytest.approx(np.linalg.eigvalsh(S)[-1])


def test_the_covariance_of_a_lost_pose_is_a_metre_and_half_a_radian():
    assert np.array_equal(np.diag([1.0, 1.0, 0.25]), LOST)
    assert pose_covariance(0.1, 0.2) == pytest.approx(np.diag([0.01, 0.01, 0.04]))
