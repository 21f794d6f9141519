import numpy as np
import pytest

from logpose.pipelines.geometry import se3, so3

RNG = np.random.default_rng(2)
AXES = RNG.normal(size=(30, 3))
AXES /= np.linalg.norm(AXES, axis=1, keepdims=True)
RHO = RNG.normal(size=(30, 3)) * 10

ANGLES = [0.0, 1e-12, 1e-5, 0.99e-2, 1.01e-2, 0.7, 3.0, np.pi - 1e-6]


@pytest.fixture(params=ANGLES, ids=str)
def tangent(request):
    return np.concatenate([RHO, AXES * request.param], axis=1)


def test_log_of_exp_gives_the_tangent_back(tangent):
    np.testing.assert_allclose(se3.log(se3.exp(tangent)), tangent, atol=2e-13)


def test_exp_is_the_matrix_exponential(tangent):
    # The defining series, summed until its terms vanish: an independent route to the same matrix.
    for row in tangent[:5]:
        x, y, z = row[3:]
        generator = np.array([[0, -z, y, row[0]], [z, 0, -x, row[1]], [-y, x, 0, row[2]], [0, 0, 0, 0]])
        total, term = np.eye(4), np.eye(4)
        for k in range(1, 60):
            term = term @ generator / k
            total = total + term
        np.testing.assert_allclose(se3.as_matrix(se3.exp(row)), total, atol=1e-12)


def test_inverse_composes_to_no_motion(tangent):
    a = se3.exp(tangent)
    t, q = se3.compose(a, se3.inverse(a))
    np.testing.assert_allclose(t, 0, atol=1e-13)
    np.testing.assert_allclose(so3.angle(q), 0, atol=1e-14)


def test_compose_is_the_matrix_product_and_associative(tangent):
    a, b, c = se3.exp(tangent), se3.exp(tangent[::-1] * 0.5), se3.exp(np.roll(tangent, 4, axis=0) * 0.1)
    product = se3.as_matrix(a) @ se3.as_matrix(b)
    np.testing.assert_allclose(se3.as_matrix(se3.compose(a, b)), product, atol=1e-12)
    left = se3.as_matrix(se3.compose(se3.compose(a, b), c))
    np.testing.assert_allclose(left, se3.as_matrix(se3.compose(a, se3.compose(b, c))), atol=1e-12)


def test_between_takes_one_pose_to_the_other(tangent):
    a, b = se3.exp(tangent), se3.exp(np.roll(tangent, 1, axis=0))
    np.testing.assert_allclose(se3.as_matrix(se3.compose(a, se3.between(a, b))), se3.as_matrix(b), atol=1e-12)


def test_apply_is_the_matrix_times_the_point(tangent):
    a = se3.exp(tangent)
    points = np.concatenate([RHO[::-1], np.ones((30, 1))], axis=1)
    expected = np.einsum("nij,nj->ni", se3.as_matrix(a), points)[:, :3]
    np.testing.assert_allclose(se3.apply(a, RHO[::-1]), expected, atol=1e-12)


def test_matrix_gives_the_motion_back(tangent):
    a = se3.exp(tangent)
    t, q = se3.from_matrix(se3.as_matrix(a))
    np.testing.assert_allclose(t, a[0], atol=1e-14)
    np.testing.assert_allclose(so3.angle(so3.compose(so3.inverse(q), a[1])), 0, atol=1e-14)


def test_a_quarter_circle_ends_where_geometry_says():
    # Constant twist v = 1 m/s, w = pi/2 rad/s for 1 s: a quarter of a circle of radius 2/pi.
    t, q = se3.exp(np.array([1.0, 0, 0, 0, 0, np.pi / 2]))
    np.testing.assert_allclose(t, [2 / np.pi, 2 / np.pi, 0], atol=1e-15)
    np.testing.assert_allclose(so3.log(q), [0, 0, np.pi / 2], atol=1e-15)


@pytest.mark.parametrize("shape", [(), (3,), (2, 3), (0,)])
def test_everything_works_on_any_leading_shape(shape):
    a = se3.exp(RNG.normal(size=(*shape, 6)))
    assert se3.log(a).shape == (*shape, 6)
    assert se3.as_matrix(a).shape == (*shape, 4, 4)
    assert se3.compose(a, se3.identity())[0].shape == (*shape, 3)
