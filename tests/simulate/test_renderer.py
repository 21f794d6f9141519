"""The renderer against a brute-force one, and the signs of what moves."""

from dataclasses import replace

import numpy as np
import pytest

from logpose.formats.calibration import Calibration
from logpose.pipelines.simulate.camera import CameraParams, base_camera, project
from logpose.pipelines.simulate.pose import MountParams, View, rpy
from logpose.pipelines.simulate.renderer import Patch, Texture, depth_image, finer, plane_rows, render
from logpose.pipelines.simulate.shapes import DISC, HEXAGON, RECTANGLE, ROUNDED, Bars, Drawing, Glow, Shape

LENS = (-0.15, 0.02, 0.001, -0.0005, 0.0)
BENT = Calibration(320, 240, 322.0, 323.0, 160.3, 118.9, "plumb_bob", LENS)
PINHOLE = Calibration(640, 480, 525.0, 525.0, 319.5, 239.5, "plumb_bob", (0.0,) * 5)
HEIGHT = 2.74
UP = base_camera(CameraParams(mount=MountParams(z_m=0.32)))


def ceiling(shapes, radiance=0.0, glows=(), bars=None):
    corner, u, v = np.array([0, 0, HEIGHT]), np.array([10.0, 0, 0]), np.array([0, 10.0, 0])
    return Patch(corner, u, v, Drawing(shapes, glows, bars), None, radiance)


def robot(x=5.0, y=5.0, heading=0.0, roll=0.0, pitch=0.0):
    return View(rpy(roll, pitch, heading), np.array([x, y, 0.0])) @ UP


def disc(x, y, radius=0.07, radiance=1.0):
    return Shape(DISC, x, y, 2 * radius, 2 * radius, radiance)


def wall_ahead(distance, side, **more):
    """A square wall before a camera at 0 that looks along x: corner top left, U to the right, V down."""
    corner = np.array([distance, side / 2, side / 2])
    return Patch(corner, np.array([0, -side, 0.0]), np.array([0, 0.0, -side]), **more)


def test_depth_of_a_wall_agrees_with_the_specification(look):
    view = look(np.array([5.2, 2.2, 1.1]), np.radians(97), np.radians(6))
    wall = Patch(np.array([10.0, 10, 0]), np.array([-10.0, 0, 0]), np.array([0, 0, 2.7]))
    g = plane_rows(wall, view)[0]
    inverse = np.array([[525.0, 0, 319.5], [0, 525, 239.5], [0, 0, 1]])
    np.testing.assert_allclose(g @ np.linalg.inv(inverse), [0.000029760523, 0.000025335610, 0.110976054623], atol=1e-12)
    depth = depth_image([wall], view, PINHOLE)
    assert depth[240, 320] == pytest.approx(7.900144163808, abs=1e-6)  # float32


def test_a_patch_is_seen_from_its_front_only(look):
    wall = Patch(np.array([10.0, 10, 0]), np.array([-10.0, 0, 0]), np.array([0, 0, 2.7]))
    view = look(np.array([5.2, 2.2, 1.1]), np.radians(97), np.radians(6))
    assert (depth_image([replace(wall, side_u=-wall.side_u, corner=np.array([0.0, 10, 0]))], view, PINHOLE) == 0).all()
    away = look(view.position, np.radians(-83), 0.0)
    assert (depth_image([wall], away, PINHOLE) == 0).all()


def test_the_nearer_patch_hides_the_farther_in_any_order(look):
    far = wall_ahead(4.0, 8.0, radiance=0.2)
    near = wall_ahead(2.0, 1.0, radiance=0.9)
    view = look(np.zeros(3), 0.0, 0.0)
    one, other = (render(patches, [view], PINHOLE) for patches in ([far, near], [near, far]))
    assert (one == other).all()
    assert one[240, 320] == pytest.approx(0.9)
    assert one[20, 20] == pytest.approx(0.2)
    depth = depth_image([far, near], view, PINHOLE)
    assert depth[240, 320] == pytest.approx(2.0)
    # The near patch is 1 m wide at 2 m: 262.5 pixels.
    assert (depth[240] < 3).sum() == pytest.approx(262.5, abs=1)


