import numpy as np
import pytest

from logpose.pipelines.geometry.motion import Increment, twist_increment
from logpose.pipelines.localize_pf.association import CLUTTER
from logpose.pipelines.localize_pf.paper import PaperFilter, log_gaussian, sample_motion_model_velocity
from logpose.pipelines.localize_pf.params import LocalizePfParams

TABLE_3 = (0.3, 0.3, 0.1, 0.25, 0.001, 0.001)
START = np.array([[1.0, 2.0, 0.3]])


def test_sensor_model_corrected_and_as_printed():
    # z = 1, z* = 1.05, sigma = 0.1
    assert np.exp(log_gaussian(np.array(-0.05), 0.1)) == pytest.approx(3.520653267643, abs=1e-9)
    assert np.exp(log_gaussian(np.array(-0.05), 0.1, "2pi")) == pytest.approx(3.833805158744, abs=1e-9)


def test_the_printed_density_is_not_normalised_the_corrected_is():
    x = np.linspace(-3, 3, 60001)
    assert np.exp(log_gaussian(x, 0.1)).sum() * 1e-4 == pytest.approx(1.0, abs=1e-9)
    assert np.exp(log_gaussian(x, 0.1, "2pi")).sum() * 1e-4 == pytest.approx(np.sqrt(np.pi), abs=1e-9)


@pytest.mark.parametrize(
    ("v", "w", "deviations"),
    [
        (0.36, 0.0, (0.03888, 0.01296, 0.0001296)),
        (0.36, 0.5, (0.11388, 0.07546, 0.0003796)),
        (0.4, 0.7, (0.195, 0.1385, 0.00065)),
    ],
)
def test_noise_of_table_2_has_the_deviations_of_table_3(v, w, deviations):
    dt = 1.0
    for j, deviation in enumerate(deviations):
        normal = np.zeros((1, 3))
        normal[0, j] = 1.0
        noisy = sample_motion_model_velocity(np.zeros((1, 3)), (v, w, dt), TABLE_3, normal)
        clean = sample_motion_model_velocity(np.zeros((1, 3)), (v, w, dt), TABLE_3, np.zeros((1, 3)))
        chord = np.hypot(noisy[0, 0], noisy[0, 1]) / np.sinc(w / 2 / np.pi)
        found = chord - v if j == 0 else noisy[0, 2] - clean[0, 2]
        assert found == pytest.approx(deviation, abs=1e-9)


def test_reading_b_as_a_variance_makes_the_noise_five_times_larger():
    normal = np.array([[1.0, 0.0, 0.0]])
    moved = sample_motion_model_velocity(np.zeros((1, 3)), (0.36, 0.0, 1.0), TABLE_3, normal, noise_as="variance")
    assert moved[0, 0] - 0.36 == pytest.approx(np.sqrt(0.03888), abs=1e-9)


@pytest.mark.parametrize(
    ("w", "end"),
    [
        (0.5, (1.029494703699, 2.009826336299, 0.343181818182)),
        (0.0, (1.029702279935, 2.009187991880, 0.3)),
    ],
)
def test_table_2_without_noise_is_the_arc(w, end):
    moved = sample_motion_model_velocity(START, (0.36, w, 380 / 4400), TABLE_3, np.zeros((1, 3)))
    assert moved[0] == pytest.approx(end, abs=1e-9)


def paper_filter(landmarks, **changes):
    changes = {"particles": 200, **changes}
    made = PaperFilter(np.array(landmarks, dtype=float), 0.0, LocalizePfParams(map="-", method="paper", **changes))
    made.start(np.zeros(3), np.diag([0.01, 0.01, 0.001]))
    return made


def test_table_1_takes_the_likeliest_of_the_nearest():
    pf = paper_filter([(1.0, 0.0), (1.0, 0.8), (-1.0, 0.0), (9.0, 9.0)])
    update = pf.update(np.array([[1.0, 0.8], [-1.0, 0.0]]), np.zeros((2, 2, 2)))
    assert update.matches.tolist() == [1, 2]
    assert update.resampled
    assert update.surprise.min() > 0.0


def test_one_nearest_landmark_cuts_the_right_one():
    # the erratum of Table 1: nearest to the particle is not nearest to the detection
    seen = np.array([[1.0, 0.8]])
    landmarks = [(0.3, 0.0), (1.0, 0.8)]
    assert paper_filter(landmarks, n_nearest=1).update(seen, np.zeros((1, 2, 2))).matches.tolist() == [0]
    corrected = paper_filter(landmarks, n_nearest=1, nearest_to="detection")
    assert corrected.update(seen, np.zeros((1, 2, 2))).matches.tolist() == [1]


def test_weights_that_underflow_keep_the_cloud_and_are_counted():
    pf = paper_filter([(1.0, 0.0)])
    before = pf.poses.copy()
    update = pf.update(np.array([[40.0, 0.0]]), np.zeros((1, 2, 2)))
    assert update.underflow
    assert not update.resampled
    assert update.ess == pytest.approx(200.0)
    assert np.array_equal(pf.poses, before)
    assert np.array_equal(pf.log_w, np.full(200, -np.log(200)))


def test_an_image_of_clutter_alone_keeps_the_cloud():
    pf = paper_filter([(1.0, 0.0)])
    before = pf.poses.copy()
    update = pf.update(np.array([[1.0, 0.0]]), np.zeros((1, 2, 2)), np.array([CLUTTER]))
    assert (update.resampled, update.underflow) == (False, False)
    assert np.array_equal(pf.poses, before)


def test_nothing_seen_changes_nothing():
    pf = paper_filter([(1.0, 0.0)])
    before = pf.poses.copy()
    update = pf.update(np.zeros((0, 2)), np.zeros((0, 2, 2)))
    assert np.array_equal(pf.poses, before)
    assert not update.resampled


def test_given_ids_are_used_and_clutter_left_out():
    pf = paper_filter([(1.0, 0.0), (1.0, 0.8)])
    update = pf.update(np.array([[1.0, 0.0], [0.0, 5.0]]), np.zeros((2, 2, 2)), np.array([0, CLUTTER]))
    assert update.matches.tolist() == [0, CLUTTER]


def test_standing_still_has_no_noise_in_the_paper():
    pf = paper_filter([(1.0, 0.0)])
    before = pf.poses.copy()
    pf.predict(Increment(dt=0.1))
    assert np.allclose(pf.poses, before, atol=1e-15)
    pf.predict(twist_increment((0.4, 0.0, 0.1), 0.1))
    assert np.ptp(np.hypot(*(pf.poses - before)[:, :2].T)) > 1e-3
