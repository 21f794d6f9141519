"""Tilt and roll: the printed views of a tilted camera, the slopes of lines, and the paper's leaning mark."""

import numpy as np
import pytest

from logpose.pipelines.geometry.mount import OPTICAL, pan_tilt_roll, robot_tilt
from logpose.pipelines.stripe_pose.attitude import Stated, Turned, expected, looking_of
from logpose.pipelines.stripe_pose.levelling import leaning_pose, level_bearings, levelling_matrix, line_of_bearing
from logpose.pipelines.stripe_pose.pose import level_pose

LINES = np.array([0.0, -0.06, 0.06])
F = 16.0
# phi, tilt, roll [deg], D of the level frame [mm], Z_p [mm], X_p [mm], u.
TILTED = [
    (25, 10, 3, (40, 700), 0.0, (0.902100433069, -0.336218374372, 2.055429770598),
     (0.057142857143, -0.021312707998, 0.130113109503)),
    (-40, -8, -5, (10, 900), 1.5, (0.310314659447, -0.485956873265, 1.178977918267),
     (0.011111111111, -0.038316557855, 0.064964638290)),
    (10, 20, 0, (0, 500), -0.8, (0, -1.847635568999, 1.772206099889), (0, -0.120691881393, 0.115764651861)),
]  # fmt: skip
# phi_z, phi_y, phi_x [deg], Dx, Dy, Dz [mm], X_p [mm] in the paper's own model.
LEANING = [
    (25, 5, 10, 40, 700, 80.246038211455, (0.622831086728, -0.638395266533, 1.799525633297)),
    (-50, -3, 8, -60, 900, 36.793953926779, (-0.972112846287, -1.583001116795, -0.295945423494)),
    (60, 10, -12, 0, 1200, -312.745727149772, (-0.385613076712, -0.774189650600, -0.028397123203)),
]


@pytest.mark.parametrize(("phi", "tilt", "roll", "d", "zp", "xp", "u"), TILTED)
def test_a_tilted_and_rolled_camera_is_levelled_exactly(phi, tilt, roll, d, zp, xp, u):
    rays = np.stack([np.array(xp) / F, np.full(3, zp / F)], axis=-1)
    found = level_bearings(rays, np.radians(tilt), np.radians(roll))
    assert found == pytest.approx(u, abs=1e-12)
    pose = level_pose(LINES, found)
    assert (np.degrees(pose[0]), *(1e3 * pose[1:])) == pytest.approx((phi, *d), rel=1e-9, abs=1e-8)
    x, _ = line_of_bearing(found, np.radians(tilt), np.radians(roll), zp / F)
    assert F * x == pytest.approx(xp, abs=1e-12)


@pytest.mark.parametrize(("phi_z", "phi_y", "phi_x", "dx", "dy", "dz", "xp"), LEANING)
def test_the_paper_s_leaning_mark_comes_back(phi_z, phi_y, phi_x, dx, dy, dz, xp):
    found = leaning_pose(LINES, np.array(xp) / F, np.radians(phi_x), np.radians(phi_y))
    assert (np.degrees(found[0]), *(1e3 * found[1:])) == pytest.approx((phi_z, dx, dy, dz), rel=1e-9, abs=1e-8)


def test_a_line_bears_the_same_on_every_row():
    u = np.array([-0.2, 0.0, 0.3])
    for z in (-0.3, 0.0, 0.25):
        x, _ = line_of_bearing(u, 0.1, -0.05, z)
        assert level_bearings(np.stack([x, np.full(3, z)], axis=-1), 0.1, -0.05) == pytest.approx(u, abs=1e-14)


def test_roll_leans_all_lines_alike_and_tilt_more_to_the_sides():
    u = np.array([-0.3, 0.0, 0.3])
    _, rolled = line_of_bearing(u, 0.0, 0.02)
    assert rolled == pytest.approx(-np.tan(0.02) * np.ones(3), rel=1e-9)
    _, tilted = line_of_bearing(u, 0.05, 0.0)
    assert tilted[1] == pytest.approx(0.0, abs=1e-15)
    assert tilted[0] == pytest.approx(-tilted[2])
    assert abs(tilted[2]) > 0.01


