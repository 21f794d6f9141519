import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from logpose.formats.errors import ConfigError, FormatError
from logpose.formats.events import NO_ID, Notice, Odometry, Pose, Sightings, Summary
from logpose.formats.maps.landmarks import write_landmarks
from logpose.formats.products import LandmarkMap
from logpose.pipelines.geometry.se2 import compose, transform
from logpose.pipelines.localize_pf.params import LocalizePfParams
from logpose.pipelines.localize_pf.stage import localize_pf
from logpose.pipelines.odometry.poses import MISSING_START_POSE

S = 1_000_000_000
LANDMARKS = np.array([(0.5 + 0.9 * k, 0.7 * (-1) ** k) for k in range(12)])


@pytest.fixture
def map_path(tmp_path):
    return write(tmp_path / "map.yaml", LANDMARKS)


def write(path, xy):
    xyz = np.column_stack([xy, np.full(len(xy), 2.42)])
    write_landmarks(LandmarkMap(ids=100 + np.arange(len(xy)), positions=xyz), path)
    return str(path)


def twist(t, v=0.4, w=0.0):
    return Odometry(stamp=round(t * S), source="odometry", linear=np.array([v, 0, 0]), angular=np.array([0, 0, w]))


def log(sim, n=100, *, landmarks=LANDMARKS, given=False, odometry=True, seen=True, speed=0.4):
    """Drive along x from the origin, 10 images per second."""
    events = []
    for k in range(n):
        t = 0.1 * k
        if odometry:
            events.append(twist(t, speed))
        if seen:
            z = landmarks - (speed * t, 0.0)
            near = np.flatnonzero(np.abs(z).max(axis=1) < 1.2)
            events.append(sim.sightings(round(t * S), z[near], 1e-5, 100 + near if given else None))
    return events


def run(events, **params):
    return list(localize_pf(iter(events), LocalizePfParams(**params)))


def poses(out):
    return [e for e in out if isinstance(e, Pose) and e.source == "localize-pf"]


START = {"initial_pose": "0,0,0"}


def test_forwards_everything_in_order_and_makes_a_pose_and_ids_per_image(sim, map_path):
    events = log(sim)
    out = run(events, map=map_path, **START)
    assert [e for e in out if any(e is f for f in events)] == events
    assert [e.stamp for e in out] == sorted(e.stamp for e in out)
    assert len(poses(out)) == 100
    named = [e for e in out if isinstance(e, Sightings) and e.source == "localize-pf"]
    assert len(named) == 100
    assert all(np.all(e.ids >= 100) for e in named)
    last = poses(out)[-1]
    assert last.position[0] == pytest.approx(3.96, abs=0.03)
    assert last.frame_id == "map"
    assert last.info["status"] == "tracking"
    assert set(last.info) == {"status", "n_seen", "n_matched", "ess", "elsewhere"}
    follows = out.index(named[5])
    assert out[follows - 1] is poses(out)[5]
    assert named[5].stamp == poses(out)[5].stamp


def test_covariance_of_a_pose_is_symmetric_and_positive_and_keeps_to_the_plane(sim, map_path):
    for pose in poses(run(log(sim), map=map_path, **START)):
        assert np.allclose(pose.covariance, pose.covariance.T, atol=1e-15)
        assert np.linalg.eigvalsh(pose.covariance).min() > 0.0
        assert np.array_equal(np.diag(pose.covariance)[2:5], [1e-6] * 3)
        assert pose.position[2] == 0.0


def test_summary_counts_every_image(sim, map_path):
    summary = run(log(sim), map=map_path, **START)[-1]
    assert isinstance(summary, Summary)
    assert summary.source == "localize-pf"
    v = summary.values
    assert v["n_frames"] == sum(v["n_seen_histogram"]) == sum(v["n_matched_histogram"]) == 100
    assert sum(v["status_share"].values()) == pytest.approx(1.0)
    assert v["underflows"] == 0
    assert 1.0 <= v["mean_ess"] <= 200.0


def test_same_seed_same_bytes_other_seed_others(sim, map_path):
    def numbers(seed):
        out = run(log(sim), map=map_path, seed=seed, particles=50, initial_sigma_m=0.5, **START)
        return b"".join(p.position.tobytes() + p.orientation.tobytes() + p.covariance.tobytes() for p in poses(out))

    assert numbers(3) == numbers(3)
    assert numbers(3) != numbers(4)


