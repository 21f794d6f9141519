import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from logpose.formats.errors import ConfigError
from logpose.formats.events import Image, MarkSighting, Notice, Odometry, Pose, Summary
from logpose.formats.trajectories.trajectory import read_trajectory
from logpose.pipelines.estimation.kalman import chi_square
from logpose.pipelines.evaluate.evaluation import EvaluateParams
from logpose.pipelines.evaluate.stage import evaluate
from logpose.pipelines.fuse.params import FuseParams
from logpose.pipelines.fuse.stage import fuse_poses
from logpose.pipelines.geometry.se2 import compose
from logpose.pipelines.write import WriteTrajectoryParams, write_trajectory

S = 1_000_000_000
START = {"initial_pose": "0,0,0"}


def test_everything_is_forwarded_in_order_and_each_image_has_one_pose(sim, marks):
    picture = Image(stamp=5 * S // 10, source="image", encoding="mono8", data=np.zeros(4, np.uint8))
    events = sorted([sim.pose(0, (0, 0, 0), "initial_pose"), *sim.log(), picture], key=lambda e: e.stamp)
    out = sim.run(events, marks)
    assert [e for e in out if e in events] == events
    assert [e.stamp for e in out] == sorted(e.stamp for e in out)
    assert [p.stamp for p in sim.poses(out)] == [k * S // 10 for k in range(40)]
    assert sim.statuses(out) == ["tracking", "dead-reckoning"] * 20
    assert {p.frame_id for p in sim.poses(out)} == {"map"}
    assert sim.at(out)[:, 0] == pytest.approx(0.04 * np.arange(40), abs=0.005)


def test_a_pose_has_a_covariance_in_the_plane_and_counts(sim, marks):
    last = sim.poses(sim.run(sim.log(3), marks, **START))[-1]
    assert last.covariance.shape == (6, 6)
    assert np.diag(last.covariance)[2:5] == pytest.approx([1e-6] * 3)
    assert np.linalg.eigvalsh(last.covariance)[0] > 0
    assert last.info == {"status": "tracking", "n_seen": 1, "n_matched": 1}


def test_without_a_start_pose_it_begins_at_the_first_mark_that_is_sure(sim, marks):
    unsure = [sim.nothing_seen(0), sim.sighting(S // 10, 10, (9, 9, 9), status="unverified")]
    first = sim.sighting(S // 5, 10, (0.3, 0.1, 0.2), np.diag([1e-6, 4e-6, 9e-6]))
    out = sim.run([sim.odometry(0, (0, 0, 0)), *unsure, first], marks, map_sigma_m=0.01, map_sigma_deg=0.0)
    assert sim.at(out) == pytest.approx(np.array([[0.3, 0.1, 0.2]]))
    assert np.diag(sim.poses(out)[0].covariance)[[0, 1, 5]] == pytest.approx([1.01e-4, 1.04e-4, 9e-6], rel=0.01)
    assert sim.values(out)["n_images"] == 3
    assert sim.values(out)["n_before_start"] == 2


def test_a_logged_start_pose_is_taken_and_a_given_one_wins(sim, marks):
    blind = [e for k in range(3) for e in (sim.odometry(k * S, (k, 0, 0)), sim.nothing_seen(k * S))]
    events = [sim.pose(0, (5.0, 6.0, math.pi / 2), "initial_pose"), *blind]
    assert sim.at(sim.run(events, marks))[-1] == pytest.approx([5.0, 8.0, math.pi / 2], abs=1e-9)
    assert sim.at(sim.run(events, marks, initial_pose="1,2,0"))[-1] == pytest.approx([3.0, 2.0, 0.0], abs=1e-9)


def test_a_second_start_pose_begins_anew_and_says_so(sim, marks):
    again = sim.pose(S, (7.0, 0.0, 0.0), "initial_pose")
    blind = [e for k in range(4) for e in (sim.odometry(k * S // 2, (0, 0, 0)), sim.nothing_seen(k * S // 2))]
    events = sorted([sim.pose(0, (0, 0, 0), "initial_pose"), *blind, again], key=lambda e: e.stamp)
    out = sim.run(events, marks)
    assert sim.codes(out) == ["start-pose-again"]
    assert sim.at(out)[[0, -1], 0] == pytest.approx([0.0, 7.0])


def test_a_time_without_marks_is_bridged_and_its_uncertainty_grows(room, sim):
    drive, path = room(3, seconds=40.0, blind=(10.0, 30.0))
    out = sim.run(drive.events(), path)
    errors, nees, stamps = sim.score(drive, out)
    blind = (stamps > 10.2 * S) & (stamps < 30 * S)
    assert set(np.array(sim.statuses(out))[blind]) == {"dead-reckoning"}
    sigma = np.sqrt([p.covariance[0, 0] + p.covariance[1, 1] for p in sim.poses(out)])
    assert all(a <= b for a, b in pairwise(sigma[blind]))
    assert nees[blind].max() < chi_square(0.9999, 3)
    assert sigma[-1] < 0.5 * sigma[blind][-1]


def test_silence_of_the_images_is_bridged_along_the_odometry(sim, marks):
    events = sim.log(20) + [sim.odometry(2 * S + k * S // 10, (0.8 + 0.04 * k, 0, 0)) for k in range(100)]
    out = sim.run(events, marks, **START)
    bridged = [p for p in sim.poses(out) if p.stamp >= 2 * S]
    assert len(bridged) == pytest.approx(9.9 / 0.5, abs=1)
    assert {p.info["status"] for p in bridged} == {"dead-reckoning"}
    assert bridged[-1].position[0] == pytest.approx(4.7, abs=0.3)
    assert bridged[-1].covariance[0, 0] > bridged[0].covariance[0, 0]
    assert sim.values(out)["n_images"] == 20


def test_a_gap_of_the_odometry_is_said_and_widens_the_covariance(sim, marks):
    events = [e for e in sim.log(60) if not (isinstance(e, Odometry) and S < e.stamp < 3.5 * S)]
    events = sim.changed(events, lambda n, e: [e] if not S < e.stamp < 3.5 * S else [])
    out = sim.run(events, marks, **START)
    assert [e.message for e in out if isinstance(e, Notice)] == [
        "odometry is silent for 2.500 s; the pose is uncertain there."
    ]
    sigma = {p.stamp: math.sqrt(p.covariance[0, 0]) for p in sim.poses(out)}
    # from 1.9 s on (the image before a second of silence is over) 0.3 m/s are unknown, through seven images
    assert sigma[3 * S + 3 * S // 10] == pytest.approx(0.3 * 1.4, rel=0.02)
    assert sim.at(out)[-1, 0] == pytest.approx(59 * 0.04, abs=0.02)


def test_a_jump_of_the_odometry_is_said_and_not_followed(sim, marks):
    events = [
        replace(e, position=e.position + np.array([50.0, 0, 0])) if isinstance(e, Odometry) and e.stamp >= S else e
        for e in sim.log()
    ]
    out = sim.run(events, marks, **START)
    assert [e.message for e in out if isinstance(e, Notice)] == [
        "odometry jumps by 50.040 m and 0.0 deg within 0.100 s at stamp 1000000000 ns; the pose does not follow it and "
        "is uncertain there."
    ]
    assert sim.at(out)[:, 0] == pytest.approx(0.04 * np.arange(40), abs=0.05)


def test_a_start_pose_without_odometry_has_no_effect_and_that_is_said(sim, marks):
    out = sim.run([sim.sighting(0, 10, (1.0, 0.0, 0.0))], marks, initial_pose="3,3,0", smooth=True)
    assert sim.at(out) == pytest.approx(np.array([[1.0, 0.0, 0.0]]), abs=1e-6)
    (notice,) = (e for e in out if isinstance(e, Notice))
    assert notice.message == (
        "there is no odometry, so each image stands alone: the start pose is not used, and there is nothing to smooth."
    )


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
        here = sim.at(sim.run(drive.events(), path, smooth=smooth))
        there = sim.at(sim.run(moved, sim.write_map(moved_marks, tmp_path / "moved.yaml"), smooth=smooth))
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
        made, written = sim.poses(out), read_trajectory(target)
        assert written.stamps.tolist() == [p.stamp for p in made] == [k * S // 5 for k in range(101)]
        if smooth:
            assert out.index(made[0]) > out.index(events[-1])
            assert (
                sim.values([e for e in out if getattr(e, "source", "") == "fuse-poses"])["smoother"]["n_rejected"] == 0
            )
    assert results[True]["matched"] == results[False]["matched"] == 101
    assert results[True]["ate"]["rmse_m"] < results[False]["ate"]["rmse_m"]


def test_the_summary_tells_the_calibration_and_the_errors_of_the_marks(room, sim):
    drive, path = room(0, seconds=30.0)
    for smooth in (False, True):
        told = sim.values(sim.run(drive.events(), path, smooth=smooth))
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
        sim.run(made, marks)
    assert str(caught.value) == message.replace("{map}", marks)


def test_a_log_in_which_no_mark_is_told_apart_has_no_pose_and_says_so(sim, marks):
    for smooth in (False, True):
        out = sim.run([sim.odometry(0, (0, 0, 0)), sim.nothing_seen(0), sim.nothing_seen(S)], marks, smooth=smooth)
        assert sim.codes(out) == ["no-pose"]
        assert sim.poses(out) == []
        assert sim.values(out)["n_before_start"] == 2


def test_what_cannot_be_used_is_refused(sim, marks):
    with pytest.raises(ValueError, match=r"^the sighting of mark 10 is not finite\. Leave it out, or correct it\.$"):
        sim.run([sim.sighting(0, 10, (0, math.nan, 0))], marks)
    with pytest.raises(ValueError, match=r"^sightings go back in time by 0\.500000000 s\. Sort them by stamp\.$"):
        sim.run([sim.nothing_seen(S), sim.nothing_seen(S // 2)], marks)


def test_odometry_without_pose_among_poses_is_skipped_and_said(sim, marks):
    events = [
        replace(e, position=None, orientation=None) if isinstance(e, Odometry) and e.stamp in {S, 2 * S} else e
        for e in sim.log()
    ]
    out = sim.run(events, marks, **START)
    assert sim.codes(out) == ["odometry-without-pose"]
    assert sim.at(out)[-1, 0] == pytest.approx(39 * 0.04, abs=0.01)
