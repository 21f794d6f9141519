"""Light to bytes: vignetting, gain, noise of the right size, saturation."""

import numpy as np
import pytest
from scipy.special import ndtr

from logpose.formats.calibration import Calibration
from logpose.pipelines.simulate.sensors.imager import ImagerParams, gains, photograph, vignette

CAMERA = Calibration(160, 120, 161.0, 161.0, 79.5, 59.5, "plumb_bob", (0.0,) * 5)
CLEAN = ImagerParams(psf_px=0.0, vignetting=0.0, read_noise_dn=0.0, shot_noise_dn=0.0, gain_sd=0.0)


def flat(value):
    return np.full((120, 160), value, np.float32)


def noise(seed=0):
    return np.random.default_rng(seed).standard_normal((120, 160), np.float32)


def test_a_perfect_sensor_rounds_and_saturates():
    for light, grey in ((0.0, 0), (0.5, 128), (1.0, 255), (3.0, 255)):
        assert (photograph(flat(light), 1.0, CAMERA, CLEAN, noise()) == grey).all()
    assert (photograph(flat(0.5), 0.5, CAMERA, CLEAN, noise()) == 64).all()


def test_noise_grows_with_the_light_as_asked():
    params = CLEAN.model_copy(update={"read_noise_dn": 2.0, "shot_noise_dn": 0.05})
    for light in (0.1, 0.6):
        image = photograph(flat(light), 1.0, CAMERA, params, noise()).astype(float)
        expected = np.sqrt(2.0**2 + 0.05 * 255 * light + 1 / 12)  # and rounding
        assert image.std() == pytest.approx(expected, rel=3 / np.sqrt(2 * image.size))
        assert image.mean() == pytest.approx(255 * light, abs=4 * expected / np.sqrt(image.size))


def test_vignetting_takes_its_share_in_the_corner_and_nothing_on_the_axis():
    shares = vignette(CAMERA, 0.3)
    assert shares[0, 0] == pytest.approx(0.7, abs=1e-6)
    assert shares.max() == pytest.approx(1.0, abs=1e-4)


def test_the_point_spread_keeps_the_light_and_its_place(centroid):
    light = flat(0.0)
    light[60, 70] = 100.0
    params = CLEAN.model_copy(update={"psf_px": 1.5})
    grey = photograph(light / 20, 1.0, CAMERA, params, noise()).astype(float)
    np.testing.assert_allclose(centroid(grey), [70, 60], atol=1e-9)
    assert grey.sum() == pytest.approx(255 * 5, rel=0.02)
    spread = np.sqrt((grey[60] * (np.arange(160) - 70) ** 2).sum() / grey[60].sum())
    assert spread == pytest.approx(1.5, rel=0.05)


def test_the_gain_wanders_slowly_around_its_mean():
    params = ImagerParams(gain=1.2, gain_sd=0.05)
    found = np.log(gains(200_000, 0.1, params, np.random.default_rng(0)) / 1.2)
    n_independent = 200_000 * 0.1 / 40
    assert found.std() == pytest.approx(0.05, rel=3 / np.sqrt(2 * n_independent))
    assert abs(found.mean()) < 3 * 0.05 / np.sqrt(n_independent)
    assert np.abs(np.diff(found)).max() < 6 * 0.05 * np.sqrt(2 * 0.1 / 20)
    assert (gains(5, 0.1, ImagerParams(gain_sd=0.0), np.random.default_rng(0)) == 1.0).all()


@pytest.mark.parametrize("place", [70.0, 70.17, 70.33, 70.5])
def test_the_lens_blurs_before_pixels_collect_where_they_are_oversampled(place):
    # A blurred edge is the integral of the normal distribution; what a pixel collects is the integral of that.
    def collected(x):
        z = (x - place) / 0.7
        return (x - place) * ndtr(z) + 0.7 * np.exp(-z * z / 2) / np.sqrt(2 * np.pi)

    u = np.arange(60, 81)
    expected = collected(u + 0.5) - collected(u - 0.5)
    params = CLEAN.model_copy(update={"psf_px": 0.7})
    worst = []
    for n in (1, 4):
        left = np.arange(160 * n) / n - 0.5  # of each of the finer pixels
        share = np.clip((left + 1 / n - place) * n, 0, 1)
        light = np.tile(share.astype(np.float32), (120 * n, 1))
        grey = photograph(light, 1.0, CAMERA, params, noise())[60, 60:81].astype(float)
        worst.append(np.abs(grey / 255 - expected).max())
    assert worst[1] < 0.006  # half a grey level is 0.002
    assert worst[0] > 3 * worst[1]
