"""The loop that all stages share which write pictures of images with what was found in them."""

import numpy as np
import pytest

from logpose.formats.events import Image, Odometry, Sightings
from logpose.pipelines.images.overlays import overlays

GREY = np.arange(12, dtype=np.uint8).reshape(3, 4)


def image(stamp, data=GREY):
    return Image(stamp=stamp, topic="/image", encoding="mono8", data=data.ravel(), width=4, height=3, step=4)


def sighting(stamp, source="detector"):
    nothing = np.zeros(0)
    return Sightings(
        stamp=stamp,
        source=source,
        xy=np.zeros((0, 2)),
        cov=np.zeros((0, 2, 2)),
        uv=np.zeros((0, 2)),
        radius=nothing,
        score=nothing,
        ids=nothing.astype(int),
    )


@pytest.fixture
def drawn(tmp_path):
    """Run the loop; returns what was forwarded, the stamps of the pictures, and with how many sightings each was drawn."""

    def run(events, every=1):
        counts = []

        def draw(grey, seen):
            counts.append(len(seen))
            return np.repeat(grey[:, :, None], 3, axis=2)

        passed = list(overlays(iter(events), Sightings, "detector", draw, folder=str(tmp_path / "o"), every=every))
        return passed, sorted(int(path.stem) for path in tmp_path.glob("o/*.png")), counts

    return run


def test_a_picture_has_all_sightings_of_its_image_and_the_last_one_is_written_at_the_end(drawn):
    events = [image(1), sighting(1), sighting(1), Odometry(stamp=2), image(3), sighting(3)]
    passed, stamps, counts = drawn(events)
    assert passed == events
    assert (stamps, counts) == ([1, 3], [2, 1])


def test_images_without_a_record_and_records_of_others_have_no_picture(drawn):
    events = [image(1), image(2), sighting(2, source="another"), sighting(1), image(4), sighting(4)]
    assert drawn(events)[1] == [4]
    assert drawn([sighting(1)])[1] == [4]  # as before: nothing more was written


def test_every_nth_of_the_images_with_a_record_is_drawn(drawn):
    events = [event for i in range(5) for event in (image(i), sighting(i))]
    assert drawn(events, every=2)[1] == [0, 2, 4]


def test_a_damaged_image_has_no_picture_and_stops_nothing(drawn):
    events = [image(1, GREY[:2]), sighting(1), image(2), sighting(2)]
    passed, stamps, _ = drawn(events)
    assert passed == events
    assert stamps == [2]