def test_a_floor_under_the_camera_is_clipped_not_folded(look):
    floor = Patch(np.array([-50.0, -50, 0]), np.array([0.0, 100, 0]), np.array([100.0, 0, 0]), radiance=0.5)
    depth = depth_image([floor], look(np.array([0, 0, 1.0]), 0.0, 0.0), PINHOLE)
    assert (depth[:240] == 0).all()
    v = np.arange(252, 480)  # nearer rows of the horizon end at the floor's border, 50 m away
    np.testing.assert_allclose(depth[252:, 300], 525.0 / (v - 239.5), rtol=1e-6)


@pytest.mark.parametrize("place", [(5.0, 5.0), (5.4, 5.21), (4.6, 5.62), (5.41, 4.42)])
@pytest.mark.parametrize("tilt", [0.0, 0.03])
def test_the_centroid_of_a_disc_is_that_of_a_brute_force_renderer(place, tilt, supersampled, centroid):
    view = robot(5.02, 4.97, 0.3, tilt, -tilt)
    centre = project((np.array([*place, HEIGHT]) - view.position) @ view.rotation, BENT)
    left, top = (int(c) - 16 for c in centre)
    window = (left, left + 32, top, top + 32)
    light = render([ceiling([disc(*place)])], [view], BENT)[top : top + 33, left : left + 33]
    reference = supersampled(view, BENT, lambda x, y: np.hypot(x - place[0], y - place[1]) < 0.07, window, HEIGHT, 16)
    assert np.abs(centroid(light) - centroid(reference)).max() < 0.01
    assert light.sum() == pytest.approx(reference.sum(), rel=1e-3)
    # Where a curved edge crosses a pixel of a disc of 9 px radius, a straight one errs by 1 / (8 R) of a pixel at most.
    assert np.abs(light - reference).max() < 0.03


@pytest.mark.parametrize(
    ("shape", "inside"),
    [
        (
            Shape(RECTANGLE, 5.3, 5.2, 0.2, 0.1, 1.0, 0.4),
            lambda x, y: (np.abs(x) < 0.1) & (np.abs(y) < 0.05),
        ),
        (
            Shape(ROUNDED, 5.3, 5.2, 0.2, 0.14, 1.0, 0.4, 0.04),
            lambda x, y: np.hypot(np.maximum(abs(x) - 0.06, 0), np.maximum(abs(y) - 0.03, 0)) < 0.04,
        ),
        (
            Shape(HEXAGON, 5.3, 5.2, 0.16, 0.16, 1.0, 0.4),
            lambda x, y: (
                (np.abs(x) < 0.08)
                & (np.abs(0.5 * x + 3**0.5 / 2 * y) < 0.08)
                & (np.abs(0.5 * x - 3**0.5 / 2 * y) < 0.08)
            ),
        ),
    ],
)
def test_a_shape_covers_what_a_brute_force_renderer_says(shape, inside, supersampled, centroid):
    view = robot(heading=0.2)
    centre = project((np.array([shape.x, shape.y, HEIGHT]) - view.position) @ view.rotation, BENT)
    left, top = (int(c) - 20 for c in centre)

    def turned(x, y):
        dx, dy, c, s = x - shape.x, y - shape.y, np.cos(shape.turn), np.sin(shape.turn)
        return inside(c * dx + s * dy, c * dy - s * dx)

    reference = supersampled(view, BENT, turned, (left, left + 40, top, top + 40), HEIGHT, 16)
    light = render([ceiling([shape])], [view], BENT)[top : top + 41, left : left + 41]
    assert np.abs(centroid(light) - centroid(reference)).max() < 0.01
    assert light.sum() == pytest.approx(reference.sum(), rel=2e-3)
    assert np.abs(light - reference).max() < 0.16  # at a corner the product of two straight edges is not exact


def test_bars_stand_where_the_tiles_end(supersampled):
    view = robot(heading=0.1)
    light = render([ceiling([], bars=Bars(0.6, 0.02, 1.0))], [view], BENT)[60:181, 80:241]

    def inside(x, y):
        return (np.abs(x - 0.6 * np.round(x / 0.6)) < 0.01) | (np.abs(y - 0.6 * np.round(y / 0.6)) < 0.01)

    reference = supersampled(view, BENT, inside, (80, 240, 60, 180), HEIGHT, 8)
    assert np.abs(light - reference).max() < 0.13  # 1/8 is one row of the reference's sub-pixels
    assert light.mean() == pytest.approx(reference.mean(), rel=2e-3)


