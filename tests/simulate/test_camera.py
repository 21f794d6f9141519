"""The camera against the test vectors of its specification, and against OpenCV, which shares no code with it."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logpose.formats.calibration import Calibration
from logpose.pipelines.simulate.camera import (
    CameraParams,
    base_camera,
    calibration_of,
    project,
    ray_table,
    rays_through,
)
from logpose.pipelines.simulate.pose import MountParams, place, quaternion, rpy

LENS = (-0.15, 0.02, 0.001, -0.0005, 0.01)
PINHOLE = Calibration(640, 480, 525.0, 525.0, 319.5, 239.5, "plumb_bob", (0.0,) * 5)


def test_a_camera_that_looks_along_yaw_and_pitch_agrees_with_the_specification(look):
    view = look(np.array([5.2, 2.2, 1.1]), np.radians(97), np.radians(6))
    expected = [
        [0.992546151641, 0.121869343405, 0],
        [-0.012738815186, 0.103749323953, -0.994521895368],
        [-0.121201730391, 0.987108879971, 0.104528463268],
    ]
    np.testing.assert_allclose(view.rotation.T, expected, atol=1e-9)
    point = view.rotation.T @ (np.array([5, 10, 1.5]) - view.position)
    np.testing.assert_allclose(point, [0.752071648232, 0.413983731725, 7.765500995158], atol=1e-9)
    np.testing.assert_allclose(project(point, PINHOLE), [370.345092360165, 267.488079493056], atol=1e-9)


@pytest.mark.parametrize(
    ("uv", "xy"),
    [
        ((100, 0), (0, 0.375)),
        ((0, -100), (0.375, 0)),
        ((-100, 0), (0, -0.375)),
        ((0, 100), (-0.375, 0)),
        ((200, -150), (0.5625, 0.75)),
        ((-320, 240), (-0.9, -1.2)),
        ((0, 0), (0, 0)),
    ],
)
def test_a_camera_that_looks_up_has_the_image_top_ahead_and_its_right_to_the_left(uv, xy):
    # papers/ceiling.md section 7: f = 645.333333333333, h = 2.42
    camera = CameraParams(fx_px=1936 / 3, fy_px=1936 / 3, cx_px=0.0, cy_px=0.0)
    view = base_camera(camera)
    point = view.rotation.T @ (np.array([*xy, 2.42]) - view.position)
    np.testing.assert_allclose(project(point, calibration_of(camera)), uv, atol=1e-9)


def test_the_mount_turns_and_shifts_the_camera():
    mount = MountParams(x_m=0.1, y_m=-0.2, z_m=0.3, yaw_deg=90)
    view = base_camera(CameraParams(mount=mount))
    # Turned left by 90 degrees, the image top points to the robot's left.
    np.testing.assert_allclose(view.rotation @ [0, -1, 0], [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(view.position, [0.1, -0.2, 0.3])
    np.testing.assert_allclose(base_camera(CameraParams(looks="forward")).rotation @ [0, 0, 1], [1, 0, 0])
    told = place(base_camera(CameraParams(mount=mount)))
    x, y, z, w = told.rotation
    axis = np.array([x, y, z])
    rebuilt = [v + 2 * np.cross(axis, np.cross(axis, v) + w * v) for v in np.eye(3)]
    np.testing.assert_allclose(np.array(rebuilt).T, view.rotation, atol=1e-12)


@settings(deadline=None)
@given(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))
def test_a_quaternion_turns_vectors_as_its_matrix_does(roll, pitch, yaw):
    rotation = rpy(roll, pitch, yaw)
    q = quaternion(rotation)
    assert abs(np.linalg.norm(q) - 1) < 1e-12
    assert q[3] >= 0
    turned = [v + 2 * np.cross(q[:3], np.cross(q[:3], v) + q[3] * v) for v in np.eye(3)]
    np.testing.assert_allclose(np.array(turned).T, rotation, atol=1e-9)


def test_the_lens_bends_as_opencv_s_does():
    points = np.random.default_rng(0).uniform([-1, -1, 2], [1, 1, 3], (200, 3))
    calibration = Calibration(640, 480, 500.0, 510.0, 311.0, 243.0, "plumb_bob", LENS)
    matrix = np.array([[500.0, 0, 311], [0, 510, 243], [0, 0, 1]])
    expected = cv2.projectPoints(points, np.zeros(3), np.zeros(3), matrix, np.array(LENS))[0].reshape(-1, 2)
    np.testing.assert_allclose(project(points, calibration), expected, atol=1e-9)


def test_a_point_behind_the_camera_has_no_pixel():
    assert np.isnan(project(np.array([0.1, 0.1, -1.0]), PINHOLE)).all()


def test_the_ray_of_a_pixel_meets_that_pixel():
    calibration = Calibration(640, 480, 645.33, 645.33, 319.5, 239.5, "plumb_bob", LENS)
    table = ray_table(calibration)
    assert table.shape == (482, 642, 2)
    points = np.concatenate([table, np.ones((482, 642, 1))], axis=2)
    v, u = np.mgrid[-1:481, -1:641]
    np.testing.assert_allclose(project(points, calibration), np.stack([u, v], axis=-1), atol=1e-9)


def test_a_lens_that_folds_over_inside_the_image_is_refused():
    calibration = Calibration(640, 480, 300.0, 300.0, 319.5, 239.5, "plumb_bob", (-0.5, 0.0, 0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="folds over"):
        rays_through(np.array([[0.0, 0.0]]), calibration)
