import numpy as np
import pytest

from logpose.pipelines.estimation.banded import Factorised, Normal
from logpose.pipelines.estimation.losses import Loss
from logpose.pipelines.estimation.smoothing import Factor, Linear, smooth, whitening
from logpose.pipelines.geometry.se2 import between, compose

PLANAR = np.array([0.02, 0.01, 0.01])
FIX = np.array([0.03, 0.03, 0.02])


def add(states, errors):
    return states + errors


def move(poses, errors):
    return compose(poses, errors)


def turned(heading):
    """Return (K, 3, 3): the errors of poses with these headings, in the map."""
    T = np.tile(np.eye(3), (len(heading), 1, 1))
    c, s = np.cos(heading), np.sin(heading)
    T[:, 0, 0], T[:, 0, 1], T[:, 1, 0], T[:, 1, 1] = c, -s, s, c
    return T


def wrapped(residual):
    residual[:, 2] = np.remainder(residual[:, 2] + np.pi, 2 * np.pi) - np.pi
    return residual


def fixes(at, z, sigma=FIX, loss=None):
    """Poses measured in the map."""

    def linearise(poses, _border):
        return Linear(wrapped(z - poses[at]), -turned(poses[at, 2]))

    W = np.tile(np.diag(1 / np.asarray(sigma)), (len(at), 1, 1))
    return Factor(linearise, W, at) if loss is None else Factor(linearise, W, at, loss=loss)


def steps(u, sigma=PLANAR, loss=None):
    """Motion from each pose to the next; the border, if there is one, is the error of the speed scale."""
    at = np.arange(len(u))

    def linearise(poses, border):
        driven = u * np.array([1.0 + border[0], 1.0, 1.0]) if len(border) else u
        end = compose(poses[at], driven)
        r = between(end, poses[at + 1])
        A = np.tile(np.eye(3), (len(u), 1, 1))
        A[:, 0, 2], A[:, 1, 2] = -r[:, 1], r[:, 0]
        F = np.tile(np.eye(3), (len(u), 1, 1))
        F[:, :2, :2] = np.swapaxes(turned(driven[:, 2])[:, :2, :2], 1, 2)
        F[:, :2, 2] = (F[:, :2, :2] @ np.stack([-driven[:, 1], driven[:, 0]], axis=-1)[..., None])[..., 0]
        by_border = None
        if len(border):
            forward = np.zeros((len(u), 3, 1))
            forward[:, :2, 0] = u[:, :1] * F[:, :2, 0]
            by_border = -A @ forward
        return Linear(r, -A @ F, turned(r[:, 2]), by_border)

    W = np.tile(np.diag(1 / np.asarray(sigma)), (len(u), 1, 1))
    columns = np.zeros((len(u), 1), dtype=np.intp)
    return Factor(linearise, W, at, columns, **({} if loss is None else {"loss": loss}))


def scale_prior(sigma=0.1):
    return Factor(
        lambda _poses, border: Linear(border[None, :], by_border=np.ones((1, 1, 1))),
        np.array([[[1 / sigma]]]),
        columns=np.zeros((1, 1), dtype=np.intp),
    )


def drive(n, seed, scale=0.0):
    """Return true poses, steps and fixes of a drive, without noise and with it."""
    rng = np.random.default_rng(seed)
    u = np.column_stack([np.full(n - 1, 0.3), np.zeros(n - 1), rng.normal(0, 0.3, n - 1)])
    truth = [np.array([1.0, 2.0, 3.0])]
    for step in u:
        truth.append(compose(truth[-1], step * (1 + scale, 1, 1)))
    truth = np.array(truth)
    noisy_u = u + rng.normal(0, 1, u.shape) * PLANAR
    noisy_z = truth + rng.normal(0, 1, truth.shape) * FIX
    return truth, u, noisy_u, noisy_z


