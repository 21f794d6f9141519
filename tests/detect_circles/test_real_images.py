"""Real pictures: nothing round where nothing round is, all that is round in a picture of sweets."""

import numpy as np
import pytest

from logpose.pipelines.detect_circles.detect import Search, find_circles

# False circles allowed, over all images without lamps; what the detector of 2026-11 found is 0 to 2 of each polarity.
AT_MOST = 5
N_NEGATIVES = {"boards": 13, "office": 30, "street": 20}


@pytest.fixture(scope="module")
def pictures(benchmark):
    """Which they are, and how they are scaled."""
    return benchmark("recordings")


@pytest.mark.parametrize("polarity", ["bright", "dark"])
def test_boards_offices_and_streets_have_no_lamps(pictures, recordings, polarity):
    n_false = 0
    for name, pattern in pictures.NEGATIVES.items():
        images = [pictures.fitted(path) for path in sorted(recordings.glob(pattern))]
        assert len(images) == N_NEGATIVES[name]
        n_false += sum(len(find_circles(image, Search(8.0, 48.0, polarity=polarity))) for image in images)
    assert n_false <= AT_MOST


@pytest.mark.parametrize("radii", [(8.0, 48.0), (8.0, 64.0), (20.0, 50.0)])
def test_all_twelve_sweets_in_view_are_found(pictures, recordings, radii):
    found = find_circles(pictures.fitted(recordings / "opencv_calib/smarties.png"), Search(*radii, polarity="dark"))
    assert len(found) == 12
    # All sweets are alike; seen from above their radii agree to a few per cent.
    assert np.ptp(found.radius) < 0.1 * found.radius.mean()
