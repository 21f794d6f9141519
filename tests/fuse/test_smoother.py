import math
from dataclasses import replace

import numpy as np
import pytest

from logpose.formats.events import MarkSighting, Summary
from logpose.pipelines.estimation.kalman import chi_square
from logpose.pipelines.estimation.losses import SQUARES
from logpose.pipelines.fuse import factors
from logpose.pipelines.fuse.history import History, Sightings, Starts
from logpose.pipelines.fuse.params import FuseParams
from logpose.pipelines.fuse.smoother import smooth_way
from logpose.pipelines.fuse.stage import fuse_poses
from logpose.pipelines.fuse.view import Seen
from logpose.pipelines.geometry.motion import pose_increment
from logpose.pipelines.geometry.se2 import compose

S = 1_000_000_000


def run(events, path, **params):
    return list(fuse_poses(iter(events), FuseParams(map=path, smooth=True, **params)))


def told(out):
    assert isinstance(out[-1], Summary)
    return out[-1].values["smoother"]


def sure(event):
    return isinstance(event, MarkSighting) and event.status == "ok"


def rms(errors):
    return float(np.sqrt(np.mean(np.sum(errors[:, :2] ** 2, axis=1))))


@pytest.mark.parametrize("seed", range(3))
def test_factors_change_as_differences_do(seed):
    rng = np.random.default_rng(seed)
    n, params = 4, FuseParams(map="marks.yaml")
    states, border = rng.normal(0, 0.2, (n, 6)), rng.normal(0, 0.1, 6)
    states[:, 3:] *= 0.1
    u = np.abs(rng.normal(0, 0.05, (n - 1, 7)))
    place = np.arange(n - 1)
    cov = np.tile(np.eye(3), (n - 1, 1, 1))
    seen = Sightings(place, np.zeros(3, int), rng.normal(0, 1, (3, 3)), cov, np.ones(3), np.ones(3, bool))
    made = [
        factors.increments(place, u, cov),
        factors.sightings(seen, rng.normal(0, 2, (3, 2)), np.array([0, 1, 1]), SQUARES),
        factors.starts(Starts(place, rng.normal(0, 1, (3, 3)), cov, np.ones(3, bool)), SQUARES),
        factors.calibration_walk(place, u, params),
        factors.calibration_starts(place, params),
        factors.survey(2, params),
        factors.anywhere(states + 0.1),
    ]
    step = 1e-6
    for factor in made:
        linear = factor.linearise(states, border)
        for shift, part in ((0, linear.by_state), (1, linear.by_next)):
            for j in range(6 if part is not None else 0):
                error = np.zeros((n, 6))
                for k, node in enumerate(factor.at):  # one at a time: neighbours share a state
                    error[:] = 0.0
                    error[node + shift, j] = step
                    ends = [factor.linearise(add(states, sign * error), border).residual[k] for sign in (1, -1)]
                    assert part[k, :, j] == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=3e-4)
        for j in range(6 if linear.by_border is not None else 0):
            e = step * np.eye(6)[j]
            ends = [factor.linearise(states, border + sign * e).residual for sign in (1, -1)]
            whole = np.zeros((len(linear.residual), 3, 6))
            for k, columns in enumerate(factor.columns):
                whole[k][:, columns] = linear.by_border[k]
            assert whole[:, :, j] == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-6)


def add(states, errors):
    return np.concatenate([compose(states[:, :3], errors[:, :3]), states[:, 3:] + errors[:, 3:]], axis=1)


def test_a_smoothed_trajectory_is_nearer_to_the_truth_than_a_filtered_one(room, sim):
    drive, path = room(2, seconds=30.0)
    smoothed, _, _ = sim.score(drive, run(drive.events(), path))
    filtered, _, _ = sim.score(drive, list(fuse_poses(iter(drive.events()), FuseParams(map=path))))
    assert len(smoothed) == len(filtered) == 151
    assert rms(smoothed) < 0.9 * rms(filtered)
    # the way into a corner, where no mark is seen, is known from both its ends
    assert np.abs(smoothed[:, 2]).max() < np.abs(filtered[:, 2]).max()


