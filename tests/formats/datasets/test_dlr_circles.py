import numpy as np
import pytest

from logpose.formats.datasets.dlr_circles import convert_dlr_circles
from logpose.formats.errors import FormatError
from logpose.formats.events import NO_ID, Odometry, Pose, Sightings
from logpose.formats.log import open_log
from logpose.formats.maps.landmarks import read_landmarks
from logpose.formats.trajectories.tum import read_tum

ROLES = dict.fromkeys(("odometry", "sightings", "true_sightings", "truth", "initial_pose"), "auto")
COV3 = "1e-4 0 1e-4 0 0 1e-4"
CIRCLES = np.array([[1.0, 1.0], [2.0, -1.0], [3.0, 1.5], [4.0, -0.5]])


def write_circles(path, *, noise=0.0, n=12):
    """A straight drive of 0.3 m steps with a slight left turn, in the axes of the file: X right, Y back, clockwise."""
    rng = np.random.default_rng(5)
    lines, pose = ["# comment", ""], np.zeros(3)
    for k in range(n):
        step = np.array([0.3, 0.0, 0.05])
        c, s = np.cos(pose[2]), np.sin(pose[2])
        pose = pose + np.array([c * step[0] - s * step[1], s * step[0] + c * step[1], step[2]])
        x, y, turn = step + noise * rng.normal(size=3)
        lines.append(f"STEP image.{k:04d} {-y} {-x} {-turn} {COV3}")
        if k == 5:
            continue
        c, s = np.cos(pose[2]), np.sin(pose[2])
        for i, circle in enumerate(CIRCLES):
            d = circle - pose[:2]
            x, y = c * d[0] + s * d[1], -s * d[0] + c * d[1]
            lines.append(f"LANDMARK_C {-y} {-x} 0.9 1e-3 1e-4 4e-3 {-1 if k == 3 and i == 0 else i + 10} 77")
    path.write_text("\n".join(lines) + "\n")
    return pose


