"""An abstract ceiling for Monte-Carlo tests: a unicycle under point landmarks, its own forward model.

Nothing here comes from the estimators. Route and numbers are those of the paper's experiment: W1 ... W7 and
back, 0.36 m/s, 11.58 images/s, 146 landmarks along the route of 297, footprint 2.4 x 2.0 m, ceiling 2.42 m
above the lens.
"""

import math
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from logpose.formats.datasets.mrclam import convert_mrclam
from logpose.formats.events import NO_ID, Odometry, Pose, Sightings
from logpose.formats.maps.landmarks import write_landmarks
from logpose.formats.products import LandmarkMap

WAYPOINTS = np.array(
    [(30.38, 27.2), (37.47, 27.32), (75.11, 27.63), (75.03, 38.85), (36.13, 39.01), (19.87, 38.49), (18.81, 27.56)]
)
DT = 380 / 4400
SPEED, TURN = 0.36, 0.5
HEIGHT, FOCAL = 2.42, 645.33
HALF_AHEAD, HALF_ASIDE = 1.0, 1.2


@dataclass(frozen=True)
class World:
    """How the sensors err; lengths in m, angles in rad unless named otherwise."""

    pixel: float = 1.0
    tilt_deg: float = 0.0
    tilt_s: float = 0.0  # correlation time; 0 is white
    survey: float = 0.0
    clutter: float = 0.0
    detection: float = 0.95
    speed_scale: float = 0.02
    turn_scale: float = 0.02
    bias_deg_s: float = 0.1
    white_v: float = 0.01
    white_w: float = 0.01
    gap: tuple[int, int] = (0, 0)
    start_error: tuple[float, float] = (0.05, 2.0)  # m, deg, 1 sigma
    frames: int = 10**9


@dataclass
class Drive:
    """A drive as it really was, and as it was logged."""

    truth: np.ndarray
    stamps: np.ndarray
    passes: np.ndarray  # frame at which each waypoint is passed
    landmarks: np.ndarray
    surveyed: np.ndarray
    start: np.ndarray
    twists: np.ndarray
    seen: list[np.ndarray]
    ids: list[np.ndarray]
    cov: float

    def events(self, *, given: bool = False):
        """Return the log; odometry of the motion since the last image comes with it."""
        made = [_pose(int(self.stamps[0]), self.start, "initial_pose")]
        x = y = theta = 0.0
        for k, stamp in enumerate(self.stamps):
            v, w = self.twists[k]
            x, y, theta = step_arc((x, y, theta), v, w)
            made.append(
                Odometry(
                    stamp=int(stamp), source="odometry", frame_id="odom",
                    position=np.array([x, y, 0.0]),
                    orientation=np.array([0.0, 0.0, math.sin(theta / 2), math.cos(theta / 2)]),
                    linear=np.array([v, 0.0, 0.0]), angular=np.array([0.0, 0.0, w]),
                )
            )  # fmt: skip
            made.append(sightings(int(stamp), self.seen[k], self.cov, self.ids[k] if given else None))
        return made


def _pose(stamp, pose, source):
    half = pose[2] / 2
    q = np.array([0.0, 0.0, math.sin(half), math.cos(half)])
    return Pose(stamp=stamp, source=source, frame_id="map", position=np.array([pose[0], pose[1], 0.0]), orientation=q)


def sightings(stamp, xy, var, ids=None):
    """Return a Sightings event of points (n, 2) in the robot's frame."""
    n = len(xy)
    return Sightings(
        stamp=stamp,
        source="sightings" if ids is None else "true_sightings",
        frame_id="base_link",
        xy=np.asarray(xy, dtype=float).reshape(-1, 2),
        cov=np.tile(var * np.eye(2), (n, 1, 1)),
        uv=np.full((n, 2), np.nan),
        radius=np.full(n, np.nan),
        score=np.ones(n),
        ids=np.full(n, NO_ID) if ids is None else np.asarray(ids, dtype=np.int64),
    )


def step_arc(pose, v, w):
    """Drive one frame on a circle."""
    x, y, theta = pose
    dtheta = w * DT
    if abs(dtheta) < 1e-12:
        return x + v * DT * math.cos(theta), y + v * DT * math.sin(theta), theta
    r = v / w
    return (
        x + r * (math.sin(theta + dtheta) - math.sin(theta)),
        y - r * (math.cos(theta + dtheta) - math.cos(theta)),
        theta + dtheta,
    )


def drive_route():
    """Return poses (T, 3), commands (T, 2) of the step that led to each, and the frame of each waypoint."""
    x, y = WAYPOINTS[0]
    theta = math.atan2(*(WAYPOINTS[1] - WAYPOINTS[0])[::-1])
    poses, commands, passes = [(x, y, theta)], [(0.0, 0.0)], [0]
    for target in [*WAYPOINTS[1:], WAYPOINTS[0]]:
        while True:
            x, y, theta = poses[-1]
            ahead = np.array(target) - (x, y)
            error = math.remainder(math.atan2(ahead[1], ahead[0]) - theta, 2 * math.pi)
            left = float(np.hypot(*ahead))
            if left < 0.02 or (left < 0.3 and abs(error) > 1.0):
                break
            v = 0.0 if abs(error) > 0.3 else min(SPEED, left / DT)
            w = float(np.clip(error / DT, -TURN, TURN))
            poses.append(step_arc(poses[-1], v, w))
            commands.append((v, w))
        passes.append(len(poses) - 1)
    return np.array(poses), np.array(commands), np.array(passes[:-1])