def test_turning_left_moves_features_clockwise():
    before, after = robot(), robot(heading=0.1)
    point = np.array([5.6, 5.5, HEIGHT])
    u0, v0 = project((point - before.position) @ before.rotation, PINHOLE) - [319.5, 239.5]
    u1, v1 = project((point - after.position) @ after.rotation, PINHOLE) - [319.5, 239.5]
    # theta = atan2(y_R, x_R) with x_R ~ -v, y_R ~ u
    assert np.arctan2(u1, -v1) - np.arctan2(u0, -v0) == pytest.approx(-0.1, abs=1e-12)


def test_a_rendered_disc_moves_with_the_robot(centroid):
    image = render([ceiling([disc(5.0, 5.0)])], [robot()], BENT)
    ahead = render([ceiling([disc(5.0, 5.0)])], [robot(x=4.8)], BENT)
    left = render([ceiling([disc(5.0, 5.0)])], [robot(y=4.8)], BENT)
    turned = render([ceiling([disc(5.4, 5.0)])], [robot(heading=0.3)], BENT)
    assert centroid(ahead)[1] < centroid(image)[1] - 20  # a light ahead stands higher in the image
    assert centroid(left)[0] > centroid(image)[0] + 20  # a light to the left stands further right
    assert centroid(turned)[0] < centroid(image)[0] - 10  # after a left turn what was ahead is to the right


def test_tilt_shifts_the_image_by_height_times_angle(centroid):
    # Nose down by 1 degree (pitch > 0): the axis points ahead, features appear further back, lower in the image.
    flat = centroid(render([ceiling([disc(5.0, 5.0)])], [robot()], BENT))
    down = centroid(render([ceiling([disc(5.0, 5.0)])], [robot(pitch=np.radians(1))], BENT))
    # Rolled to the right (roll > 0): the axis points right, features appear further left, right in the image.
    right = centroid(render([ceiling([disc(5.0, 5.0)])], [robot(roll=np.radians(-1))], BENT))
    shift = 323 * np.tan(np.radians(1)) * HEIGHT / (HEIGHT - 0.32)
    assert down[1] - flat[1] == pytest.approx(shift, rel=0.02)
    assert down[0] - flat[0] == pytest.approx(0, abs=0.05)
    assert abs(right[0] - flat[0]) == pytest.approx(shift, rel=0.02)
    axis = robot(roll=np.radians(-1)).rotation[:, 2]
    assert np.sign(axis[1]) == np.sign(flat[0] - right[0])  # an axis to the left moves features right of the robot


def test_a_rigid_move_of_the_whole_world_changes_nothing():
    ring = [disc(5.5, 4.6, 0.15, 0.9), disc(5.5, 4.6, 0.1, 0.1)]
    shapes = [disc(5.2, 5.3), Shape(ROUNDED, 4.6, 4.9, 0.2, 0.1, 0.7, 0.5, 0.02), *ring]
    texture = Texture.of(np.random.default_rng(0).integers(0, 256, (64, 64), np.uint8), 40.0, is_tiled=True)
    patch = replace(
        ceiling(shapes, glows=[Glow(5.2, 5.3, 0.07, 0.2, 0.05, 0.4)], bars=Bars(0.6, 0.02, 0.5)), texture=texture
    )
    view = robot(heading=0.4, roll=0.02)
    move = View(rpy(0.3, -0.2, 2.0), np.array([30.0, -7.0, 3.0]))
    moved = replace(
        patch,
        corner=move.rotation @ patch.corner + move.position,
        side_u=move.rotation @ patch.side_u,
        side_v=move.rotation @ patch.side_v,
    )
    one, other = render([patch], [view], BENT), render([moved], [move @ view], BENT)
    assert one.std() > 0.05
    np.testing.assert_allclose(one, other, atol=1e-6)


def test_motion_blur_is_the_mean_of_the_poses_and_keeps_the_centroid(centroid):
    patch = ceiling([disc(5.0, 5.0)])
    views = [robot(x=5.0 + d) for d in (-0.02, 0.0, 0.02)]
    blurred = render([patch], views, PINHOLE)
    np.testing.assert_allclose(blurred, np.mean([render([patch], [v], PINHOLE) for v in views], axis=0), atol=1e-6)
    sharp = render([patch], [robot()], PINHOLE)
    np.testing.assert_allclose(centroid(blurred), centroid(sharp), atol=1e-3)
    assert (blurred > 0).sum() > (sharp > 0).sum()