def test_a_false_start_pose_is_overruled_for_the_poses_before_it_was_found_out(room, sim):
    drive, path = room(1, seconds=20.0)
    good = run(drive.events(has_start=False), path)
    start = sim.pose(0, drive.truth[0] + (2.0, -1.0, 2.0), "initial_pose")
    out = run([start, *drive.events(has_start=False)], path)
    errors, nees, _ = sim.score(drive, out)
    assert sim.at(out) == pytest.approx(sim.at(good), abs=1e-3)
    assert np.hypot(*errors[:5, :2].T).max() < 0.05
    assert nees.max() < chi_square(0.99999, 3)


def test_false_sightings_are_left_out_and_the_others_kept(room, sim):
    drive, path = room(2, seconds=30.0)
    rng = np.random.default_rng(0)
    events, n = [], 0
    for event in drive.events():
        is_false = sure(event) and rng.random() < 0.2
        n += is_false
        events.append(replace(event, robot=event.robot + rng.normal(0, 1, 3)) if is_false else event)
    out = run(events, path)
    errors, _, _ = sim.score(drive, out)
    clean, _, _ = sim.score(drive, run(drive.events(), path))
    assert n > 15
    assert told(out)["n_rejected"] == n
    assert rms(errors) < 1.3 * rms(clean)  # a fifth of the information is gone
    assert all(p.info["n_matched"] <= p.info["n_seen"] for p in sim.poses(out))


def test_a_robot_that_was_carried_is_followed_on_both_sides(room, sim):
    drive, path = room(2, seconds=45.0)
    cut, on = 150, 300  # the messages and images between are gone, and the odometry did not see it
    odometry_then = [sim.seen_from(drive.told[on], told) for told in drive.told[on:]]
    events = [sim.pose(0, drive.start, "initial_pose")]
    truth = {}
    for k in [*range(cut + 1), *range(on, len(drive.truth))]:
        stamp = (k if k <= cut else k - on + cut + 1) * S // 10
        truth[stamp] = drive.truth[k]
        here = drive.told[k] if k <= cut else sim.then(drive.told[cut], odometry_then[k - on])
        events.append(sim.odometry(stamp, here))
        events += [replace(e, stamp=stamp) for e in drive.seen.get(k, [])]
    out = run(events, path)
    distance = np.array([math.hypot(*(truth[p.stamp][:2] - p.position[:2])) for p in sim.poses(out)])
    # when it was carried nobody knows: after the last mark before, and before the first one after
    lost = np.array([p.info["status"] == "lost" for p in sim.poses(out)])
    assert out[-1].values["begun_anew"] == 1
    assert told(out)["n_increments_rejected"] == 1
    assert distance[~lost].max() < 0.05
    assert 0 < lost.sum() < 0.3 * len(lost)
    assert {p.covariance[0, 0] > 1.0 for p, is_lost in zip(sim.poses(out), lost, strict=True) if is_lost} == {True}


def test_a_mark_that_was_moved_does_not_bend_the_way(room, sim):
    drive, path = room(5, seconds=20.0)
    moved = []
    for event in drive.events():
        is_it = sure(event) and event.mark == 12
        moved.append(replace(event, robot=sim.then((0.5, 0.3, 0.2), event.robot)) if is_it else event)
    out = run(moved, path)
    errors, _, _ = sim.score(drive, out)
    n = sum(sure(event) and event.mark == 12 for event in moved)
    assert n > 8
    assert told(out)["n_rejected"] >= n
    assert np.hypot(*errors[:, :2].T).max() < 0.05


class Guess:
    """What a history takes of a filter."""

    def __init__(self, x):
        self.pose, self.calibration = np.array([x, 0.0, 0.0]), np.zeros(3)


METRE = pose_increment(np.array([1.0, 0.0, 0.0]), 1.0)


