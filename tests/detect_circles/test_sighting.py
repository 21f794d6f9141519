"""From pixels to the robot frame: the nominal camera, any mount, mirrored images, Jacobians and tilt."""

import cv2
import numpy as np
import pytest

from logpose.pipelines.detect_circles.detect import Search, find_circles
from logpose.pipelines.detect_circles.radius import default_radii, expected_radii
from logpose.pipelines.detect_circles.sighting import View
from logpose.pipelines.geometry.camera import Camera
from logpose.pipelines.geometry.mount import UP, upward

F, H = 645.333333333333, 2.42
LENS = Camera(F, 640.0, 322.0, 236.0, "plumb_bob", (-0.22, 0.05, 0.001, -0.0005, 0.0))


def tilted(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


VIEWS = [
    View(LENS, 640, 480, UP, np.zeros(3), H),
    View(LENS, 640, 480, upward(2.0), np.array([0.2, -0.1, 0.32]), 2.74),
    View(LENS, 640, 480, tilted(0.2) @ upward(-0.3), np.array([0.1, 0.0, 0.5]), 3.0),
    View(LENS, 640, 480, upward(0.7), np.array([0.1, 0.0, 0.5]), 3.0, is_flipped=True),
]
views = pytest.mark.parametrize("view", VIEWS, ids=["nominal", "turned", "tilted", "mirrored"])


def test_nominal_camera_top_is_forward_and_right_is_left():
    view = View(Camera(F, F, 320.0, 240.0), 640, 480, UP, np.zeros(3), H)
    uv = np.array([[320.0, 140.0], [420.0, 240.0], [520.0, 90.0], [0.0, 480.0]])
    np.testing.assert_allclose(
        view.to_robot(uv), [[0.375, 0.0], [0.0, 0.375], [0.5625, 0.75], [-0.9, -1.2]], atol=1e-12
    )


@views
def test_to_image_inverts_to_robot(view):
    uv = np.random.default_rng(0).uniform((0, 0), (639, 479), (200, 2))
    np.testing.assert_allclose(view.to_image(view.to_robot(uv)), uv, atol=1e-9)


@views
def test_the_jacobian_agrees_with_finite_differences(view):
    uv, d = np.random.default_rng(1).uniform((0, 0), (639, 479), (50, 2)), 1e-3
    numeric = np.stack([(view.slopes(uv + s) - view.slopes(uv - s)) / (2 * d) for s in d * np.eye(2)], axis=-1)
    np.testing.assert_allclose(view.jacobian(uv), numeric, atol=1e-9)


def test_a_pixel_of_noise_is_h_over_f_metres_without_a_lens():
    view = View(Camera(F, F, 320.0, 240.0), 640, 480, UP, np.zeros(3), H)
    cov = view.sight(np.array([[500.0, 100.0]]), np.eye(2)[None])[1]
    np.testing.assert_allclose(cov[0], (H / F) ** 2 * np.eye(2), atol=1e-15)


@pytest.mark.parametrize("view", VIEWS[:2] + VIEWS[3:], ids=["nominal", "turned", "mirrored"])
def test_tilt_moves_a_sighting_as_the_covariance_says(view):
    # Tilt the robot by a small angle about either axis, look at the same lamp, compare with the linear model.
    uv = np.random.default_rng(2).uniform((50, 50), (590, 430), (20, 2))
    xy, d = view.to_robot(uv), 1e-6
    columns = []
    for axis in (0, 1):
        turn = np.eye(3)
        i, j = ((1, 2), (2, 0))[axis]
        turn[i, j], turn[j, i] = -d, d
        lamps = np.concatenate([xy, np.full((len(xy), 1), view.ceiling_m)], axis=1) @ turn  # in the tilted robot
        ray = lamps - view.translation
        seen = view.translation[:2] + view.lens_to_ceiling * ray[:, :2] / ray[:, 2:]
        columns.append((seen - xy) / d)
    T = np.stack(columns, axis=-1)
    cov = view.sight(uv, np.zeros((20, 2, 2)), tilt_rad=0.01)[1]
    np.testing.assert_allclose(cov, 1e-4 * T @ T.swapaxes(-1, -2), rtol=1e-4, atol=1e-12)


def test_one_degree_of_tilt_is_42_mm_overhead():
    view = View(Camera(F, F, 320.0, 240.0), 640, 480, UP, np.zeros(3), H)
    cov = view.sight(np.array([[320.0, 240.0]]), np.zeros((1, 2, 2)), np.radians(1.0))[1]
    np.testing.assert_allclose(np.sqrt(np.diag(cov[0])), 0.0422, atol=5e-5)  # h tan(1 deg)


@views
def test_the_plane_table_agrees_with_the_exact_map(view):
    plane = view.plane()
    rows, columns = plane.table.shape[:2]
    assert (columns - 1) * plane.step >= view.width - 1
    assert (rows - 1) * plane.step >= view.height - 1
    uv = plane.step * np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1)
    exact = np.sqrt(view.camera.fx * view.camera.fy) * view.slopes(uv)
    np.testing.assert_allclose(plane.table, exact, atol=1e-4)


