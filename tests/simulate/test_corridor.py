"""The building: where marks hang, what hides them, what the light does, and what is refused."""

import numpy as np
import pytest

from logpose.formats.errors import ConfigError
from logpose.pipelines.simulate.world import parse_world
from logpose.pipelines.simulate.worlds.corridor import build_corridor
from logpose.pipelines.simulate.write import write_simulation

EDGES = np.array([-0.12, -0.07, -0.02, 0.02, 0.1, 0.16])


@pytest.mark.parametrize(
    ("at", "heading"), [((1.4, 2.4), 0.0), ((1.4, 0.0), np.pi), ((4.0, 1.0), -np.pi / 2), ((0.0, 1.0), np.pi / 2)]
)
def test_a_mark_points_to_the_right_of_who_looks_at_its_wall(room, at, heading):
    mark = build_corridor(room(corridor__marks__0__at_m=list(at)).corridor).marks.marks[0]
    np.testing.assert_allclose(mark.pose[:2], at, atol=1e-12)
    assert np.cos(mark.pose[2] - heading) == pytest.approx(1.0)
    assert mark.edges == pytest.approx(EDGES)
    assert mark.height == 0.2


def test_the_map_that_is_given_has_the_errors_of_its_survey(room):
    marks = [{"id": i, "lines_m": [-0.05, 0.0, 0.05]} for i in range(40)]
    outline = [[0, 0], [12, 0], [12, 6], [0, 6]]
    errors = {"corridor__survey_sd_m": 0.01, "corridor__survey_sd_deg": 0.5}
    world = room(corridor__marks=marks, corridor__outline_m=outline, **errors)
    given, true = (world.build().maps[end].marks for end in (".marks.yaml", ".marks.true.yaml"))
    off = np.array([a.pose - b.pose for a, b in zip(given, true, strict=True)])
    assert off[:, :2].std() == pytest.approx(0.01, rel=3 / np.sqrt(2 * 80))  # 3 sigma
    assert off[:, 2].std() == pytest.approx(np.radians(0.5), rel=3 / np.sqrt(2 * 40))
    assert [m.id for m in given] == list(range(40))


def test_marks_without_a_place_are_spread_along_the_walls(room):
    marks = [{"id": i, "lines_m": [-0.05, 0.0, 0.05]} for i in range(8)]
    built = build_corridor(room(corridor__marks=marks, corridor__outline_m=[[0, 0], [4, 0], [4, 3], [0, 3]]).corridor)
    # Perimeter 14 m, one every 1.75 m from 0.875 m on, along the outline.
    expected = [(0.875, 0), (2.625, 0), (4, 0.375), (4, 2.125), (3.125, 3), (1.375, 3), (0, 2.625), (0, 0.875)]
    np.testing.assert_allclose([m.pose[:2] for m in built.marks.marks], expected, atol=1e-9)


def test_a_post_hides_what_is_behind_it_from_one_place_and_not_from_another(room, picture, columns_of):
    post = {"at_m": [1.4, 2.0], "size_m": [0.03, 0.03, 2.0], "radiance": 0.3}
    for x, is_hidden in ((1.31, True), (1.6, False)):  # from 1.31 the lens is at x = 1.4
        pose = (x, 1.2, np.radians(10))  # the camera looks straight at the wall y = 2.4
        bare, hidden = room(), room(corridor__blocks=[post])
        column = columns_of(bare, pose, np.array([0.0]))[0]  # in the middle bar
        before, after = (picture(world, pose)[121, round(column)] for world in (bare, hidden))
        assert before == 204  # 0.8 of 255
        assert after in ((76, 77) if is_hidden else (204,))


def test_a_box_hides_the_lower_half_of_a_mark(room, picture, columns_of):
    box = {"at_m": [1.4, 2.2], "size_m": [0.6, 0.2, 0.9], "radiance": 0.5}
    world = room(corridor__blocks=[box])
    pose = (1.4, 1.2, np.radians(10))
    image = picture(world, pose)
    column = round(columns_of(world, pose, np.array([0.0]))[0])
    assert image[110, column] == 204, "above the height of the lens the bar is seen"
    assert image[125, column] == 128, "below it the box"