def dense_normal(factors, states, border):
    """Return the whole normal matrix and right side, built without knowing that it is banded."""
    n, d, q = len(states), 3, len(border)
    H, g = np.zeros((n * d + q, n * d + q)), np.zeros(n * d + q)
    for f in factors:
        linear = f.linearise(states, border)
        for k in range(len(linear.residual)):
            J = np.zeros((linear.residual.shape[1], n * d + q))
            if linear.by_state is not None:
                i = f.at[k] * d
                J[:, i : i + d] = linear.by_state[k]
            if linear.by_next is not None:
                i = (f.at[k] + 1) * d
                J[:, i : i + d] = linear.by_next[k]
            if linear.by_border is not None:
                J[:, n * d + f.columns[k]] = linear.by_border[k]
            r = f.whiten[k] @ linear.residual[k]
            w = float(f.loss.weight(np.array([r @ r]))[0])
            J = f.whiten[k] @ J
            H += w * J.T @ J
            g -= w * J.T @ r
    return H, g


def dense_smooth(factors, states, border, iterations=30):
    for _ in range(iterations):
        H, g = dense_normal(factors, states, border)
        x = np.linalg.solve(H, g)
        states, border = compose(states, x[: 3 * len(states)].reshape(-1, 3)), border + x[3 * len(states) :]
    return states, border, np.linalg.inv(dense_normal(factors, states, border)[0])


def blocks(matrix, n, d=3):
    return np.array([matrix[i * d : (i + 1) * d, i * d : (i + 1) * d] for i in range(n)])


