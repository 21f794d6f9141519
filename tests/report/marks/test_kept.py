"""What is kept of sightings of marks, and what follows from it alone."""

from dataclasses import replace

import numpy as np
import pytest

from logpose.pipelines.report.marks.kept import MarkKeeper, bridged, ids_of, longest_bridged_s

SECOND = 1_000_000_000


@pytest.fixture
def keep(marked):
    """Return what is kept of some events."""

    def findings_of(events, marks=None):
        keeper = MarkKeeper(marks)
        for event in events:
            keeper.take(event)
        return keeper.build()

    return findings_of


@pytest.fixture
def seen(marked):
    """Make a sighting of mark 1 at a time in seconds."""
    mark, pose = marked.room().marks[0], np.array([0.3, 0.1, 1.2])

    def at(seconds, status="ok"):
        if status == "no_mark":
            return marked.sighting(round(seconds * SECOND))
        return marked.sighting(round(seconds * SECOND), mark, pose, status)

    return at


def test_every_number_of_a_sighting_is_kept(keep, seen):
    event = replace(seen(1.0), lines=np.array([[10.0, 0, 0, 9, 0.3], [20.0, 0, 0, 9, -0.4]]), members=np.arange(2))
    found = keep([event])
    assert (found.source, found.stamps.tolist(), found.mark.tolist()) == ("stripe-pose", [SECOND], [1])
    for name in ("pose", "cov", "robot", "robot_cov"):
        np.testing.assert_array_equal(getattr(found, name)[0], getattr(event, name))
    assert found.n_lines.tolist() == [2]
    assert found.residual[0] == pytest.approx(np.sqrt((0.09 + 0.16) / 2))
    assert found.distance[0] == pytest.approx(np.hypot(0.1, 1.2))


def test_a_run_without_sightings_has_no_findings(keep, marked):
    assert keep([]) is None
    assert keep([marked.image(1, np.zeros((4, 4), np.uint8))]) is None


def test_sightings_of_one_stamp_are_one_image(keep, seen):
    found = keep([seen(1.0, "ambiguous"), seen(1.0, "ambiguous"), seen(2.0)])
    assert (len(found), len(found.images), len(found.used_images)) == (3, 2, 1)


@pytest.mark.parametrize(
    ("status", "is_used"),
    [("ok", True), ("unverified", True), ("ambiguous", False), ("poor_geometry", False), ("mirrored_or_back", False)],
)
def test_what_is_sure_or_assumed_is_used_and_nothing_else(keep, seen, status, is_used):
    assert keep([seen(1.0, status)]).is_used.tolist() == [is_used]


def test_a_sighting_without_a_place_is_not_used(keep, seen):
    assert not keep([replace(seen(1.0), robot=np.full(3, np.nan))]).is_used.any()


def test_sightings_of_another_source_are_left_out(keep, seen):
    assert len(keep([seen(1.0), replace(seen(2.0), source="other")])) == 1


def test_ids_are_those_of_the_map_and_those_that_were_seen(keep, seen, marked):
    assert ids_of(keep([seen(1.0), seen(2.0, "no_mark")])) == [1]
    assert ids_of(keep([seen(1.0)], marked.room())) == [1, 2, 3, 4, 7]


def track_of(collect, marked, seconds, source="stripe-pose"):
    return collect([marked.pose(round(t * SECOND), (t, 0.0, 0.0), source) for t in seconds]).primary


def test_odometry_bridges_from_the_last_image_used_to_the_next(collect, keep, seen, marked):
    statuses = ["ok", "ok", "no_mark", "poor_geometry", "no_mark", "ok"]
    found = keep([seen(0.1 * i, status) for i, status in enumerate(statuses)])
    track = track_of(collect, marked, np.arange(6) * 0.1)
    assert found.rests_on_image(track.stamps).tolist() == [True, True, False, False, False, True]
    assert bridged(found, track) == [(SECOND // 10, SECOND // 2)]
    assert longest_bridged_s(found, track) == pytest.approx(0.4)


def test_poses_between_two_used_images_rest_on_them(collect, keep, seen, marked):
    found = keep([seen(0.1 * i) for i in range(6)])
    assert longest_bridged_s(found, track_of(collect, marked, np.arange(26) * 0.02)) == 0.0


def test_what_comes_before_the_first_and_after_the_last_mark_is_bridged_too(collect, keep, seen, marked):
    found = keep([seen(0.1 * i, "ok" if i == 5 else "no_mark") for i in range(11)])
    spans = bridged(found, track_of(collect, marked, np.arange(11) * 0.1))
    assert spans == [(0, SECOND // 2), (SECOND // 2, SECOND)]


def test_another_estimators_poses_are_not_bridged(collect, keep, seen, marked):
    found = keep([seen(0.0), seen(0.1, "no_mark")])
    assert bridged(found, track_of(collect, marked, [0.0, 5.0], "slam-cekf")) == []


def test_images_are_not_kept(marked, seen):
    """640 x 480 bytes each; what is kept is made small, and of a bounded number of images."""
    keeper = MarkKeeper()
    pixels = np.zeros((480, 640), np.uint8)
    for i in range(60):
        keeper.take(marked.image(i * SECOND, pixels.copy()))
        keeper.take(replace(seen(float(i)), row=240.0))
    keeper.build()
    snapshots = keeper._snapshots
    kept = [*snapshots._regular, snapshots._worst]
    assert len(kept) <= 9
    assert keeper._image is None
