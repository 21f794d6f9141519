import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logpose.formats.decode import decoder_for
from logpose.formats.encode import as_message
from logpose.formats.errors import FormatError
from logpose.formats.events import NO_ID, MarkSighting
from logpose.formats.mark_poses import (
    HEADER,
    mark_pose_from_json,
    mark_pose_line,
    mark_pose_to_json,
    read_mark_poses,
    write_mark_poses,
)
from logpose.formats.write_log import create_log

NAN3, NAN33 = np.full(3, np.nan), np.full((3, 3), np.nan)


def sighting(**changes):
    values = {
        "stamp": 5,
        "source": "mark-poses",
        "frame_id": "map",
        "mark": 7,
        "status": "ok",
        "pose": np.array([0.5, -0.25, 1.5]),
        "cov": np.diag([1.0, 2.0, 3.0]),
        "attitude": np.array([0.125, -0.5]),
        "robot": np.array([2.0, 3.0, -1.0]),
        "robot_cov": np.diag([4.0, 5.0, 6.0]),
        "row": 239.5,
        "lines": np.array([[100.25, 0.5, 10.0, 200.0, -0.0625], [110.0, 0.25, 12.0, 190.0, np.nan]]),
        "members": np.array([0, NO_ID], dtype=np.int64),
    }
    return MarkSighting(**values | changes)


NOTHING = sighting(
    mark=NO_ID, status="no_mark", pose=NAN3, cov=NAN33, attitude=np.full(2, np.nan), robot=NAN3, robot_cov=NAN33,
    row=float("nan"), lines=np.empty((0, 5)), members=np.empty(0, dtype=np.int64),
)  # fmt: skip


def assert_same(a, b):
    for name in ("stamp", "source", "frame_id", "mark", "status"):
        assert getattr(a, name) == getattr(b, name)
    for name in ("pose", "cov", "attitude", "robot", "robot_cov", "row", "lines", "members"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)


@st.composite
def sightings(draw):
    number = st.floats(-1e9, 1e9)

    def numbers(*shape):
        size = int(np.prod(shape))
        return np.array(draw(st.lists(number, min_size=size, max_size=size))).reshape(shape)

    def covariance():
        root = np.array(draw(st.lists(st.floats(-3, 3), min_size=9, max_size=9))).reshape(3, 3)
        product = root @ root.T
        return np.triu(product) + np.triu(product, 1).T  # to the bit: a product may round its halves differently

    n = draw(st.integers(0, 5))
    has_pose = draw(st.booleans())
    has_robot = has_pose and draw(st.booleans())
    lines = numbers(n, 5)
    lines[:, 4] = np.where(has_pose, lines[:, 4], np.nan)
    return sighting(
        stamp=draw(st.integers(-(2**63) + 1, 2**63 - 1)),
        mark=draw(st.integers(0, 2**63 - 1) | st.just(NO_ID)),
        frame_id=draw(st.sampled_from(["map", "", "my map"])),
        status=draw(st.sampled_from(["ok", "ambiguous", "poor_geometry"])),
        pose=numbers(3) if has_pose else NAN3,
        cov=covariance() if has_pose else NAN33,
        attitude=numbers(2) if draw(st.booleans()) else np.full(2, np.nan),
        robot=numbers(3) if has_robot else NAN3,
        robot_cov=covariance() if has_robot else NAN33,
        row=draw(number),
        lines=lines,
        members=np.array(draw(st.lists(st.integers(0, 20), min_size=n, max_size=n)), dtype=np.int64),
    )


@settings(max_examples=50, deadline=None)
@given(st.lists(sightings(), max_size=4))
def test_the_file_gives_sightings_back_bit_by_bit(tmp_path_factory, events):
    path = tmp_path_factory.mktemp("poses") / "poses.jsonl"
    events.sort(key=lambda event: event.stamp)
    assert write_mark_poses(events, path) == len(events)
    for a, b in zip(read_mark_poses(path), events, strict=True):
        assert_same(a, b)


def test_a_line_has_the_keys_that_are_documented():
    assert HEADER == '{"logpose": "mark-poses/1"}\n'
    assert mark_pose_line(sighting()) == (
        '{"stamp_ns": 5, "frame_id": "map", "mark": 7, "status": "ok", "phi_rad": 0.5, "dx_m": -0.25, "dy_m": 1.5, '
        '"cov": [1.0, 0.0, 0.0, 2.0, 0.0, 3.0], '
        '"robot": {"x_m": 2.0, "y_m": 3.0, "heading_rad": -1.0, "cov": [4.0, 0.0, 0.0, 5.0, 0.0, 6.0]}, '
        '"tilt_rad": 0.125, "roll_rad": -0.5, "row_px": 239.5, "edges": ['
        '{"member": 0, "u_px": 100.25, "slope": 0.5, "first_row": 10.0, "last_row": 200.0, "residual_px": -0.0625}, '
        '{"member": null, "u_px": 110.0, "slope": 0.25, "first_row": 12.0, "last_row": 190.0, "residual_px": null}]}\n'
    )


def test_what_does_not_exist_is_null():
    assert mark_pose_to_json(NOTHING) == {
        "stamp_ns": 5, "frame_id": "map", "mark": None, "status": "no_mark", "phi_rad": None, "dx_m": None,
        "dy_m": None, "cov": None, "robot": None, "tilt_rad": None, "roll_rad": None, "row_px": None, "edges": [],
    }  # fmt: skip
    assert_same(mark_pose_from_json(mark_pose_to_json(NOTHING)), NOTHING)