@views
@pytest.mark.parametrize("tilt", [0.0, 0.01])
def test_circles_are_placed_through_the_table_as_through_the_lens(view, tilt):
    image = np.full((480, 640), 70, np.uint8)
    for k, (u, v) in enumerate([(100, 80), (320, 240), (550, 400)]):
        cv2.circle(image, (16 * u + 5 * k, 16 * v), 16 * (15 + 5 * k), 190, -1, cv2.LINE_AA, 4)
    circles = find_circles(image, Search(10.0, 40.0), view.plane())
    assert len(circles) == 3
    xy, cov = view.sight_circles(circles, tilt)
    exact_xy, exact_cov = view.sight(circles.uv, circles.cov, tilt)
    np.testing.assert_allclose(xy, exact_xy, atol=0.004 * 3.0 / F)  # the table is right to 0.002 px
    np.testing.assert_allclose(cov, exact_cov, rtol=1e-3, atol=1e-3 * np.abs(exact_cov).max())


def test_circles_found_without_a_plane_lie_on_no_ceiling():
    with pytest.raises(ValueError, match="the circles were found without a plane"):
        VIEWS[0].sight_circles(find_circles(np.zeros((480, 640), np.uint8), Search(10.0, 40.0)))


def test_rays_that_do_not_rise_are_on_no_ceiling():
    view = View(Camera(300.0, 300.0, 320.0, 240.0), 640, 480, tilted(1.2) @ UP, np.zeros(3), 2.0)
    xy = view.to_robot(np.array([[320.0, 0.0], [320.0, 479.0]]))
    assert np.isnan(xy).all(axis=1).sum() == 1


def test_a_ceiling_below_the_lens_is_refused():
    with pytest.raises(ValueError) as caught:
        View(LENS, 640, 480, UP, np.array([0.0, 0.0, 0.32]), 0.3)
    assert str(caught.value) == "the ceiling, 0.3 m above base_link, is not above the lens, 0.32 m above it"


def test_radii_follow_from_camera_ceiling_and_lamp():
    view = View(Camera(F, F, 320.0, 240.0), 640, 480, UP, np.zeros(3), H)
    least, most = expected_radii(view, 0.15)
    middle = 0.075 * F / H  # 20 px everywhere: no lens, ceiling parallel to the image
    assert least == pytest.approx(0.8 * middle, rel=1e-6)
    assert most == pytest.approx(1.2 * middle, rel=1e-6)
    bent = View(LENS, 640, 480, UP, np.zeros(3), H)
    assert expected_radii(bent, 0.15)[0] < 0.95 * least


def test_without_a_lamp_the_range_is_wide():
    assert default_radii(640) == (8.0, 64.0)
    assert default_radii(100) == (4.0, 10.0)