_ROUTE = drive_route()


def scatter(route, rng, n_near=146, n_all=297):
    """Return landmarks: n_near within reach of the route's camera, the others elsewhere on 100 x 50 m."""
    near, far = [], []
    while len(near) < n_near:
        p = route[rng.integers(len(route)), :2] + rng.uniform(-1.3, 1.3, 2)
        if all(np.hypot(*(p - q)) > 0.8 for q in near):
            near.append(p)
    while len(near) + len(far) < n_all:
        p = rng.uniform((0, 0), (100, 50))
        if np.min(np.hypot(*(route[::10, :2] - p).T)) > 2.0 and all(np.hypot(*(p - q)) > 0.8 for q in far):
            far.append(p)
    return np.array(near + far)


def simulate(world: World, seed: int) -> Drive:
    """Drive once round."""
    rng = np.random.default_rng(1000 + seed)
    truth, commands, passes = _ROUTE
    truth, commands = truth[: world.frames], commands[: world.frames]
    passes = passes[passes < len(truth)]
    landmarks = scatter(_ROUTE[0], rng)
    surveyed = landmarks + rng.normal(0, 1, landmarks.shape) * world.survey
    sigma = math.radians(world.tilt_deg) * HEIGHT
    keep = math.exp(-DT / world.tilt_s) if world.tilt_s else 0.0
    shift = rng.normal(0, 1, 2) * sigma
    seen, ids = [], []
    for k, (x, y, theta) in enumerate(truth):
        shift = keep * shift + math.sqrt(1 - keep**2) * sigma * rng.normal(0, 1, 2)
        c, s = math.cos(theta), math.sin(theta)
        body = (landmarks - (x, y)) @ np.array([[c, -s], [s, c]])
        inside = (np.abs(body[:, 0]) < HALF_AHEAD) & (np.abs(body[:, 1]) < HALF_ASIDE)
        inside &= rng.random(len(body)) < world.detection
        if world.gap[0] <= k < world.gap[1]:
            inside[:] = False
        which = np.flatnonzero(inside)
        z = body[which] + shift + rng.normal(0, 1, (len(which), 2)) * world.pixel * HEIGHT / FOCAL
        # the share of false ones among all is clutter
        wrong = rng.poisson(2.16 * world.clutter / (1 - world.clutter)) if not world.gap[0] <= k < world.gap[1] else 0
        false = rng.uniform((-HALF_AHEAD, -HALF_ASIDE), (HALF_AHEAD, HALF_ASIDE), (wrong, 2))
        seen.append(np.concatenate([z, false]))
        ids.append(np.concatenate([which, np.full(wrong, NO_ID)]))
    odometry = commands * (1 + world.speed_scale, 1 + world.turn_scale)
    odometry[:, 1] += math.radians(world.bias_deg_s)
    odometry += rng.normal(0, 1, odometry.shape) * (world.white_v, world.white_w)
    spread = np.array([world.start_error[0], world.start_error[0], math.radians(world.start_error[1])])
    start = truth[0] + rng.normal(0, 1, 3) * spread
    stamps = np.round(np.arange(len(truth)) * DT * 1e9).astype(np.int64)
    cov = (world.pixel * HEIGHT / FOCAL) ** 2
    return Drive(truth, stamps, passes, landmarks, surveyed, start, odometry, seen, ids, cov)


def write_map(drive: Drive, path):
    """Write the surveyed landmarks; return the path."""
    xyz = np.column_stack([drive.surveyed, np.full(len(drive.surveyed), HEIGHT)])
    write_landmarks(LandmarkMap(ids=np.arange(len(xyz)), positions=xyz), path)
    return str(path)


def score(drive: Drive, made):
    """Return mean error at the waypoints, rms, max [m], and mean NEES, of the poses of localize-pf."""
    row = {int(stamp): k for k, stamp in enumerate(drive.stamps)}
    error = np.full((len(drive.truth), 2), np.nan)
    nees = []
    for event in made:
        if isinstance(event, Pose) and event.source == "localize-pf" and event.stamp in row:
            k = row[event.stamp]
            error[k] = event.position[:2] - drive.truth[k, :2]
            yaw = 2 * math.atan2(event.orientation[2], event.orientation[3])
            e = np.array([*error[k], math.remainder(yaw - drive.truth[k, 2], 2 * math.pi)])
            nees.append(e @ np.linalg.solve(event.covariance[np.ix_([0, 1, 5], [0, 1, 5])], e))
    distance = np.hypot(*error.T)
    return {
        "waypoints": float(np.nanmean(distance[drive.passes])),
        "rms": float(np.sqrt(np.nanmean(distance**2))),
        "max": float(np.nanmax(distance)),
        "end": float(distance[-1]),
        "nees": float(np.mean(nees)),
    }


@pytest.fixture
def ceiling(tmp_path):
    """Return a function (seed, **world) -> (Drive, path of its map)."""

    def make(seed: int = 0, **world):
        drive = simulate(World(**world), seed)
        return drive, write_map(drive, tmp_path / f"map{seed}.yaml")

    return make


@pytest.fixture
def sim():
    """Return what tests build events with."""
    return SimpleNamespace(pose=_pose, sightings=sightings, score=score, write_map=write_map, dt=DT)


@pytest.fixture
def mrclam_log(recordings, tmp_path):
    """Robot 2 of set 1, its landmark map beside it."""
    log = tmp_path / "robot2.mcap"
    convert_mrclam(recordings / "mrclam" / "MRCLAM_Dataset1", log, robot=2)
    return log