@pytest.mark.parametrize(("x", "broken"), [(1.15, []), (2.0, [1])])
def test_a_chain_is_cut_where_the_filter_began_anew_and_joined_if_both_ends_fit(x, broken):
    # the start is known to 0.1 m, the metre to 1 cm: 0.15 m are 1.5 sigma, 1 m is 10
    start = np.diag([0.01, 0.01, 1e-4])
    seen = Seen(0, np.array([x, 0.0, 0.0]), np.diag([1e-6, 1e-6, 1e-6]))
    history = History()
    history.begin(Guess(0.0), (np.zeros(3), start))
    history.confirm(Guess(0.0))
    history.step(Guess(1.0), METRE)
    history.see(seen, 1.0, is_taken=False)
    history.correct(Guess(x), [seen])
    params = FuseParams(map="marks.yaml", speed_scale_sigma=1e-4, map_sigma_m=1e-4, map_sigma_deg=0.01)
    way = smooth_way(history, np.array([[x, 2.0]]), params)
    assert way.broken.tolist() == broken
    assert way.is_kept.tolist() == [True]
    assert way.result.states[:, 0] == pytest.approx([0.0 if broken else x - 1.0, x], abs=0.005)


def test_one_image_is_smoothed_to_what_it_says(room, sim, tmp_path):
    marks = sim.write_map([(0.0, 2.0, 0.0)], tmp_path / "one.yaml")
    event = sim.sighting(S, 10, (0.5, 0.2, 0.1))
    for events in ([event], [sim.odometry(0, (0, 0, 0)), event]):
        out = run(events, marks)
        plain = list(fuse_poses(iter(events), FuseParams(map=marks)))
        assert sim.at(out) == pytest.approx(sim.at(plain), abs=1e-9)
        assert sim.poses(out)[0].covariance == pytest.approx(sim.poses(plain)[0].covariance, rel=1e-6, abs=1e-12)


def test_noise_of_zero_is_solved_too(room, sim):
    drive, path = room(2, seconds=10.0)
    names = ["along_per_sqrt_m", "along_per_sqrt_s", "cross_per_sqrt_m", "heading_per_sqrt_rad", "heading_per_sqrt_m"]
    names += ["heading_per_sqrt_s", "scale_walk_per_sqrt_s", "bias_walk_rad_s_per_sqrt_s"]
    out = run(drive.events(), path, **dict.fromkeys(names, 0.0))
    assert told(out)["is_converged"]
    assert all(np.linalg.eigvalsh(p.covariance)[0] > 0 for p in sim.poses(out))


def test_without_noise_and_with_a_true_map_the_truth_comes_out(room, sim):
    exact = {"along_per_sqrt_m": 0.0, "along_per_sqrt_s": 0.0, "cross_per_sqrt_m": 0.0, "heading_per_sqrt_rad": 0.0}
    exact |= {"scale": 0.0, "bias_rad_s": 0.0, "start_sigma": (0.0, 0.0), "noise": (1e-9, 1e-9, 1e-9)}
    exact |= {"heading_per_sqrt_m": 0.0, "heading_per_sqrt_s": 0.0, "survey_m": 0.0, "survey_deg": 0.0}
    drive, path = room(0, seconds=20.0, **exact)
    errors, _, _ = sim.score(drive, run(drive.events(), path))
    assert np.abs(errors).max() < 1e-8


def test_history_goes_back_from_where_it_is_corrected_to_where_it_was_sure():
    history = History()
    history.begin(Guess(0.0))
    for x in (1.0, 2.0):
        history.step(Guess(x), METRE)
    history.confirm(Guess(2.5))
    for x in (3.5, 4.5, 5.5):
        history.step(Guess(x), METRE)
    history.correct(Guess(10.0), [])
    assert history.states[:, 0] == pytest.approx([0.0, 1.0, 2.5, 8.0, 9.0, 10.0])
    assert history.doubted == [3]
    assert history.linked.tolist() == [False, True, True, True, True, True]


def test_a_start_that_nothing_confirmed_is_overruled():
    history = History()
    history.begin(Guess(0.0), (np.zeros(3), np.eye(3)))
    history.step(Guess(1.0), METRE)
    assert history.starts.is_taken.tolist() == [True]
    history.correct(Guess(7.0), [])
    assert history.states[:, 0] == pytest.approx([6.0, 7.0])
    assert history.starts.is_taken.tolist() == [False]
    assert history.doubted == []
