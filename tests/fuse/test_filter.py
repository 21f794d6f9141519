import numpy as np
import pytest

from logpose.pipelines.estimation.kalman import chi_square
from logpose.pipelines.fuse.filter import PoseFilter
from logpose.pipelines.fuse.mark_errors import displaced
from logpose.pipelines.fuse.motion import linearise
from logpose.pipelines.fuse.params import FuseParams
from logpose.pipelines.fuse.view import Seen, View, groups
from logpose.pipelines.geometry.motion import Increment, pose_increment
from logpose.pipelines.geometry.se2 import between, compose, in_map
from logpose.pipelines.odometry.noise import corrected

PLACES = np.array([[0.0, 2.0], [4.0, 2.0]])
LEAST = 1e-8  # nothing is believed to less than 0.1 mm and 0.1 mrad


def seen(mark, pose, sigma=(0.002, 0.002, 0.005)):
    return Seen(mark, np.array(pose, dtype=float), np.diag(np.square(sigma)))


def params(**values):
    return FuseParams(map="marks.yaml", **values)


def begun(**values):
    return PoseFilter.begin(PLACES, params(**values), seen(0, (0.0, 1.0, 0.3)))


def differences(function, n, step=1e-6):
    return np.stack([(function(h) - function(-h)) / (2 * step) for h in step * np.eye(n)], axis=-1)


@pytest.mark.parametrize("seed", range(5))
def test_motion_of_errors_is_that_of_differences(seed):
    rng = np.random.default_rng(seed)
    calibration, pose = rng.normal(0, 0.05, 3), rng.normal(0, 2, 3)
    u = np.array([*rng.normal(0, 0.1, 3), 0.1, 0.1, 0.2, 0.0])
    end = compose(pose, corrected(calibration, u))
    moved = differences(
        lambda e: between(end, compose(compose(pose, e[:3]), corrected(calibration + e[3:], u))), 6
    )  # fmt: skip
    F, G = linearise(calibration, u)
    assert F[:, :3] == pytest.approx(moved[:, :3], abs=1e-8)
    # the scales bend an arc of 0.1 rad and 0.1 m, which the lever of the middle tells to a third of the second order
    assert F[:, 3:] == pytest.approx(moved[:, 3:], abs=2e-3)
    assert G[:, :2] == pytest.approx(F[:, :2])


@pytest.mark.parametrize("seed", range(5))
def test_a_survey_error_moves_what_is_found_as_differences_do(seed):
    rng = np.random.default_rng(seed)
    pose, place, error = rng.normal(0, 2, 3), rng.normal(0, 2, 2), rng.normal(0, 0.3, 3)
    _, by_pose, by_error = displaced(pose, place, error)
    moved = differences(lambda e: displaced(compose(pose, e), place, error)[0], 3)
    assert by_pose == pytest.approx(moved, abs=1e-8)
    assert by_error == pytest.approx(differences(lambda e: displaced(pose, place, error + e)[0], 3), abs=1e-8)


def test_a_mark_that_hangs_turned_by_half_a_degree_shifts_who_is_a_metre_before_it_by_9_mm():
    found, _, _ = displaced(np.array([0.0, 1.0, 0.0]), np.array([0.0, 2.0]), np.array([0.0, 0.0, np.radians(0.5)]))
    assert found == pytest.approx([np.radians(0.5), 1.0, np.radians(0.5)], abs=1e-4)  # Rot(0.5 deg) (0, -1)


def test_it_begins_where_the_sighting_says_as_surely_as_the_survey_allows():
    robot = begun(map_sigma_m=0.01, map_sigma_deg=1.0)
    assert robot.pose == pytest.approx([0.0, 1.0, 0.3])
    turn = np.radians(1.0)
    # 1 m before the mark its heading moves the robot sideways; the noise is 2 mm and 5 mrad
    expected = np.array([[1e-4 + turn**2, 0, turn**2], [0, 1e-4, 0], [turn**2, 0, turn**2]])
    expected += np.diag([4e-6, 4e-6, 25e-6])
    assert robot.covariance() == pytest.approx(expected, abs=3 * LEAST)


def test_the_same_mark_again_teaches_nothing_of_its_survey_error():
    robot = begun(map_sigma_m=0.01, map_sigma_deg=1.0, news_s=1e-3)
    for _ in range(1000):
        robot.predict(Increment(dt=0.1))
        robot.correct(seen(0, (0.0, 1.0, 0.3)))
    sigma = np.sqrt(np.diag(robot.covariance()))
    assert 0.01 < sigma[1] < 0.0101
    assert np.radians(1.0) < sigma[2]
    assert robot.errors == pytest.approx(np.zeros((1, 3)), abs=1e-12)


