"""Edges of rows: where they are to hundredths of a pixel, and how far they go."""

import math

import numpy as np
import pytest
from scipy.special import erf

from logpose.pipelines.stripe_pose.edges import (
    WIDE_SIGMA_PX,
    edge_near,
    extrema,
    filter_taps,
    follow,
    respond,
)

from .conftest import mark_of, picture


def step(at, blur, width=80, low=40.0, high=200.0):
    """A row with one edge, whole grey levels apart from rounding."""
    u = np.arange(float(width))
    return low + (high - low) * 0.5 * (1 + erf((u - at) / (math.sqrt(2) * blur)))


def found_in(rows, taps, threshold=5.0):
    pixels = np.clip(np.rint(rows), 0, 255).astype(np.uint8)
    columns, strengths = np.empty(512), np.empty(512)
    grey, response = (np.empty(pixels.shape[1], np.float32) for _ in range(2))
    out = []
    for row in range(len(pixels)):
        respond(pixels, row, taps, grey, response)
        n = extrema(response, threshold, columns, strengths)
        out.append((columns[:n].copy(), strengths[:n].copy()))
    return out


@pytest.mark.parametrize("blur", [0.6, 0.8, 1.0, 1.5])
@pytest.mark.parametrize("sigma", [1.2, WIDE_SIGMA_PX])
def test_an_edge_has_no_bias_wherever_it_lies_between_two_pixels(blur, sigma):
    places = 40.0 + np.linspace(0.0, 1.0, 21)
    taps = filter_taps(sigma)
    errors = []
    for at in places:
        column, _ = edge_near(np.clip(np.rint([step(at, blur)]), 0, 255).astype(np.uint8), 0, at, 1, taps)
        errors.append(column - at)
    # Rounding to whole grey levels alone moves an edge of 160 levels by about 0.005 px.
    assert np.max(np.abs(errors)) < 0.02
    assert abs(np.mean(errors)) < 0.003


def test_both_polarities_are_told_apart():
    row = step(30.0, 0.8) - step(50.0, 0.8) + 40.0
    ((columns, strengths),) = found_in([row], filter_taps())
    assert columns == pytest.approx([30.0, 50.0], abs=0.01)
    assert np.sign(strengths).tolist() == [1.0, -1.0]


def test_a_flat_row_has_no_edges():
    assert [len(columns) for columns, _ in found_in(np.full((2, 60), 90.0), filter_taps())] == [0, 0]


def test_noise_moves_an_edge_as_the_theory_of_the_filter_says():
    rng = np.random.default_rng(3)
    blur, contrast, noise, sigma = 1.0, 100.0, 2.0, 1.2
    clean = np.clip(np.rint(step(40.3, blur, low=60.0, high=160.0) + noise * rng.standard_normal((3000, 80))), 0, 255)
    pixels, taps = clean.astype(np.uint8), filter_taps(sigma)
    columns = np.array([edge_near(pixels, row, 40.3, 1, taps)[0] for row in range(len(pixels))])
    total = math.hypot(sigma, blur)
    # sd = noise / contrast sqrt(3 / (8 sqrt(pi) s_f^5)) sqrt(2 pi) s_t^3; noise with the rounding of grey levels.
    expected = math.hypot(noise, 1 / math.sqrt(12)) / contrast
    expected *= math.sqrt(3 / (8 * math.sqrt(math.pi))) * sigma**-2.5 * math.sqrt(2 * math.pi) * total**3
    assert np.std(columns) == pytest.approx(expected, rel=0.08)  # 3000 draws: 1.3 %; five taps: some per cent


def test_an_edge_beyond_the_window_is_none():
    pixels = np.clip(np.rint([step(40.0, 0.8)]), 0, 255).astype(np.uint8)
    assert math.isnan(edge_near(pixels, 0, 34.0, 1, filter_taps())[0])
    assert math.isnan(edge_near(pixels, 0, 40.0, -1, filter_taps())[0])
    assert edge_near(pixels, 0, 40.0, 0, filter_taps())[0] == pytest.approx(40.0, abs=0.01)


@pytest.mark.parametrize("roll", [0.0, 0.1, -0.2])
def test_edges_are_followed_over_all_rows_of_the_bars_and_no_further(roll):
    mark, pose = mark_of(), np.array([0.2, 0.0, 1.0])
    image = picture(mark, pose, roll=roll, height=0.1)
    m = len(mark.edges)
    found, size = np.empty((m, 480)), np.empty((m, 480))
    row = 240
    start = _columns(image, row)
    assert len(start) == m
    follow(image, row, 480, start, mark.polarity, filter_taps(), 2.0, found, size)
    rows = np.isfinite(found).sum(axis=1)
    expected = 600 * 0.1 / (np.sin(0.2) * mark.edges + 1.0) * np.cos(roll)
    assert np.all(np.abs(rows - expected) <= 4)


def _columns(image, row):
    ((columns, strengths),) = found_in(image[row : row + 1], filter_taps(), 20.0)
    first = np.flatnonzero(strengths > 0)[0]
    return columns[first : first + 8]
