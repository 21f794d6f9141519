"""Which sightings are believed."""

from dataclasses import replace

import numpy as np
import pytest

S = 1_000_000_000
PLACES = [(0.0, 2.0, 0.0), (4.0, 2.0, 0.0)]
START = {"initial_pose": "0,0,0"}


def test_a_false_sighting_is_rejected_and_counted(sim, marks):
    false = (0.3, 0.3, 0.3)
    events = sim.changed(sim.log(), lambda n, e: [replace(e, robot=e.robot + false) if n == 10 else e])
    out, clean = sim.run(events, marks, **START), sim.run(sim.log(), marks, **START)
    assert sim.poses(out)[20].info == {"status": "dead-reckoning", "n_seen": 1, "n_matched": 0}
    assert sim.values(out)["sightings"]["rejected"] == 1
    assert sim.values(out)["sightings"]["accepted"] == 19
    assert sim.at(out) == pytest.approx(sim.at(clean), abs=0.003)


def ambiguous(event, offset, **changes):
    return replace(event, status="ambiguous", robot=event.robot + offset, **changes)


def test_the_candidate_that_passes_is_taken_if_it_is_the_only_one(sim, marks):
    def two(second):
        return sim.changed(sim.log(), lambda n, e: [ambiguous(e, 0), ambiguous(e, second, mark=11)] if n > 9 else [e])

    clear, unclear = sim.run(two((2.0, 0.5, 0.1)), marks, **START), sim.run(two((1e-4, 0, 0)), marks, **START)
    assert sim.values(clear)["sightings"]["ambiguous_accepted"] == 10
    assert sim.poses(clear)[-2].info == {"status": "tracking", "n_seen": 1, "n_matched": 1}
    assert sim.at(clear)[-2, 0] == pytest.approx(38 * 0.04, abs=0.002)
    assert sim.values(unclear)["sightings"]["ambiguous_left"] == 10
    assert sim.poses(unclear)[-2].info == {"status": "dead-reckoning", "n_seen": 1, "n_matched": 0}


def test_candidates_beside_one_another_are_two_things(sim, marks):
    def apart(n, event):
        lines = event.lines + np.array([300.0, 0, 0, 0, 0])
        return [ambiguous(event, 0), ambiguous(event, (1e-4, 0, 0), lines=lines)] if n == 10 else [event]

    out = sim.run(sim.changed(sim.log(), apart), marks, **START)
    assert sim.poses(out)[20].info == {"status": "tracking", "n_seen": 2, "n_matched": 2}


def test_an_assumed_mark_counts_only_where_the_pose_is_known_well(sim, marks):
    def assumed(offset):
        return sim.changed(
            sim.log(), lambda n, e: [replace(e, status="unverified", robot=e.robot + offset)] if n > 9 else [e]
        )

    assert sim.values(sim.run(assumed(0), marks, **START))["sightings"]["unverified_accepted"] == 10
    assert sim.values(sim.run(assumed((0.05, 0.0, 0.0)), marks, **START))["sightings"]["unverified_accepted"] == 0
    vague = sim.run(assumed(0), marks, unverified_sigma_m=1e-3, **START)
    assert sim.values(vague)["sightings"]["unverified_accepted"] == 0
    at_the_start = sim.changed(sim.log(), lambda n, e: [replace(e, status="unverified")])
    wide = sim.run(at_the_start, marks, initial_sigma_m=1.0, **START)
    assert sim.values(wide)["sightings"]["unverified_left"] == 20


@pytest.mark.parametrize("status", ["poor_geometry", "mirrored_or_back", "no_mark"])
def test_other_sightings_are_left_out(sim, marks, status):
    out = sim.run(sim.changed(sim.log(), lambda n, e: [replace(e, status=status, robot=e.robot + 1.0)]), marks, **START)
    assert set(sim.statuses(out)) == {"dead-reckoning"}
    assert {p.info["n_seen"] for p in sim.poses(out)} == {0}


def test_without_odometry_each_image_with_a_sure_mark_stands_alone(sim, marks):
    far = [(0.0, 0.0, 0.0), (3.0, 1.0, 2.0), (-1.0, 0.0, -3.0)]
    events = []
    for k, place in enumerate(far):
        events += [sim.sighting(k * S, 10, place), sim.nothing_seen(k * S + S // 2)]
    events.append(sim.sighting(9 * S, 11, (8, 8, 1), status="ambiguous"))
    for smooth in (False, True):
        out = sim.run(events, marks, smooth=smooth)
        assert sim.at(out) == pytest.approx(np.array(far), abs=1e-6)
        assert [p.stamp for p in sim.poses(out)] == [0, S, 2 * S]
        assert sim.statuses(out) == ["tracking"] * 3
        assert sim.values(out)["odometry"] is None
        assert sim.codes(out) == ["no-odometry"] * smooth


def test_a_sighting_that_tells_nothing_of_the_robot_is_left_out(sim, marks):
    """As of a camera on a head whose joints were not logged."""
    nowhere = sim.sighting(S, 10, [np.nan] * 3, np.full((3, 3), np.nan))
    for smooth in (False, True):
        plain, more = (
            sim.run(sorted([*sim.log(), *extra], key=lambda e: e.stamp), marks, smooth=smooth)
            for extra in ([], [nowhere])
        )
        assert sim.at(more)[-1] == pytest.approx(sim.at(plain)[-1])


def test_marks_of_one_image_are_combined_by_their_information(sim, marks):
    a, b = np.array([1.00, 0.0, 0.1]), np.array([1.01, 0.004, 0.102])
    R, Q = np.diag([1e-4, 4e-6, 1e-5]), np.diag([1e-5, 4e-5, 4e-5])
    out = sim.run([sim.sighting(0, 10, a, R), sim.sighting(0, 11, b, Q)], marks, map_sigma_m=0.0, map_sigma_deg=0.0)
    both = np.linalg.inv(np.linalg.inv(R) + np.linalg.inv(Q))
    assert sim.at(out)[0] == pytest.approx(both @ (np.linalg.solve(R, a) + np.linalg.solve(Q, b)), abs=5e-5)
    assert sim.poses(out)[0].covariance[np.ix_([0, 1, 5], [0, 1, 5])] == pytest.approx(both, rel=0.01, abs=5e-8)
    assert sim.poses(out)[0].info["n_matched"] == 2


def test_of_marks_that_disagree_the_larger_group_is_believed(sim, marks, tmp_path):
    three = sim.write_map([*PLACES, (8.0, 2.0, 0.0)], tmp_path / "three.yaml")
    true = [sim.sighting(0, 11, (1.0, 0.0, 0.0)), sim.sighting(0, 12, (1.001, 0.0, 0.0))]
    false = sim.sighting(0, 10, (2.0, 0.0, 0.0), np.diag([1e-8] * 3))  # and the most precise
    out = sim.run([false, *true], three)
    assert sim.at(out)[0, 0] == pytest.approx(1.0, abs=0.002)
    assert sim.values(out)["sightings"]["rejected"] == 1
