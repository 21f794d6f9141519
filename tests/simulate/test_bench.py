"""The bench of the stripe paper: what is set is what is seen, by formulas that share no code with the renderer."""

import cv2
import numpy as np
import pytest

from logpose.formats.errors import ConfigError
from logpose.formats.events import CameraInfo, Image, Pose, Transform
from logpose.formats.maps.marks import read_marks
from logpose.formats.trajectories.tum import read_tum
from logpose.pipelines.simulate.simulate import simulate
from logpose.pipelines.simulate.world import read_world
from logpose.pipelines.simulate.write import write_simulation

CELLS = [(d, x, a) for d in (0.4, 0.7) for x in (0.0, 0.02) for a in (0.0, 40.0, -30.0)]
EDGES = np.array([-0.06, -0.045, 0.0, 0.015, 0.03, 0.045, 0.06, 0.075])


def pictures(world, seed=0):
    return [e.data.reshape(e.height, e.width) for e in simulate(world, seed) if isinstance(e, Image)]


def bearings(phi, d_x, d_y):
    return (np.cos(phi) * EDGES + d_x) / (np.sin(phi) * EDGES + d_y)


def seen_from(event, world):
    """Return phi, D_x, D_y of a mark at the origin, X axis along x, from a true pose of the carriage."""
    heading = 2 * np.arctan2(event.orientation[2], event.orientation[3])
    mount = world.camera.mount
    c, s = np.cos(heading), np.sin(heading)
    lens = event.position[:2] + np.array([c * mount.x_m - s * mount.y_m, s * mount.x_m + c * mount.y_m])
    azimuth = heading + np.radians(mount.yaw_deg)
    ahead, right = np.array([np.cos(azimuth), np.sin(azimuth)]), np.array([np.sin(azimuth), -np.cos(azimuth)])
    return np.pi / 2 - azimuth, -lens @ right, -lens @ ahead


def test_there_is_one_image_of_each_combination_in_order_with_its_truth(bench):
    world = bench()
    events = list(simulate(world, 0))
    assert [type(e) for e in events] == [Transform, *[CameraInfo, Pose, Image] * 12]
    assert (np.diff([e.stamp for e in events if isinstance(e, Image)]) == 100_000_000).all()
    found = [seen_from(e, world) for e in events if isinstance(e, Pose)]
    expected = [(np.radians(angle), offset, distance) for distance, offset, angle in CELLS]
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_edges_lie_where_the_paper_s_formula_has_them(bench, edge_near):
    world = bench(bench__angles_deg=[0.0, 40.0, -30.0, 65.0])
    checked = 0
    cells = [(d, x, a) for d in (0.4, 0.7) for x in (0.0, 0.02) for a in (0.0, 40.0, -30.0, 65.0)]
    for (distance, offset, angle), image in zip(cells, pictures(world), strict=True):
        expected = 255.5 + 930.909 * bearings(np.radians(angle), offset, distance)
        for row in (191, 140, 230):  # upright edges of a level camera are upright on all rows
            for column in expected[(expected > 8) & (expected < 503)]:
                assert edge_near(image[row], column) == pytest.approx(column, abs=0.02), (distance, offset, angle)
                checked += 1
    assert checked > 300


def test_the_carriage_stands_where_the_specification_has_the_vehicle(bench):
    # papers: mark at 10, 5, -60 deg; lens at 0.25, 0.03 and panned by 15 deg; seen at 20 deg, 0.1, 1.5.
    world = bench(camera__mount={"x_m": 0.25, "y_m": 0.03, "yaw_deg": 15.0})
    x, y, heading = world.carriage(np.radians(20), 0.1, 1.5)
    c, s = np.cos(np.radians(-60)), np.sin(np.radians(-60))
    there = [10 + c * x - s * y, 5 + s * x + c * y, np.degrees(heading) - 60]
    assert there == pytest.approx([8.253760205910, 4.829911603545, -5.0], abs=1e-9)


def test_where_the_camera_sits_on_the_carriage_does_not_change_what_it_sees(bench):
    moved = bench(camera__mount={"x_m": 0.3, "y_m": -0.1, "z_m": 0.4, "yaw_deg": 70.0})
    for one, other in zip(pictures(bench()), pictures(moved), strict=True):
        assert np.abs(one.astype(int) - other).max() <= 1  # a grey level may round the other way


def test_the_phase_is_spread_evenly_over_a_pixel(bench):
    world = bench(bench__repeats=50, bench__phase_px=1.0)
    stops = world.build().motion(7)
    poses = [
        Pose(stamp=0, position=np.array([x, y, 0]), orientation=np.array([0, 0, np.sin(h / 2), np.cos(h / 2)]))
        for x, y, h in stops.pose
    ]
    found = np.array([seen_from(pose, world) for pose in poses]).reshape(12, 50, 3)
    cells = np.array([(np.radians(angle), offset, distance) for distance, offset, angle in CELLS])
    pixels = (found[..., 1] - cells[:, None, 1]) * 930.909 / cells[:, None, 2]
    assert np.abs(pixels).max() <= 0.5
    assert pixels.std() == pytest.approx(1 / np.sqrt(12), rel=3 / np.sqrt(2 * 600))
    assert abs(pixels.mean()) < 3 / np.sqrt(12 * 600)
    np.testing.assert_allclose(found[..., [0, 2]], np.broadcast_to(cells[:, None, [0, 2]], (12, 50, 2)), atol=1e-12)


