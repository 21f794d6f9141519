import numpy as np
import pytest

from logpose.pipelines.estimation.kalman import Consistency, chi_square, correct, innovation, predict


def spd(rng, n):
    A = rng.normal(0, 1, (n, n))
    return A @ A.T + 0.1 * np.eye(n)


def test_one_step_on_paper():
    # P = 4, drive by 1 with noise 1 -> 5; measure with noise 5: gain 1/2, variance 2.5, residual 2 -> error 1
    P = predict(np.array([[4.0]]), np.eye(1), np.eye(1))
    assert pytest.approx(np.array([[5.0]])) == P
    seen = innovation(P, np.array([2.0]), np.eye(1), np.array([[5.0]]))
    assert seen.nis == pytest.approx(0.4)
    error, P = correct(P, seen)
    assert error == pytest.approx([1.0])
    assert pytest.approx(np.array([[2.5]])) == P


def test_two_measurements_at_once_or_one_after_the_other_are_the_information_form():
    rng = np.random.default_rng(0)
    P, R = spd(rng, 5), spd(rng, 3)
    H, x = rng.normal(0, 1, (3, 5)), rng.normal(0, 1, 5)
    error, posterior = correct(P, innovation(P, H @ x, H, R))
    information = np.linalg.inv(P) + H.T @ np.linalg.solve(R, H)
    assert posterior == pytest.approx(np.linalg.inv(information), abs=1e-12)
    assert error == pytest.approx(np.linalg.solve(information, H.T @ np.linalg.solve(R, H @ x)), abs=1e-12)

    R = np.diag(np.diag(R))
    error, posterior = correct(P, innovation(P, H @ x, H, R))
    done, left = np.zeros(5), P
    for i in range(3):
        step, left = correct(left, innovation(left, H[[i]] @ (x - done), H[[i]], R[[i]][:, [i]]))
        done = done + step
    assert left == pytest.approx(posterior, abs=1e-12)
    assert done == pytest.approx(error, abs=1e-12)


def test_the_first_errors_move_and_the_others_stay():
    rng = np.random.default_rng(1)
    P, F, Q = spd(rng, 7), rng.normal(0, 1, (3, 3)), spd(rng, 3)
    whole, noise = np.eye(7), np.zeros((7, 7))
    whole[:3, :3], noise[:3, :3] = F, Q
    assert predict(P, F, Q) == pytest.approx(whole @ P @ whole.T + noise, abs=1e-12)


def test_covariance_stays_positive_where_the_short_form_does_not():
    # a state known to 1 km measured to a micrometre twice: P - K H P leaves rounding of 1e6 * 1e-16
    P = np.array([[1e6, 1e6 - 1e-7], [1e6 - 1e-7, 1e6]])
    H, R = np.array([[1.0, 0.0], [0.0, 1.0]]), 1e-12 * np.eye(2)
    for _ in range(3):
        _, P = correct(P, innovation(P, np.zeros(2), H, R))
    assert np.array_equal(P, P.T)
    assert np.linalg.eigvalsh(P).min() > 0.0
    assert np.diag(P).max() <= 1e-12


def test_an_exact_measurement_leaves_no_doubt_in_its_direction():
    P = np.array([[2.0, 1.0], [1.0, 3.0]])
    error, P = correct(P, innovation(P, np.array([0.5]), np.array([[1.0, 0.0]]), np.zeros((1, 1))))
    assert error == pytest.approx([0.5, 0.25])
    assert pytest.approx(np.array([[0.0, 0.0], [0.0, 2.5]]), abs=1e-15) == P


def test_gate_is_the_quantile_of_chi_square():
    from scipy.stats import chi2

    for dof in (1, 2, 3, 6):
        for probability in (0.5, 0.95, 0.999):
            assert chi_square(probability, dof) == pytest.approx(chi2.ppf(probability, dof), rel=1e-12)
    just = np.sqrt(chi_square(0.999, 1))
    P, H, R = np.zeros((1, 1)), np.eye(1), np.eye(1)
    assert innovation(P, np.array([just * 0.999]), H, R).passes(0.999)
    assert not innovation(P, np.array([just * 1.001]), H, R).passes(0.999)


def simulate(seed, n=200, noise_scale=1.0):
    """Follow a point that is pushed at random and measured; the filter believes a noise of one."""
    rng = np.random.default_rng(seed)
    F, Q = np.array([[1.0, 0.1], [0.0, 1.0]]), 0.01 * np.diag([0.1, 1.0])
    H, R = np.array([[1.0, 0.0]]), np.array([[1.0]])
    truth, guess, P = rng.normal(0, 1, 2), np.zeros(2), np.eye(2)
    seen_all, nees = Consistency(), []
    for _ in range(n):
        truth = F @ truth + rng.multivariate_normal(np.zeros(2), Q)
        guess, P = F @ guess, predict(P, F, Q)
        z = truth[:1] + noise_scale * rng.normal(0, 1, 1)
        seen = innovation(P, z - guess[:1], H, R)
        seen_all.add(seen)
        error, P = correct(P, seen)
        guess = guess + error
        nees.append((truth - guess) @ np.linalg.solve(P, truth - guess))
    return seen_all, nees


def test_innovations_of_an_honest_filter_are_white_and_of_their_size():
    for seed in range(3):
        seen, _ = simulate(seed)
        low, high = seen.bounds(0.999)
        assert (seen.count, seen.dof) == (200, 200)
        assert low < seen.ratio < high
    boastful, _ = simulate(0, noise_scale=1.5)
    assert boastful.ratio > boastful.bounds(0.999)[1]


def test_errors_of_an_honest_filter_are_of_their_size():
    # the last error of each of 200 runs is independent of the others: 400 degrees of freedom, 99.9 %
    last = [simulate(seed, n=20)[1][-1] for seed in range(200)]
    assert chi_square(0.0005, 400) < np.sum(last) < chi_square(0.9995, 400)


def test_without_innovations_there_is_no_ratio():
    assert np.isnan(Consistency().ratio)