def test_covariances_of_the_map_are_averaged_and_stand_for_map_sigma(sim, tmp_path):
    xyz = np.column_stack([LANDMARKS, np.full(len(LANDMARKS), 2.42)])
    variances = np.where(np.arange(len(xyz)) < 6, 0.01, 0.03)[:, None] * (1.0, 1.0, 0.0)
    covariances = np.array([np.diag(v) for v in variances])
    write_landmarks(LandmarkMap(ids=np.arange(12), positions=xyz, covariances=covariances), tmp_path / "cov.yaml")
    plain = write(tmp_path / "plain.yaml", LANDMARKS)
    a = poses(run(log(sim, 30), map=str(tmp_path / "cov.yaml"), **START))
    b = poses(run(log(sim, 30), map=plain, map_sigma_m=math.sqrt(0.02), **START))
    for p, q in zip(a, b, strict=True):
        assert np.allclose(p.covariance, q.covariance, rtol=1e-9)


@pytest.mark.parametrize("method", ["best", "paper"])
def test_a_rigid_move_of_the_world_moves_every_pose_with_it(sim, tmp_path, method):
    move = np.array([40.0, -17.0, 2.5])
    here = write(tmp_path / "here.yaml", LANDMARKS)
    there = write(tmp_path / "there.yaml", transform(move, LANDMARKS))
    start = f"{move[0]},{move[1]},{math.degrees(move[2])!r}"
    a = poses(run(log(sim), map=here, method=method, **START))
    b = poses(run(log(sim), map=there, method=method, initial_pose=start))
    for p, q in zip(a, b, strict=True):
        expected = compose(move, np.array([p.position[0], p.position[1], 2 * math.asin(p.orientation[2])]))
        assert q.position[:2] == pytest.approx(expected[:2], abs=1e-6)


def test_the_truth_is_never_read(sim, map_path):
    events = log(sim)
    truth = [sim.pose(e.stamp, (50.0, 50.0, 1.0), "truth") for e in events]
    mixed = sorted([*events, *truth], key=lambda e: e.stamp)
    a, b = (poses(run(e, map=map_path, **START)) for e in (events, mixed))
    assert all(np.array_equal(p.position, q.position) for p, q in zip(a, b, strict=True))


def test_true_ids_are_used_only_when_asked_for(sim, map_path):
    events = [*log(sim, 30, given=True)]
    out = run(events, map=map_path, association="given", **START)
    named = [e for e in out if isinstance(e, Sightings) and e.source == "localize-pf"]
    true = [e for e in events if isinstance(e, Sightings)]
    assert all(np.array_equal(a.ids, b.ids) for a, b in zip(named, true, strict=True))
    with pytest.raises(ConfigError) as caught:
        run(events, map=map_path, **START)
    assert str(caught.value) == (
        "localize-pf: no images and no sightings in the log. Name their topic with --topic image=/NAME or "
        "--topic sightings=/NAME, or pass --sightings FILE."
    )


def test_ids_that_are_not_in_the_map_are_no_landmarks(sim, map_path):
    events = [twist(0.0), sim.sightings(0, [(0.5, 0.7)], 1e-5, [7])]
    out = run(events, map=map_path, association="given", **START)
    named = [e for e in out if isinstance(e, Sightings) and e.source == "localize-pf"]
    assert named[0].ids.tolist() == [NO_ID]


def test_the_start_pose_of_the_log_is_taken_and_a_given_one_wins(sim, map_path):
    first = sim.pose(0, (0.05, 0.0, 0.0), "initial_pose")
    out = run([first, *log(sim, 20)], map=map_path)
    assert poses(out)[-1].position[0] == pytest.approx(0.76, abs=0.03)
    far = sim.pose(0, (90.0, 0.0, 0.0), "initial_pose")
    assert poses(run([far, *log(sim, 20)], map=map_path, **START))[-1].position[0] == pytest.approx(0.76, abs=0.03)


def test_images_before_the_start_pose_have_no_pose_and_are_counted(sim, map_path):
    events = log(sim, 30)
    late = sim.pose(S, (0.4, 0.0, 0.0), "initial_pose")
    out = run(sorted([*events, late], key=lambda e: e.stamp), map=map_path)
    assert len(poses(out)) + out[-1].values["n_before_start"] == 30
    assert poses(out)[-1].position[0] == pytest.approx(1.16, abs=0.03)


def test_a_second_start_pose_begins_anew_and_says_so(sim, map_path):
    again = sim.pose(2 * S, (0.8, 0.0, 0.0), "initial_pose")
    events = sorted([sim.pose(0, (0, 0, 0), "initial_pose"), *log(sim, 50), again], key=lambda e: e.stamp)
    notices = [e for e in run(events, map=map_path) if isinstance(e, Notice)]
    assert [n.code for n in notices] == ["start-pose-again"]


def test_silence_of_the_sightings_is_bridged_by_odometry(sim, map_path):
    events = log(sim, 20) + [twist(2.0 + 0.1 * k) for k in range(100)]
    out = run(events, map=map_path, **START)
    bridged = [p for p in poses(out) if p.stamp > 2 * S]
    assert len(bridged) == pytest.approx(9.9 / 0.5, abs=1)
    assert {p.info["status"] for p in bridged} == {"dead-reckoning"}
    assert bridged[-1].position[0] == pytest.approx(4.7, abs=0.2)
    assert bridged[-1].covariance[0, 0] > bridged[0].covariance[0, 0]
    assert out[-1].values["n_frames"] == 20


