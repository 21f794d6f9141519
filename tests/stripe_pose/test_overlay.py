"""Edges drawn over an image, and the stage that writes the pictures."""

import cv2
import numpy as np

from logpose.formats.events import Image, MarkSighting
from logpose.pipelines.images.canvas import GREEN, ORANGE
from logpose.pipelines.stripe_pose.overlay import Seen, draw_overlay, words
from logpose.pipelines.stripe_pose.params import WriteMarkOverlaysParams
from logpose.pipelines.stripe_pose.stage import write_mark_overlays

GREY = np.full((60, 200), 90, np.uint8)


def seen(status="ok", lines=((50.0, 0.0, 10.0, 40.0, 0.0),), row=30.0, pose=(0.5, 0.1, 1.25), name="7"):
    return Seen(name, status, np.array(pose), np.array(lines, dtype=float).reshape(-1, 5), row)


def coloured(picture, colour):
    """Rows and columns of the pixels of a hue, however faint."""
    difference = picture.astype(float) - picture.mean(axis=2, keepdims=True)
    direction = (np.array(colour) - np.mean(colour)) / np.std(colour) / np.sqrt(3)
    size = np.linalg.norm(difference, axis=2)
    return np.argwhere((difference @ direction > 0.95 * size) & (size > 20))


def test_an_edge_is_drawn_where_it_was_seen_and_nowhere_else():
    picture = draw_overlay(GREY, [seen()])
    below = coloured(picture, GREEN)
    below = below[below[:, 0] > 15]  # the words stand above
    assert set(below[:, 1]) <= {49, 50, 51}
    assert (below[:, 0].min(), below[:, 0].max()) == (16, 40)
    assert GREY.min() == GREY.max() == 90, "the image itself was drawn on"


def test_a_leaning_edge_passes_its_column_at_the_row():
    picture = draw_overlay(GREY, [seen(lines=[(50.0, 0.5, 10.0, 50.0, 0.0)], row=30.0)])
    found = coloured(picture, GREEN)
    assert abs(np.mean(found[found[:, 0] == 30][:, 1]) - 50) < 1
    assert abs(np.mean(found[found[:, 0] == 50][:, 1]) - 60) < 1


def test_what_is_not_sure_has_another_colour():
    assert len(coloured(draw_overlay(GREY, [seen("ambiguous")]), ORANGE)) > 30
    assert not len(coloured(draw_overlay(GREY, [seen("ambiguous")]), GREEN))


def test_nothing_found_leaves_the_image_as_it_is():
    picture = draw_overlay(GREY, [seen("no_mark", lines=(), name="", pose=(np.nan,) * 3, row=np.nan)])
    assert (picture == 90).all()


def test_edges_far_outside_or_unknown_are_left_out():
    picture = draw_overlay(GREY, [seen(lines=[(1e9, 0, 0, 50, 0), (np.nan, 0, 0, 50, 0), (50, 1e6, 0, 50, 0)])])
    assert not len(coloured(picture, GREEN))


def test_the_words_say_mark_status_and_pose():
    assert words(seen()) == "7: 28.65 deg 0.100 1.250 m"
    assert words(seen("poor_geometry", pose=(np.nan,) * 3)) == "7 poor_geometry"
    assert words(seen("no_mark", name="", pose=(np.nan,) * 3)) == "no_mark"


# ---- the stage ------------------------------------------------------------------------------------------------


def image(stamp, data=None, **changes):
    pixels = np.full((20, 30), 90, np.uint8).ravel() if data is None else data
    sizes = {"encoding": "mono8", "width": 30, "height": 20, "step": 30} | changes
    return Image(stamp=stamp, source="image", data=pixels, **sizes)


def sighting(stamp, u, source="stripe-pose"):
    nothing = {"pose": np.full(3, np.nan), "cov": np.full((3, 3), np.nan), "robot": np.full(3, np.nan)}
    return MarkSighting(
        stamp=stamp, source=source, mark=1, status="ok", attitude=np.zeros(2), robot_cov=np.full((3, 3), np.nan),
        row=10.0, lines=np.array([[u, 0.0, 15.0, 19.0, 0.0]]), members=np.zeros(1, np.int64), **nothing,
    )  # fmt: skip


def run(events, folder, **params):
    forwarded = list(write_mark_overlays(iter(events), WriteMarkOverlaysParams(path=str(folder), **params)))
    assert forwarded == events
    return sorted(path.name for path in folder.glob("*")) if folder.is_dir() else []


def test_all_sightings_of_an_image_stand_in_its_picture(tmp_path):
    events = [
        image(1),
        sighting(1, 5.0),
        sighting(1, 25.0),
        sighting(1, 15.0, "other"),
        image(2),
        image(3),
        sighting(3, 9.0),
    ]
    assert run(events, tmp_path / "o") == ["1.png", "3.png"]
    columns = set(coloured(cv2.imread(str(tmp_path / "o" / "1.png"))[16:], GREEN)[:, 1])
    assert {5, 25} <= columns
    assert 15 not in columns


def test_every_second_image_may_do(tmp_path):
    events = [event for i in range(5) for event in (image(i), sighting(i, 5.0))]
    assert run(events, tmp_path / "o", every=2) == ["0.png", "2.png", "4.png"]


def test_a_damaged_image_has_no_picture(tmp_path):
    cut = image(1, np.zeros(7, np.uint8), encoding="jpeg", width=0, height=0, step=0)
    assert run([cut, sighting(1, 5.0), image(2), sighting(2, 5.0)], tmp_path / "o") == ["2.png"]
