"""Round trips and errors of the formats that hold trajectories."""

import io
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logpose.formats.errors import ConfigError, FormatError
from logpose.formats.events import Pose
from logpose.formats.products import Trajectory
from logpose.formats.trajectories.euroc import read_euroc, write_euroc
from logpose.formats.trajectories.kitti import read_kitti, write_kitti
from logpose.formats.trajectories.trajectory import read_trajectory
from logpose.formats.trajectories.trajectory_csv import (
    COVARIANCE_COLUMNS,
    CsvWriter,
    read_trajectory_csv,
    write_trajectory_csv,
)
from logpose.formats.trajectories.tum import TumWriter, read_tum, write_tum

LENGTH = st.floats(-1e6, 1e6)


@st.composite
def trajectories(draw, *, full=False):
    n = draw(st.integers(1, 5))
    stamps = sorted(draw(st.lists(st.integers(0, 2**62), min_size=n, max_size=n, unique=True)))
    quaternions = np.array(
        [
            draw(st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: sum(v * v for v in q) > 0.1 and q[3] > 1e-3))
            for _ in range(n)
        ]
    )
    covariances, columns = None, {}
    if full and draw(st.booleans()):
        roots = np.array(draw(st.lists(st.floats(-1, 1), min_size=36 * n, max_size=36 * n))).reshape(n, 6, 6)
        covariances = roots @ np.swapaxes(roots, 1, 2)
        covariances = np.triu(covariances) + np.swapaxes(np.triu(covariances, 1), 1, 2)
    if full:
        word = st.sampled_from(["tracking", "lost", "a,b", 'say "no"', "nan", "1_000"])
        value = st.none() | st.integers(-(2**60), 2**60) | st.floats(allow_nan=False, allow_infinity=False) | word
        columns = {key: draw(st.lists(value, min_size=n, max_size=n)) for key in ("n_seen", "status of it")}
    return Trajectory(
        stamps=np.array(stamps),
        positions=np.array([draw(st.tuples(LENGTH, LENGTH, LENGTH)) for _ in range(n)]),
        orientations=quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True),
        frame_id=draw(st.sampled_from(["map", "odom", "my frame"])),
        covariances=covariances,
        columns=columns,
    )


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("trajectories")


def simple(n=3):
    zero = np.zeros(n)
    return Trajectory(
        stamps=np.arange(1, n + 1) * 100_000_000 + 1_700_000_000_000_000_001,
        positions=np.column_stack([np.arange(n) * 0.1, zero, zero]),
        orientations=np.tile([0.0, 0.0, 0.6, 0.8], (n, 1)),
    )


@settings(max_examples=25, deadline=None)
@given(trajectories())
def test_tum_keeps_stamps_exactly_and_numbers_to_a_nanometre(folder, trajectory):
    path = folder / "t.tum"
    write_tum(trajectory, path)
    back = read_tum(path)
    np.testing.assert_array_equal(back.stamps, trajectory.stamps)
    np.testing.assert_allclose(back.positions, trajectory.positions, atol=0.51e-9, rtol=1e-15)
    np.testing.assert_allclose(back.orientations, trajectory.orientations, atol=1e-8, rtol=0)
    assert back.frame_id == trajectory.frame_id
    first = path.read_bytes()
    write_tum(back, path)
    assert path.read_bytes() == first


@settings(max_examples=25, deadline=None)
@given(trajectories())
def test_euroc_keeps_everything_bit_by_bit(folder, trajectory):
    path = folder / "t.csv"
    write_euroc(trajectory, path)
    back = read_euroc(path)
    np.testing.assert_array_equal(back.stamps, trajectory.stamps)
    np.testing.assert_array_equal(back.positions, trajectory.positions)
    np.testing.assert_allclose(back.orientations, trajectory.orientations, atol=1e-8, rtol=0)


@settings(max_examples=25, deadline=None)
@given(trajectories(full=True))
def test_csv_keeps_everything_bit_by_bit(folder, trajectory):
    path = folder / "t.csv"
    write_trajectory_csv(trajectory, path)
    for back in (read_trajectory_csv(path), read_trajectory(path)):
        np.testing.assert_array_equal(back.stamps, trajectory.stamps)
        np.testing.assert_array_equal(back.positions, trajectory.positions)
        np.testing.assert_allclose(back.orientations, trajectory.orientations, atol=1e-8, rtol=0)
        assert back.frame_id == trajectory.frame_id
        assert back.columns == trajectory.columns
        if trajectory.covariances is None:
            assert back.covariances is None
        else:
            np.testing.assert_array_equal(back.covariances, trajectory.covariances)