def test_a_wall_around_the_corner_is_hidden(room, picture):
    outline = [[0, 0], [4, 0], [4, 5], [2.5, 5], [2.5, 2.4], [0, 2.4]]
    mark = {"id": 1, "at_m": [3.2, 5.0], "lines_m": [-0.3, 0.0, 0.3], "bar_m": 0.2, "dark": 0.0, "bright": 1.0}
    world = room(corridor__outline_m=outline, corridor__marks=[mark], corridor__wall=0.4, camera__mount__yaw_deg=0.0)
    for place, is_seen in (((3.3, 1.0), True), ((1.0, 1.0), False)):
        image = picture(world, (*place, np.arctan2(5.0 - place[1], 3.2 - place[0])))
        assert (image == 255).sum() > 500 if is_seen else image.max() < 130, place


def test_light_falls_off_along_the_wall_and_away_from_the_lamps(room, picture):
    mark = {"id": 1, "at_m": [3.7, 0.0], "lines_m": [-0.05, 0.0, 0.05]}
    pose = (2.0, 1.2, np.radians(10))

    def wall(**light):
        world = room(corridor__marks=[mark], corridor__light=light, corridor__wall=0.4)
        return picture(world, pose).astype(float)

    even = wall(ambient=1.0, lamp_pitch_m=0.0)
    assert np.median(even) == pytest.approx(102, abs=1)
    sloped = wall(ambient=1.0, lamp_pitch_m=0.0, slope_per_m=[0.2, 0.0])
    ratio = (sloped / even).mean(axis=0)
    # The camera looks along y from x = 2.0 - 0.05: 1.1 m to the wall, 300 px, so a column is 1.1 / 300 m.
    x = 2.0 + 0.1 * np.cos(pose[2]) - 0.05 * np.sin(pose[2]) + (np.arange(320) - 158.3) * (2.4 - 1.2 - 0.067) / 300
    np.testing.assert_allclose(ratio, 1 + 0.2 * (x - 2.0), atol=0.01)
    lamps = wall(ambient=0.5, lamp_pitch_m=4.0)  # one lamp, in the middle of the ceiling
    assert lamps[:80, 130:190].mean() > 1.1 * lamps[160:, 130:190].mean()
    assert lamps[:40, 130:190].mean() > 1.05 * lamps[:40, 260:].mean()


def test_clutter_leaves_the_marks_free_and_stays_on_its_wall(room):
    marks = [{"id": i, "lines_m": [-0.05, 0.0, 0.05]} for i in range(6)]
    settings = {"corridor__marks": marks, "corridor__outline_m": [[0, 0], [14, 0], [14, 3], [0, 3]]}
    bare = build_corridor(room(**settings).corridor)
    full = build_corridor(room(**settings, corridor__clutter={"per_m": 1.0, "clearance_m": 0.1}).corridor)
    np.testing.assert_array_equal([m.pose for m in full.marks.marks], [m.pose for m in bare.marks.marks])
    n = 0
    for wall, empty in zip(full.patches[:4], bare.patches[:4], strict=True):
        hung = list(empty.drawing.shapes)
        things = list(wall.drawing.shapes)[: len(wall.drawing.shapes) - len(hung)]
        n += len(things)
        for thing in things:
            left, right = thing.x - thing.length / 2, thing.x + thing.length / 2
            assert left > 0.049
            assert right < wall.size[0] - 0.049
            assert all(right + 0.099 < s.x - s.length / 2 or left - 0.099 > s.x + s.length / 2 for s in hung)
    assert n > 100


