"""The default detector: what is a circle and what is not, to which fraction of a pixel, and any image at all."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logpose.pipelines.detect_circles.detect import Search, find_circles
from logpose.pipelines.detect_circles.sighting import View
from logpose.pipelines.geometry.camera import Camera
from logpose.pipelines.geometry.mount import upward

SEARCH = Search(7.0, 30.0)


@pytest.mark.parametrize("seed", range(6))
def test_a_centre_is_right_to_a_twentieth_of_a_pixel(draw, shapes, seed):
    disc, _ = shapes
    u, v = np.random.default_rng(seed).uniform((40, 40), (120, 80))
    r = 8.0 + 3.0 * seed
    found = find_circles(draw([disc(u, v, r)], seed=seed), SEARCH)
    assert len(found) == 1
    # Noise 2 on a contrast of 120: 0.01 px; the rest is the pixel grid's.
    assert np.hypot(*(found.uv[0] - (u, v))) < 0.05
    assert abs(found.radius[0] - r) < 0.2
    assert found.score[0] > 0.8
    assert found.arc[0] > 0.95
    assert not found.is_cut[0]


@pytest.mark.parametrize("angle", [0.0, 0.2, 0.5, 0.785])
@pytest.mark.parametrize(("sides", "inner"), [(4, 8.0), (4, 13.0), (4, 20.0), (6, 12.0), (6, 20.0), (3, 12.0)])
def test_polygons_are_no_circles(draw, shapes, sides, inner, angle):
    _, polygon = shapes
    image = draw([polygon(80.3, 60.6, inner, sides, angle)])
    assert len(find_circles(image, Search(6.0, 40.0))) == 0


@pytest.mark.parametrize("angle", [0.0, 0.5, 1.1])
@pytest.mark.parametrize("length", [1.8, 2.5, 4.0])
def test_panels_are_no_circles(draw, angle, length):
    c, s = np.cos(angle), np.sin(angle)

    def panel(x, y):
        a, b = (x - 80.2) * c + (y - 60.4) * s, (y - 60.4) * c - (x - 80.2) * s
        return (np.abs(a) < 12.0 * length) & (np.abs(b) < 12.0)

    assert len(find_circles(draw([panel]), Search(6.0, 40.0))) == 0


@pytest.mark.parametrize("r", [7.5, 10.0, 14.0, 20.0])
def test_touching_lamps_are_no_panel(draw, shapes, r):
    disc, _ = shapes
    for angle in (0.0, 0.4, 0.785):
        c, s = r * np.cos(angle), r * np.sin(angle)
        found = find_circles(draw([disc(80.0 - c, 60.0 - s, r), disc(80.0 + c, 60.0 + s, r)]), Search(6.0, 30.0))
        assert len(found) == 2


def test_touching_lamps_are_two(draw, shapes):
    disc, _ = shapes
    found = find_circles(draw([disc(55.0, 60.0, 17.0), disc(89.4, 62.0, 17.0)]), SEARCH)
    order = np.argsort(found.uv[:, 0])
    np.testing.assert_allclose(found.uv[order], [[55.0, 60.0], [89.4, 62.0]], atol=0.15)


def test_three_touching_lamps_are_three(draw, shapes):
    disc, _ = shapes
    places = [(60.0, 45.0), (92.2, 45.0), (76.1, 72.9)]
    found = find_circles(draw([disc(u, v, 16.0) for u, v in places]), SEARCH)
    assert len(found) == 3
    order = np.lexsort((found.uv[:, 0], found.uv[:, 1].round(-1)))
    np.testing.assert_allclose(found.uv[order], places, atol=0.5)  # at a contact two edges blur into one


@pytest.mark.parametrize("outside", [-0.45, -0.25, -0.1])
def test_a_cut_lamp_is_seen_with_less_score_and_more_error(draw, shapes, outside):
    disc, _ = shapes
    r = 18.0
    whole = find_circles(draw([disc(80.0, 60.0, r)]), SEARCH)
    v = r * (1 + outside)  # this share of the radius lies outside the image
    found = find_circles(draw([disc(80.2, v - 0.5, r)]), SEARCH)
    assert len(found) == 1
    assert found.is_cut[0]
    assert found.score[0] < whole.score[0]
    assert found.cov[0, 1, 1] > whole.cov[0, 1, 1]
    error = found.uv[0] - (80.2, v - 0.5)
    assert error @ np.linalg.solve(found.cov[0], error) < 13.8  # chi2, 2 degrees of freedom, 0.999


def test_a_lamp_with_only_a_short_arc_in_view_is_refused(draw, shapes):
    disc, _ = shapes
    assert len(find_circles(draw([disc(80.0, -6.0, 18.0)]), SEARCH)) == 0


@pytest.mark.parametrize(("polarity", "n_bright", "n_dark"), [("bright", 1, 0), ("dark", 0, 1), ("both", 1, 1)])
def test_polarity_chooses(draw, shapes, polarity, n_bright, n_dark):
    disc, _ = shapes
    bright = draw([disc(40.0, 60.0, 14.0)], ground=110.0, value=200.0).astype(int)
    dark = draw([disc(115.0, 60.0, 14.0)], ground=110.0, value=30.0).astype(int)
    image = np.clip(bright + dark - 110, 0, 255).astype(np.uint8)
    found = find_circles(image, Search(7.0, 30.0, polarity=polarity))
    assert (len(found), int(found.is_dark.sum())) == (n_bright + n_dark, n_dark)


def test_a_dim_lamp_in_noise_is_found(draw, shapes):
    disc, _ = shapes
    found = find_circles(draw([disc(80.0, 60.0, 16.0)], ground=80.0, value=110.0, noise=6.0), SEARCH)
    assert len(found) == 1
    assert np.hypot(*(found.uv[0] - (80.0, 60.0))) < 0.6  # 3.5 sigma: 0.4 px a ray / sqrt(56 / 2), each way


def test_the_covariance_is_honest(draw, shapes):
    disc, _ = shapes
    nees = []
    for seed in range(60):
        u, v = 80.0 + 0.13 * seed % 1, 60.0 + 0.29 * seed % 1
        image = draw([disc(u, v, 14.0)], size=(120, 160), ground=80.0, value=140.0, noise=5.0, seed=seed)
        found = find_circles(image, SEARCH)
        assert len(found) == 1
        e = found.uv[0] - (u, v)
        nees.append(e @ np.linalg.solve(found.cov[0], e))
    # Mean of 60 chi2(2): 2 -+ 0.26; the bound allows the covariance to be wrong by a factor of two.
    assert 1.0 < np.mean(nees) < 4.0


def test_with_a_camera_the_true_centre_is_reported_not_the_middle_of_the_outline():
    # A tilted camera sees a disc on the ceiling as an ellipse whose middle is not the image of its centre.
    c, s = np.cos(0.5), np.sin(0.5)
    rotation = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]) @ upward(0.0)
    view = View(
        Camera(300.0, 300.0, 159.5, 119.5, "plumb_bob", (-0.15, 0.0, 0.0, 0.0)), 320, 240, rotation, np.zeros(3), 1.0
    )
    centre = view.to_robot(np.array([200.0, 80.0]))
    n = 5
    y, x = (np.mgrid[0 : 160 * n, 0 : 160 * n] + 0.5) / n - 0.5
    xy = view.to_robot(np.stack([x + 120, y], axis=-1))
    share = (np.hypot(*np.moveaxis(xy - centre, -1, 0)) < 0.16).reshape(160, n, 160, n).mean(axis=(1, 3))
    image = np.full((240, 320), 60, np.uint8)
    image[:160, 120:280] += (120 * share).astype(np.uint8)
    search = Search(10.0, 70.0)
    in_plane, in_image = find_circles(image, search, view.plane()), find_circles(image, search)
    assert len(in_plane) == len(in_image) == 1
    assert np.hypot(*(in_plane.uv[0] - (200.0, 80.0))) < 0.06
    assert np.hypot(*(in_image.uv[0] - (200.0, 80.0))) > 0.5


@pytest.mark.parametrize("size", [(1, 1), (7, 7), (8, 8), (16, 16), (17, 33), (100, 9), (0, 5)])
def test_tiny_images_are_no_trouble(size):
    image = np.random.default_rng(0).integers(0, 256, size).astype(np.uint8)
    assert find_circles(image, SEARCH).uv.shape[1] == 2


def test_a_lamp_in_a_4k_image(draw, shapes):
    disc, _ = shapes
    image = np.full((2160, 3840), 70, np.uint8)
    image[1000:1120, 2000:2160] = draw([disc(80.25, 60.5, 40.0)])
    found = find_circles(image, Search(25.0, 120.0))
    assert len(found) == 1
    np.testing.assert_allclose(found.uv[0], [2080.25, 1060.5], atol=0.06)


def test_memory_layout_does_not_matter_and_the_image_is_not_touched(draw, shapes):
    disc, _ = shapes
    image = draw([disc(70.3, 60.2, 15.0)])
    expected = find_circles(image, SEARCH).uv
    wide = np.zeros((120, 320), np.uint8)
    wide[:, ::2] = image
    for same in (np.asfortranarray(image), wide[:, ::2], image[::-1][::-1]):
        copy = same.copy()
        np.testing.assert_array_equal(find_circles(same, SEARCH).uv, expected)
        np.testing.assert_array_equal(same, copy)
    image.setflags(write=False)
    np.testing.assert_array_equal(find_circles(image, SEARCH).uv, expected)


def test_the_same_image_gives_the_same_bits(draw, shapes):
    disc, _ = shapes
    image = draw([disc(70.3, 60.2, 15.0), disc(120.0, 30.0, 11.0)])
    first = find_circles(image, SEARCH)
    for _ in range(3):
        again = find_circles(image, SEARCH)
        assert first.uv.tobytes() == again.uv.tobytes()
        assert first.cov.tobytes() == again.cov.tobytes()


@settings(max_examples=60, deadline=None)
@given(
    st.integers(1, 90),
    st.integers(1, 90),
    st.integers(0, 2**32 - 1),
    st.sampled_from(["noise", "blocks", "binary", "ramp", "discs"]),
    st.sampled_from(["bright", "dark", "both"]),
    st.floats(1.5, 12.0),
)
def test_any_image_gives_finite_circles_inside_it(height, width, seed, kind, polarity, least):
    rng = np.random.default_rng(seed)
    if kind == "ramp":
        image = np.add.outer(np.arange(height), 3 * np.arange(width)).astype(np.uint8)
    elif kind == "discs":
        image = np.zeros((height, width), np.uint8)
        for _ in range(4):
            centre = (int(rng.integers(-5, width + 5)), int(rng.integers(-5, height + 5)))
            cv2.circle(image, centre, int(rng.integers(1, 30)), int(rng.integers(1, 255)), -1)
    else:
        coarse = 1 if kind == "noise" else 7
        image = rng.integers(0, 256, (height // coarse + 1, width // coarse + 1))
        image = np.kron(image, np.ones((coarse, coarse), int))[:height, :width]
        image = (255 * (image > 127) if kind == "binary" else image).astype(np.uint8)
    found = find_circles(image, Search(least, 3.0 * least + 5.0, polarity=polarity))
    for values in (found.uv, found.radius, found.cov, found.score, found.arc):
        assert np.isfinite(values).all()
    assert ((found.uv > -1) & (found.uv < (width, height))).all()
    assert ((found.score >= 0) & (found.score <= 1)).all()
    assert (np.linalg.eigvalsh(found.cov) > 0).all() if len(found) else True
    assert ((found.radius >= least) & (found.radius <= 3.0 * least + 5.0)).all()


def test_wrong_input_is_refused():
    with pytest.raises(ValueError, match=r"a grey image is \(H, W\) uint8, not \(5, 5, 3\) uint8"):
        find_circles(np.zeros((5, 5, 3), np.uint8), SEARCH)
    with pytest.raises(ValueError, match=r"a grey image is \(H, W\) uint8, not \(5, 5\) float64"):
        find_circles(np.zeros((5, 5)), SEARCH)
    with pytest.raises(ValueError, match="the radius range is 9 to 8 px"):
        Search(9.0, 8.0)
    plane = View(Camera(60.0, 60.0, 32.0, 24.0), 64, 48, upward(0.0), np.zeros(3), 2.0).plane()
    with pytest.raises(ValueError, match="the image is 50x40 px, the plane is for 64x48 px"):
        find_circles(np.zeros((40, 50), np.uint8), SEARCH, plane)
