"""Group axioms on random, tiny and large poses, and on batches."""

import numpy as np
import pytest

from logpose.pipelines.geometry import se2
from logpose.pipelines.geometry.angles import wrap

RNG = np.random.default_rng(0)
POSES = np.concatenate(
    [
        RNG.uniform(-1, 1, (20, 3)) * (5, 5, np.pi),
        RNG.uniform(-1, 1, (10, 3)) * 1e-7,
        [[0, 0, 0], [1, 2, np.pi], [1, 2, 1e-5], [3, 0, -np.pi + 1e-9]],
    ]
)


def close(a, b, tolerance=1e-12):
    assert np.allclose(np.asarray(a)[..., :2], np.asarray(b)[..., :2], rtol=0, atol=tolerance)
    assert np.allclose(wrap(np.asarray(a)[..., 2] - np.asarray(b)[..., 2]), 0, atol=tolerance)


def test_inverse_undoes():
    close(se2.compose(POSES, se2.inverse(POSES)), np.zeros_like(POSES))
    close(se2.compose(se2.inverse(POSES), POSES), np.zeros_like(POSES))


def test_identity_changes_nothing():
    close(se2.compose(POSES, np.tile(se2.identity(), (len(POSES), 1))), POSES)


def test_composition_is_associative_and_between_closes_it():
    a, b, c = POSES[:10], POSES[10:20], POSES[20:30]
    close(se2.compose(se2.compose(a, b), c), se2.compose(a, se2.compose(b, c)))
    close(se2.compose(a, se2.between(a, b)), b)


def test_points_move_as_frames_do():
    points = RNG.uniform(-3, 3, (10, 2))
    a, b = POSES[:10], POSES[10:20]
    twice = se2.transform(a, se2.transform(b, points))
    assert np.allclose(twice, se2.transform(se2.compose(a, b), points), atol=1e-12)
    assert np.allclose(se2.transform(a, points), np.einsum("nij,nj->ni", se2.rotation(a[:, 2]), points) + a[:, :2])


def test_exp_and_log_undo_each_other():
    close(se2.exp(se2.log(POSES)), POSES, 1e-9)  # one pose lies 1e-9 from the seam, where log is steep
    small = RNG.uniform(-1, 1, (20, 3)) * (1, 1, 3)
    assert np.allclose(se2.log(se2.exp(small)), small, atol=1e-12)


@pytest.mark.parametrize("turn", [1e-3, 1e-4, 0.99e-4, 1e-6, 0.0])
def test_series_near_zero_joins_the_closed_form(turn):
    # Driving 2 m on a circle of radius 2 / turn, by geometry; cancellation costs it 1e-16 / turn^2 of the versine.
    x, y, _ = se2.exp(np.array([2.0, 0.0, turn]))
    assert x == pytest.approx(2.0 - 2.0 * turn**2 / 6.0, abs=1e-12)
    assert y == pytest.approx(turn - turn**3 / 12.0, abs=1e-12)


def test_adjoint_moves_an_error_through_a_pose():
    T, xi = np.array([1.0, -2.0, 0.7]), np.array([0.3, 0.1, -0.2])
    moved = se2.exp(se2.adjoint(T) @ xi)
    close(se2.compose(T, se2.exp(xi)), se2.compose(moved, T))
