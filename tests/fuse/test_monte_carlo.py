"""Whether the fusion knows how wrong it is, over drives with their own errors of everything.

NEES of the last pose, and of one in the middle, of independent drives: chi-square with 3 degrees of freedom each.
"""

import numpy as np
import pytest

from logpose.pipelines.estimation.kalman import chi_square
from logpose.pipelines.fuse.params import FuseParams
from logpose.pipelines.fuse.stage import fuse_poses

N = 9


def nees(sim, drives, **params):
    """Return (number of drives, 2): in the middle and at the end."""
    rows = []
    for drive, path in drives:
        _, values, _ = sim.score(drive, list(fuse_poses(iter(drive.events()), FuseParams(map=path, **params))))
        rows.append(values[[len(values) // 2, -1]])
    return np.array(rows)


def assert_honest(values, probability=0.999):
    tail = (1 - probability) / 2
    dof = 3 * len(values)
    for total in values.sum(axis=0):
        assert chi_square(tail, dof) < total < chi_square(1 - tail, dof)


@pytest.mark.parametrize("smooth", [False, True])
def test_errors_of_drives_are_as_large_as_they_are_said_to_be(room, sim, smooth):
    assert_honest(nees(sim, [room(seed, seconds=16.0) for seed in range(N)], smooth=smooth))


@pytest.mark.parametrize("smooth", [False, True])
def test_a_robot_that_stands_before_one_mark_learns_no_more_than_its_survey_knows(room, sim, smooth):
    drives = [room(seed, seconds=5.0, stands=True) for seed in range(N)]
    honest = nees(sim, drives, smooth=smooth)
    assert_honest(honest)
    # who takes the map for true averages 25 images of the same error
    assert nees(sim, drives, smooth=smooth, map_sigma_m=0.0, map_sigma_deg=0.0)[:, 1].mean() > 5 * chi_square(0.999, 3)


@pytest.mark.slow
@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize("world", [{"seconds": 60.0}, {"seconds": 60.0, "blind": (20.0, 40.0)}])
def test_errors_of_fifty_drives_are_as_large_as_they_are_said_to_be(room, sim, smooth, world):
    assert_honest(nees(sim, [room(seed, **world) for seed in range(50)], smooth=smooth))
