import math

import numpy as np
import pytest

from logpose.formats.events import Pose
from logpose.pipelines.report.track import TrackBuilder, Waypoint, primary_of


def quaternion(roll, pitch, yaw):
    """Hand formula, independent of the code: Rz(yaw) Ry(pitch) Rx(roll)."""
    cr, sr, cp, sp, cy, sy = (f(a / 2) for a in (roll, pitch, yaw) for f in (math.cos, math.sin))
    return np.array(
        [
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ]
    )


def test_a_track_keeps_stamps_exactly_and_headings_of_tilted_poses():
    builder = TrackBuilder("localize-pf")
    stamp = 1_700_000_000_123_456_789
    covariance = np.arange(36.0).reshape(6, 6)
    builder.add(
        Pose(
            stamp=stamp,
            position=np.array([1.0, 2.0, 3.0]),
            orientation=quaternion(0.05, -0.1, 2.5),
            covariance=covariance,
            info={"n_seen": 3, "status": "lost"},
        )
    )
    builder.add(Pose(stamp=stamp + 1, position=np.array([4.0, 6.0, 3.0]), orientation=quaternion(0.0, 0.0, -3.0)))
    track = builder.build()
    assert track.stamps.tolist() == [stamp, stamp + 1]
    assert track.heading == pytest.approx([2.5, -3.0], abs=1e-12)
    assert track.covariance[0].tolist() == [[0, 1, 5], [6, 7, 11], [30, 31, 35]]
    assert np.isnan(track.covariance[1]).all()
    assert (track.n_seen[0], math.isnan(track.n_seen[1]), math.isnan(track.n_matched[0])) == (3.0, True, True)
    assert (track.status.tolist(), track.status_words) == ([0, -1], ("lost",))
    assert track.length == 5.0


def test_an_empty_track_has_no_length():
    assert TrackBuilder("x").build().length == 0.0


def test_dead_reckoning_is_the_primary_estimate_only_when_alone():
    tracks = {name: TrackBuilder(name).build() for name in ("dead-reckon", "localize-pf", "slam-cekf")}
    assert primary_of(tracks).source == "localize-pf"
    assert primary_of({"dead-reckon": tracks["dead-reckon"]}).source == "dead-reckon"
    assert primary_of({}) is None


def test_a_waypoint_that_was_not_passed_has_no_numbers():
    point = Waypoint.read({"name": "W1", "x_m": 1.0, "dx_m": None})
    assert (point.name, point.x, math.isnan(point.dx), math.isnan(point.distance)) == ("W1", 1.0, True, True)
