"""Cameras: against OpenCV, against their own inverse and finite differences, at the edge of what a model covers."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from logpose.pipelines.geometry.camera import Camera

LENSES = [
    ("plumb_bob", ()),
    ("plumb_bob", (-0.3, 0.1, 0.0, 0.0)),
    ("plumb_bob", (-0.28, 0.07, 0.001, -0.002, 0.003)),
    ("rational_polynomial", (0.5, -0.2, 0.0005, -0.0003, 0.01, 0.8, -0.1, 0.02)),
    ("equidistant", ()),
    ("equidistant", (0.02, -0.01, 0.004, -0.001)),
]
lenses = pytest.mark.parametrize(("model", "distortion"), LENSES)


def camera(model, distortion):
    return Camera(500.0, 510.0, 319.3, 241.1, model, distortion)


def directions(n=300):
    rng = np.random.default_rng(3)
    return np.concatenate([rng.uniform(-0.8, 0.8, (n, 2)), np.ones((n, 1))], axis=1)


@lenses
def test_projects_as_opencv_does(model, distortion):
    points, zero = directions(), np.zeros(3)
    matrix = np.array([[500.0, 0.0, 319.3], [0.0, 510.0, 241.1], [0.0, 0.0, 1.0]])
    if model == "equidistant":
        coefficients = np.array((*distortion, 0.0, 0.0, 0.0, 0.0)[:4])
        expected = cv2.fisheye.projectPoints(points[None], zero, zero, matrix, coefficients)[0]
    else:
        coefficients = np.array(distortion or (0.0,) * 4)
        expected = cv2.projectPoints(points, zero, zero, matrix, coefficients)[0]
    np.testing.assert_allclose(camera(model, distortion).project(points), expected.reshape(-1, 2), atol=1e-9)


@lenses
def test_unproject_inverts_project(model, distortion):
    lens, points = camera(model, distortion), directions()
    np.testing.assert_allclose(lens.unproject(lens.project(3.7 * points)), points, atol=1e-13)


@lenses
def test_the_axis_goes_to_the_principal_point_and_back(model, distortion):
    lens = camera(model, distortion)
    np.testing.assert_allclose(lens.project(np.array([0.0, 0.0, 2.0])), [319.3, 241.1], atol=1e-12)
    np.testing.assert_allclose(lens.unproject(np.array([319.3, 241.1])), [0.0, 0.0, 1.0], atol=1e-14)


@lenses
def test_jacobians_agree_with_finite_differences(model, distortion):
    lens = camera(model, distortion)
    uv, xy, d = lens.project(directions()), directions()[:, :2], 1e-5
    steps = [np.array([d, 0.0]), np.array([0.0, d])]
    numeric = np.stack(
        [(lens.unproject(uv + 100 * s) - lens.unproject(uv - 100 * s))[:, :2] / (200 * d) for s in steps], axis=-1
    )
    np.testing.assert_allclose(lens.unproject_with_jacobian(uv)[1], numeric, atol=1e-9)
    numeric = np.stack([(lens.distort(xy + s) - lens.distort(xy - s)) / (2 * d) for s in steps], axis=-1)
    np.testing.assert_allclose(lens.distort_jacobian(xy), numeric, atol=1e-8)


@lenses
def test_any_leading_shape_goes_through(model, distortion):
    lens, points = camera(model, distortion), directions(24)
    uv = lens.project(points)
    np.testing.assert_array_equal(lens.project(points.reshape(2, 3, 4, 3)).reshape(-1, 2), uv)
    np.testing.assert_array_equal(lens.unproject(uv.reshape(4, 6, 2)).reshape(-1, 3), lens.unproject(uv))
    assert lens.project(np.empty((0, 3))).shape == (0, 2)
    assert lens.unproject(np.empty((0, 2))).shape == (0, 3)


def test_what_is_behind_the_camera_has_no_pixel():
    lens = camera("plumb_bob", ())
    assert np.isnan(lens.project(np.array([[0.1, 0.1, -1.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))).all()


def test_beyond_the_turning_point_of_the_lens_both_ways_are_nan():
    # x (1 - 0.5 x^2) grows until x = sqrt(2/3) = 0.816, where it is 0.544; nothing maps farther out.
    lens = Camera(100.0, 100.0, 0.0, 0.0, "plumb_bob", (-0.5, 0.0, 0.0, 0.0))
    assert np.isfinite(lens.distort(np.array([0.81, 0.0]))).all()
    assert np.isnan(lens.distort(np.array([0.83, 0.0]))).all()
    assert np.isfinite(lens.undistort(np.array([0.54, 0.0]))).all()
    assert np.isnan(lens.undistort(np.array([0.55, 0.0]))).all()
    assert np.isnan(lens.undistort(np.array([[30.0, -20.0]]))).all()


def test_equidistant_is_the_angle_from_the_axis():
    lens = Camera(100.0, 100.0, 0.0, 0.0, "equidistant")
    np.testing.assert_allclose(lens.project(np.array([1.0, 0.0, 1.0])), [100 * np.pi / 4, 0.0], atol=1e-12)


@given(
    st.floats(-0.35, 0.35), st.floats(-0.1, 0.1), st.floats(-0.003, 0.003), st.floats(-0.7, 0.7), st.floats(-0.7, 0.7)
)
def test_undistort_is_exact_or_nan_for_any_lens(k1, k2, p1, x, y):
    lens = Camera(1.0, 1.0, 0.0, 0.0, "plumb_bob", (k1, k2, p1, -p1, 0.0))
    back = lens.distort(lens.undistort(np.array([x, y])))
    assert np.isnan(back).all() or np.abs(back - (x, y)).max() < 1e-12


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        ((0.0, 1.0, 0.0, 0.0), "the focal lengths are fx=0.0, fy=1.0 px; both must be positive"),
        (
            (1.0, 1.0, 0.0, 0.0, "fov"),
            "unknown distortion model 'fov'; known: plumb_bob, rational_polynomial, equidistant",
        ),
        ((1.0, 1.0, 0.0, 0.0, "plumb_bob", (0.1,)), "plumb_bob takes 0 or 4 or 5 coefficients, not 1"),
        ((1.0, 1.0, float("nan"), 0.0), "a number of the calibration is not finite"),
    ],
)
def test_impossible_cameras_are_refused(numbers, message):
    with pytest.raises(ValueError) as caught:
        Camera(*numbers)
    assert str(caught.value) == message