@settings(max_examples=25, deadline=None)
@given(trajectories())
def test_kitti_keeps_poses_and_writes_the_stamps_beside_them(folder, trajectory):
    path = folder / "t.kitti"
    write_kitti(trajectory, path)
    back = read_kitti(path)
    np.testing.assert_array_equal(back.stamps, trajectory.stamps)
    np.testing.assert_allclose(back.positions, trajectory.positions, atol=1e-9, rtol=1e-15)
    same = np.abs(np.sum(back.orientations * trajectory.orientations, axis=1))
    np.testing.assert_allclose(same, 1, atol=1e-10)


def test_tum_is_laid_out_as_documented(tmp_path):
    path = tmp_path / "t.tum"
    trajectory = simple(1)
    write_tum(
        Trajectory(stamps=trajectory.stamps, positions=-trajectory.positions, orientations=-trajectory.orientations),
        path,
    )
    assert path.read_text() == "# frame: map\n1700000000.100000001 0.0 0.0 0.0 0.0 0.0 0.6 0.8\n"


def test_tum_stamps_never_pass_through_a_float(tmp_path):
    path = tmp_path / "t.tum"
    path.write_text(
        "1403715529.112143517 0 0 0 0 0 0 1\n"
        "1.403715529112143518e+09 0 0 0 0 0 0 1\n"
        "1403715529.1121435185 0 0 0 0 0 0 1\n"  # half to even
        "1403715530 0 0 0 0 0 0 1\n"
    )
    expected = [1403715529112143517, 1403715529112143518, 1403715529112143518, 1403715530000000000]
    assert read_tum(path, allow_repeats=True).stamps.tolist() == expected


def test_kitti_without_stamps_counts_seconds_and_takes_named_ones(tmp_path):
    path, times = tmp_path / "poses.txt", tmp_path / "stamps.txt"
    path.write_text("1 0 0 1 0 1 0 2 0 0 1 3\n1 0 0 4 0 1 0 5 0 0 1 6\n")
    times.write_text("0.000000e+00\n1.037359e-01\n")
    assert read_trajectory(path).stamps.tolist() == [0, 1_000_000_000]
    assert read_trajectory(f"{path},{times}").stamps.tolist() == [0, 103_735_900]
    times.rename(tmp_path / "times.txt")
    assert read_trajectory(path).stamps.tolist() == [0, 103_735_900]
    (tmp_path / "times.txt").write_text("0\n")
    with pytest.raises(FormatError, match=r"poses.txt:2: there are only 1 stamps in .*times.txt."):
        read_trajectory(path)
    (tmp_path / "times.txt").write_text("0\n1\n2\n")
    with pytest.raises(FormatError, match=r"times.txt: has 3 stamps for the 2 poses of .*poses.txt."):
        read_trajectory(path)


def test_a_rounded_matrix_becomes_the_nearest_rotation(tmp_path):
    path = tmp_path / "poses.txt"
    path.write_text("0.8 -0.6 0 1 0.6 0.8 0 2 0 0 1.001 3\n")
    np.testing.assert_allclose(read_kitti(path).orientations[0], [0, 0, math.sqrt(0.1), math.sqrt(0.9)], atol=1e-15)


