"""The pan-tilt head: its encoders say where the camera looks."""

import numpy as np
import pytest

from logpose.formats.events import JointState
from logpose.pipelines.simulate.simulate import simulate

EDGES = np.array([-0.12, -0.07, -0.02, 0.02, 0.1, 0.16])


def test_joint_states_tell_where_the_head_looks_to_their_noise(room, edge_near, picture, columns_of):
    head = {"rate_hz": 50.0, "pan": {"middle_deg": 2.0, "swing_deg": 6.0, "period_s": 4.0}, "sd_deg": 0.05}
    world = room(head=head)
    states = [e for e in simulate(world, 1) if isinstance(e, JointState)]
    times = np.array([e.stamp - world.start_stamp_ns for e in states]) * 1e-9
    positions = np.degrees([e.positions for e in states])
    errors = positions - np.column_stack([2.0 + 6.0 * np.sin(2 * np.pi * times / 4.0), np.zeros(len(times))])
    assert errors.std() == pytest.approx(0.05, rel=3 / np.sqrt(2 * errors.size))
    # What the camera sees at t = 1 s is what a camera sees that is panned by 8 degrees more.
    pose = (1.25, 1.4, -0.05)
    row = picture(world, pose, time=1.0)[121]
    expected = columns_of(world, pose, EDGES, pan=np.radians(8.0))
    assert [edge_near(row, column) for column in expected] == pytest.approx(expected, abs=0.02)


def test_a_head_that_tilts_up_sees_the_mark_lower_in_the_image(room, picture):
    sweep = {"pan": {"swing_deg": 0.0}, "tilt": {"middle_deg": 5.0}}
    level, raised = (picture(world, (1.4, 1.2, np.radians(10))) for world in (room(), room(head=sweep)))
    rows = [np.flatnonzero((image == 204).any(axis=1)).mean() for image in (level, raised)]
    assert rows[1] - rows[0] == pytest.approx(300 * np.tan(np.radians(5.0)), abs=1.0)
