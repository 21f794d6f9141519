"""Where the robot is: the printed cases of eq. (1), and its covariance."""

import numpy as np
import pytest

from logpose.pipelines.stripe_pose.world import robot_covariance, robot_pose

# mark x, y [m], psi [deg] | lens x, y [m], pan [deg] | phi [deg], Dx, Dy [m] | robot x, y [m], heading [deg]
CASES = [
    ((10, 5, -90), (0.2, 0, 0), (0, 0, 2), (7.8, 5.0, 0.0)),
    ((10, 5, -60), (0.25, 0.03, 15), (20, 0.1, 1.5), (8.253760205910, 4.829911603545, -5.0)),
    ((-3, 7.5, 170), (0.1, -0.05, -30), (-35, -0.2, 0.9), (-3.614854375585, 8.329468601834, -35.0)),
]


def on_robot(mount, height=0.0):
    x, y, pan = mount
    return np.array([x, y, height, np.radians(pan)])


def turned(values, last):
    out = np.array(values, float)
    out[last] = np.radians(out[last])
    return out


@pytest.mark.parametrize(("mark", "mount", "pose", "robot"), CASES)
def test_the_robot_stands_where_the_paper_says(mark, mount, pose, robot):
    found = robot_pose(turned(mark, 2), turned(pose, 0), on_robot(mount), np.zeros(2))
    assert (*found[:2], np.degrees(found[2])) == pytest.approx(robot, abs=1e-9)


@pytest.mark.parametrize(("mark", "mount", "pose", "robot"), CASES)
def test_the_covariance_is_that_of_the_linearised_pose(mark, mount, pose, robot):
    mark, pose, mount = turned(mark, 2), turned(pose, 0), on_robot(mount, 0.6)
    leaning = np.array([0.0, 0.0])

    def at(h):
        return robot_pose(mark, pose + h[:3], mount, leaning + h[3:])

    J = np.stack([(at(h) - at(-h)) / 2e-6 for h in 1e-6 * np.eye(5)], axis=1)
    A = np.random.default_rng(0).standard_normal((5, 5))
    cov = 1e-4 * A @ A.T
    assert robot_covariance(mark, pose, mount, leaning, cov) == pytest.approx(J @ cov @ J.T, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("pan", [0.0, 40.0, 90.0, -120.0])
def test_a_robot_that_leans_back_or_aside_stands_where_it_stands(pan):
    """The lens of a robot that pitches and rolls about its place on the floor, by matrices of rotation alone."""
    pitch, roll, height = 0.02, -0.015, 0.7
    cp, sp, cr, sr = np.cos(pitch), np.sin(pitch), np.cos(roll), np.sin(roll)
    lean = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]]) @ np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    lens = lean @ np.array([0.0, 0.0, height])
    a = np.radians(pan)
    ahead, right = np.array([np.cos(a), np.sin(a), 0.0]), np.array([np.sin(a), -np.cos(a), 0.0])
    leaning = np.array([np.arcsin((lean @ ahead)[2]), -np.arcsin((lean @ right)[2])])
    psi = a - np.pi / 2  # the mark is ahead of the camera, its X axis to the right
    # The mark 2 m before the camera, seen without a turn, from where the lens truly is.
    place = lens[:2] + 2.0 * ahead[:2]
    robot = robot_pose(np.array([*place, psi]), np.array([0.0, 0.0, 2.0]), np.array([0, 0, height, a]), leaning)
    assert robot == pytest.approx([0.0, 0.0, 0.0], abs=3e-4)  # second order of the angles times the height


def test_a_rigid_move_of_the_world_moves_the_robot_with_it():
    mark, pose, mount = np.array([1.0, 2.0, 0.3]), np.array([0.4, 0.1, 1.2]), np.array([0.2, 0.1, 0.4, 0.5])
    leaning = np.array([0.01, -0.02])
    before = robot_pose(mark, pose, mount, leaning)
    a = 0.9
    R = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    moved = np.array([*(R @ mark[:2] + [3.0, -1.0]), mark[2] + a])
    after = robot_pose(moved, pose, mount, leaning)
    assert after == pytest.approx([*(R @ before[:2] + [3.0, -1.0]), before[2] + a], abs=1e-12)
