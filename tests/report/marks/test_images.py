"""The picture of what was found in a few images."""

import base64
import re
from dataclasses import replace

import cv2
import numpy as np
import pytest

from logpose.pipelines.report.drawing import LIGHT, drawing, to_svg
from logpose.pipelines.report.marks.images import (
    FALLING,
    RISING,
    UNKNOWN,
    draw_images,
    edge_roles,
    images_caption,
    pose_in_words,
    title_of,
)
from logpose.pipelines.report.marks.kept import MarkFindings


def lines_of(axes, role):
    """The x of the lines of a colour, drawn from a first to a last row."""
    return [line.get_xdata() for line in axes.lines if line.get_color() == LIGHT[role] and len(line.get_xdata()) == 2]


@pytest.fixture(scope="module")
def figure(mark_findings):
    with drawing():
        return draw_images(mark_findings)


def test_each_image_is_shown_whole_close_up_and_as_brightness(figure, mark_findings):
    kinds = [snapshot.kind for snapshot in mark_findings.of(MarkFindings).snapshots]
    assert kinds == ["typical", "worst", "refused"]
    assert len(figure.axes) == 3 + 3 + 2  # nothing to show close up in an image without edges
    assert len([axes for axes in figure.axes if axes.images]) == 5


def test_edges_are_drawn_where_they_were_found_in_the_colour_of_their_polarity(figure, mark_findings):
    snapshot = mark_findings.of(MarkFindings).snapshots[0]
    polarity = mark_findings.of(MarkFindings).mark_of(snapshot.main.mark).polarity
    for role, sign in ((RISING, 1), (FALLING, -1)):
        drawn = lines_of(figure.axes[0], role)
        np.testing.assert_allclose([x[0] for x in drawn], snapshot.main.lines[polarity == sign, 0])


def test_the_image_is_drawn_in_its_own_pixels(figure, mark_findings):
    snapshot = mark_findings.of(MarkFindings).snapshots[0]
    whole = figure.axes[0].images[0]
    assert tuple(whole.get_extent()) == (-0.5, snapshot.width - 0.5, snapshot.height - 0.5, -0.5)
    left, right, top, bottom = snapshot.window
    assert tuple(figure.axes[1].images[0].get_extent()) == (left - 0.5, right - 0.5, bottom - 0.5, top - 0.5)


def test_every_edge_of_the_drawn_mark_is_a_step_of_the_brightness(mark_findings):
    for snapshot in mark_findings.of(MarkFindings).snapshots[:2]:
        columns, brightness = snapshot.profile
        at, polarity = snapshot.main.lines[:, 0], mark_findings.of(MarkFindings).mark_of(snapshot.main.mark).polarity
        step = np.interp(at + 2.0, columns, brightness) - np.interp(at - 2.0, columns, brightness)
        assert (step * polarity > 100).all()  # bars are 170 grey levels brighter than the board


def test_the_ids_stand_in_the_image_and_the_pose_above_it(figure, mark_findings):
    snapshot = mark_findings.of(MarkFindings).snapshots[0]
    assert [text.get_text() for text in figure.axes[0].texts] == [str(snapshot.main.mark)]
    words = [text.get_text() for text in figure.texts]
    assert pose_in_words(snapshot.main) in words
    assert f"{title_of(snapshot)}, t = {(snapshot.stamp - mark_findings.start) / 1e9:.2f} s" in words


def test_the_words_hold_the_numbers_with_their_standard_deviations(marked):
    event = marked.sighting(1, marked.room().marks[0], np.array([np.radians(30.0), 0.6, 0.8]))
    event = replace(event, cov=np.diag([np.radians(0.5), 0.003, 0.004]) ** 2, lines=np.zeros((8, 5)))
    # distance 1 m; its variance is (0.6 x 3 mm)^2 + (0.8 x 4 mm)^2 = (3.67 mm)^2
    assert pose_in_words(event) == "mark 1: φ 30.00°±0.50°, 1.000 m±3.7 mm, 8 edges, residual 0.000 px"
    assert pose_in_words(replace(event, status="ambiguous")).endswith(", ambiguous")
    assert pose_in_words(marked.sighting(1)) == "no mark"


def test_edges_of_no_mark_have_a_colour_of_their_own(mark_findings, marked):
    event = marked.sighting(1, marked.room().marks[0], np.array([0.3, 0.1, 1.2]))
    roles = edge_roles(replace(event, members=np.array([0, 1, -1, 3, 4, 5, 6, 99])), mark_findings.of(MarkFindings))
    assert roles == [RISING, FALLING, UNKNOWN, FALLING, RISING, FALLING, RISING, UNKNOWN]
    nowhere = replace(mark_findings.of(MarkFindings), marks=None)
    assert set(edge_roles(event, nowhere)) == {RISING}


def test_candidates_for_one_place_do_not_hide_each_others_ids(marked, collect):
    mark, pose = marked.room().marks[0], np.array([0.3, 0.1, 1.2])
    events = [marked.image(1, np.zeros((360, 480), np.uint8))]
    events += [replace(marked.sighting(1, mark, pose, "ambiguous"), mark=identity) for identity in (1, 2)]
    with drawing():
        figure = draw_images(collect(events))
    heights = [text.get_position()[1] for text in figure.axes[0].texts]
    assert heights[1] > heights[0] + 10  # points; a letter is 11 high


def embedded(text):
    found = re.findall(r"data:image/(\w+);base64,([^\"]+)", text)
    assert {kind for kind, _ in found} == {"jpeg"}
    return [cv2.imdecode(np.frombuffer(base64.b64decode(data), np.uint8), 0) for _, data in found]


def test_the_page_holds_the_images_themselves_upright_and_small(figure, mark_findings):
    with drawing():
        text = to_svg(figure, "images")
    assert len(text) < 300_000
    found = embedded(text)
    wanted = [
        pixels
        for s in mark_findings.of(MarkFindings).snapshots
        for pixels in (s.pixels, *([s.close] if s.is_close else []))
    ]
    for image, pixels in zip(found, wanted, strict=True):
        assert image.shape == pixels.shape
        difference = image.astype(float) - pixels
        assert np.sqrt(np.mean(difference**2)) < 6  # grey levels lost to JPEG; a flipped mark is off by 60
    scales = re.findall(r'<image [^>]*transform="matrix\(([\d.]+) 0 0 ([\d.]+) ', text)
    assert len(scales) == len(found)  # positive: neither turned nor mirrored


def test_the_picture_is_the_same_every_time(figure, mark_findings):
    with drawing():
        assert to_svg(draw_images(mark_findings), "images") == to_svg(figure, "images")


def test_a_run_without_images_has_no_such_picture(marked, collect):
    with drawing():
        assert draw_images(collect([])) is None
        assert draw_images(collect(marked.drive(40, with_images=False))) is None


def test_the_caption_says_what_is_there(mark_findings, collect, marked):
    assert "largest residual" in images_caption(mark_findings)
    only = collect([marked.image(1, np.zeros((9, 9), np.uint8)), marked.sighting(1)])
    assert "largest residual" not in images_caption(only)
    assert "is there a mark in it?" in images_caption(only)