@pytest.mark.parametrize(
    ("kind", "least"), [("fence", 14), ("blinds", 14), ("radiator", 20), ("shelf", 20), ("door", 2), ("poster", 2)]
)
def test_clutter_has_the_upright_edges_of_its_kind(room, kind, least, picture):
    mark = {"id": 1, "at_m": [3.7, 0.0], "lines_m": [-0.05, 0.0, 0.05]}
    world = room(corridor__marks=[mark], corridor__clutter={"per_m": 3.0, "kinds": [kind]}, camera__fx_px=120.0)
    row = picture(world, (2.0, 1.2, np.radians(10)))[121].astype(int)
    assert (np.abs(np.diff(row)) > 15).sum() >= least


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "-0.02, 0.1]",
            "0.1, 0.1]",
            "w.yaml:22: corridor.marks.0: lines_m must increase. List the rising edges from left to right.",
        ),
        (
            "[0.05, 0.04, 0.06]",
            "[0.05, 0.04]",
            "w.yaml:22: corridor.marks.0: bar_m has 2 widths for 3 lines. Give one each, or one.",
        ),
        (
            "[0.05, 0.04, 0.06]",
            "0.2",
            "w.yaml:22: corridor.marks.0: bar_m reaches the next line. Make the bars narrower.",
        ),
        (
            "[0.05, 0.04, 0.06]",
            "0",
            "w.yaml:22: corridor.marks.0: bar_m must be above 0. Give the width of the bright bars.",
        ),
        (
            "-0.12, -0.02, 0.1]",
            "0, 0.1]",
            "w.yaml:22: corridor.marks.0.lines_m: what is given should have at least 3 items, not 2 "
            "(abscissae of the rising edges, left to right as seen [m]). Correct it.",
        ),
        ("id: 4, ", "", "w.yaml:22: corridor.marks.0.id is missing (number of the mark in the map). Add it."),
        (
            "  marks: [",
            "  marks: [{id: 4, lines_m: [0, 0.1, 0.2]}, ",
            "w.yaml:19: corridor: marks: id 4 stands twice. Give each mark its own.",
        ),
        (
            "  clutter:",
            "  blocks: [{at_m: [1, 1], size_m: [1, 0, 1]}]\n  clutter:",
            "w.yaml:23: corridor.blocks.0: size_m must be above 0. Give length, width and height.",
        ),
        (
            "  height_m: 2.5",
            "  height_m: 0.5",
            "w.yaml:1: camera.mount.z_m is 0.9, the ceiling is at 0.5 m. Put the lens between floor and ceiling.",
        ),
        ("x_m: 1.0,", "x_m: 9.0,", "w.yaml:1: waypoint A lies outside corridor.outline_m. Move it."),
        (
            "[0.0, 0.0], [4.0, 0.0]",
            "[0.0, 0.0], [1.4, 0.0], [1.5, 2.2], [1.6, 0.0], [4.0, 0.0]",
            "w.yaml:1: the way from A to B leads through a wall. Add a waypoint.",
        ),
        ("odometry:", "imu: {rate: 3}\nodometry:", "w.yaml:7: unknown key 'imu.rate'. Did you mean 'rate_hz'?"),
    ],
)
def test_a_mistake_in_a_corridor_is_answered_with_its_line_and_the_cure(room_text, old, new, message):
    with pytest.raises(ConfigError) as caught:
        parse_world(room_text.replace(old, new, 1), "w.yaml")
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"corridor__marks__0__at_m": [1.4, 2.0]}, "mark 4 is at 1.4, 2.0, where no wall is"),
        ({"corridor__marks__0__at_m": [0.1, 2.4]}, "mark 4 reaches around a corner or over another mark"),
        ({"corridor__marks__0__z_m": 2.45}, "mark 4 reaches through the floor or the ceiling"),
        (
            {"corridor__marks": [{"id": i, "lines_m": [-1.2, 0.0, 1.2]} for i in range(6)]},
            "there is no room for mark 2",
        ),
        ({"corridor__outline_m": [[0, 2.4], [4, 2.4], [4, 0], [0, 0]]}, "outline_m does not run counter-clockwise"),
        (
            {"corridor__outline_m": [[0, 0], [4, 0], [4, 0.01], [4, 2.4], [0, 2.4]]},
            "two corners of outline_m lie in one place",
        ),
        ({"corridor__outline_m": [[0, 0], [4, 2.4], [4, 0], [0, 2.4], [-1, 1.2]]}, "outline_m crosses itself"),
    ],
)
def test_what_cannot_be_built_is_refused_in_one_line(room, tmp_path, settings, message):
    inside = {"robot__waypoints": [{"name": "A", "x_m": 0.3, "y_m": 1.2}, {"name": "B", "x_m": 0.8, "y_m": 1.2}]}
    with pytest.raises(ConfigError) as caught:
        write_simulation(room(**inside, **settings), tmp_path / "run.mcap", 0)
    assert str(caught.value) == f"{tmp_path / 'run.mcap'}: not simulated, {message}. Change the world."
    assert list(tmp_path.iterdir()) == []