def test_the_special_cases_of_the_middle_row():
    x = np.array([0.1, -0.2])
    rays = np.stack([x, np.zeros(2)], axis=-1)
    assert level_bearings(rays, 0.3, 0.0) == pytest.approx(x / np.cos(0.3))  # f -> f cos(tilt)
    assert level_bearings(rays, 0.0, 0.3) == pytest.approx(x * np.cos(0.3))  # f -> f / cos(roll)


@pytest.mark.parametrize(("pan", "tilt", "roll"), [(0.0, 0.0, 0.0), (0.7, 0.2, -0.1), (-2.5, -0.4, 0.3)])
def test_the_attitude_of_a_mount_is_read_back(pan, tilt, roll):
    c, s = np.cos(pan - np.pi / 2), np.sin(pan - np.pi / 2)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    assert pan_tilt_roll(turn @ levelling_matrix(tilt, roll).T @ OPTICAL) == pytest.approx((pan, tilt, roll), abs=1e-14)


def looking(mount, tilted, turned=None, stated=None):
    return looking_of(mount, tilted, turned or Turned(), stated or Stated())


def test_a_camera_looks_ahead_where_nothing_is_known():
    nothing = looking(None, None)
    assert (nothing.pan, nothing.tilt, nothing.roll) == pytest.approx((0.0, 0.0, 0.0), abs=1e-15)
    assert nothing.tilt_known == "not"


def test_a_robot_that_pitches_up_tilts_a_camera_that_looks_ahead_and_rolls_one_that_looks_left():
    up = np.array([0.0, np.sin(-0.05), 0.0, np.cos(-0.05)])  # nose up by 0.1: a negative turn about y
    heading = np.array([0.0, 0.0, np.sin(0.4), np.cos(0.4)])
    x, y, z, w = _product(heading, up)
    tilted = robot_tilt(np.array([x, y, z, w]), None)
    ahead = looking(None, tilted)
    assert (ahead.pan, ahead.tilt, ahead.roll) == pytest.approx((0.0, 0.1, 0.0), abs=1e-12)
    left = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    pan, tilt, roll = pan_tilt_roll(tilted @ left)
    assert pan == pytest.approx(np.pi / 2, abs=1e-12)
    assert tilt == pytest.approx(0.0, abs=1e-12)
    # Nose up lifts the camera's right side, which a positive turn about its optical axis lowers.
    assert roll == pytest.approx(-0.1, abs=1e-12)
    assert ahead.tilt_known == "measured"


def test_options_win_over_joints_and_joints_turn_the_head_from_its_mount():
    head = looking(None, None, Turned(tilt=0.1, pan=0.2))
    assert (head.pan, head.tilt, head.roll) == pytest.approx((0.2, 0.1, 0.0))
    assert (head.tilt_known, head.roll_known) == ("measured", "not")
    silent = looking(np.array([-0.5, 0.5, -0.5, 0.5]), None, Turned(tilt=np.nan, pan=np.nan))
    assert np.isnan(silent.pan)
    assert (silent.tilt, silent.tilt_known, silent.roll_known) == (pytest.approx(0.0), "not", "stated")
    said = looking(None, np.eye(3), Turned(tilt=0.1, pan=np.nan), Stated(pan=0.5, tilt=0.3))
    assert (said.pan, said.tilt, said.tilt_known, said.roll_known) == (0.5, 0.3, "stated", "measured")


def test_what_is_not_known_gets_a_wide_prior_and_options_a_narrow_one():
    nothing = expected(looking(None, None), "best", None, None)
    assert nothing.tilt_sd == pytest.approx(np.radians(4.0))
    stated = expected(looking(np.array([-0.5, 0.5, -0.5, 0.5]), None), "best", None, None)
    assert stated.tilt_sd == pytest.approx(np.radians(1.0))
    assert expected(looking(None, None), "best", 0.01, 0.02).roll_sd == 0.02
    assert expected(looking(None, None), "given", None, None).tilt_sd == 0.0
    assert expected(looking(None, None), "lines", None, None).tilt_sd == np.inf


def _product(a, b):
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )
