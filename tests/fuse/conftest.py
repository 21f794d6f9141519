"""A robot that drives round a room and looks to its left, where marks hang; its own forward model, no images.

Nothing in it comes from the estimators. The room is 6 x 4 m, three marks hang on each wall; the robot drives clockwise
0.8 m before them, 0.3 m/s, turns on the spot in the corners, and takes 5 images/s. A mark is seen where it lies within
30 degrees of the view. Odometry errs as its parameters say (random walks, scales, bias), the marks are surveyed wrongly
by a rigid motion each, and phi, D_x, D_y of a sighting have white noise.
"""

import math
from dataclasses import dataclass, field, replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from logpose.formats.events import NO_ID, MarkSighting, Notice, Odometry, Pose, Summary
from logpose.formats.maps.marks import write_marks
from logpose.formats.products import MarkMap, StripeMark
from logpose.pipelines.fuse.params import FuseParams
from logpose.pipelines.fuse.stage import fuse_poses

S = 1_000_000_000
DT, EVERY = 0.1, 2  # an odometry message each 0.1 s, an image with every second one
NOISE = (math.radians(0.3), 0.0003, 0.002)  # phi, D_x, D_y
WALLS = [((0.0, 4.0), 0.0), ((6.0, 4.0), -math.pi / 2), ((6.0, 0.0), math.pi), ((0.0, 0.0), math.pi / 2)]
LENGTHS = (6.0, 4.0, 6.0, 4.0)


def then(a, b):
    """Return the pose b, told in the frame a, where a is told."""
    c, s = math.cos(a[2]), math.sin(a[2])
    return np.array([a[0] + c * b[0] - s * b[1], a[1] + s * b[0] + c * b[1], a[2] + b[2]])


def seen_from(a, b):
    """Return the pose b as seen from a."""
    c, s = math.cos(a[2]), math.sin(a[2])
    x, y = b[0] - a[0], b[1] - a[1]
    return np.array([c * x + s * y, -s * x + c * y, b[2] - a[2]])


def wall_marks():
    """Return the true poses of the marks: heading along the wall, to the right of who looks at it."""
    marks = []
    for (corner, heading), length in zip(WALLS, LENGTHS, strict=True):
        for share in (0.25, 0.5, 0.75):
            marks.append((*then((*corner, heading), (share * length, 0.0, 0.0))[:2], heading))
    return np.array(marks)


@dataclass(frozen=True)
class World:
    """How the robot errs; 1 sigma, random walks as in the parameters of the same names."""

    seconds: float = 60.0
    along_per_sqrt_m: float = 0.01
    along_per_sqrt_s: float = 0.005
    cross_per_sqrt_m: float = 0.002
    heading_per_sqrt_rad: float = 0.01
    heading_per_sqrt_m: float = 0.003
    heading_per_sqrt_s: float = 0.003
    scale: float = 0.04
    bias_rad_s: float = 0.006
    survey_m: float = 0.005
    survey_deg: float = 0.3
    noise: tuple[float, float, float] = NOISE
    start_sigma: tuple[float, float] = (0.1, 4.0)  # m, deg
    stands: bool = False
    blind: tuple[float, float] = (0.0, 0.0)  # s


@dataclass
class Drive:
    """A drive as it was, and as it was logged."""

    truth: np.ndarray
    stamps: np.ndarray
    marks: np.ndarray  # as they hang
    surveyed: np.ndarray
    start: np.ndarray
    told: np.ndarray  # by the odometry
    seen: dict[int, list[MarkSighting]] = field(default_factory=dict)

    def events(self, *, has_odometry=True, has_start=True):
        """Return the log."""
        made = [pose(0, self.start, "initial_pose")] if has_start else []
        for k, stamp in enumerate(self.stamps):
            if has_odometry:
                made.append(odometry(int(stamp), self.told[k]))
            made += self.seen.get(k, [])
        return made


def odometry(stamp, at):
    """Return a message that tells a pose in the frame of the odometry."""
    told = pose(stamp, at, "")
    return Odometry(
        stamp=stamp, source="odometry", frame_id="odom", position=told.position, orientation=told.orientation
    )


def pose(stamp, at, source):
    half = at[2] / 2
    q = np.array([0.0, 0.0, math.sin(half), math.cos(half)])
    return Pose(stamp=stamp, source=source, frame_id="map", position=np.array([at[0], at[1], 0.0]), orientation=q)


def located(mark, view):
    """Return the robot's pose by eq. (1): camera in its centre, looking to the left, so its X axis points ahead."""
    phi, dx, dy = view
    back = mark[2] - phi
    c, s = math.cos(back), math.sin(back)
    return np.array([mark[0] - c * dx + s * dy, mark[1] - s * dx - c * dy, back])


def located_jacobian(mark, view):
    return np.array([(located(mark, view + h) - located(mark, view - h)) / 2e-6 for h in 1e-6 * np.eye(3)]).T


def sighting(stamp, mark_id, at, cov=None, status="ok", column=100.0):
    """Return a MarkSighting of which the fusion reads mark, status, robot pose and columns."""
    nothing = np.full(3, np.nan)
    return MarkSighting(
        stamp=stamp, source="stripe-pose", frame_id="map", mark=mark_id, status=status, pose=nothing,
        cov=np.full((3, 3), np.nan), attitude=np.zeros(2), robot=np.asarray(at, dtype=float),
        robot_cov=np.diag([1e-6, 1e-6, 1e-5]) if cov is None else cov, row=240.0,
        lines=np.array([[column, 0, 0, 100, 0], [column + 50, 0, 0, 100, 0]]), members=np.arange(2),
    )  # fmt: skip


def nothing_seen(stamp):
    return replace(sighting(stamp, NO_ID, [np.nan] * 3, np.full((3, 3), np.nan), "no_mark"), lines=np.zeros((0, 5)))


def view_of(robot, mark):
    """Return phi, D_x, D_y of a mark, or None where it is not seen."""
    ahead, left, _ = seen_from(robot, mark)
    phi = math.remainder(mark[2] - robot[2], 2 * math.pi)
    if not (0.2 < left < 1.8 and abs(ahead) < 0.577 * left and abs(phi) < 1.2):
        return None
    return np.array([phi, ahead, left])


def simulate(world: World, seed: int) -> Drive:
    """Drive along the walls."""
    rng = np.random.default_rng(5000 + seed)
    marks = wall_marks()
    survey = (world.survey_m, world.survey_m, math.radians(world.survey_deg))
    surveyed = marks + rng.normal(0, 1, marks.shape) * survey
    scales, bias = rng.normal(0, world.scale, 2), rng.normal(0, world.bias_rad_s)
    truth = [np.array([1.4, 3.2, 0.0])]
    route = corners()
    drive = Drive(None, None, marks, surveyed, None, None)
    told = [np.array([0.0, 0.0, 0.0])]
    for k in range(int(world.seconds / DT) + 1):
        if k:
            v, w = (0.0, 0.0) if world.stands else steer(truth[-1], route)
            told.append(then(told[-1], arc(v / (1 + scales[0]), (w - bias) / (1 + scales[1]))))
            truth.append(driven(truth[-1], v, w, world, rng))
        if k % EVERY == 0:
            stamp = round(k * DT * S)
            is_blind = world.blind[0] <= k * DT < world.blind[1]
            drive.seen[k] = [] if is_blind else look(stamp, truth[-1], drive, world, rng)
            drive.seen[k] = drive.seen[k] or [nothing_seen(stamp)]
    drive.truth = np.array(truth)
    drive.stamps = np.round(np.arange(len(truth)) * DT * S).astype(np.int64)
    drive.told = np.array(told)
    spread = np.array([world.start_sigma[0]] * 2 + [math.radians(world.start_sigma[1])])
    drive.start = drive.truth[0] + rng.normal(0, 1, 3) * spread
    return drive


def look(stamp, robot, drive, world, rng):
    found = []
    for i, mark in enumerate(drive.marks):
        view = view_of(robot, mark)
        if view is not None:
            noisy = view + rng.normal(0, 1, 3) * world.noise
            J = located_jacobian(drive.surveyed[i], view)
            cov = J @ np.diag(np.square(world.noise)) @ J.T
            found.append(sighting(stamp, 10 + i, located(drive.surveyed[i], noisy), cov, column=100.0 * i))
    return found


def corners():
    return [np.array(p) for p in ((5.2, 3.2), (5.2, 0.8), (0.8, 0.8), (0.8, 3.2))]


def steer(robot, route):
    """Return speed and turn rate: to the next corner, on the spot if it lies aside."""
    x, y = route[0] - robot[:2]
    if math.hypot(x, y) < 0.05:
        route.append(route.pop(0))
        x, y = route[0] - robot[:2]
    error = math.remainder(math.atan2(y, x) - robot[2], 2 * math.pi)
    return (0.0 if abs(error) > 0.3 else 0.3), float(np.clip(2.0 * error, -0.6, 0.6))


def arc(v, w):
    """Return where a step leads, as seen from its start."""
    turn = w * DT
    chord = v * DT * (math.sin(turn / 2) / (turn / 2) if turn else 1.0)
    return chord * math.cos(turn / 2), chord * math.sin(turn / 2), turn


def driven(robot, v, w, world, rng):
    """Drive an arc, and be pushed off it."""
    x, y, turn = arc(v, w)
    way = math.hypot(x, y)
    along = math.sqrt(world.along_per_sqrt_m**2 * way + world.along_per_sqrt_s**2 * DT)
    cross = world.cross_per_sqrt_m * math.sqrt(way)
    heading = math.sqrt(
        world.heading_per_sqrt_rad**2 * abs(turn) + world.heading_per_sqrt_m**2 * way + world.heading_per_sqrt_s**2 * DT
    )
    push = rng.normal(0, 1, 3) * (along, cross, heading)
    return then(robot, (x + push[0], y + push[1], turn + push[2]))


def score(drive, made, skip=0):
    """Return errors (K, 3) and squared normalised errors (K,) of the poses, and their stamps."""
    row = {int(stamp): k for k, stamp in enumerate(drive.stamps)}
    errors, nees, stamps = [], [], []
    for event in [e for e in made if isinstance(e, Pose) and e.source == "stripe-pose"][skip:]:
        true = drive.truth[row[event.stamp]]
        heading = 2 * math.atan2(event.orientation[2], event.orientation[3])
        e = np.array([*(true[:2] - event.position[:2]), math.remainder(true[2] - heading, 2 * math.pi)])
        errors.append(e)
        nees.append(e @ np.linalg.solve(event.covariance[np.ix_([0, 1, 5], [0, 1, 5])], e))
        stamps.append(event.stamp)
    return np.array(errors), np.array(nees), np.array(stamps)


def write_map(poses, path):
    lines = np.array([-0.06, 0.0, 0.04, 0.12])
    marks = [StripeMark(id=10 + i, lines=lines, bars=None, pose=np.array(p)) for i, p in enumerate(poses)]
    write_marks(MarkMap(marks=tuple(marks)), path)
    return str(path)


@pytest.fixture(scope="session")
def room(tmp_path_factory):
    """Return a function (seed, **world) -> (Drive, path of the map as surveyed)."""
    folder = tmp_path_factory.mktemp("rooms")

    @cache
    def make(seed=0, **world):
        drive = simulate(World(**world), seed)
        name = f"{seed}-{abs(hash(tuple(world.items())))}.yaml"
        return drive, write_map(drive.surveyed, folder / name)

    return make


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


def log(n=40, x=lambda t: 0.4 * t, mark=10, every=2):
    """A robot that drives along x at 0.4 m/s and sees a mark in every second image, 10 messages a second."""
    events = []
    for k in range(n):
        stamp, here = k * S // 10, np.array([x(0.1 * k), 0.0, 0.0])
        events.append(odometry(stamp, (0.4 * 0.1 * k, 0.0, 0.0)))
        seen = mark if callable(mark) else lambda _: mark
        is_seen = k % every == 0
        events.append(sighting(stamp, seen(0.1 * k), here) if is_seen else nothing_seen(stamp))
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


@pytest.fixture
def marks(tmp_path):
    """Return the path of a map of two marks beside the way."""
    return write_map([(0.0, 2.0, 0.0), (4.0, 2.0, 0.0)], tmp_path / "marks.yaml")


@pytest.fixture(scope="session")
def sim():
    """Return what tests build events with."""
    return SimpleNamespace(
        pose=pose, odometry=odometry, sighting=sighting, nothing_seen=nothing_seen, write_map=write_map, score=score,
        then=then, seen_from=seen_from, run=run, poses=poses, values=values, codes=codes, statuses=statuses, at=at,
        log=log, changed=changed,
    )  # fmt: skip
