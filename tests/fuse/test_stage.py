import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from logpose.formats.errors import ConfigError
from logpose.formats.events import Image, MarkSighting, Notice, Odometry, Pose, Summary
from logpose.formats.trajectory import read_trajectory
from logpose.pipelines.estimation.kalman import chi_square
from logpose.pipelines.evaluate.evaluation import EvaluateParams
from logpose.pipelines.evaluate.stage import evaluate
from logpose.pipelines.fuse.params import FuseParams
from logpose.pipelines.fuse.stage import fuse_poses
from logpose.pipelines.geometry.se2 import compose
from logpose.pipelines.write import WriteTrajectoryParams, write_trajectory

S = 1_000_000_000
PLACES = [(0.0, 2.0, 0.0), (4.0, 2.0, 0.0)]
START = {"initial_pose": "0,0,0"}


@pytest.fixture
def marks(sim, tmp_path):
    return sim.write_map(PLACES, tmp_path / "marks.yaml")


def run(events, path, **params):
    return list(fuse_poses(iter(events), FuseParams(map=path, **params)))


def poses(out):
    return [e for e in out if isinstance(e, Pose) and e.source == "stripe-pose"]


def values(out):
    assert isinstance(out[-1], Summary)
    assert out[-1].source == "fuse-poses"
    return out[-1].values


def codes(out):
    return [e.code for e in out if isinstance(e, Notice)]


def statuses(out):
    return [p.info["status"] for p in poses(out)]


def at(out):
    return np.array([[p.position[0], p.position[1], 2 * math.atan2(*p.orientation[2:])] for p in poses(out)])


def log(sim, n=40, x=lambda t: 0.4 * t, mark=10, every=2):
    """A robot that drives along x at 0.4 m/s and sees a mark in every second image, 10 messages a second."""
    events = []
    for k in range(n):
        stamp, here = k * S // 10, np.array([x(0.1 * k), 0.0, 0.0])
        events.append(sim.odometry(stamp, (0.4 * 0.1 * k, 0.0, 0.0)))
        seen = mark if callable(mark) else lambda _: mark
        is_seen = k % every == 0
        events.append(sim.sighting(stamp, seen(0.1 * k), here) if is_seen else sim.nothing_seen(stamp))
    return events


def changed(events, change):
    """Change sightings of a mark by (number, event) -> events."""
    n, made = 0, []
    for event in events:
        if isinstance(event, MarkSighting) and event.status == "ok":
            made += change(n, event)
            n += 1
        else:
            made.append(event)
    return made


