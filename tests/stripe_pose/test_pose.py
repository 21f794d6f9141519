"""The closed form: the paper's numbers, its singular points, and what must hold for any view."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logpose.pipelines.stripe_pose.pose import (
    bearing_jacobian,
    bearings,
    condition,
    homography,
    is_ahead,
    level_pose,
    plane_distance,
    pose_covariance,
)

THREE = np.array([0.0, -0.06, 0.06])
FOUR = np.array([-0.06, 0.0, 0.06, 0.12])
F = 16.0
F_PX = 16.0 / (8.8 / 512)

# phi [deg], Dx, Dy [mm], and X_p of the lines 0, -60, 60 mm for f = 16 mm [mm].
LEVEL = [
    (0, 0, 500, (0, -1.92, 1.92)),
    (20, 0, 500, (0, -1.881428192725, 1.733080037952)),
    (40, 30, 600, (0.8, -0.454912308532, 1.903327571008)),
    (-35, -25, 450, (-0.888888888889, -2.449112797925, 0.929738989073)),
    (70, 15, 800, (0.3, -0.118796593137, 0.663652005094)),
    (80, 0, 436.363636363636, (0, -0.441858524741, 0.336464917679)),
    (0, 60, 1000, (0.96, 0, 1.92)),
]
# Columns of the middle, left and right line of 512 [px], then phi [deg], Dx, Dy [mm].
WHOLE_PIXELS = [
    ((256, 149, 359), (9.587801979982, 0.281799971424, 524.660310433479)),
    ((255, 143, 367), (0.0, -0.267857142857, 498.701298701299)),
    ((300, 215, 372), (43.352688434865, 23.778957211584, 497.439268328136)),
    ((200, 140, 275), (-54.848693570935, -26.323199501626, 441.522625547343)),
]


def pose(phi, dx, dy):
    return np.array([np.radians(phi), dx / 1e3, dy / 1e3])


def in_print(found):
    return np.array([np.degrees(found[0]), *(1e3 * found[1:])])


def refine(start, X, u):
    """Return the pose of maximum likelihood, by Gauss-Newton."""
    for _ in range(10):
        start = start + np.linalg.lstsq(bearing_jacobian(start, X), u - bearings(start, X), rcond=None)[0]
    return start


@pytest.mark.parametrize(("phi", "dx", "dy", "xp"), LEVEL)
def test_a_level_view_projects_and_is_recovered(phi, dx, dy, xp):
    assert F * bearings(pose(phi, dx, dy), THREE) == pytest.approx(xp, abs=1e-11)
    found = in_print(level_pose(THREE, np.array(xp) / F))
    assert found == pytest.approx((phi, dx, dy), rel=1e-9, abs=1e-8)


@pytest.mark.parametrize(("columns", "printed"), WHOLE_PIXELS)
def test_whole_pixels_give_the_printed_poses(columns, printed):
    assert in_print(level_pose(THREE, (np.array(columns) - 255.5) / F_PX)) == pytest.approx(printed, rel=1e-9, abs=1e-9)


def test_four_lines_by_least_squares_and_by_likelihood():
    u = (np.array([150, 262, 361, 449]) - 255.5) / F_PX
    linear = level_pose(FOUR, u)
    assert in_print(linear) == pytest.approx((28.687005534626, 3.255577754273, 464.483356878088), rel=1e-9)
    best = refine(linear, FOUR, u)
    assert in_print(best) == pytest.approx((28.6812143414, 3.2549755869, 464.5151250526), rel=1e-9)
    error = F_PX * (bearings(best, FOUR) - u)
    assert np.sqrt(np.mean(error**2)) == pytest.approx(0.0184040867, rel=1e-8)


def test_the_covariance_is_the_printed_bound():
    cov = pose_covariance(pose(40, 30, 600), THREE, 0.3 / F_PX)
    sd = np.sqrt(np.diag(cov))
    assert in_print(sd) == pytest.approx((2.270756142, 0.935114588, 21.732457629), rel=1e-9)
    correlation = cov / np.outer(sd, sd)
    expected = (-0.989675548181, -0.996379323778, 0.992897921076)
    assert (correlation[0, 1], correlation[0, 2], correlation[1, 2]) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("lines", [THREE, FOUR, np.array([-0.1, -0.068, -0.048, -0.02, 0.02, 0.044, 0.08, 0.1])])
def test_ten_thousand_random_poses_come_back(lines):
    rng = np.random.default_rng(1)
    poses = np.stack(
        [rng.uniform(-1.45, 1.45, 20_000), rng.uniform(-1, 1, 20_000), rng.uniform(0.2, 3, 20_000)], axis=-1
    )
    poses = poses[is_ahead(poses, lines) & (plane_distance(poses) > 0.05)][:10_000]
    assert len(poses) == 10_000
    found = level_pose(lines, bearings(poses, lines))
    # The condition of the problem grows as the mark turns edge-on; distances carry the digits.
    assert np.max(np.abs(found - poses) / np.maximum(1.0, np.abs(poses))) < 1e-9


@settings(max_examples=200, deadline=None)
@given(st.floats(-1.3, 1.3), st.floats(-0.5, 0.5), st.floats(0.3, 3.0), st.floats(0.1, 10.0))
def test_a_larger_world_has_the_same_bearings(phi, dx, dy, scale):
    small, large = np.array([phi, dx, dy]), np.array([phi, scale * dx, scale * dy])
    if not (is_ahead(small, FOUR) and plane_distance(small) > 0.05):
        return
    assert bearings(large, scale * FOUR) == pytest.approx(bearings(small, FOUR), rel=1e-12, abs=1e-12)
    assert level_pose(scale * FOUR, bearings(small, FOUR)) == pytest.approx(large, rel=1e-7, abs=1e-7)


def test_the_jacobian_is_the_difference_quotient():
    at = pose(35, -40, 700)
    quotient = np.stack([(bearings(at + h, FOUR) - bearings(at - h, FOUR)) / 2e-6 for h in 1e-6 * np.eye(3)], axis=1)
    assert bearing_jacobian(at, FOUR) == pytest.approx(quotient, rel=1e-7, abs=1e-9)


def test_the_bound_is_what_noisy_bearings_scatter_by():
    at, sigma = pose(30, 20, 900), 0.05 / F_PX
    rng = np.random.default_rng(2)
    found = level_pose(THREE, bearings(at, THREE) + sigma * rng.standard_normal((4000, 3)))
    ratio = np.std(found, axis=0) / np.sqrt(np.diag(pose_covariance(at, THREE, sigma)))
    assert ratio == pytest.approx(1.0, abs=0.04)  # 4000 draws scatter by 1.1 %; 3.5 sigma


def test_a_mark_seen_in_a_mirror_has_its_front_behind_it():
    u = bearings(pose(20, 0, 500), FOUR)
    assert homography(FOUR, u)[0] - homography(FOUR, u)[1] * homography(FOUR, u)[2] > 0
    a, b, c = homography(-FOUR, u)
    assert a - b * c < 0


def test_two_lines_in_one_place_have_no_pose():
    assert not np.all(np.isfinite(level_pose(THREE, np.array([0.1, 0.1, 0.1]))))
    assert condition(THREE, np.array([0.1, 0.1, 0.1 + 1e-12])) > 1e8
    assert condition(THREE, bearings(pose(20, 0, 500), THREE)) < 1e4


def test_fewer_than_three_lines_are_refused():
    with pytest.raises(ValueError, match="2 lines; a pose needs at least three"):
        level_pose(THREE[:2], np.zeros(2))
