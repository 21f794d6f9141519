import numpy as np
import pytest

from logpose.pipelines.geometry.motion import Increment, twist_increment
from logpose.pipelines.geometry.se2 import compose, inverse, transform
from logpose.pipelines.localize_pf.association import CLUTTER
from logpose.pipelines.localize_pf.filter import ParticleFilter
from logpose.pipelines.localize_pf.params import LocalizePfParams

LANDMARKS = np.array([(1.0, 0.0), (0.0, 1.5), (-1.2, -0.4), (3.0, 0.5), (4.5, -1.0), (6.0, 0.3)])
CERTAIN = np.diag([0.05, 0.05, 0.03]) ** 2
R = 0.01**2 * np.eye(2)


def make(landmarks=LANDMARKS, start=(0.0, 0.0, 0.0), cov=CERTAIN, variance=0.0, **changes):
    pf = ParticleFilter(np.asarray(landmarks), variance, LocalizePfParams(map="-", **changes))
    pf.start(np.array(start, dtype=float), cov)
    return pf


def view(pose, landmarks, reach=2.0):
    z = transform(inverse(np.array(pose)), np.asarray(landmarks))
    near = np.flatnonzero(np.hypot(*z.T) < reach)
    return z[near], np.tile(R, (len(near), 1, 1)), near


def test_one_update_is_the_kalman_filter_on_paper():
    """One certain heading, one landmark ahead: x and y are two scalar Kalman steps."""
    pf = make(
        [(1.0, 0.0)], cov=np.diag([0.04, 0.01, 0.0]), particles=1, shift_sigma_m=0.0, kernel_m=10.0, clutter=1e-12,
        sighting_sigma_m=0.0,
    )  # fmt: skip
    pf.update(np.array([[0.9, 0.05]]), np.array([np.diag([0.04, 0.03])]))
    mean, cov = pf.estimate()
    # seen 0.1 nearer: half of it (0.04 / 0.08); seen 0.05 to the left: a quarter (0.01 / 0.04) to the right
    assert mean == pytest.approx([0.05, -0.0125, 0.0], abs=1e-5)
    assert np.diag(cov) == pytest.approx([0.02, 0.0075, 0.0], abs=1e-5)


def test_it_converges_to_the_truth_and_its_covariance_says_so():
    truth = np.array([0.06, -0.04, 0.03])
    pf = make()
    for _ in range(30):
        u = twist_increment((0.3, 0.0, 0.05), 0.1)
        truth = compose(truth, np.array([u.dx, u.dy, u.dtheta]))
        pf.predict(u)
        z, cov, near = view(truth, LANDMARKS)
        update = pf.update(z, cov)
        assert update.matches.tolist() == near.tolist()
    mean, cov = pf.estimate()
    assert mean == pytest.approx(truth, abs=0.02)  # the common shift of 2 cm is what one place cannot tell
    assert np.allclose(cov, cov.T, atol=1e-15)
    assert np.linalg.eigvalsh(cov).min() > 0.0
    assert np.sqrt(cov[0, 0]) < 0.03


def test_weights_sum_to_one_after_every_update():
    pf = make(cov=np.diag([0.3, 0.3, 0.2]) ** 2)
    for k in range(5):
        z, cov, _ = view((0.1 * k, 0.0, 0.0), LANDMARKS)
        pf.update(z, cov)
        assert np.exp(pf.cloud.log_w).sum() == pytest.approx(1.0, abs=1e-12)
        pf.predict(twist_increment((1.0, 0.0, 0.0), 0.1))


def test_two_sightings_are_never_the_same_landmark():
    pf = make([(1.0, 0.0)])
    z = np.array([[1.0, 0.0], [1.02, 0.01]])
    update = pf.update(z, np.tile(R, (2, 1, 1)))
    assert sorted(update.matches.tolist()) == [CLUTTER, 0]


def test_what_is_no_landmark_is_left_out():
    pf = make()
    z, cov, near = view((0.0, 0.0, 0.0), LANDMARKS)
    z = np.vstack([z, [[0.4, -1.0]]])
    update = pf.update(z, np.concatenate([cov, R[None]]))
    assert update.matches.tolist() == [*near.tolist(), CLUTTER]
    assert update.surprise[-1] < 0.0 < update.surprise[0]


