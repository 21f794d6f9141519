"""Lines and circles over an image."""

import numpy as np

from logpose.pipelines.images.canvas import GREEN, LIMIT_PX, circle, ground, is_drawable, line, put_text

GREY = np.full((40, 60), 90, np.uint8)


def changed(picture):
    return np.argwhere((picture != 90).any(axis=2))


def test_the_ground_is_a_copy_in_three_channels():
    picture = ground(GREY)
    picture[0, 0] = 255
    assert picture.shape == (40, 60, 3)
    assert GREY.max() == 90


def test_a_line_stands_where_it_is_to_a_fraction_of_a_pixel():
    for column in (10.0, 10.25, 10.5):
        picture = ground(GREY)
        line(picture, np.array([column, 5.0]), np.array([column, 30.0]), GREEN)
        weight = np.abs(picture[20].astype(float) - 90).sum(axis=1)
        assert abs(np.sum(np.arange(60) * weight) / weight.sum() - column) < 0.15  # the line's own smoothing


def test_a_circle_has_its_radius_and_letters_stand_above_their_place():
    picture = ground(GREY)
    circle(picture, np.array([30.0, 20.0]), 12.0, GREEN)
    reach = np.hypot(*(changed(picture) - (20, 30)).T)
    assert reach.min() > 10.5
    assert reach.max() < 13.5
    picture = ground(GREY)
    put_text(picture, "7", (5, 30), GREEN)
    assert len(changed(picture))
    assert changed(picture)[:, 0].max() <= 31


def test_points_that_are_not_known_or_far_outside_cannot_be_drawn():
    points = np.array([[1.0, 2.0], [np.nan, 2.0], [1.0, LIMIT_PX], [-LIMIT_PX + 1.0, 0.0]])
    assert is_drawable(points).tolist() == [True, False, False, True]