def test_a_gap_of_the_odometry_is_a_notice_and_no_loss_and_widens_the_covariance(sim, map_path):
    events = [e for e in log(sim, 60) if not (isinstance(e, Odometry) and S < e.stamp < 3.5 * S)]
    events = [e for e in events if not (isinstance(e, Sightings) and S < e.stamp < 3.5 * S)]
    out = run(events, map=map_path, **START)
    notices = [e for e in out if isinstance(e, Notice)]
    assert [(n.code, n.is_loss) for n in notices] == [("odometry-gap", False)]
    assert notices[0].message == "odometry is silent for 2.500 s; the pose is uncertain there."
    assert poses(out)[-1].position[0] == pytest.approx(2.36, abs=0.05)


def with_poses(events):
    """Give every odometry message its pose on the way along x."""
    x = {e.stamp: 0.4e-9 * e.stamp for e in events}
    unit = np.array([0.0, 0.0, 0.0, 1.0])
    return [
        replace(e, position=np.array([x[e.stamp], 0.0, 0.0]), orientation=unit) if isinstance(e, Odometry) else e
        for e in events
    ]


def test_a_jump_of_the_odometry_is_a_notice_and_no_loss(sim, map_path):
    events = [
        replace(e, position=e.position + np.array([50.0, 0.0, 0.0])) if isinstance(e, Odometry) and e.stamp >= S else e
        for e in with_poses(log(sim, 30))
    ]
    notices = [e for e in run(events, map=map_path, **START) if isinstance(e, Notice)]
    assert [(n.code, n.is_loss, n.stamp) for n in notices if n.code == "odometry-jump"] == [("odometry-jump", False, S)]
    assert notices[0].message == (
        "odometry jumps by 50.040 m and 0.0 deg within 0.100 s at stamp 1000000000 ns; poses after it are wrong until "
        "the map corrects them."
    )
    calm = run(events, map=map_path, jump_speed_m_s=1000.0, **START)
    assert "odometry-jump" not in [e.code for e in calm if isinstance(e, Notice)]


def test_odometry_without_pose_among_poses_is_skipped_and_said(sim, map_path):
    events = [
        replace(e, position=None, orientation=None) if isinstance(e, Odometry) and e.stamp in {0, S, 2 * S} else e
        for e in with_poses(log(sim, 100))
    ]
    out = run(events, map=map_path, **START)
    assert poses(out)[-1].position[0] == pytest.approx(3.96, abs=0.03)
    assert [n.message for n in out if isinstance(n, Notice)] == [
        "2 of 100 odometry messages give no pose and were skipped; their motion is in the next pose, if one comes."
    ]


def test_a_wrong_start_is_lost_and_never_confident(sim, map_path):
    out = run(log(sim, 100), map=map_path, initial_pose="0,0,90", initial_sigma_deg=1.0)
    lost = [p for p in poses(out) if p.info["status"] == "lost"]
    assert lost
    assert all(p.covariance[0, 0] >= 1.0 for p in lost)
    for p in poses(out)[40:]:  # once there was time to judge: wrong poses are not sold as good ones
        if p.info["status"] == "tracking":
            assert np.hypot(p.position[0] - 0.4e-9 * p.stamp, p.position[1]) < 0.2


@pytest.mark.parametrize(
    ("events", "params", "message"),
    [
        ("all", {}, f"localize-pf: {MISSING_START_POSE}"),
        (
            "no odometry", START,
            "localize-pf: no odometry in the log. Name its topic with --topic odometry=/NAME.",
        ),
        (
            "nothing", START,
            "localize-pf: no images and no sightings in the log. Name their topic with --topic image=/NAME or "
            "--topic sightings=/NAME, or pass --sightings FILE.",
        ),
        (
            "all", {"initial_pose": "1,2"},
            "initial pose '1,2': is not three numbers. Write X,Y,HEADING_DEG [m, m, deg], as in 1.5,2,90.",
        ),
    ],
)  # fmt: skip
@pytest.mark.parametrize("n", [20, 100])
def test_what_is_missing_is_said(sim, map_path, events, params, message, n):
    made = {"all": log(sim, n), "no odometry": log(sim, n, odometry=False), "nothing": []}[events]
    with pytest.raises(ConfigError) as caught:
        run(made, map=map_path, **params)
    assert str(caught.value) == message