def test_everything_is_forwarded_in_order_and_each_image_has_one_pose(sim, marks):
    picture = Image(stamp=5 * S // 10, source="image", encoding="mono8", data=np.zeros(4, np.uint8))
    events = sorted([sim.pose(0, (0, 0, 0), "initial_pose"), *log(sim), picture], key=lambda e: e.stamp)
    out = run(events, marks)
    assert [e for e in out if e in events] == events
    assert [e.stamp for e in out] == sorted(e.stamp for e in out)
    assert [p.stamp for p in poses(out)] == [k * S // 10 for k in range(40)]
    assert statuses(out) == ["tracking", "dead-reckoning"] * 20
    assert {p.frame_id for p in poses(out)} == {"map"}
    assert at(out)[:, 0] == pytest.approx(0.04 * np.arange(40), abs=0.005)


def test_a_pose_has_a_covariance_in_the_plane_and_counts(sim, marks):
    last = poses(run(log(sim, 3), marks, **START))[-1]
    assert last.covariance.shape == (6, 6)
    assert np.diag(last.covariance)[2:5] == pytest.approx([1e-6] * 3)
    assert np.linalg.eigvalsh(last.covariance)[0] > 0
    assert last.info == {"status": "tracking", "n_seen": 1, "n_matched": 1}


def test_without_a_start_pose_it_begins_at_the_first_mark_that_is_sure(sim, marks):
    unsure = [sim.nothing_seen(0), sim.sighting(S // 10, 10, (9, 9, 9), status="unverified")]
    first = sim.sighting(S // 5, 10, (0.3, 0.1, 0.2), np.diag([1e-6, 4e-6, 9e-6]))
    out = run([sim.odometry(0, (0, 0, 0)), *unsure, first], marks, map_sigma_m=0.01, map_sigma_deg=0.0)
    assert at(out) == pytest.approx(np.array([[0.3, 0.1, 0.2]]))
    assert np.diag(poses(out)[0].covariance)[[0, 1, 5]] == pytest.approx([1.01e-4, 1.04e-4, 9e-6], rel=0.01)
    assert values(out)["n_images"] == 3
    assert values(out)["n_before_start"] == 2


def test_a_logged_start_pose_is_taken_and_a_given_one_wins(sim, marks):
    blind = [e for k in range(3) for e in (sim.odometry(k * S, (k, 0, 0)), sim.nothing_seen(k * S))]
    events = [sim.pose(0, (5.0, 6.0, math.pi / 2), "initial_pose"), *blind]
    assert at(run(events, marks))[-1] == pytest.approx([5.0, 8.0, math.pi / 2], abs=1e-9)
    assert at(run(events, marks, initial_pose="1,2,0"))[-1] == pytest.approx([3.0, 2.0, 0.0], abs=1e-9)


def test_a_second_start_pose_begins_anew_and_says_so(sim, marks):
    again = sim.pose(S, (7.0, 0.0, 0.0), "initial_pose")
    blind = [e for k in range(4) for e in (sim.odometry(k * S // 2, (0, 0, 0)), sim.nothing_seen(k * S // 2))]
    events = sorted([sim.pose(0, (0, 0, 0), "initial_pose"), *blind, again], key=lambda e: e.stamp)
    out = run(events, marks)
    assert codes(out) == ["start-pose-again"]
    assert at(out)[[0, -1], 0] == pytest.approx([0.0, 7.0])


def test_a_false_sighting_is_rejected_and_counted(sim, marks):
    false = (0.3, 0.3, 0.3)
    events = changed(log(sim), lambda n, e: [replace(e, robot=e.robot + false) if n == 10 else e])
    out, clean = run(events, marks, **START), run(log(sim), marks, **START)
    assert poses(out)[20].info == {"status": "dead-reckoning", "n_seen": 1, "n_matched": 0}
    assert values(out)["sightings"]["rejected"] == 1
    assert values(out)["sightings"]["accepted"] == 19
    assert at(out) == pytest.approx(at(clean), abs=0.003)


def ambiguous(sim, event, offset, **changes):
    return replace(event, status="ambiguous", robot=event.robot + offset, **changes)


def test_the_candidate_that_passes_is_taken_if_it_is_the_only_one(sim, marks):
    def two(second):
        return changed(
            log(sim), lambda n, e: [ambiguous(sim, e, 0), ambiguous(sim, e, second, mark=11)] if n > 9 else [e]
        )

    clear, unclear = run(two((2.0, 0.5, 0.1)), marks, **START), run(two((1e-4, 0, 0)), marks, **START)
    assert values(clear)["sightings"]["ambiguous_accepted"] == 10
    assert poses(clear)[-2].info == {"status": "tracking", "n_seen": 1, "n_matched": 1}
    assert at(clear)[-2, 0] == pytest.approx(38 * 0.04, abs=0.002)
    assert values(unclear)["sightings"]["ambiguous_left"] == 10
    assert poses(unclear)[-2].info == {"status": "dead-reckoning", "n_seen": 1, "n_matched": 0}


def test_candidates_beside_one_another_are_two_things(sim, marks):
    def apart(n, event):
        lines = event.lines + np.array([300.0, 0, 0, 0, 0])
        return [ambiguous(sim, event, 0), ambiguous(sim, event, (1e-4, 0, 0), lines=lines)] if n == 10 else [event]

    out = run(changed(log(sim), apart), marks, **START)
    assert poses(out)[20].info == {"status": "tracking", "n_seen": 2, "n_matched": 2}


def test_an_assumed_mark_counts_only_where_the_pose_is_known_well(sim, marks):
    def assumed(offset):
        return changed(
            log(sim), lambda n, e: [replace(e, status="unverified", robot=e.robot + offset)] if n > 9 else [e]
        )

    assert values(run(assumed(0), marks, **START))["sightings"]["unverified_accepted"] == 10
    assert values(run(assumed((0.05, 0.0, 0.0)), marks, **START))["sightings"]["unverified_accepted"] == 0
    vague = run(assumed(0), marks, unverified_sigma_m=1e-3, **START)
    assert values(vague)["sightings"]["unverified_accepted"] == 0
    at_the_start = changed(log(sim), lambda n, e: [replace(e, status="unverified")])
    wide = run(at_the_start, marks, initial_sigma_m=1.0, **START)
    assert values(wide)["sightings"]["unverified_left"] == 20


@pytest.mark.parametrize("status", ["poor_geometry", "mirrored_or_back", "no_mark"])
def test_other_sightings_are_left_out(sim, marks, status):
    out = run(changed(log(sim), lambda n, e: [replace(e, status=status, robot=e.robot + 1.0)]), marks, **START)
    assert set(statuses(out)) == {"dead-reckoning"}
    assert {p.info["n_seen"] for p in poses(out)} == {0}


def test_a_time_without_marks_is_bridged_and_its_uncertainty_grows(room, sim):
    drive, path = room(3, seconds=40.0, blind=(10.0, 30.0))
    out = run(drive.events(), path)
    errors, nees, stamps = sim.score(drive, out)
    blind = (stamps > 10.2 * S) & (stamps < 30 * S)
    assert set(np.array(statuses(out))[blind]) == {"dead-reckoning"}
    sigma = np.sqrt([p.covariance[0, 0] + p.covariance[1, 1] for p in poses(out)])
    assert all(a <= b for a, b in pairwise(sigma[blind]))
    assert nees[blind].max() < chi_square(0.9999, 3)
    assert sigma[-1] < 0.5 * sigma[blind][-1]


def test_silence_of_the_images_is_bridged_along_the_odometry(sim, marks):
    events = log(sim, 20) + [sim.odometry(2 * S + k * S // 10, (0.8 + 0.04 * k, 0, 0)) for k in range(100)]
    out = run(events, marks, **START)
    bridged = [p for p in poses(out) if p.stamp >= 2 * S]
    assert len(bridged) == pytest.approx(9.9 / 0.5, abs=1)
    assert {p.info["status"] for p in bridged} == {"dead-reckoning"}
    assert bridged[-1].position[0] == pytest.approx(4.7, abs=0.3)
    assert bridged[-1].covariance[0, 0] > bridged[0].covariance[0, 0]
    assert values(out)["n_images"] == 20


def test_a_gap_of_the_odometry_is_said_and_widens_the_covariance(sim, marks):
    events = [e for e in log(sim, 60) if not (isinstance(e, Odometry) and S < e.stamp < 3.5 * S)]
    events = changed(events, lambda n, e: [e] if not S < e.stamp < 3.5 * S else [])
    out = run(events, marks, **START)
    assert [e.message for e in out if isinstance(e, Notice)] == [
        "odometry is silent for 2.500 s; the pose is uncertain there."
    ]
    sigma = {p.stamp: math.sqrt(p.covariance[0, 0]) for p in poses(out)}
    # from 1.9 s on (the image before a second of silence is over) 0.3 m/s are unknown, through seven images
    assert sigma[3 * S + 3 * S // 10] == pytest.approx(0.3 * 1.4, rel=0.02)
    assert at(out)[-1, 0] == pytest.approx(59 * 0.04, abs=0.02)


def test_a_jump_of_the_odometry_is_said_and_not_followed(sim, marks):
    events = [
        replace(e, position=e.position + np.array([50.0, 0, 0])) if isinstance(e, Odometry) and e.stamp >= S else e
        for e in log(sim)
    ]
    out = run(events, marks, **START)
    assert [e.message for e in out if isinstance(e, Notice)] == [
        "odometry jumps by 50.040 m and 0.0 deg within 0.100 s at stamp 1000000000 ns; the pose does not follow it and "
        "is uncertain there."
    ]
    assert at(out)[:, 0] == pytest.approx(0.04 * np.arange(40), abs=0.05)


def test_a_false_start_is_lost_and_begins_anew_where_marks_agree(sim, marks):
    events = log(sim, 60, mark=lambda t: 10 if t < 3.0 else 11)
    out = run(events, marks, initial_pose="1,1,90")
    found = [i for i, status in enumerate(statuses(out)) if status == "tracking"]
    lost = [p for p in poses(out) if p.info["status"] == "lost"]
    assert lost
    assert all(p.covariance[0, 0] >= 1.0 and p.covariance[5, 5] >= 0.25 for p in lost)
    assert found[0] == 30  # all of one mark: only when they have agreed for 3 s, or a second one does
    assert at(out)[found] == pytest.approx(np.array([(0.04 * i, 0, 0) for i in found]), abs=0.02)
    assert values(out)["begun_anew"] == 1


def test_a_second_mark_settles_it_at_once(sim, marks):
    events = log(sim, 30, mark=lambda t: 10 if t < 0.7 else 11)
    out = run(events, marks, initial_pose="1,1,90")
    assert statuses(out).index("tracking") == 8  # the fifth sighting


def test_false_sightings_that_do_not_agree_never_win(sim, marks):
    rng = np.random.default_rng(0)
    events = changed(log(sim, 80), lambda n, e: [replace(e, robot=e.robot + rng.normal(0, 1, 3)) if n > 5 else e])
    out = run(events, marks, **START)
    assert values(out)["begun_anew"] == 0
    assert "lost" not in statuses(out)
    assert at(out)[-1, 0] == pytest.approx(79 * 0.04, abs=0.15)


def test_without_odometry_each_image_with_a_sure_mark_stands_alone(sim, marks):
    far = [(0.0, 0.0, 0.0), (3.0, 1.0, 2.0), (-1.0, 0.0, -3.0)]
    events = []
    for k, place in enumerate(far):
        events += [sim.sighting(k * S, 10, place), sim.nothing_seen(k * S + S // 2)]
    events.append(sim.sighting(9 * S, 11, (8, 8, 1), status="ambiguous"))
    for smooth in (False, True):
        out = run(events, marks, smooth=smooth)
        assert at(out) == pytest.approx(np.array(far), abs=1e-6)
        assert [p.stamp for p in poses(out)] == [0, S, 2 * S]
        assert statuses(out) == ["tracking"] * 3
        assert values(out)["odometry"] is None
        assert codes(out) == ["no-odometry"] * smooth


def test_a_start_pose_without_odometry_has_no_effect_and_that_is_said(sim, marks):
    out = run([sim.sighting(0, 10, (1.0, 0.0, 0.0))], marks, initial_pose="3,3,0", smooth=True)
    assert at(out) == pytest.approx(np.array([[1.0, 0.0, 0.0]]), abs=1e-6)
    (notice,) = (e for e in out if isinstance(e, Notice))
    assert notice.message == (
        "there is no odometry, so each image stands alone: the start pose is not used, and there is nothing to smooth."
    )


def test_a_sighting_that_tells_nothing_of_the_robot_is_left_out(sim, marks):
    """As of a camera on a head whose joints were not logged."""
    nowhere = sim.sighting(S, 10, [np.nan] * 3, np.full((3, 3), np.nan))
    for smooth in (False, True):
        plain, more = (
            run(sorted([*log(sim), *extra], key=lambda e: e.stamp), marks, smooth=smooth) for extra in ([], [nowhere])
        )
        assert at(more)[-1] == pytest.approx(at(plain)[-1])


def test_marks_of_one_image_are_combined_by_their_information(sim, marks):
    a, b = np.array([1.00, 0.0, 0.1]), np.array([1.01, 0.004, 0.102])
    R, Q = np.diag([1e-4, 4e-6, 1e-5]), np.diag([1e-5, 4e-5, 4e-5])
    out = run([sim.sighting(0, 10, a, R), sim.sighting(0, 11, b, Q)], marks, map_sigma_m=0.0, map_sigma_deg=0.0)
    both = np.linalg.inv(np.linalg.inv(R) + np.linalg.inv(Q))
    assert at(out)[0] == pytest.approx(both @ (np.linalg.solve(R, a) + np.linalg.solve(Q, b)), abs=5e-5)
    assert poses(out)[0].covariance[np.ix_([0, 1, 5], [0, 1, 5])] == pytest.approx(both, rel=0.01, abs=5e-8)
    assert poses(out)[0].info["n_matched"] == 2


def test_of_marks_that_disagree_the_larger_group_is_believed(sim, marks, tmp_path):
    three = sim.write_map([*PLACES, (8.0, 2.0, 0.0)], tmp_path / "three.yaml")
    true = [sim.sighting(0, 11, (1.0, 0.0, 0.0)), sim.sighting(0, 12, (1.001, 0.0, 0.0))]
    false = sim.sighting(0, 10, (2.0, 0.0, 0.0), np.diag([1e-8] * 3))  # and the most precise
    out = run([false, *true], three)
    assert at(out)[0, 0] == pytest.approx(1.0, abs=0.002)
    assert values(out)["sightings"]["rejected"] == 1


def test_a_rigid_move_of_the_world_moves_the_trajectory(room, sim, tmp_path):
    drive, path = room(6, seconds=14.0)
    world = np.array([30.0, -20.0, 2.0])
    moved_marks = np.array([compose(world, mark) for mark in drive.surveyed])
    moved = []
    T = np.array([[math.cos(2.0), -math.sin(2.0), 0], [math.sin(2.0), math.cos(2.0), 0], [0, 0, 1]])
    for event in drive.events():
        if isinstance(event, Pose):
            moved.append(sim.pose(event.stamp, compose(world, drive.start), "initial_pose"))
        elif isinstance(event, MarkSighting) and event.status == "ok":
            moved.append(replace(event, robot=compose(world, event.robot), robot_cov=T @ event.robot_cov @ T.T))
        else:
            moved.append(event)
    for smooth in (False, True):
        here = at(run(drive.events(), path, smooth=smooth))
        there = at(run(moved, sim.write_map(moved_marks, tmp_path / "moved.yaml"), smooth=smooth))
        difference = there - compose(world, here)
        difference[:, 2] = np.remainder(difference[:, 2] + np.pi, 2 * np.pi) - np.pi
        assert np.abs(difference).max() < 1e-7


def test_smoothed_poses_follow_the_log_and_writers_and_evaluation_take_them(room, sim, tmp_path):
    drive, path = room(1, seconds=20.0)
    events = []
    for event in drive.events():
        events.append(event)
        if isinstance(event, Odometry):
            events.append(sim.pose(event.stamp, drive.truth[round(event.stamp * 10 / S)], "truth"))
    results = {}
    for smooth in (False, True):
        target = tmp_path / f"{smooth}.tum"
        chain = fuse_poses(iter(events), FuseParams(map=path, smooth=smooth))
        chain = write_trajectory(chain, WriteTrajectoryParams(path=str(target), source="stripe-pose"))
        out = list(evaluate(chain, EvaluateParams(source="stripe-pose", interpolate=True)))
        assert [e for e in out if e in events] == events
        results[smooth] = next(e.values for e in out if isinstance(e, Summary) and e.source == "evaluation")
        made, written = poses(out), read_trajectory(target)
        assert written.stamps.tolist() == [p.stamp for p in made] == [k * S // 5 for k in range(101)]
        if smooth:
            assert out.index(made[0]) > out.index(events[-1])
            assert values([e for e in out if getattr(e, "source", "") == "fuse-poses"])["smoother"]["n_rejected"] == 0
    assert results[True]["matched"] == results[False]["matched"] == 101
    assert results[True]["ate"]["rmse_m"] < results[False]["ate"]["rmse_m"]


def test_the_summary_tells_the_calibration_and_the_errors_of_the_marks(room):
    drive, path = room(0, seconds=30.0)
    for smooth in (False, True):
        told = values(run(drive.events(), path, smooth=smooth))
        assert told["nis_per_dof"] == pytest.approx(1.0, abs=0.24)  # of 300 numbers the mean has a sigma of 0.08
        # map minus truth, as the marks were surveyed; the whole map may lie off by its own mean error
        errors = (drive.surveyed - drive.marks)[[mark["mark"] - 10 for mark in told["marks"]]]
        off = np.array([[m["dx_m"], m["dy_m"], m["dheading_rad"]] for m in told["marks"]]) - errors
        sigma = np.array([[m["dx_m_sigma"], m["dy_m_sigma"], m["dheading_rad_sigma"]] for m in told["marks"]])
        assert np.abs(off / sigma).max() < 4.5
        assert sigma[:, 2].max() < np.radians(0.3)
        assert abs(told["odometry"]["speed_scale_sigma"]) < 0.02


@pytest.mark.parametrize(
    ("events", "message"),
    [
        (
            "none",
            "fuse-poses: no sightings of stripe marks come here. Put stripe-pose before it, and images into the log.",
        ),
        ("unknown", "{map}: has no mark 77, which was seen. Name the map it was found by."),
    ],
)
def test_what_is_missing_is_said(sim, marks, events, message):
    made = {"none": [sim.odometry(0, (0, 0, 0))], "unknown": [sim.sighting(0, 77, (0, 0, 0))]}[events]
    with pytest.raises(ConfigError) as caught:
        run(made, marks)
    assert str(caught.value) == message.replace("{map}", marks)


def test_a_log_in_which_no_mark_is_told_apart_has_no_pose_and_says_so(sim, marks):
    for smooth in (False, True):
        out = run([sim.odometry(0, (0, 0, 0)), sim.nothing_seen(0), sim.nothing_seen(S)], marks, smooth=smooth)
        assert codes(out) == ["no-pose"]
        assert poses(out) == []
        assert values(out)["n_before_start"] == 2


def test_what_cannot_be_used_is_refused(sim, marks):
    with pytest.raises(ValueError, match=r"^the sighting of mark 10 is not finite\. Leave it out, or correct it\.$"):
        run([sim.sighting(0, 10, (0, math.nan, 0))], marks)
    with pytest.raises(ValueError, match=r"^sightings go back in time by 0\.500000000 s\. Sort them by stamp\.$"):
        run([sim.nothing_seen(S), sim.nothing_seen(S // 2)], marks)


def test_odometry_without_pose_among_poses_is_skipped_and_said(sim, marks):
    events = [
        replace(e, position=None, orientation=None) if isinstance(e, Odometry) and e.stamp in {S, 2 * S} else e
        for e in log(sim)
    ]
    out = run(events, marks, **START)
    assert codes(out) == ["odometry-without-pose"]
    assert at(out)[-1, 0] == pytest.approx(39 * 0.04, abs=0.01)


def test_one_mark_against_many_sightings_of_others_is_not_believed(sim, marks):
    def moved(_n, event):
        return [replace(event, robot=sim.then((0.5, 0.3, 0.2), event.robot))] if event.mark == 11 else [event]

    out = run(changed(log(sim, 90, mark=lambda t: 10 if t < 1.0 else 11), moved), marks, **START)
    assert values(out)["begun_anew"] == 0
    assert set(statuses(out)[13:]) == {"lost"}
    assert at(out)[-1] == pytest.approx([89 * 0.04, 0.0, 0.0], abs=0.1)


def test_one_mark_against_a_single_sighting_of_another_is_believed_in_time(sim, marks):
    def lonely(n, event):
        if event.mark == 11:
            return [event]
        return [replace(event, robot=sim.then((0.5, 0.3, 0.2), event.robot))] if n == 0 else []

    out = run(changed(log(sim, 90, mark=lambda t: 10 if t < 1.0 else 11), lonely), marks)
    assert values(out)["begun_anew"] == 1
    tracked = [p.stamp for p in poses(out) if p.info["status"] == "tracking"]
    assert tracked[:2] == [0, 4 * S]  # 3 s after the first sighting that contradicts
    assert at(out)[-1] == pytest.approx([89 * 0.04, 0.0, 0.0], abs=0.02)