GOOD = "1.0 0 0 0 0 0 0 1\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "{p}: has no poses. Name a file with at least one."),
        ("# frame: map\n", "{p}: has no poses. Name a file with at least one."),
        (GOOD + "2.0 0 0 0 0 0 0\n", "{p}:2: has 7 columns, not 8. A TUM line is 't x y z qx qy qz qw'."),
        (GOOD + "2.0 0 nan 0 0 0 0 1\n", "{p}:2: y is 'nan'. Every value must be finite; remove the line."),
        (GOOD + "nan 0 0 0 0 0 0 1\n", "{p}:2: the stamp is 'nan'. Every value must be finite; remove the line."),
        (GOOD + "t 0 0 0 0 0 0 1\n", "{p}:2: the stamp is 't', not a number. Correct or remove the line."),
        (GOOD + "1e999 0 0 0 0 0 0 1\n", "{p}:2: the stamp '1e999' is out of range. Stamps are seconds since 1970."),
        (GOOD + "2.0 0 0 zero 0 0 0 1\n", "{p}:2: z is 'zero', not a number. Correct or remove the line."),
        (
            GOOD + "\n0.5 0 0 0 0 0 0 1\n",
            "{p}:3: the stamp is before that of line 1. Sort the file by time, one pose per stamp.",
        ),
        (GOOD + "2.0 0 0 0 0 0 0 0\n", "{p}:2: the quaternion has length 0, not 1. Check the order of the columns."),
        (
            GOOD + "2.0 0 0 0 1 1 0 0\n",
            "{p}:2: the quaternion has length 1.414, not 1. Check the order of the columns.",
        ),
        ("1 2 3\n", "{p}:1: has 3 columns. A trajectory has 8 (TUM), 12 (KITTI), or commas (EuRoC, trajectory.csv)."),
        ("1 " * 12 + "\n", "{p}:1: the matrix is no rotation (off by 3). Check the order of the columns."),
        ("1,2,3\n", "{p}:1: has 3 columns, not 8 or more. EuRoC is 't,x,y,z,qw,qx,qy,qz'."),
        ("1.5,0,0,0,1,0,0,0\n", "{p}:1: the stamp is '1.5', not integer nanoseconds. Correct the line."),
        ("1,0,0,0,0,0,0,0\n", "{p}:1: the quaternion has length 0, not 1. Check the order of the columns."),
        ("stamp_ns,x_m\n1,2\n", "{p}:1: column 'y_m' is missing. The columns begin stamp_ns,x_m,y_m,z_m,qx,qy,qz,qw."),
        ("stamp_ns,x_m,x_m\n", "{p}:1: column 'x_m' stands twice. Remove one."),
        (
            "# logpose: trajectory/2\nstamp_ns,x_m\n",
            "{p}:1: the file is 'trajectory/2', not 'trajectory/1'. Convert it first.",
        ),
        (
            "stamp_ns,x_m,y_m,z_m,qx,qy,qz,qw\n1,0,0,0,0,0,0\n",
            "{p}:2: has 7 columns, the header 8. Correct the line.",
        ),
        ("stamp_ns,x_m,y_m,z_m,qx,qy,qz,qw\n", "{p}: has no poses. Name a file with at least one."),
        (
            "stamp_ns,x_m,y_m,z_m,qx,qy,qz,qw\n1,,0,0,0,0,0,1\n",
            "{p}:2: x_m is '', not a number. Correct or remove the line.",
        ),
        (
            f"stamp_ns,x_m,y_m,z_m,qx,qy,qz,qw,{','.join(COVARIANCE_COLUMNS)}\n1,0,0,0,0,0,0,1,-1{',0' * 20}\n",
            "{p}:2: a variance is negative. Correct or remove the line.",
        ),
    ],
)
def test_a_wrong_line_is_named_with_its_cure(tmp_path, text, message):
    path = tmp_path / "t"
    path.write_text(text)
    with pytest.raises(FormatError) as caught:
        read_trajectory(path)
    assert str(caught.value) == message.format(p=path)


def test_repeated_stamps_are_kept_only_where_they_are_allowed(tmp_path):
    path = tmp_path / "t.tum"
    path.write_text(GOOD + GOOD)
    assert len(read_trajectory(path)) == 2
    expected = r":2: the stamp repeats that of line 1. Sort the file by time, one pose per stamp.$"
    with pytest.raises(FormatError, match=expected):
        read_tum(path)
    with pytest.raises(FormatError, match=expected):
        read_trajectory(path, allow_repeats=False)


def test_a_missing_file_a_folder_and_a_binary_file_are_told_apart(tmp_path):
    with pytest.raises(FormatError, match=r"^nowhere.tum: no such file. Check the path.$"):
        read_trajectory("nowhere.tum")
    with pytest.raises(FormatError, match=r"is a folder. Name a file in it, or a topic of the log: .*:/topic.$"):
        read_trajectory(tmp_path)
    log = tmp_path / "a.bag"
    log.write_bytes(b"#ROSBAG V2.0\n\xff\xfe\x80")
    with pytest.raises(FormatError, match=r"a.bag: is no text file. If it is a log, name a topic: .*a.bag:/topic.$"):
        read_trajectory(log)


def test_standard_input_is_read_by_content(monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO("# frame: odom\n" + GOOD))
    back = read_trajectory("-")
    assert (back.frame_id, back.stamps.tolist()) == ("odom", [1_000_000_000])
    monkeypatch.setattr("sys.stdin", io.StringIO("x\n"))
    with pytest.raises(FormatError, match=r"^<stdin>:1: has 1 columns."):
        read_trajectory("-")