@pytest.mark.parametrize("n", [1, 2, 3, 20])
@pytest.mark.parametrize("q", [0, 1, 2])
def test_banded_equations_are_solved_as_dense_ones_and_so_are_the_diagonal_blocks_of_the_inverse(n, q):
    rng = np.random.default_rng(n + q)
    d = 4
    J = rng.normal(0, 1, (n, 3 * d + q, 2 * d + q))  # of states i, i + 1 and the border
    normal, H = Normal.zero(n, d, q), np.zeros((n * d + q, n * d + q))
    g = rng.normal(0, 1, n * d + q)
    for i in range(n):
        columns = [*range(i * d, min(i + 2, n) * d), *range(n * d, n * d + q)]
        rows = [*range(min(2, n - i) * d), *range(2 * d, 2 * d + q)]
        part = J[i].T @ J[i]
        H[np.ix_(columns, columns)] += part[np.ix_(rows, rows)]
    for i in range(n):
        own, after = slice(i * d, (i + 1) * d), slice((i + 1) * d, (i + 2) * d)
        normal.diagonal[i], normal.border[i] = H[own, own], H[own, n * d :]
        if i + 1 < n:
            normal.below[i] = H[after, own]
    normal.corner[:] = H[n * d :, n * d :]
    factorised = Factorised(normal)
    x, b = factorised.solve(g[: n * d].reshape(n, d), g[n * d :])
    expected = np.linalg.solve(H, g)
    assert x.ravel() == pytest.approx(expected[: n * d], rel=1e-9, abs=1e-9)
    assert b == pytest.approx(expected[n * d :], rel=1e-9, abs=1e-9)
    states, corner = factorised.marginals()
    inverse = np.linalg.inv(H)
    assert states == pytest.approx(blocks(inverse, n, d), rel=1e-9, abs=1e-9)
    assert corner == pytest.approx(inverse[n * d :, n * d :], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("has_border", [False, True])
def test_a_chain_is_smoothed_as_by_dense_least_squares(has_border):
    truth, _, u, z = drive(12, 0)
    at = np.array([0, 3, 4, 4, 11])  # one pose is measured twice
    factors = [fixes(at, z[at]), steps(u)] + [scale_prior()] * has_border
    border = np.zeros(int(has_border))
    result = smooth(z, factors, move, border=border)
    states, expected_border, inverse = dense_smooth(factors, z, border)
    assert result.is_converged
    assert wrapped(result.states - states) == pytest.approx(np.zeros((12, 3)), abs=1e-9)
    assert result.border == pytest.approx(expected_border, abs=1e-9)
    assert result.covariances == pytest.approx(blocks(inverse, 12), abs=1e-9)
    assert result.border_covariance == pytest.approx(inverse[36:, 36:], abs=1e-9)


@pytest.mark.parametrize("kind", ["huber", "cauchy", "geman-mcclure"])
def test_a_robust_chain_ends_where_dense_reweighting_ends(kind):
    _, _, u, z = drive(10, 1)
    z[4] += (2.0, -1.0, 0.5)
    factors = [fixes(np.arange(10), z, loss=Loss(kind, 3.0)), steps(u, loss=Loss("huber", 3.0))]
    start = z.copy()
    start[4] = compose(z[3], u[3])
    result = smooth(start, factors, move, iterations=200, tolerance=1e-20)
    states, _, inverse = dense_smooth(factors, start, np.zeros(0), iterations=200)
    assert wrapped(result.states - states) == pytest.approx(np.zeros((10, 3)), abs=1e-9)
    assert result.covariances == pytest.approx(blocks(inverse, 10), abs=1e-9)


def test_without_noise_the_truth_comes_out_from_a_start_far_off():
    truth, u, _, _ = drive(40, 2, scale=0.05)
    factors = [fixes(np.array([0, 39]), truth[[0, 39]]), steps(u), scale_prior(sigma=1e3)]
    start = compose(truth, np.random.default_rng(2).normal(0, 1, truth.shape) * (0.5, 0.5, 0.5))
    result = smooth(start, factors, move, border=np.zeros(1), tolerance=1e-24)
    assert wrapped(result.states - truth) == pytest.approx(np.zeros_like(truth), abs=1e-9)
    assert result.border == pytest.approx([0.05], abs=1e-7)  # the prior of 1e3 pulls by 5e-5 / 1e6


def test_one_state_is_its_measurements():
    z = np.array([[1.0, 2.0, 3.0], [1.2, 2.0, 3.1]])
    result = smooth(z[:1], [fixes(np.zeros(2, dtype=np.intp), z)], move)
    assert result.states[0] == pytest.approx([1.1, 2.0, 3.05])
    assert result.covariances[0] == pytest.approx(np.diag(FIX**2) / 2)


def test_a_rigid_move_of_the_world_changes_nothing_but_the_frame():
    _, _, u, z = drive(15, 3)
    z[7] += (1.0, 1.0, 0.0)
    at = np.arange(0, 15, 2)
    world = np.array([100.0, -50.0, 2.0])
    loss = Loss("geman-mcclure", 4.0)
    kept = smooth(z, [fixes(at, z[at], loss=loss), steps(u)], move, tolerance=1e-20)
    moved = compose(world, z)
    other = smooth(moved, [fixes(at, moved[at], loss=loss), steps(u)], move, tolerance=1e-20)
    assert wrapped(other.states - compose(world, kept.states)) == pytest.approx(np.zeros((15, 3)), abs=1e-9)
    assert other.covariances == pytest.approx(kept.covariances, abs=1e-12)  # of errors in the frame of the robot


@pytest.mark.parametrize("kind", ["huber", "cauchy", "geman-mcclure"])
def test_false_measurements_pull_no_more_than_their_loss_allows(kind):
    _, _, u, z = drive(60, 4)
    bad, at = np.array([10, 30, 45]), np.arange(60)
    false = z.copy()
    false[bad] += (3.0, 1.0, 1.0)
    good = np.setdiff1d(at, bad)
    loss = Loss(kind, 3.0)
    clean = smooth(z, [fixes(good, z[good], loss=loss), steps(u)], move)
    start = smooth(z, [fixes(at, false, loss=Loss("huber", 3.0)), steps(u)], move, tolerance=1e-6).states
    result = smooth(start, [fixes(at, false, loss=loss), steps(u)], move)
    squares = smooth(z, [fixes(at, false), steps(u)], move)
    shift, without = (np.hypot(*(r.states - clean.states)[bad, :2].T) for r in (result, squares))
    # a residual of length e pulls with w e / sigma, and the pose gives way by its variance; twice, for the heading's part
    s = result.squares[0][bad]
    pull = loss.weight(s) * np.sqrt(s) / FIX[0]
    assert np.all(shift < 2 * pull * clean.covariances[bad, 0, 0])
    assert np.all(without > 0.5)
    assert set(np.argsort(result.squares[0])[-3:]) == set(bad)


def test_losses_are_squares_near_zero_and_their_weights_are_their_slopes():
    s = np.array([1e-9, 0.5, 3.0, 8.99, 9.01, 50.0, 1e6])
    for kind in ("squares", "huber", "cauchy", "geman-mcclure"):
        loss = Loss(kind, 3.0)
        assert loss.cost(s[:1]) == pytest.approx(s[:1], rel=1e-6)
        slope = (loss.cost(s * (1 + 1e-6)) - loss.cost(s * (1 - 1e-6))) / (2e-6 * s)
        assert loss.weight(s) == pytest.approx(slope, rel=1e-4)
        assert np.all(np.diff(loss.weight(s)) <= 0)


def test_steps_that_overshoot_are_damped():
    # r = arctan(x): from x = 3 Gauss-Newton jumps to -9.5 and then away for ever
    at = np.zeros(1, dtype=np.intp)
    factor = Factor(lambda x, _: Linear(np.arctan(x[at]), 1 / (1 + x[at, :, None] ** 2)), np.ones((1, 1, 1)), at)
    result = smooth(np.array([[3.0]]), [factor], add)
    assert result.is_converged
    assert result.states == pytest.approx(np.zeros((1, 1)), abs=1e-6)


def test_covariances_are_honest_for_linear_gaussian_chains():
    sums = []
    one = np.ones((20, 1, 1))
    for seed in range(100):
        rng = np.random.default_rng(seed)
        x = np.cumsum(rng.normal(0, 0.1, (20, 1)), axis=0)
        z, at = x + rng.normal(0, 0.5, x.shape), np.arange(20)
        seen = Factor(lambda s, _, z=z: Linear(z - s, -one), one / 0.5, at)
        walk = Factor(lambda s, _: Linear(np.diff(s, axis=0), -one[1:], one[1:]), one[1:] / 0.1, at[:-1])
        start = Factor(lambda s, _: Linear(s[:1], one[:1]), one[:1] / 0.1, at[:1])
        result = smooth(z, [seen, walk, start], add)
        sums.append((result.states[10, 0] - x[10, 0]) ** 2 / result.covariances[10, 0, 0])
    # 100 independent runs of one degree of freedom: chi-square of 100, 99.9 %
    assert 61.9 < np.sum(sums) < 153.2


def test_what_is_not_determined_is_said():
    _, _, u, z = drive(5, 0)
    with pytest.raises(ValueError, match=r"^the measurements do not determine every state\. Add a weak prior\.$"):
        smooth(z, [steps(u)], move)
    beside = Factor(
        lambda _, b: Linear(0 * b[None], by_border=np.zeros((1, 1, 1))),
        np.ones((1, 1, 1)),
        columns=np.zeros((1, 1), np.intp),
    )
    with pytest.raises(ValueError, match=r"^the measurements do not determine the border\. Add a weak prior\.$"):
        smooth(z, [fixes(np.arange(5), z), beside], move, border=np.zeros(1))


def test_whitening_makes_covariances_one():
    rng = np.random.default_rng(0)
    A = rng.normal(0, 1, (4, 3, 3))
    cov = A @ np.swapaxes(A, 1, 2) + 0.1 * np.eye(3)
    W = whitening(cov)
    assert W @ cov @ np.swapaxes(W, 1, 2) == pytest.approx(np.tile(np.eye(3), (4, 1, 1)), abs=1e-12)
