import numpy as np
import pytest

from logpose.pipelines.report.frames import LONGEST_GAP_NS, FrameTree, divide, interpolate

SECOND = 1_000_000_000


def planar(x, y, heading):
    return np.array([x, y, 0.0]), np.array([0.0, 0.0, np.sin(heading / 2), np.cos(heading / 2)])


def matrix(pose):
    (x, y, z), (i, j, k, w) = pose
    rotation = np.array(
        [
            [1 - 2 * (j * j + k * k), 2 * (i * j - k * w), 2 * (i * k + j * w)],
            [2 * (i * j + k * w), 1 - 2 * (i * i + k * k), 2 * (j * k - i * w)],
            [2 * (i * k - j * w), 2 * (j * k + i * w), 1 - 2 * (i * i + j * j)],
        ]
    )
    return np.block([[rotation, np.array([[x], [y], [z]])], [np.zeros((1, 3)), np.ones((1, 1))]])


def random_pose(rng):
    q = rng.normal(size=4)
    return rng.normal(size=3), q / np.linalg.norm(q)


def test_map_to_odom_and_odom_to_base_give_the_estimate():
    rng = np.random.default_rng(2)
    for _ in range(20):
        map_T_base, odom_T_base = random_pose(rng), random_pose(rng)
        product = matrix(divide(map_T_base, odom_T_base)) @ matrix(odom_T_base)
        assert product == pytest.approx(matrix(map_T_base), abs=1e-12)


def test_odometry_is_interpolated_to_the_estimate():
    tree = FrameTree()
    assert list(tree.odometry(0, planar(0.0, 0.0, 0.0))) == []
    assert list(tree.estimate(SECOND // 4, planar(5.0, 5.0, 1.0))) == []
    (placed,) = tree.odometry(SECOND, planar(4.0, 0.0, 0.8))
    assert placed.stamp == SECOND // 4
    assert matrix(placed.odom_T_base) == pytest.approx(matrix(planar(1.0, 0.0, 0.2)), abs=1e-12)
    product = matrix(placed.map_T_odom) @ matrix(placed.odom_T_base)
    assert product == pytest.approx(matrix(planar(5.0, 5.0, 1.0)), abs=1e-12)


def test_turning_goes_the_short_way_whatever_the_sign_of_the_quaternion():
    a, b = planar(0.0, 0.0, 3.0), planar(0.0, 0.0, -3.0)
    wanted = matrix(planar(0.0, 0.0, np.pi))
    assert matrix(interpolate(a, b, 0.5)) == pytest.approx(wanted, abs=1e-12)
    assert matrix(interpolate(a, (b[0], -b[1]), 0.5)) == pytest.approx(wanted, abs=1e-12)


def test_an_estimate_at_the_stamp_of_odometry_needs_no_other_message():
    tree = FrameTree()
    list(tree.odometry(5, planar(0.0, 0.0, 0.0)))
    list(tree.estimate(5, planar(1.0, 0.0, 0.0)))
    assert [placed.stamp for placed in tree.end()] == [5]


def test_nothing_is_said_over_a_gap_or_before_odometry():
    tree = FrameTree()
    list(tree.estimate(0, planar(0.0, 0.0, 0.0)))
    assert list(tree.odometry(10, planar(0.0, 0.0, 0.0))) == []
    list(tree.estimate(20, planar(0.0, 0.0, 0.0)))
    assert list(tree.odometry(11 + LONGEST_GAP_NS, planar(1.0, 0.0, 0.0))) == []


def test_estimates_do_not_pile_up_when_odometry_is_silent():
    tree = FrameTree()
    list(tree.odometry(0, planar(0.0, 0.0, 0.0)))
    for i in range(1000):
        list(tree.estimate(i * SECOND // 10, planar(0.0, 0.0, 0.0)))
    assert len(tree._waiting) <= 11


@pytest.mark.parametrize("has_odometry", [True, False])
def test_without_poses_of_odometry_the_tree_is_map_to_base(has_odometry):
    tree, placed = FrameTree(), []
    for i in range(30):
        if has_odometry:
            placed += tree.odometry(i * SECOND // 10, None)
        placed += tree.estimate(i * SECOND // 10, planar(float(i), 0.0, 0.0))
    placed += tree.end()
    assert [p.stamp for p in placed] == [i * SECOND // 10 for i in range(30)]
    assert all(p.map_T_odom is None for p in placed)
    assert placed[7].odom_T_base[0][0] == 7.0


def test_estimates_that_come_when_the_log_has_ended_stand_without_odometry():
    tree = FrameTree()
    for i in range(50):
        list(tree.odometry(i * SECOND // 10, planar(0.1 * i, 0.0, 0.0)))
    placed = [p for i in range(50) for p in tree.estimate(i * SECOND // 10, planar(0.1 * i, 1.0, 0.0))]
    placed += tree.end()
    assert [p.stamp for p in placed] == [i * SECOND // 10 for i in range(50)]
    assert all(p.map_T_odom is None for p in placed)