def test_two_marks_share_their_disagreement():
    # both say the robot is at x = 0 and x = 0.02 with the same survey error and next to no noise: it is between them
    robot = begun(map_sigma_m=0.01, map_sigma_deg=1e-6)
    robot = PoseFilter.begin(PLACES, robot.params, seen(0, (0.0, 1.0, 0.0), (1e-6, 1e-6, 1e-6)))
    robot.correct(seen(1, (0.02, 1.0, 0.0), (1e-6, 1e-6, 1e-6)))
    assert robot.pose == pytest.approx([0.01, 1.0, 0.0], abs=1e-4)
    assert robot.errors[:, 0] == pytest.approx([-0.01, 0.01], abs=1e-4)
    assert np.sqrt(robot.covariance()[0, 0]) == pytest.approx(0.01 / np.sqrt(2), rel=1e-2)


def test_news_is_one_for_another_place_and_little_for_the_same_image_again():
    robot = begun(news_length_m=0.02, news_turn_rad=0.02, news_s=1.0)
    assert robot.news(0) == pytest.approx(1e-6)
    assert robot.news(1) == 1.0
    robot.predict(Increment(dt=0.1))
    assert robot.news(0) == pytest.approx(np.tanh(0.1))
    robot.predict(pose_increment(np.array([0.06, 0.0, 0.0]), 0.1))
    assert robot.news(0) == pytest.approx(np.tanh(0.2 + 3.0))


def test_images_of_a_robot_that_stands_count_by_their_time_not_by_their_number():
    still = {"along_per_sqrt_s": 0.0, "heading_per_sqrt_s": 0.0, "map_sigma_m": 0.0, "map_sigma_deg": 0.0}
    still |= {"turn_bias_sigma_rad_s": 0.0, "bias_walk_rad_s_per_sqrt_s": 0.0}
    variances = []
    for rate in (5, 50):
        robot = begun(**still)
        for _ in range(20 * rate):
            robot.predict(Increment(dt=1 / rate))
            robot.correct(seen(0, (0.0, 1.0, 0.3)))
        variances.append(robot.covariance()[1, 1])
    assert variances[1] == pytest.approx(variances[0], rel=0.05)
    # 20 s are 20 sightings, and the first
    assert variances[1] == pytest.approx(4e-6 / 21 + LEAST, rel=0.05)


def test_a_sighting_of_another_mark_expects_its_survey_error():
    robot = begun(map_sigma_m=0.01, map_sigma_deg=0.0)
    S = robot.expect(seen(1, (0.0, 1.0, 0.3))).S
    assert S[0, 0] == pytest.approx(2 * 4e-6 + 2e-4, abs=7 * LEAST)


def test_the_scale_of_the_speed_is_found_from_two_marks():
    robot = begun(map_sigma_m=1e-4, map_sigma_deg=0.01)
    heading = 0.3
    for _ in range(40):
        robot.predict(pose_increment(np.array([0.1, 0.0, 0.0]), 0.2))
    way = 4.0 * 1.03  # it drove 3 % more than it says
    at = (way * np.cos(heading), 1.0 + way * np.sin(heading), heading)
    expected = robot.expect(seen(1, at))
    assert expected.nis < chi_square(0.999, 3)
    robot.correct(seen(1, at))
    assert robot.calibration[0] == pytest.approx(0.03, abs=0.003)


def test_covariance_in_the_map_is_turned_from_that_of_the_robot():
    robot = PoseFilter(PLACES, params(), np.array([0.0, 0.0, np.pi / 2]), np.diag([4.0, 1.0, 0.1]))
    assert np.diag(robot.P)[:3] == pytest.approx([1.0, 4.0, 0.1])
    assert np.diag(robot.covariance()) == pytest.approx([4.0, 1.0, 0.1])
    assert in_map(np.zeros(4)).shape == (4, 3, 3)


def test_candidates_that_lie_over_one_another_in_the_image_are_one_thing():
    def at(low, high):
        return Seen(0, np.zeros(3), np.eye(3), (low, high))

    a, b, c, d = at(0, 50), at(40, 90), at(91, 120), at(10, 20)
    found = groups([c, b, d, a])
    assert [len(group) for group in found] == [3, 1]
    assert found[1] == [c]
    assert View(0, sure=[a], ambiguous=[a, b, c], unverified=[d]).n_seen == 4