def test_the_keys_of_the_plan_are_enough_to_be_read(tmp_path):
    path = tmp_path / "p.jsonl"
    path.write_text('\n{"stamp_ns": 0, "mark": 1, "status": "ok", "phi_rad": 0, "dx_m": 0.1, "dy_m": 1, "cov": null}\n')
    (read,) = read_mark_poses(path)
    assert (read.mark, read.status, read.frame_id, len(read.lines)) == (1, "ok", "map", 0)
    np.testing.assert_array_equal(read.pose, [0, 0.1, 1])
    assert np.isnan(read.robot).all()


def test_phi_as_certain_as_it_is_beside_an_uncertain_distance_is_a_covariance():
    # rad^2 beside m^2: the smallest eigenvalue drowns in the rounding of the largest one.
    sd = np.array([1e-9, 1.0, 1e3])
    correlation = np.array([[1, 0.999999, -0.99], [0.999999, 1, -0.99], [-0.99, -0.99, 1.0]])
    event = sighting(cov=correlation * np.outer(sd, sd))
    np.testing.assert_array_equal(mark_pose_from_json(mark_pose_to_json(event)).cov, event.cov)


def test_a_log_holds_the_line_as_a_string(tmp_path):
    from logpose.formats.containers.container import Channel
    from logpose.formats.encode import Encoder

    kind, fields = as_message(sighting())
    encoder = Encoder("ros2")
    message = decoder_for(Channel(1, "/m", kind, "cdr", encoder.definition(kind)[0], "ros2msg"))(
        encoder.encode(kind, fields)
    )
    assert kind == "std_msgs/msg/String"
    assert_same(mark_pose_from_json(json.loads(message.data)), sighting())
    with create_log(tmp_path / "a.mcap") as log:
        log.write(sighting(topic="/stripe-pose/mark_poses"))
    with create_log(tmp_path / "a.bag") as log:
        log.write(sighting(topic="/stripe-pose/mark_poses"))


def broken(**changes):
    return json.dumps(mark_pose_to_json(sighting()) | changes)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"logpose": "mark-poses/2"}', "{p}:1: the file is 'mark-poses/2', not 'mark-poses/1'. Convert it first."),
        (
            '{"logpose": "sightings/1"}',
            "{p}:1: the file is 'sightings/1', not 'mark-poses/1'. Convert it first.",
        ),
        ("{", "{p}:1: is no JSON (Expecting property name enclosed in double quotes). Correct or remove the line."),
        (
            '{"stamp_ns": 0, "status": "ok", "phi_rad": NaN}',
            "{p}:1: is no JSON (NaN is not allowed, missing numbers are null). Correct or remove the line.",
        ),
        ("[]", "{p}:1: is list, not an object. Write one JSON object per line."),
        ('{"status": "ok"}', "{p}:1: stamp_ns is None. It must be integer nanoseconds."),
        ('{"stamp_ns": 1.5, "status": "ok"}', "{p}:1: stamp_ns is 1.5. It must be integer nanoseconds."),
        ('{"stamp_ns": 0}', "{p}:1: status is None. It must be a string."),
        (broken(frame_id=None), "{p}:1: frame_id is None. It must be a string."),
        (broken(mark="a"), "{p}:1: mark is 'a'. It must be null or an integer from 0."),
        (broken(mark=-1), "{p}:1: mark is -1. It must be null or an integer from 0."),
        (broken(phi_rad="x"), "{p}:1: phi_rad is 'x', not a number. Correct or remove the line."),
        (broken(dx_m=10**400), "{p}:1: dx_m is not finite. Correct or remove the line."),
        (broken(cov=[1, 2]), "{p}:1: cov is [1, 2]. It must be null or the upper triangle, 6 numbers."),
        (
            broken(cov=[1, 2, 0, 1, 0, 1]),
            "{p}:1: cov [1, 2, 0, 1, 0, 1] is no covariance. No eigenvalue may be negative.",
        ),
        (
            broken(cov=[-1, 0, 0, 1, 0, 1]),
            "{p}:1: cov [-1, 0, 0, 1, 0, 1] is no covariance. No eigenvalue may be negative.",
        ),
        (broken(robot=3), "{p}:1: robot is 3. It must be null or {{x_m, y_m, heading_rad, cov}}."),
        (broken(robot={"x_m": "a"}), "{p}:1: robot: x_m is 'a', not a number. Correct or remove the line."),
        (broken(edges={}), "{p}:1: edges is {{}}. It must be a list."),
        (broken(edges=[1]), "{p}:1: edges[0] is no object. Write one object per edge."),
        (
            broken(edges=[{"member": True}]),
            "{p}:1: edges[0]: member is True. It must be null or an integer from 0.",
        ),
        (
            broken(stamp_ns=6) + "\n" + broken(),
            "{p}:2: stamp_ns 5 comes after 6. Sort the lines by time.",
        ),
    ],
)
def test_a_wrong_line_is_explained(tmp_path, text, message):
    path = tmp_path / "poses.jsonl"
    path.write_text(text + "\n")
    with pytest.raises(FormatError) as caught:
        list(read_mark_poses(path))
    assert str(caught.value) == message.format(p=path)


def test_an_empty_file_holds_nothing(tmp_path):
    path = tmp_path / "poses.jsonl"
    path.write_text("")
    assert list(read_mark_poses(path)) == []
