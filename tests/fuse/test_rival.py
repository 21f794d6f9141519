"""When the estimate is wrong, and begins anew."""

from dataclasses import replace

import numpy as np
import pytest

S = 1_000_000_000
START = {"initial_pose": "0,0,0"}


def test_a_false_start_is_lost_and_begins_anew_where_marks_agree(sim, marks):
    events = sim.log(60, mark=lambda t: 10 if t < 3.0 else 11)
    out = sim.run(events, marks, initial_pose="1,1,90")
    found = [i for i, status in enumerate(sim.statuses(out)) if status == "tracking"]
    lost = [p for p in sim.poses(out) if p.info["status"] == "lost"]
    assert lost
    assert all(p.covariance[0, 0] >= 1.0 and p.covariance[5, 5] >= 0.25 for p in lost)
    assert found[0] == 30  # all of one mark: only when they have agreed for 3 s, or a second one does
    assert sim.at(out)[found] == pytest.approx(np.array([(0.04 * i, 0, 0) for i in found]), abs=0.02)
    assert sim.values(out)["begun_anew"] == 1


def test_a_second_mark_settles_it_at_once(sim, marks):
    events = sim.log(30, mark=lambda t: 10 if t < 0.7 else 11)
    out = sim.run(events, marks, initial_pose="1,1,90")
    assert sim.statuses(out).index("tracking") == 8  # the fifth sighting


def test_false_sightings_that_do_not_agree_never_win(sim, marks):
    rng = np.random.default_rng(0)
    events = sim.changed(sim.log(80), lambda n, e: [replace(e, robot=e.robot + rng.normal(0, 1, 3)) if n > 5 else e])
    out = sim.run(events, marks, **START)
    assert sim.values(out)["begun_anew"] == 0
    assert "lost" not in sim.statuses(out)
    assert sim.at(out)[-1, 0] == pytest.approx(79 * 0.04, abs=0.15)


def test_one_mark_against_many_sightings_of_others_is_not_believed(sim, marks):
    def moved(_n, event):
        return [replace(event, robot=sim.then((0.5, 0.3, 0.2), event.robot))] if event.mark == 11 else [event]

    out = sim.run(sim.changed(sim.log(90, mark=lambda t: 10 if t < 1.0 else 11), moved), marks, **START)
    assert sim.values(out)["begun_anew"] == 0
    assert set(sim.statuses(out)[13:]) == {"lost"}
    assert sim.at(out)[-1] == pytest.approx([89 * 0.04, 0.0, 0.0], abs=0.1)


def test_one_mark_against_a_single_sighting_of_another_is_believed_in_time(sim, marks):
    def lonely(n, event):
        if event.mark == 11:
            return [event]
        return [replace(event, robot=sim.then((0.5, 0.3, 0.2), event.robot))] if n == 0 else []

    out = sim.run(sim.changed(sim.log(90, mark=lambda t: 10 if t < 1.0 else 11), lonely), marks)
    assert sim.values(out)["begun_anew"] == 1
    tracked = [p.stamp for p in sim.poses(out) if p.info["status"] == "tracking"]
    assert tracked[:2] == [0, 4 * S]  # 3 s after the first sighting that contradicts
    assert sim.at(out)[-1] == pytest.approx([89 * 0.04, 0.0, 0.0], abs=0.02)