def test_later_shapes_cover_earlier_ones_and_a_glow_adds():
    view = robot()
    image = render([ceiling([disc(5, 5, 0.3, 0.5), disc(5, 5, 0.1, 0.9)], 0.1)], [view], BENT)
    u, v = np.round(project((np.array([5, 5, HEIGHT]) - view.position) @ view.rotation, BENT)).astype(int)
    assert image[v, u] == pytest.approx(0.9)
    assert image[v, u + 25] == pytest.approx(0.5)
    assert image[v, u + 60] == pytest.approx(0.1)
    glow = render([ceiling([], 0.1, [Glow(5, 5, 0.1, 0.2, 0.1, 0.3)])], [view], BENT)
    assert glow[v, u] == pytest.approx(0.3)
    profile = glow[v, u : u + 70]
    assert (np.diff(profile) <= 1e-6).all()
    assert profile[-1] == pytest.approx(0.1)


def test_a_picture_on_a_wall_is_not_mirrored(look):
    letter = np.zeros((8, 8), np.uint8)
    letter[:, 0] = letter[0] = 255  # a Greek gamma: bars on top and to the left
    wall = wall_ahead(4.0, 2.0, texture=Texture.of(letter, 4.0))
    image = render([wall], [look(np.zeros(3), 0.0, 0.0)], PINHOLE)
    seen = np.flatnonzero(depth_image([wall], look(np.zeros(3), 0.0, 0.0), PINHOLE)[240])
    left, right = seen[0], seen[-1]
    assert image[240, left + 5] > 0.9
    assert image[240, right - 5] < 0.1
    assert image[239 - 120, 320] > 0.9
    assert image[239 + 120, 320] < 0.1


def test_a_texture_seen_from_afar_is_averaged(look):
    checks = (np.indices((256, 256)).sum(axis=0) % 2 * 255).astype(np.uint8)
    wall = wall_ahead(8.0, 8.0, texture=Texture.of(checks, 400.0, is_tiled=True))
    image = render([wall], [look(np.zeros(3), 0.0, 0.0)], PINHOLE)
    inner = image[100:380, 100:540]
    assert inner.mean() == pytest.approx(0.5, abs=0.01)
    assert inner.std() < 0.02


def test_finer_pixels_divide_the_pixels_of_the_same_camera():
    n, fine = 3, finer(PINHOLE, 3)
    points = np.random.default_rng(0).uniform([-1, -1, 2], [1, 1, 3], (50, 3))
    coarse, divided = project(points, PINHOLE), project(points, fine)
    # Pixel centres are integers, so pixel u holds the finer pixels 3 u to 3 u + 2.
    np.testing.assert_allclose((divided + 0.5) / n, coarse + 0.5, atol=1e-9)
    assert (fine.width, fine.height) == (1920, 1440)


def test_finer_pixels_see_the_same_and_the_border_of_a_post_smoother(centroid, look):
    patch = ceiling([disc(5.2, 5.3)])
    one, mean = (render([patch], [robot()], finer(BENT, n)) for n in (1, 3))
    mean = mean.reshape(240, 3, 320, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(centroid(one), centroid(mean), atol=0.005)
    assert one.sum() == pytest.approx(mean.sum(), rel=2e-3)
    # A post 2 m away: from 292.28 px to 344.78 px.
    post = Patch(np.array([2.0, 0.1037, 1.0]), np.array([0.0, -0.2, 0]), np.array([0, 0.0, -2.0]), radiance=1.0)
    row = (
        render([post], [look(np.zeros(3), 0.0, 0.0)], finer(PINHOLE, 4)).reshape(480, 4, 640, 4).mean(axis=(1, 3))[240]
    )
    np.testing.assert_allclose(row[[291, 292, 293, 344, 345, 346]], [0, 0.25, 1, 1, 0.25, 0], atol=1e-6)


def test_shading_is_linear_between_its_nodes(look):
    view = look(np.zeros(3), 0.0, 0.0)
    wall = wall_ahead(4.0, 8.0, radiance=0.5, shading=np.array([[0.2, 1.0], [0.6, 1.4]]))
    image = render([wall], [view], PINHOLE)
    v, u = np.mgrid[:480, :640]
    s, t = ((4.0 + (x - c) * 4.0 / 525) / 8.0 for x, c in ((u, 319.5), (v, 239.5)))
    np.testing.assert_allclose(image, 0.5 * (0.2 + 0.8 * s + 0.4 * t), rtol=1e-5)