@pytest.fixture(scope="module")
def converted(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dlr")
    end = write_circles(folder / "map.circles")
    imported = convert_dlr_circles(folder, folder / "d.mcap")
    return imported, list(open_log([imported.files[0]], ROLES)), end


def of(events, kind, source):
    return [e for e in events if isinstance(e, kind) and e.source == source]


def test_forward_is_x_left_is_y_and_turns_are_counterclockwise(converted):
    _, events, end = converted
    last = of(events, Odometry, "odometry")[-1]
    np.testing.assert_allclose(last.position[:2], end[:2], atol=1e-12)
    assert 2 * np.arctan2(last.orientation[2], last.orientation[3]) == pytest.approx(end[2], abs=1e-12)


def test_map_and_trajectory_of_exact_data_are_exact(converted):
    imported, _, end = converted
    landmarks = read_landmarks(imported.files[1])
    assert landmarks.ids.tolist() == [10, 11, 12, 13]
    np.testing.assert_allclose(landmarks.positions[:, :2], CIRCLES, atol=1e-9)
    truth = read_tum(imported.files[2])
    np.testing.assert_allclose(truth.positions[-1, :2], end[:2], atol=1e-9)


def test_least_squares_is_nearer_than_the_odometry(tmp_path):
    end = write_circles(tmp_path / "map.circles", noise=0.01, n=60)
    imported = convert_dlr_circles(tmp_path / "map.circles", tmp_path / "d.mcap")
    truth = read_tum(imported.files[2])
    odometry = list(open_log([imported.files[0]], {"odometry": "auto"}))
    drift = np.linalg.norm(odometry[-1].position[:2] - end[:2])
    assert np.linalg.norm(truth.positions[-1, :2] - end[:2]) < drift / 3
    # The first pose fixes the frame, so the error of the first steps turns everything. What the sightings fix, the place
    # of the circles as seen from the last pose, is exact up to their sigma of 3 to 6 cm.
    q = truth.orientations[-1]
    heading = 2 * np.arctan2(q[2], q[3])
    circles = read_landmarks(imported.files[1]).positions[:, :2]
    assert (
        np.abs(seen_from(truth.positions[-1, :2], heading, circles) - seen_from(end[:2], end[2], CIRCLES)).max() < 0.03
    )


def seen_from(position, heading, points):
    c, s = np.cos(heading), np.sin(heading)
    return (points - position) @ np.array([[c, -s], [s, c]])


def test_every_step_has_odometry_and_sightings_of_the_same_stamp(converted):
    _, events, _ = converted
    odometry, blind = of(events, Odometry, "odometry"), of(events, Sightings, "sightings")
    assert [e.stamp for e in odometry] == [k * 10**9 for k in range(1, 14)]
    assert [e.stamp for e in blind] == [e.stamp for e in odometry[1:]]
    assert [len(e.ids) for e in blind] == [4, 4, 4, 4, 4, 0, 4, 4, 4, 4, 4, 4]
    order = [type(e) for e in events if e.stamp == 2 * 10**9]
    assert order.index(Odometry) < order.index(Sightings)


def test_ids_are_only_in_the_true_sightings(converted):
    imported, events, _ = converted
    assert all((e.ids == NO_ID).all() for e in of(events, Sightings, "sightings"))
    known = of(events, Sightings, "true_sightings")
    assert known[0].ids.tolist() == [10, 11, 12, 13]  # of several ids the first
    assert known[3].ids.tolist() == [NO_ID, 11, 12, 13]
    assert imported.counts["circles seen without an id"] == 1


def test_covariances_turn_with_the_axes_and_quality_is_the_score(converted):
    event = of(converted[1], Sightings, "sightings")[0]
    np.testing.assert_allclose(event.cov[0], [[4e-3, 1e-4], [1e-4, 1e-3]])
    np.testing.assert_array_equal(event.score, 0.9)


def test_the_start_pose_is_the_origin(converted):
    (start,) = of(converted[1], Pose, "initial_pose")
    assert start.stamp == 10**9
    np.testing.assert_array_equal(start.position, 0)
    np.testing.assert_array_equal(start.orientation, [0, 0, 0, 1])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", ": has no steps. Name a .circles file."),
        ("LANDMARK_C 0 0 1 1 0 1 3\n", ":1: a circle before the first STEP. Name the file as published."),
        ("STEP a 1 2\n", ":1: 'STEP' with 4 columns is neither a STEP nor a LANDMARK_C. Name a .circles file."),
        (f"STEP a 0 0 nan {COV3}\n", ":1: a value is 'nan'. Every value must be finite; remove the line."),
        (f"STEP a 0 0 0 {COV3}\n", ": no circle has an id, so there is no reference. Name the file with ids."),
        (
            f"STEP a 0 0 0 {COV3}\nLANDMARK_C 0 0 1 1 0 1 x\n",
            ":2: id 'x' is no integer. Name the file as published.",
        ),
        (
            "STEP a 0 0 0 0 0 0 0 0 0\nLANDMARK_C 0 0 1 1 0 1 3\n",
            ": the covariance of a step is not positive definite. Name the file as published.",
        ),
    ],
)
def test_a_wrong_file_is_explained(tmp_path, text, message):
    path = tmp_path / "a.circles"
    path.write_text(text)
    with pytest.raises(FormatError) as caught:
        convert_dlr_circles(path, tmp_path / "d.mcap")
    assert str(caught.value) == f"{path}{message}"


def test_a_folder_without_the_file_is_explained(tmp_path):
    with pytest.raises(FormatError, match=r"must hold one .circles file, there is none. Name the file.$"):
        convert_dlr_circles(tmp_path, tmp_path / "d.mcap")


def test_real_sightings_land_on_their_circles(tmp_path, recordings):
    imported = convert_dlr_circles(recordings / "dlr_circles", tmp_path / "d.mcap")
    log, map_path, truth_path = imported.files
    truth, landmarks = read_tum(truth_path), read_landmarks(map_path)
    places = dict(zip(landmarks.ids.tolist(), landmarks.positions[:, :2], strict=True))
    poses = dict(zip(truth.stamps.tolist(), zip(truth.positions, truth.orientations, strict=True), strict=True))
    errors = []
    for event in open_log([log], {"true_sightings": "auto"}):
        position, q = poses[event.stamp]
        h = 2 * np.arctan2(q[2], q[3])
        c, s = np.cos(h), np.sin(h)
        points = position[:2] + event.xy @ np.array([[c, s], [-s, c]])
        errors += [np.linalg.norm(p - places[i]) for p, i in zip(points, event.ids.tolist(), strict=True) if i != NO_ID]
    # The file's sigmas are 4 cm sideways and 4 to 7 cm ahead; a Rayleigh median of those is 1.18 * 4.. = 5 to 7 cm.
    assert np.median(errors) < 0.07
    # One lap of about 250 m (README: 505 m for the whole of twice as many steps).
    assert np.linalg.norm(np.diff(truth.positions, axis=0), axis=1).sum() == pytest.approx(505 / 2, rel=0.1)