def test_a_topic_of_a_log_is_a_trajectory(tmp_path):
    from logpose.formats.write_log import create_log

    trajectory, path = simple(4), tmp_path / "drive.mcap"
    with create_log(path) as log:
        for stamp, position, q in zip(trajectory.stamps, trajectory.positions, trajectory.orientations, strict=True):
            pose = Pose(stamp=int(stamp), topic="/truth", frame_id="odom", position=position, orientation=q)
            log.write(pose)
    back = read_trajectory(f"{path}:/truth")
    np.testing.assert_array_equal(back.stamps, trajectory.stamps)
    np.testing.assert_array_equal(back.positions, trajectory.positions)
    assert back.frame_id == "odom"
    with pytest.raises(ConfigError, match="'/nothing'"):
        read_trajectory(f"{path}:/nothing")


@pytest.mark.parametrize("write", [write_tum, write_euroc, write_kitti, write_trajectory_csv])
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"positions": np.full((3, 3), np.nan)}, "pose 0: position .* is not finite"),
        ({"orientations": np.zeros((3, 4))}, "pose 0: the quaternion has length 0, not 1"),
        ({"stamps": np.array([1, 3, 2])}, "pose 2: stamp 2 does not follow 3"),
        ({"stamps": np.array([1, 1, 2])}, "pose 1: stamp 1 does not follow 1"),
    ],
)
def test_what_could_not_be_read_back_is_not_written(tmp_path, write, change, message):
    from dataclasses import replace

    path = tmp_path / "t"
    with pytest.raises(ValueError, match=message):
        write(replace(simple(), **change), path)
    assert not path.exists()


def pose(stamp, **changes):
    values = {"position": np.zeros(3), "orientation": np.array([0.0, 0, 0, 1])} | changes
    return Pose(stamp=stamp, frame_id="map", **values)


def test_writers_stream_what_the_functions_write(tmp_path):
    trajectory = simple()
    for writer, write, name in ((TumWriter, write_tum, "t.tum"), (CsvWriter, write_trajectory_csv, "t.csv")):
        stream = io.StringIO()
        out = writer(stream)
        for stamp, position, q in zip(trajectory.stamps, trajectory.positions, trajectory.orientations, strict=True):
            out.write(pose(int(stamp), position=position, orientation=q))
        write(trajectory, tmp_path / name)
        assert stream.getvalue() == (tmp_path / name).read_text()


@pytest.mark.parametrize("writer", [TumWriter, CsvWriter])
def test_writers_leave_out_repeats_count_them_and_refuse_the_past(writer):
    stream = io.StringIO()
    out = writer(stream)
    for stamp in (1, 2, 2, 3):
        out.write(pose(stamp))
    assert out.repeats == 1
    assert sum(not line.startswith(("#", "stamp")) for line in stream.getvalue().splitlines()) == 3
    with pytest.raises(ValueError, match="the stamp 2 is before that of the last pose, 3"):
        out.write(pose(2))
    with pytest.raises(ValueError, match="is not finite"):
        out.write(pose(4, position=np.array([np.nan, 0, 0])))


def test_csv_columns_are_those_of_the_first_pose():
    out = CsvWriter(io.StringIO())
    out.write(pose(1, info={"n_seen": 3}))
    out.write(pose(2, info={}))
    with pytest.raises(ValueError, match="a column 'ess', the first one had not"):
        out.write(pose(3, info={"ess": 1.0}))
    with pytest.raises(ValueError, match="a covariance, the first one had none"):
        out.write(pose(3, covariance=np.eye(6)))
    with pytest.raises(ValueError, match="column 'qx' has the name of a column of the pose"):
        CsvWriter(io.StringIO()).write(pose(1, info={"qx": 3}))


def test_a_covariance_that_is_not_there_is_empty_cells(tmp_path):
    stream = io.StringIO()
    out = CsvWriter(stream)
    out.write(pose(1, covariance=np.eye(6), info={"ess": math.nan}))
    out.write(pose(2))
    path = tmp_path / "t.csv"
    path.write_text(stream.getvalue())
    assert "nan" not in stream.getvalue()
    back = read_trajectory_csv(path)
    np.testing.assert_array_equal(back.covariances[0], np.eye(6))
    assert np.isnan(back.covariances[1]).all()
    assert back.columns["ess"] == [None, None]


@settings(max_examples=60, deadline=None)
@given(st.binary(max_size=200) | st.text("0123456789.,- e#\nna", max_size=200).map(str.encode))
def test_any_bytes_are_a_trajectory_or_a_format_error(folder, data):
    path = folder / "fuzz"
    path.write_bytes(data)
    try:
        read_trajectory(path)
    except FormatError as err:
        assert "\n" not in str(err)  # noqa: PT017
