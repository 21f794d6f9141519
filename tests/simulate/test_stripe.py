"""A robot in a corridor: what its camera sees of a mark, by formulas that share no code with the renderer, and its log."""

import cv2
import numpy as np
import pytest

from logpose.formats.events import Image, Imu, JointState, Odometry, Pose, Transform
from logpose.formats.log import open_log
from logpose.formats.maps.marks import read_marks
from logpose.pipelines.simulate.pose import View, rpy
from logpose.pipelines.simulate.simulate import events_of, simulate
from logpose.pipelines.simulate.world import read_world
from logpose.pipelines.simulate.worlds.corridor import build_corridor
from logpose.pipelines.simulate.write import write_simulation

EDGES = np.array([-0.12, -0.07, -0.02, 0.02, 0.1, 0.16])


@pytest.mark.parametrize(
    "pose",
    [(1.2, 1.4, 0.1), (1.25, 1.75, 0.2), (1.9, 1.0, 0.35), (0.7, 1.5, -0.4), (1.8, 1.5, 0.6)],
    ids=["ahead", "near", "far", "turned left", "turned right"],
)
def test_edges_of_a_mark_lie_where_the_paper_s_formula_has_them(room, edge_near, pose, picture, columns_of):
    world = room()
    row = picture(world, pose)[121]
    expected = columns_of(world, pose, EDGES)
    assert (np.diff(expected) > 6).all(), "a scene that the test can measure"
    found = [edge_near(row, column) for column in expected]
    # A level is rounded to half a grey level of 188: 0.003 px.
    np.testing.assert_allclose(found, expected, atol=0.02)


def test_edges_bend_and_lean_as_opencv_s_camera_has_them(room, edge_near, picture):
    lens = (-0.15, 0.02, 0.001, -0.0005, 0.01)
    world = room(camera__distortion=list(lens), camera__mount__pitch_deg=-4.0, camera__mount__roll_deg=3.0)
    image = picture(world, (1.1, 1.5, 0.2), tilt=(0.02, -0.03))
    view = View(rpy(0.02, -0.03, 0.2), np.array([1.1, 1.5, 0.0])) @ world.eye(0)
    matrix = np.array([[300.0, 0, 158.3], [0, 300.0, 121.2], [0, 0, 1]])
    mark = build_corridor(world.corridor).marks.marks[0]
    along = np.array([np.cos(mark.pose[2]), np.sin(mark.pose[2])])
    heights, leaning, checked = np.linspace(0.82, 0.98, 400), [], 0
    for abscissa in EDGES:
        points = np.column_stack([np.tile(mark.pose[:2] + abscissa * along, (400, 1)), heights])
        uv = cv2.projectPoints(
            (points - view.position) @ view.rotation, np.zeros(3), np.zeros(3), matrix, np.array(lens)
        )
        u, v = uv[0].reshape(-1, 2).T
        leaning.append((u[0] - u[-1]) / (v[0] - v[-1]))
        for row in range(int(np.ceil(v.min())) + 3, int(v.max()) - 3, 9):
            assert edge_near(image[row], (column := np.interp(-row, -v, u))) == pytest.approx(column, abs=0.02)
            checked += 1
    assert checked >= 24
    assert min(map(abs, leaning)) > 0.02, "a scene that leans"


def test_events_come_in_time_order_and_the_truth_is_that_of_the_drive(room):
    world = room(robot__tilt={"sd_deg": 0.5}, imu={}, head={})
    scene = world.build()
    events = list(events_of(scene, 3))
    assert [e.stamp for e in events] == sorted(e.stamp for e in events)
    kinds = {(type(e), e.topic, e.frame_id): None for e in events}
    assert {topic for _, topic, _ in kinds} == {
        "/tf_static",
        "/initialpose",
        "/odom",
        "/imu/data",
        "/joint_states",
        "/camera/camera_info",
        "/camera/image_raw",
        "/ground_truth/pose",
    }
    assert list(kinds)[:3] == [
        (Transform, "/tf_static", "base_link"),
        (Pose, "/initialpose", "map"),
        (Odometry, "/odom", "odom"),
    ]
    assert [e.child_frame_id for e in events if isinstance(e, Transform)] == ["camera_optical_frame", "imu_link"]
    driven = scene.motion(3)
    truth, images = [e for e in events if e.source == "truth"], [e for e in events if isinstance(e, Image)]
    assert [e.stamp for e in truth] == [e.stamp for e in images]
    for event in truth:
        pose, _, _ = driven.at((event.stamp - world.start_stamp_ns) * 1e-9)
        np.testing.assert_allclose(event.position, [*pose[:2], 0.0], atol=1e-12)
        assert event.orientation == pytest.approx([0, 0, np.sin(pose[2] / 2), np.cos(pose[2] / 2)], abs=1e-12)


def test_a_run_is_written_with_its_marks_and_read_back(room, tmp_path):
    world = room(camera__rate_hz=2.0, imu={"rate_hz": 10.0}, head={"rate_hz": 10.0})
    files = write_simulation(world, tmp_path / "run.mcap", 1)
    assert [f.name for f in files] == ["run.mcap", "run.marks.yaml", "run.truth.tum", "run.waypoints.yaml"]
    mark, built = read_marks(files[1]).marks[0], build_corridor(world.corridor).marks.marks[0]
    for name in ("lines", "bars", "pose", "height", "id"):
        np.testing.assert_array_equal(getattr(mark, name), getattr(built, name))
    topics = {"image": "auto", "imu": "/imu/data", "joints": "/joint_states", "truth": "/ground_truth/pose"}
    read, made = list(open_log([files[0]], topics)), list(simulate(world, 1))
    for kind in (Image, Imu, JointState):
        a, b = ([e for e in events if isinstance(e, kind)] for events in (read, made))
        assert [e.stamp for e in a] == [e.stamp for e in b]
        assert len(a) > 3
    joints = [[e for e in events if isinstance(e, JointState)][4] for events in (read, made)]
    assert joints[0].names == ("pan", "tilt")
    np.testing.assert_array_equal(joints[0].positions, joints[1].positions)
    image = next(e for e in read if isinstance(e, Image))
    np.testing.assert_allclose(image.mount.translation, [0.1, 0.05, 0.9])


@pytest.mark.parametrize("suffix", [".mcap", ".bag"])
def test_the_same_seed_gives_the_same_bytes_and_another_one_others(room, tmp_path, suffix):
    world = room(
        camera__rate_hz=2.0,
        camera__encoding="jpeg",
        sensor__read_noise_dn=1.0,
        corridor__clutter__per_m=0.8,
        corridor__light__lamp_pitch_m=2.0,
        corridor__survey_sd_m=0.01,
        imu={},
        head={},
    )
    one, same, other = (
        write_simulation(world, tmp_path / name / f"run{suffix}", seed) for name, seed in (("a", 1), ("b", 1), ("c", 2))
    )
    assert [p.name for p in one][1:3] == ["run.marks.yaml", "run.marks.true.yaml"]
    for a, b in zip(one, same, strict=True):
        assert a.read_bytes() == b.read_bytes(), a.name
    assert one[0].read_bytes() != other[0].read_bytes()
    assert one[1].read_bytes() == other[1].read_bytes(), "the building follows from its own seed"


@pytest.mark.parametrize("name", ["papers/stripe/corridor.world.yaml", "sample_logs/stripe.world.yaml"])
def test_the_corridors_of_the_project_can_be_built_and_driven(root, name):
    world = read_world(root / name)
    scene = world.build()
    assert len(build_corridor(world.corridor).marks) >= 4
    assert scene.motion(0).duration > 20