def test_missing_odometry_ends_a_long_log_early(sim, map_path):
    read = []

    def watched():
        for event in log(sim, 1000, odometry=False):
            read.append(event)
            yield event

    with pytest.raises(ConfigError):
        list(localize_pf(watched(), LocalizePfParams(map=map_path, **START)))
    assert len(read) < 60


def test_a_map_in_millimetres_is_recognised(sim, tmp_path):
    path = write(tmp_path / "mm.yaml", 1000.0 * np.add(LANDMARKS, (30.0, 20.0)))
    with pytest.raises(ConfigError) as caught:
        run(log(sim), map=path, **START)
    assert str(caught.value) == (
        f"{path}: the nearest landmark is 36853.8 m away, no sighting is farther than 1.4 m and odometry travels "
        "4.0 m. Give the map in metres, in the frame of the start pose."
    )


def test_sightings_that_fit_nowhere_are_a_notice(sim, map_path):
    events = []
    for k in range(60):
        events += [twist(0.1 * k, 0.1), sim.sightings(k * S // 10, [(-0.3, 0.1)], 1e-5)]
    notices = [e for e in run(events, map=map_path, initial_pose="-2,0,180") if isinstance(e, Notice)]
    assert [n.code for n in notices] == ["nothing-matched"]


def test_empty_map_is_an_error_of_the_file(sim, tmp_path):
    path = tmp_path / "none.yaml"
    path.write_text("logpose: landmarks/1\nlandmarks: []\n")
    with pytest.raises(FormatError, match=r"none\.yaml: the map has no landmarks\. Give at least one\."):
        run(log(sim), map=str(path), **START)


def test_nan_sightings_and_stamps_that_go_back_are_refused(sim, map_path):
    with pytest.raises(ValueError) as caught:
        run([twist(0), sim.sightings(0, [(np.nan, 0.0)], 1e-5)], map=map_path, **START)
    assert str(caught.value) == "sightings are not finite. Correct x_m, y_m and cov_m2 there, or leave them out."
    with pytest.raises(ValueError) as caught:
        run([twist(0), sim.sightings(S, [], 1.0), sim.sightings(S // 2, [], 1.0)], map=map_path, **START)
    assert str(caught.value) == "sightings go back in time by 0.500000000 s. Sort them by stamp."


def test_nan_odometry_is_refused(sim, map_path):
    with pytest.raises(
        ValueError, match=r"^odometry linear is not finite: \[nan, 0, 0\]\. Repair or cut the log there\.$"
    ):
        run([twist(0, np.nan), *log(sim, 3)], map=map_path, **START)


def test_paper_method_follows_the_same_log(sim, map_path):
    out = run(log(sim), map=map_path, method="paper", **START)
    assert poses(out)[-1].position[0] == pytest.approx(3.96, abs=0.1)
    assert out[-1].values["resamplings"] == sum(out[-1].values["n_seen_histogram"][1:])


@pytest.mark.parametrize("method", ["best", "paper"])
def test_one_particle_and_no_noise_follow_the_arc(sim, map_path, method):
    quiet = {
        "alphas": (0.0,) * 6, "along_per_sqrt_m": 0.0, "along_per_sqrt_s": 0.0, "cross_per_sqrt_m": 0.0,
        "heading_per_sqrt_rad": 0.0, "heading_per_sqrt_m": 0.0, "heading_per_sqrt_s": 0.0, "speed_scale_sigma": 0.0,
        "turn_scale_sigma": 0.0, "turn_bias_sigma_rad_s": 0.0, "initial_sigma_m": 0.0, "initial_sigma_deg": 0.0,
        "scale_walk_per_sqrt_s": 0.0, "bias_walk_rad_s_per_sqrt_s": 0.0,
    }  # fmt: skip
    out = run(log(sim), map=map_path, method=method, particles=1, **quiet, **START)
    assert poses(out)[-1].position[:2] == pytest.approx([3.96, 0.0], abs=1e-3)


def test_images_and_sightings_at_once_would_count_twice(sim, map_path):
    events = log(sim, 30)
    twice = [replace(e, source="detect-circles") for e in events if isinstance(e, Sightings)]
    mixed = sorted([*events, *twice], key=lambda e: e.stamp)
    with pytest.raises(ConfigError) as caught:
        run(mixed, map=map_path, **START)
    assert str(caught.value) == (
        "localize-pf: both images and sightings in the log. Choose with --topic image=none or --topic sightings=none "
        "which of them to use."
    )


def test_stamps_of_poses_increase_also_where_odometry_bridges(sim, map_path):
    events = [e for e in log(sim, 100) if not isinstance(e, Sightings) or not 2.0 < e.stamp * 1e-9 < 6.0]
    stamps = [p.stamp for p in poses(run(events, map=map_path, **START))]
    assert len(stamps) > len([e for e in events if isinstance(e, Sightings)])
    assert all(a < b for a, b in pairwise(stamps))