@pytest.mark.parametrize(("tilt", "roll"), [(5.0, 0.0), (0.0, -4.0), (-3.0, 6.0)])
def test_tilt_and_roll_turn_the_camera_about_its_lens(bench, edge_near, tilt, roll):
    settings = {
        "bench__tilt_deg": tilt,
        "bench__roll_deg": roll,
        "bench__distances_m": [0.5],
        "bench__offsets_m": [0.02],
    }
    world = bench(**settings, camera__mount={"x_m": 0.3, "y_m": -0.1, "z_m": 0.4, "yaw_deg": 70.0})
    matrix = np.array([[930.909, 0, 255.5], [0, 930.909, 191.0], [0, 0, 1]])
    t, r = np.radians([tilt, roll])
    # In the optical frame (right, down, ahead) the axis is raised by a turn about the right, then rolled about itself.
    lift = np.array([[1, 0, 0], [0, np.cos(t), -np.sin(t)], [0, np.sin(t), np.cos(t)]])
    turn = np.array([[np.cos(r), -np.sin(r), 0], [np.sin(r), np.cos(r), 0], [0, 0, 1]])
    for angle, image in zip((0.0, 40.0, -30.0), pictures(world), strict=True):
        phi = np.radians(angle)
        for abscissa in EDGES:
            heights = np.linspace(-0.04, 0.04, 300)
            points = np.column_stack(
                [np.full(300, np.cos(phi) * abscissa + 0.02), -heights, np.full(300, np.sin(phi) * abscissa + 0.5)]
            )
            uv = cv2.projectPoints(points @ lift @ turn, np.zeros(3), np.zeros(3), matrix, np.zeros(5))[0].reshape(
                -1, 2
            )
            u, v = uv.T
            assert v.min() < 250
            row = int(np.clip(np.median(v), 10, 370))
            column = np.interp(-row, -v, u)
            assert edge_near(image[row], column) == pytest.approx(column, abs=0.02)


def test_the_height_of_the_lens_slides_edges_along_themselves(bench, edge_near):
    # The paper's claim of section IV.C: the columns do not change, the rows do.
    level, raised = (pictures(bench(bench__height_m=height)) for height in (0.0, 0.03))
    for one, other in zip(level, raised, strict=True):
        np.testing.assert_array_equal(one[191], other[191])
        assert (one != other).any()


def test_truth_tells_nothing_of_tilt_and_height(bench):
    plain, tilted = (
        [e for e in simulate(bench(**more), 0) if not isinstance(e, Image)]
        for more in ({}, {"bench__tilt_deg": 5.0, "bench__roll_deg": 1.0, "bench__height_m": 0.1})
    )
    for a, b in zip(plain, tilted, strict=True):
        if isinstance(a, Pose):
            np.testing.assert_array_equal(a.position, b.position)
            np.testing.assert_array_equal(a.orientation, b.orientation)
        if isinstance(a, Transform):
            np.testing.assert_array_equal(a.rotation, b.rotation)


def test_a_run_has_a_map_and_a_truth_but_no_waypoints(bench, tmp_path):
    first = write_simulation(bench(), tmp_path / "bench.mcap", 3)
    again = write_simulation(bench(), tmp_path / "again" / "bench.mcap", 3)
    assert [f.name for f in first] == ["bench.mcap", "bench.marks.yaml", "bench.truth.tum"]
    assert [f.read_bytes() for f in first] == [f.read_bytes() for f in again]
    mark = read_marks(first[1]).marks[0]
    assert mark.pose.tolist() == [0, 0, 0]
    assert mark.edges == pytest.approx(EDGES)
    assert len(read_tum(first[2])) == 12


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"bench__distances_m": [0.4, 0.4]}, "bench.distances_m: what is given should name each value once"),
        ({"bench__distances_m": [0.1]}, "at 0.1 m and 40.0 deg the mark reaches beside or behind the lens. Leave that"),
        ({"bench__angles_deg": [90.0]}, "at 0.4 m and 90.0 deg the mark reaches beside or behind the lens. Leave that"),
        ({"bench__offsets_m": []}, "bench.offsets_m: what is given should have at least 1 item, not 0"),
        ({"bench__tilts_deg": 3.0}, "unknown key 'bench.tilts_deg'. Did you mean 'tilt_deg'?"),
    ],
)
def test_what_cannot_be_set_is_refused(bench, settings, message):
    with pytest.raises(ConfigError) as caught:
        bench(**settings)
    assert message in str(caught.value)


def test_the_paper_s_bench_is_the_one_it_prints(root):
    world = read_world(root / "papers" / "stripe" / "bench.world.yaml")
    assert world.camera.fx_px == pytest.approx(16.0 / (8.8 / 512), abs=1e-3)
    assert {-0.06, 0.0, 0.06} < set(world.mark.lines_m)
    assert world.bench.distances_m[0] == 0.3
    assert len(world.build().motion(0).pose) == 13 * 4 * 5
