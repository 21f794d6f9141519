import numpy as np
import pytest

from logpose.pipelines.evaluate.associate import Track
from logpose.pipelines.evaluate.consistency import consistency, nees
from logpose.pipelines.geometry import so3

COV = np.diag([0.04, 0.01, 0.0, 0.0, 0.0, 0.0025])


def tracks(n, covariance, scale=1.0, *, is_planar=True):
    rng = np.random.default_rng(7)
    root = np.linalg.cholesky(covariance + 1e-18 * np.eye(6))
    error = scale * rng.normal(size=(n, 6)) @ root.T
    if is_planar:
        error[:, 2:5] = 0
    truth = Track(np.arange(n), error[:, :3], so3.as_matrix(so3.exp(error[:, 3:])))
    guess = Track(np.arange(n), np.zeros((n, 3)), np.tile(np.eye(3), (n, 1, 1)), np.tile(covariance, (n, 1, 1)))
    return truth, guess


def test_a_hand_computed_value():
    truth, guess = tracks(1, COV)
    truth = Track(truth.stamps, np.array([[0.2, -0.3, 0.0]]), so3.as_matrix(so3.exp(np.array([[0.0, 0.0, 0.1]]))))
    values, dof = nees(truth, guess)
    assert dof == 3
    np.testing.assert_allclose(values, [0.2**2 / 0.04 + 0.3**2 / 0.01 + 0.1**2 / 0.0025])


@pytest.mark.parametrize("is_planar", [True, False])
def test_honest_covariances_give_the_mean_of_chi_square(is_planar):
    n, covariance = 4000, COV if is_planar else np.diag([0.04, 0.01, 0.02, 1e-4, 2e-4, 1e-4])
    found = consistency(*tracks(n, covariance, is_planar=is_planar))
    assert found["dof"] == (3 if is_planar else 6)
    # 3 sigma of the mean of n chi-square values, whose variance is 2 dof.
    assert found["nees_mean"] == pytest.approx(found["dof"], abs=3 * np.sqrt(2 * found["dof"] / n))
    # 3 sigma of a share of 0.95 in 4000 draws.
    assert found["nees_inside"] == pytest.approx(0.95, abs=3 * np.sqrt(0.95 * 0.05 / n))


def test_errors_twice_as_large_show_four_times():
    found = consistency(*tracks(4000, COV, scale=2.0))
    assert found["nees_mean"] == pytest.approx(12, rel=0.1)
    assert found["nees_mean"] > found["nees_mean_high"]


def test_poses_without_a_covariance_are_counted_and_left_out():
    truth, guess = tracks(3, COV)
    guess.covariances[0] = np.nan
    guess.covariances[1] = 0
    found = consistency(truth, guess)
    assert (found["poses"], found["without_covariance"]) == (1, 2)
    guess.covariances[2] = 0
    assert consistency(truth, guess)["nees_mean"] is None