def test_nothing_seen_moves_no_particle():
    pf = make()
    before = pf.cloud.poses.copy()
    update = pf.update(np.zeros((0, 2)), np.zeros((0, 2, 2)))
    assert np.array_equal(pf.cloud.poses, before)
    assert not update.resampled


def test_a_standing_robot_learns_nothing_from_the_same_image():
    pf = make(variance=0.015**2, shift_sigma_m=0.02)
    z, cov, _ = view((0.0, 0.0, 0.0), LANDMARKS)
    pf.update(z, cov)
    first = pf.estimate()[1]
    for _ in range(200):
        pf.predict(Increment(dt=0.01))
        update = pf.update(z, cov)
        assert not update.resampled
    assert np.linalg.eigvalsh(pf.estimate()[1])[-1] > 0.5 * np.linalg.eigvalsh(first)[-1]


def test_a_long_way_without_landmarks_spreads_the_cloud():
    pf = make()
    for _ in range(300):
        pf.predict(twist_increment((0.4, 0.0, 0.0), 0.25))
    narrow = np.sqrt(np.diag(pf.cloud.P)[:3])
    assert narrow[0] <= pf.params.kernel_m + 1e-9
    assert narrow[2] <= np.radians(pf.params.kernel_deg) + 1e-9
    assert pf.cloud.poses[:, :2].std() > 2 * pf.params.kernel_m


def test_spreading_keeps_mean_and_covariance_of_a_small_uncertainty():
    cov = np.diag([0.3, 0.2, 0.05]) ** 2
    pf = make(cov=cov, particles=20_000)
    mean, found = pf.estimate()
    assert mean == pytest.approx(np.zeros(3), abs=0.012)  # 5 sigma of 20 000
    assert np.sqrt(np.diag(found)) == pytest.approx([0.3, 0.2, 0.05], rel=0.03)


def test_an_ambiguous_place_keeps_both_answers_until_it_is_decided():
    # One landmark every 0.8 m, the start uncertain by more than that; the odd one at the end decides.
    row = np.array([(0.8 * k, 0.5) for k in range(8)] + [(6.3, 0.0)])
    truth = np.array([1.6, 0.0, 0.0])
    pf = make(row, (1.2, 0.0, 0.0), np.diag([0.5, 0.02, 0.01]) ** 2, particles=500)
    z, cov, _ = view(truth, row, 0.7)
    pf.update(z, cov)
    assert pf.elsewhere() > 0.1
    while truth[0] < 6.2:
        u = twist_increment((0.4, 0.0, 0.0), 0.25)
        truth[0] += u.dx
        pf.predict(u)
        z, cov, _ = view(truth, row, 0.7)
        pf.update(z, cov)
    assert pf.elsewhere() < 0.1
    assert pf.estimate()[0] == pytest.approx(truth, abs=0.1)


@pytest.mark.parametrize("changes", [{"particles": 1}, {"sighting_sigma_m": 0.0, "shift_sigma_m": 0.0}])
def test_one_particle_and_zero_noise_work(changes):
    pf = make(cov=np.zeros((3, 3)), **changes)
    for k in range(20):
        z, _, near = view((0.02 * k, 0.0, 0.0), LANDMARKS)
        update = pf.update(z, np.zeros((len(z), 2, 2)))
        assert update.matches.tolist() == near.tolist()
        pf.predict(twist_increment((0.2, 0.0, 0.0), 0.1))
    mean, cov = pf.estimate()
    assert mean == pytest.approx([0.4, 0.0, 0.0], abs=0.01)
    assert np.all(np.isfinite(cov))


def test_searching_leaves_most_of_the_cloud_where_it_was():
    pf = make()
    before = pf.cloud.poses.copy()
    pf.search(4.0)
    stays = np.arange(len(before)) % 4 != 3
    assert np.array_equal(pf.cloud.poses[stays], before[stays])
    assert pf.cloud.poses[~stays, 0].std() > 0.1


def test_elsewhere_is_measured_from_the_weighted_median_of_each_axis():
    pf = make(particles=4)
    pf.cloud.poses[:, :2] = [(0.0, 0.0), (0.0, 0.1), (5.0, 0.0), (9.0, 3.0)]
    pf.cloud.log_w = np.log([0.05, 0.05, 0.6, 0.3])  # most particles stand near 0, most weight at (5, 0)
    assert pf.elsewhere() == pytest.approx(0.4)
