"""Messages of odometry to increments."""

import math

import numpy as np
import pytest

from logpose.formats.events import Odometry
from logpose.pipelines.geometry.motion import Increment
from logpose.pipelines.odometry.reader import OdometryReader

S = 1_000_000_000


def twist(t, v, w=0.0):
    return Odometry(stamp=round(t * S), linear=np.array([v, 0.0, 0.0]), angular=np.array([0.0, 0.0, w]))


def posed(t, x, y, yaw, v=None):
    q = np.array([0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)])
    speed = None if v is None else np.array([v, 0.0, 0.0])
    return Odometry(
        stamp=round(t * S), position=np.array([x, y, 0.0]), orientation=q, linear=speed,
        angular=None if v is None else np.zeros(3),
    )  # fmt: skip


def total(reader, events):
    whole = Increment()
    for event in events:
        whole = whole.then(reader.read(event) if isinstance(event, Odometry) else reader.until(round(event * S)))
    return whole


def test_first_message_moves_nothing():
    assert OdometryReader().read(twist(5.0, 1.0)) == Increment()


def test_twists_take_the_mean_of_both_ends():
    assert total(OdometryReader(), [twist(0, 1.0), twist(0.5, 2.0), twist(1.0, 2.0)]).dx == pytest.approx(1.75)


def test_extrapolation_to_an_image_is_taken_off_afterwards():
    asked = total(OdometryReader(), [posed(0, 0, 0, 0), posed(0.1, 0.1, 0, 0), 0.15, 0.17, posed(0.2, 0.2, 0.01, 0)])
    assert (asked.dx, asked.dy) == pytest.approx((0.2, 0.01), abs=1e-12)
    assert asked.dt == pytest.approx(0.2)


def test_poses_are_exact_in_any_frame():
    u = total(OdometryReader(), [posed(0, 3, 4, 1.0), posed(0.1, 3 + math.cos(1.0), 4 + math.sin(1.0), 1.2)])
    assert (u.dx, u.dy, u.dtheta) == pytest.approx((1.0, 0.0, 0.2), abs=1e-12)


def test_the_other_half_can_be_asked_for():
    events = [posed(0, 0, 0, 0, v=2.0), posed(0.5, 0.9, 0, 0, v=2.0)]
    assert total(OdometryReader("auto"), events).dx == pytest.approx(0.9)
    assert total(OdometryReader("twist"), events).dx == pytest.approx(1.0)


def test_duplicate_stamps_move_nothing():
    assert total(OdometryReader(), [twist(0, 1.0), twist(0, 1.0), twist(0.5, 1.0), twist(0.5, 1.0)]).dx == 0.5


def test_a_gap_is_told_once_and_marked():
    reader = OdometryReader()
    u = total(reader, [twist(0, 1.0), twist(0.1, 1.0), twist(2.6, 1.0)])
    assert list(reader.gaps) == [(2_600_000_000, 2.5)]
    assert u.gap == pytest.approx(2.5)


def test_images_in_a_gap_do_not_drive_on_for_ever():
    u = total(OdometryReader(), [twist(0, 1.0), twist(0.1, 1.0), 0.6, 1.1, 1.6, 20.0])
    assert u.dx == pytest.approx(1.1)
    assert u.gap == pytest.approx(18.9, abs=1e-6)


@pytest.mark.parametrize(
    ("half", "event", "message"),
    [
        (
            "auto",
            Odometry(stamp=0, linear=np.array([np.nan, 0, 0]), angular=np.zeros(3)),
            "odometry linear is not finite: [nan, 0, 0]. Repair or cut the log there.",
        ),
        (
            "auto",
            Odometry(stamp=0, position=np.array([0, np.inf, 0]), orientation=np.array([0, 0, 0, 1.0])),
            "odometry position is not finite: [0, inf, 0]. Repair or cut the log there.",
        ),
        (
            "pose",
            Odometry(stamp=0, position=np.zeros(3), orientation=np.zeros(4)),
            "odometry has no pose. Set odometry_from to twist.",
        ),
        ("twist", Odometry(stamp=0), "odometry has no twist. Set odometry_from to pose."),
    ],
)
def test_bad_odometry_names_the_field(half, event, message):
    with pytest.raises(ValueError) as caught:
        OdometryReader(half).read(event)
    assert str(caught.value) == message


def test_auto_waits_for_a_pose_and_drives_by_twists_until_then():
    reader = OdometryReader()
    asked = total(reader, [twist(0, 1.0), twist(0.1, 1.0), posed(0.2, 5.0, 0, 0, v=1.0), posed(0.3, 5.3, 0, 0, v=1.0)])
    assert reader.odometry_from == "pose"
    assert (asked.dx, reader.count, reader.skipped) == (pytest.approx(0.2 + 0.3), 4, 0)


def test_auto_takes_ten_messages_without_pose_for_a_log_of_twists():
    reader = OdometryReader()
    total(reader, [twist(0.1 * k, 1.0) for k in range(9)])
    assert reader.odometry_from == "auto"
    asked = total(reader, [twist(0.9, 1.0), posed(1.0, 70.0, 0, 0, v=1.0)])
    assert (reader.odometry_from, asked.dx) == ("twist", pytest.approx(0.2))


@pytest.mark.parametrize("half", ["auto", "pose"])
def test_a_message_without_pose_among_poses_is_skipped(half):
    reader = OdometryReader(half)
    zero = Odometry(stamp=round(0.2 * S), position=np.zeros(3), orientation=np.zeros(4), linear=np.ones(3))
    asked = total(reader, [posed(0, 0, 0, 0), posed(0.1, 0.1, 0, 0), zero, 0.25, posed(0.3, 0.4, 0, 0)])
    assert (asked.dx, asked.dt) == (pytest.approx(0.4), pytest.approx(0.3))
    assert (reader.count, reader.skipped, list(reader.jumps)) == (3, 1, [])


def test_a_jump_is_told_once_and_not_extrapolated():
    reader = OdometryReader()
    total(reader, [posed(0, 0, 0, 0), posed(0.05, 0.05, 0, 0), posed(0.1, 50.05, 0, 0.3), posed(0.15, 50.1, 0, 0.3)])
    assert list(reader.jumps) == [(100_000_000, pytest.approx(50.0), pytest.approx(0.3), pytest.approx(0.05))]
    spun = OdometryReader()
    total(spun, [posed(0, 0, 0, 0), posed(0.05, 0, 0, 0), posed(0.1, 0, 0, 3.0)])
    assert [jump.radians for jump in spun.jumps] == [pytest.approx(3.0)]
    assert spun.twist == (0.0, 0.0, 0.0)


def test_a_jump_is_measured_against_its_bounds():
    drives = {9.9: 0, 10.1: 1}
    for speed, n in drives.items():
        reader = OdometryReader()
        total(reader, [posed(0, 0, 0, 0), posed(1.0, speed, 0, 0)])
        assert len(reader.jumps) == n, f"{speed} m/s"
    near = OdometryReader()
    total(near, [posed(0, 0, 0, 0), posed(1e-6, 0.05, 0, 0.05), posed(1e-6, 0.3, 0, 0.05)])
    assert [jump.seconds for jump in near.jumps] == [0.0]
    assert near.twist == pytest.approx((5e4, 0.0, 5e4))


def test_odometry_that_goes_back_is_refused():
    reader = OdometryReader()
    reader.read(twist(1.0, 1.0))
    with pytest.raises(ValueError) as caught:
        reader.read(twist(0.5, 1.0))
    assert str(caught.value) == (
        "odometry goes back in time by 0.500000000 s. Sort the log, or drop the messages that come late."
    )
