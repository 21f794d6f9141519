"""The building: how many, how far apart, where not, and how well surveyed."""

import numpy as np
import pytest

from logpose.pipelines.simulate.worlds.ceiling import (
    CeilingClutterParams,
    CeilingParams,
    GapParams,
    LandmarkParams,
    build_ceiling,
    distance_to_route,
)

ROUTE = np.array([[5.0, 5.0], [25.0, 5.0], [25.0, 15.0], [5.0, 15.0], [5.0, 5.0]])


def build(seed=1, clutter=None, gaps=(), survey=0.0, **landmarks):
    return build_ceiling(
        CeilingParams(
            height_m=2.7,
            size_m=(30.0, 20.0),
            seed=seed,
            survey_sd_m=survey,
            landmarks=LandmarkParams(**{"count": 60, "near_route": 40, **landmarks}),
            clutter=clutter or CeilingClutterParams(per_m2=0.2),
            gaps=gaps,
        ),
        ROUTE,
    )


def test_there_are_as_many_landmarks_as_asked_on_and_off_the_route():
    ceiling = build()
    far = distance_to_route(ceiling.landmarks[:, :2], ROUTE)
    assert len(ceiling.landmarks) == 60
    assert (far <= 0.9 + 1e-9).sum() == 40
    assert (far >= 1.8).sum() == 20
    assert (ceiling.landmarks[:, 2] == 2.7).all()


def test_landmarks_keep_their_distance():
    xy = build(spacing_m=0.9).landmarks[:, :2]
    apart = np.linalg.norm(xy[:, None] - xy, axis=2) + 10 * np.eye(len(xy))
    assert apart.min() >= 0.9


def test_a_gap_has_no_landmarks():
    gap = GapParams(x_m=(10.0, 16.0), y_m=(3.0, 7.0))
    x, y = build(gaps=(gap,)).landmarks[:, :2].T
    assert not ((x > 10) & (x < 16) & (y > 3) & (y < 7)).any()
    x, y = build(layout="grid", gaps=(gap,)).landmarks[:, :2].T
    assert not ((x > 10) & (x < 16) & (y > 3) & (y < 7)).any()


def test_a_grid_is_regular_and_a_list_is_taken_as_it_is():
    x = np.unique(build(layout="grid", pitch_m=1.5).landmarks[:, 0])
    np.testing.assert_allclose(np.diff(x), 1.5)
    listed = build(layout="listed", at_m=((3.0, 4.0), (7.0, 8.5)))
    np.testing.assert_array_equal(listed.landmarks[:, :2], [[3.0, 4.0], [7.0, 8.5]])


def test_the_map_has_the_error_of_its_survey():
    ceiling = build(survey=0.015, count=400, near_route=0, spacing_m=0.3)
    error = (ceiling.surveyed - ceiling.landmarks)[:, :2].reshape(-1)
    assert error.std() == pytest.approx(0.015, rel=3 / np.sqrt(2 * error.size))  # 3 sigma
    assert abs(error.mean()) < 3 * 0.015 / np.sqrt(error.size)
    assert (ceiling.surveyed[:, 2] == ceiling.landmarks[:, 2]).all()
    exact = build()
    np.testing.assert_array_equal(exact.surveyed, exact.landmarks)


def test_false_lights_look_alike_but_are_not_in_the_map():
    ceiling = build(clutter=CeilingClutterParams(per_m2=0.0, false_lights_per_m2=0.1))
    n = len(ceiling.false_lights)
    assert n == pytest.approx(60, abs=3 * np.sqrt(60))  # 600 m^2
    assert len(ceiling.radii) == len(ceiling.landmarks) + n
    apart = np.linalg.norm(ceiling.false_lights[:, None, :2] - ceiling.landmarks[:, :2], axis=2)
    assert apart.min() >= 0.3


def test_clutter_leaves_the_landmarks_free():
    ceiling = build(clutter=CeilingClutterParams(per_m2=2.0, clearance_m=0.03))
    rounds = {(s.x, s.y) for s in ceiling.patch.drawing.shapes if s.kind == 0}
    others = [s for s in ceiling.patch.drawing.shapes if (s.x, s.y) not in rounds]
    assert len(others) > 300
    for s in others:
        gaps = np.hypot(*(ceiling.landmarks[:, :2] - [s.x, s.y]).T) - ceiling.radii[: len(ceiling.landmarks)]
        assert gaps.min() > s.reach + 0.02


def test_radii_and_brightness_stay_in_their_ranges():
    ceiling = build(radius_m=(0.06, 0.075), lamps=1.0, lamp_radiance=(1.1, 1.8))
    assert ceiling.radii.min() >= 0.06
    assert ceiling.radii.max() <= 0.075
    lamps = [s for s in ceiling.patch.drawing.shapes if s.kind == 0]
    assert len(lamps) == 60
    assert all(1.1 <= s.radiance <= 1.8 for s in lamps)
    assert np.std([s.radiance for s in lamps]) > 0.1
    assert len(ceiling.patch.drawing.glows) == 60


def test_the_building_follows_from_its_seed():
    one, same, other = build(seed=3), build(seed=3), build(seed=4)
    np.testing.assert_array_equal(one.landmarks, same.landmarks)
    assert one.patch.drawing.shapes == same.patch.drawing.shapes
    assert not np.array_equal(one.landmarks, other.landmarks)


def test_clutter_does_not_move_the_landmarks():
    np.testing.assert_array_equal(build().landmarks, build(clutter=CeilingClutterParams(per_m2=1.0)).landmarks)


@pytest.mark.parametrize(
    ("what", "message"),
    [
        ({"count": 500, "near_route": 500}, "no room for 500 landmarks"),
        ({"layout": "listed"}, "needs at_m"),
        ({"layout": "listed", "at_m": ((31.0, 4.0),)}, "outside the ceiling"),
    ],
)
def test_what_cannot_be_built_is_refused(what, message):
    with pytest.raises(ValueError, match=message):
        build(**what)


def test_distance_to_a_route_is_to_its_nearest_leg():
    points = np.array([[15.0, 6.0], [26.0, 4.0], [5.0, 10.0]])
    np.testing.assert_allclose(distance_to_route(points, ROUTE), [1.0, 2**0.5, 0.0])
