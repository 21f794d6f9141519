"""Edges that blend: the fit of the whole brightness has no bias where a filter has one."""

import math

import numpy as np
import pytest
from scipy.special import erf

from logpose.pipelines.stripe_pose.edges import edge_near, filter_taps
from logpose.pipelines.stripe_pose.profile import passed, separate

WRONG = np.array([0.2, -0.2, 0.15, -0.1])
POLARITY = np.array([1, -1, 1, -1], dtype=np.int64)


def bars(columns, blur, *, rows=20, slope=0.02, noise=0.0, width=60, seed=0):
    u, v = np.meshgrid(np.arange(float(width)), np.arange(float(rows)))
    share = sum(
        s * 0.5 * (1 + erf((u - c - slope * (v - rows / 2)) / (math.sqrt(2) * blur)))
        for c, s in zip(columns, POLARITY, strict=True)
    )
    light = 40 + 0.3 * (u - 30) + (150 + 0.5 * (u - 30)) * share
    light = light + noise * np.random.default_rng(seed).standard_normal(light.shape)
    return np.clip(np.rint(light), 0, 255).astype(np.uint8)


def fitted(image, columns, slope=0.02):
    values, cov = np.empty(9), np.empty((9, 9))
    rows = len(image)
    lines = columns + slope * (np.arange(rows) - rows / 2)[:, None]
    n = separate(image, (0, rows - 1), lines, POLARITY, values, cov)
    return n, values, cov


@pytest.mark.parametrize("gap", [3.0, 4.0, 6.0])
@pytest.mark.parametrize("blur", [0.8, 1.2])
def test_neighbours_are_separated_without_bias(gap, blur):
    truth = 25.3 + gap * np.arange(4)
    n, values, _ = fitted(bars(truth, blur), truth + WRONG)
    assert n > 0
    assert truth + WRONG + values[:4] == pytest.approx(truth, abs=0.01)
    assert values[4] == pytest.approx(blur, abs=0.02)
    assert values[7] == pytest.approx(150.0, rel=0.05)


def test_the_filter_alone_is_biased_there():
    truth = 25.3 + 3.0 * np.arange(4)
    image = bars(truth, 1.2)
    first, _ = edge_near(image, 10, truth[0], 1, filter_taps())
    assert abs(first - truth[0]) > 0.1


def test_errors_are_as_large_as_the_covariance_says():
    truth = 25.3 + 4.0 * np.arange(4)
    squares = []
    for seed in range(150):
        _, values, cov = fitted(bars(truth, 0.9, noise=3.0, seed=seed), truth)
        error = values[:4]
        squares.append(error @ np.linalg.solve(cov[:4, :4], error))
    assert np.mean(squares) == pytest.approx(4.0, abs=4 * math.sqrt(2 * 4 / 150))  # chi-square of 4, 4 sigma


def test_the_normal_integral_is_that_of_the_library():
    for d in np.linspace(-5, 5, 41):
        assert passed(d, math.exp(-0.5 * d * d)) == pytest.approx(0.5 * (1 + math.erf(d / math.sqrt(2))), abs=2e-7)


def test_a_flat_image_has_no_fit():
    n, values, _ = fitted(np.full((20, 60), 90, np.uint8), 25.3 + 4.0 * np.arange(4))
    assert n == 0 or not np.all(np.abs(values[:4]) < 1.0)
