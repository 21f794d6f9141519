"""Which images are shown, and what is kept of them."""

import cv2
import numpy as np
import pytest

from logpose.formats.events import Image
from logpose.pipelines.report.marks.snapshots import (
    CANDIDATES,
    CLOSE_PX,
    WIDE_PX,
    SnapshotKeeper,
    residual_of,
    window_of,
)

PIXELS = np.tile(np.arange(240, dtype=np.uint8), (180, 1))


@pytest.fixture
def seen(marked):
    """Make a sighting with a residual of so many pixels."""

    def at(stamp, left, status="ok", columns=(50.0, 60.0, 75.0, 90.0)):
        event = marked.sighting(stamp, marked.room().marks[0], np.array([0.3, 0.1, 1.2]), status)
        n = len(columns)
        lines = np.column_stack([columns, np.zeros(n), np.full(n, 60.0), np.full(n, 120.0), np.full(n, left)])
        return marked.replaced(event, lines=lines, members=np.arange(n), row=100.0)

    return at


def chosen(marked, sightings, pixels=PIXELS):
    keeper = SnapshotKeeper()
    for event in sightings:
        used = [event] if event.status == "ok" else []
        keeper.take(marked.image(event.stamp, pixels), (event,), used)
    return {snapshot.kind: snapshot for snapshot in keeper.chosen()}


def test_the_worst_and_a_typical_image_are_shown(marked, seen):
    left = np.linspace(0.01, 0.09, 9)
    left[4] = 0.8
    found = chosen(marked, [seen(i, value) for i, value in enumerate(left)])
    assert found["worst"].stamp == 4
    assert residual_of(found["worst"].main) == pytest.approx(0.8)
    assert residual_of(found["typical"].main) == pytest.approx(np.median(left), abs=0.011)
    assert (found["typical"].of, found["worst"].of) == (9, 9)


def test_candidates_of_a_long_log_are_spread_over_it(marked, seen):
    keeper = SnapshotKeeper()
    for i in range(1000):
        event = seen(i, 0.05)
        keeper.take(marked.image(i, PIXELS), (event,), [event])
    stamps = [candidate.view.main.stamp for candidate in keeper._regular]
    assert CANDIDATES // 2 <= len(stamps) <= CANDIDATES
    assert set(np.diff(stamps)) == {128}  # 1000 images in at most 8 equal steps of a power of two


def test_of_images_without_a_pose_the_one_with_most_edges_is_shown(marked, seen):
    few = (50.0, 60.0, 75.0)
    found = chosen(
        marked,
        [seen(1, 0.1, "no_mark", ()), seen(2, 0.1, "poor_geometry"), seen(3, 0.1, "ambiguous", few)],
    )
    assert list(found) == ["refused"]
    assert (found["refused"].stamp, found["refused"].of) == (2, 3)


def test_one_image_is_shown_once(marked, seen):
    assert list(chosen(marked, [seen(1, 0.1)])) == ["typical"]


def test_the_close_up_holds_all_edges_and_the_row(seen):
    left, right, top, bottom = window_of(seen(1, 0.1), 240, 180)
    assert left < 50
    assert right > 91
    assert top < 60
    assert bottom > 121
    assert (left, right, top, bottom) == (40, 101, 56, 125)  # 10 columns and 4 rows more, as far as the image goes


def test_the_close_up_of_a_high_mark_stays_at_its_row(marked, seen):
    event = seen(1, 0.1)
    event = marked.replaced(event, lines=event.lines * [1, 1, 0, 50, 1])  # from row 0 to row 6000
    _, _, top, bottom = window_of(event, 240, 4000)
    assert top < 100 < bottom
    assert bottom - top < 3 * 61


def test_without_edges_the_window_is_the_image(marked):
    assert window_of(marked.sighting(1), 240, 180) == (0, 240, 0, 180)


def test_the_brightness_is_that_of_the_row(marked, seen):
    pixels = PIXELS.copy()
    pixels[:99] = 0
    pixels[102:] = 0
    columns, brightness = chosen(marked, [seen(1, 0.1)], pixels)["typical"].profile
    np.testing.assert_allclose(brightness, columns)


def test_a_row_outside_the_image_has_no_brightness(marked, seen):
    found = chosen(marked, [marked.replaced(seen(1, 0.1), row=-40.0)])["typical"]
    assert found.profile.size == 0


def test_a_large_image_is_made_small(marked, seen):
    pixels = np.zeros((1500, 2000), np.uint8)
    found = chosen(marked, [seen(1, 0.1, columns=(100.0, 900.0, 1900.0))], pixels)["typical"]
    assert found.pixels.shape == (480, WIDE_PX)
    assert (found.width, found.height) == (2000, 1500)
    assert found.close.shape[1] <= CLOSE_PX[0]
    assert found.close.shape[0] <= CLOSE_PX[1]


def test_a_view_into_the_large_image_is_not_kept(marked, seen):
    found = chosen(marked, [seen(1, 0.1)])["typical"]
    assert found.close.base is None
    assert found.pixels.base is None


def test_a_damaged_image_is_not_shown(seen):
    keeper = SnapshotKeeper()
    event = seen(1, 0.1)
    keeper.take(Image(stamp=1, encoding="jpeg", data=np.zeros(9, np.uint8)), (event,), [event])
    assert keeper.chosen() == ()


def test_a_compressed_image_is_shown_as_it_looks(marked, seen):
    keeper, event = SnapshotKeeper(), seen(1, 0.1)
    data = np.frombuffer(cv2.imencode(".png", PIXELS)[1].tobytes(), np.uint8)
    keeper.take(Image(stamp=1, encoding="png", data=data), (event,), [event])
    np.testing.assert_array_equal(keeper.chosen()[0].pixels, PIXELS)
