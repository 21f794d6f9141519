import numpy as np
import pytest

from logpose.pipelines.geometry import so3

RNG = np.random.default_rng(1)
AXES = RNG.normal(size=(40, 3))
AXES /= np.linalg.norm(AXES, axis=1, keepdims=True)

# Random, tiny (both sides of the switch to the series), half turns and just short of them.
ANGLES = [0.0, 1e-12, 1e-7, 0.99e-4, 1.01e-4, 1e-3, 0.5, 2.0, np.pi - 1e-3, np.pi - 1e-9, np.pi]


@pytest.fixture(params=ANGLES, ids=str)
def rotvec(request):
    return AXES * request.param


def same(a, b, atol=1e-14):
    """Two quaternions are the same rotation up to sign."""
    sign = np.sign(np.sum(a * b, axis=-1, keepdims=True))
    np.testing.assert_allclose(a, sign * b, atol=atol, rtol=0)


def test_exp_gives_unit_quaternions(rotvec):
    np.testing.assert_allclose(np.linalg.norm(so3.exp(rotvec), axis=-1), 1, atol=1e-15)


def test_exp_of_log_is_identity(rotvec):
    q = so3.exp(rotvec)
    same(so3.exp(so3.log(q)), q)


def test_log_of_exp_gives_the_rotation_vector_back(rotvec):
    angle = np.linalg.norm(rotvec, axis=1).max()
    if angle > np.pi - 1e-12:
        pytest.skip("a half turn has two rotation vectors")
    np.testing.assert_allclose(so3.log(so3.exp(rotvec)), rotvec, atol=1e-14)


def test_log_keeps_the_relative_precision_of_tiny_rotations():
    rotvec = AXES * 1e-9
    np.testing.assert_allclose(so3.log(so3.exp(rotvec)), rotvec, rtol=1e-12)


def test_angle_is_the_length_of_log(rotvec):
    np.testing.assert_allclose(so3.angle(so3.exp(rotvec)), np.linalg.norm(rotvec, axis=1), atol=1e-14)


def test_inverse_composes_to_no_rotation(rotvec):
    q = so3.exp(rotvec)
    same(so3.compose(q, so3.inverse(q)), np.broadcast_to(so3.identity(), q.shape))


def test_compose_is_associative_and_is_the_matrix_product(rotvec):
    a, b, c = so3.exp(rotvec), so3.exp(AXES[::-1] * 1.3), so3.exp(np.roll(AXES, 3, axis=0) * 0.2)
    same(so3.compose(so3.compose(a, b), c), so3.compose(a, so3.compose(b, c)))
    np.testing.assert_allclose(so3.as_matrix(so3.compose(a, b)), so3.as_matrix(a) @ so3.as_matrix(b), atol=1e-14)


def test_matrix_is_a_rotation_and_gives_the_quaternion_back(rotvec):
    q = so3.exp(rotvec)
    matrix = so3.as_matrix(q)
    np.testing.assert_allclose(matrix @ np.swapaxes(matrix, -1, -2), np.broadcast_to(np.eye(3), (40, 3, 3)), atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(matrix), 1, atol=1e-14)
    same(so3.from_matrix(matrix), q)


def test_apply_is_the_matrix_times_the_vector(rotvec):
    q, v = so3.exp(rotvec), AXES[::-1] * 5
    np.testing.assert_allclose(so3.apply(q, v), np.einsum("nij,nj->ni", so3.as_matrix(q), v), atol=1e-13)


def test_quarter_turn_about_z_turns_x_into_y():
    np.testing.assert_allclose(
        so3.apply(so3.exp(np.array([0, 0, np.pi / 2])), np.array([1.0, 0, 0])), [0, 1, 0], atol=1e-15
    )


def test_normalize_gives_length_one_and_positive_w():
    q = so3.normalize(np.array([[0.0, 0, 3, -4], [0, 0, 0, 2]]))
    np.testing.assert_allclose(q, [[0, 0, -0.6, 0.8], [0, 0, 0, 1]])


@pytest.mark.parametrize("bad", [[0.0, 0, 0, 0], [np.nan, 0, 0, 1]])
def test_normalize_refuses_what_has_no_direction(bad):
    with pytest.raises(ValueError, match="no direction"):
        so3.normalize(np.array(bad))


@pytest.mark.parametrize("shape", [(), (3,), (2, 3), (0,)])
def test_everything_works_on_any_leading_shape(shape):
    rotvec = RNG.normal(size=(*shape, 3))
    q = so3.exp(rotvec)
    assert q.shape == (*shape, 4)
    assert so3.log(q).shape == (*shape, 3)
    assert so3.angle(q).shape == shape
    assert so3.as_matrix(q).shape == (*shape, 3, 3)
    assert so3.from_matrix(so3.as_matrix(q)).shape == (*shape, 4)
    assert so3.compose(q, so3.identity()).shape == (*shape, 4)
