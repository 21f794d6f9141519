"""A synthetic drive along the paper's route: enough for every picture, made in a fraction of a second."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from logpose.formats.events import NO_ID, Image, MarkSighting, Odometry, Pose, Sightings, Summary
from logpose.formats.products import LandmarkMap, MarkMap, StripeMark

ROUTE = np.array(
    [(30.38, 27.2), (37.47, 27.32), (75.11, 27.63), (75.03, 38.85), (36.13, 39.01), (19.87, 38.49), (18.81, 27.56)]
)
PERIOD_NS = 86_363_636
START_NS = 1_000_000_000_000


def pose(stamp, x, y, heading, source="localize-pf", covariance=None, **info):
    return Pose(
        stamp=stamp,
        source=source,
        frame_id="map",
        position=np.array([x, y, 0.0]),
        orientation=np.array([0.0, 0.0, np.sin(heading / 2), np.cos(heading / 2)]),
        covariance=covariance,
        info=info,
    )


def odometry(stamp, x, y, heading):
    p = pose(stamp, x, y, heading)
    return Odometry(
        stamp=stamp, source="odometry", frame_id="odom", position=p.position, orientation=p.orientation, topic="/odom"
    )


def sightings(stamp, xy, ids=None, source="detect-circles"):
    n = len(xy)
    return Sightings(
        stamp=stamp,
        source=source,
        frame_id="base_link",
        xy=np.reshape(xy, (n, 2)).astype(float),
        cov=np.tile(np.eye(2) * 1e-5, (n, 1, 1)),
        uv=320.0 + np.reshape(xy, (n, 2)) * 260.0,
        radius=np.full(n, 21.0),
        score=np.ones(n),
        ids=np.full(n, -1) if ids is None else np.asarray(ids, dtype=np.int64),
    )


def truth_along(route, n):
    """Return (n, 3) x, y, heading at equal steps along a closed polyline."""
    closed = np.vstack([route, route[:1]])
    at = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(closed, axis=0).T))])
    s = np.linspace(0.0, at[-1], n)
    x, y = np.interp(s, at, closed[:, 0]), np.interp(s, at, closed[:, 1])
    return np.column_stack([x, y, np.unwrap(np.arctan2(np.gradient(y), np.gradient(x)))])


def landmarks_along(rng, n_near=146, n_far=151):
    path = truth_along(ROUTE, 2000)[:, :2]
    near = path[rng.integers(0, len(path), n_near)] + rng.uniform(-0.9, 0.9, (n_near, 2))
    far = np.column_stack([rng.uniform(2, 98, n_far), rng.uniform(2, 48, n_far)])
    xy = np.vstack([near, far])
    return LandmarkMap(ids=np.arange(len(xy)), positions=np.column_stack([xy, np.full(len(xy), 2.42)]))


def drive_events(n=1200, seed=3):
    """Yield what passes the last stage of a run: truth, sightings, dead reckoning, estimates, then summaries."""
    rng = np.random.default_rng(seed)
    truth, landmarks = truth_along(ROUTE, n), landmarks_along(rng)
    sigma = np.array([0.012, 0.012, 0.004])
    step = float(np.hypot(*(truth[1, :2] - truth[0, :2])))
    error, drift = np.zeros(3), np.zeros(3)
    passes = []
    for i in range(n):
        stamp = START_NS + i * PERIOD_NS
        x, y, heading = truth[i]
        relative = landmarks.positions[:, :2] - (x, y)
        c, s = np.cos(heading), np.sin(heading)
        body = relative @ np.array([[c, -s], [s, c]])
        is_seen = (np.abs(body) < (0.9, 1.2)).all(axis=1) & (rng.random(len(body)) < 0.95)
        seen = int(is_seen.sum())
        error = 0.9 * error + rng.normal(0, 0.44, 3) * sigma * (3.0 if seen < 2 else 1.0)
        drift[2] += 0.68 / n + rng.normal(0, 0.0005)
        drift[:2] += step * np.array([np.cos(heading + drift[2]) - c, np.sin(heading + drift[2]) - s])
        yield pose(stamp, x, y, heading, "truth")
        yield sightings(stamp, body[is_seen])
        yield pose(stamp, x + drift[0], y + drift[1], heading + drift[2], "dead-reckon")
        spread = np.diag(np.concatenate([sigma[:2], [1e-3] * 3, sigma[2:]]) ** 2) * (6.0 if seen < 2 else 1.0)
        yield sightings(stamp, body[is_seen], np.flatnonzero(is_seen), source="localize-pf")
        yield pose(
            stamp, x + error[0], y + error[1], heading + error[2], "localize-pf", spread,
            n_seen=seen, n_matched=seen, ess=120.0, status="dead-reckoning" if seen == 0 else "tracking",
        )  # fmt: skip
        passes.append((x, y, x + error[0], y + error[1]))
    yield Summary(stamp=stamp, source="run", values=run_values())
    yield Summary(stamp=stamp, source="evaluation", values=evaluation(np.array(passes)))


def evaluation(passes):
    """Return what ``evaluate`` would sum up, computed directly."""
    distance = np.hypot(passes[:, 2] - passes[:, 0], passes[:, 3] - passes[:, 1])
    points = []
    for name, xy in zip("1234567", ROUTE, strict=True):
        x, y, ex, ey = passes[np.hypot(*(passes[:, :2] - xy).T).argmin()].tolist()
        points.append(
            {"name": f"W{name}", "x_m": x, "y_m": y, "estimate_x_m": ex, "estimate_y_m": ey, "dx_m": ex - x,
             "dy_m": ey - y, "distance_m": float(np.hypot(ex - x, ey - y))}
        )  # fmt: skip
    ate = {"rmse_m": float(np.sqrt((distance**2).mean())), "mean_m": float(distance.mean()),
           "median_m": float(np.median(distance)), "max_m": float(distance.max())}  # fmt: skip
    totals = {"matched": len(passes), "reference_total": len(passes), "estimate_total": len(passes)}
    return totals | {"ate": ate, "waypoints": points}


def run_values():
    counts = {"announced": 1200, "read": 1200, "used": 1198, "dropped": 2, "why": {"nan": 2}}
    return {
        "pipeline": "logpose: 1\nstages:\n  - localize-pf: {map: '<b>landmarks</b>.yaml'}\n",
        "inputs": ["drive & return.mcap"],
        "topics": {"image": "/ceiling/image_raw", "odometry": "/odom"},
        "messages": {"/odom": counts},
    }


@pytest.fixture(scope="session")
def make():
    """Makers of single events and of the whole drive."""
    return SimpleNamespace(pose=pose, odometry=odometry, sightings=sightings, drive=drive_events)


@pytest.fixture(scope="session")
def landmarks():
    return landmarks_along(np.random.default_rng(3))


@pytest.fixture(scope="session")
def findings(landmarks):
    """What a report keeps of the drive."""
    from logpose.pipelines.report.collect import Collector

    collector = Collector([landmarks])
    for event in drive_events():
        collector.take(event)
    return collector.findings()


@pytest.fixture(scope="session")
def collect():
    """Return the findings of some events."""
    from logpose.pipelines.report.collect import Collector

    def findings_of(events, landmarks=None, marks=None):
        collector = Collector([landmarks, marks])
        for event in events:
            collector.take(event)
        return collector.findings()

    return findings_of


@pytest.fixture(scope="session")
def odd_runs(make):
    """Runs at the limits: nothing, one pose, no motion, long and thin, no truth, no number."""
    p = make.pose
    both = ("truth", "localize-pf")
    return {
        "empty": [],
        "one pose": [p(5, 1.0, 2.0, 0.3)],
        "truth only": [p(5, 1.0, 2.0, 0.3, "truth")],
        "standing still": [p(i * 10**8, 1.0, 2.0, 0.3, s) for i in range(5) for s in both],
        "north": [p(i * 10**8, 0.001 * i, 0.5 * i, 0.3, s) for i in range(300) for s in both],
        "east": [p(i * 10**8, 0.5 * i, 2.0, 0.3, n_seen=0, n_matched=0, status="lost") for i in range(300)],
        "sightings only": [make.sightings(i * 10**8, np.zeros((i % 4, 2))) for i in range(50)],
        "nothing seen": [make.sightings(i * 10**8, np.zeros((0, 2))) for i in range(3)],
        "dead reckoning only": [p(i * 10**8, float(i), 2.0, 0.3, "dead-reckon") for i in range(50)],
        "no number": [p(i * 10**8, np.nan, np.nan, 0.3) for i in range(5)],
        "truth of another day": [p(10**12 + i, 1.0, 2.0, 0.3, "truth") for i in range(5)]
        + [p(i * 10**8, 1.0, 2.0, 0.3) for i in range(5)],
        "five estimators": [p(i * 10**8, i * 0.1, 0.0, 0.1, s) for i in range(9) for s in ("a", "b", "c", "d", "e")],
    }


# ---- stripe marks: a room of 5 m x 3.6 m, a robot that looks to its right at the walls, drawn column by column -------

FOCAL, WIDE, HIGH, ROW = 400.0, 480, 360, 180.0
PAN, LENS = -np.pi / 2, np.array([0.1, -0.05])
EDGE_SD = 0.05 / FOCAL


def stripe_mark(identity, x, y, heading_deg, lines=(-0.09, -0.03, 0.05, 0.12), bars=0.025):
    lines = np.array(lines)
    widths = None if bars is None else np.full(len(lines), bars)
    return StripeMark(id=identity, lines=lines, bars=widths, pose=np.array([x, y, np.radians(heading_deg)]), height=0.3)


def room():
    """Marks on the four walls, each seen from inside; the last one hangs where nobody looks."""
    return MarkMap(
        marks=(
            stripe_mark(1, 1.6, 0.0, 180.0),
            stripe_mark(2, 5.6, 1.7, -90.0, (-0.12, -0.05, 0.0, 0.09)),
            stripe_mark(3, 3.3, 3.6, 0.0, (-0.08, -0.02, 0.02, 0.1)),
            stripe_mark(4, 0.3, 1.9, 90.0, (-0.1, 0.0, 0.03, 0.08)),
            stripe_mark(7, 4.9, 3.6, 0.0),
        )
    )


def level_pose_of(mark, robot):
    """Return phi, D_x, D_y of a mark for a robot at x, y, heading; written down from the frames, not from the code."""
    x, y, heading = robot
    c, s = np.cos(heading), np.sin(heading)
    lens = np.array([x + c * LENS[0] - s * LENS[1], y + s * LENS[0] + c * LENS[1]])
    view = heading + PAN
    ahead, right = np.array([np.cos(view), np.sin(view)]), np.array([np.sin(view), -np.cos(view)])
    phi = mark.pose[2] - np.arctan2(right[1], right[0])
    away = mark.pose[:2] - lens
    return np.array([np.arctan2(np.sin(phi), np.cos(phi)), away @ right, away @ ahead])


def robot_of(mark, pose):
    """Undo ``level_pose_of``, by eq. (1) of the stripe paper in the plane."""
    phi, dx, dy = pose
    turn = mark.pose[2] - phi
    c, s = np.cos(turn), np.sin(turn)
    lens = mark.pose[:2] - (c * dx - s * dy, s * dx + c * dy)
    heading = turn - PAN + np.pi / 2
    c, s = np.cos(heading), np.sin(heading)
    x, y = lens - (c * LENS[0] - s * LENS[1], s * LENS[0] + c * LENS[1])
    return np.array([x, y, np.arctan2(np.sin(heading), np.cos(heading))])


def numeric_jacobian(function, at):
    steps = 1e-6 * np.eye(len(at))
    return np.stack([(function(at + step) - function(at - step)) / 2e-6 for step in steps], axis=1)


def columns_of(mark, pose):
    """Return the image columns of all edges of a mark, nan behind the camera."""
    phi, dx, dy = pose
    depth = np.sin(phi) * mark.edges + dy
    return np.where(depth > 0.05, 0.5 * WIDE + FOCAL * (np.cos(phi) * mark.edges + dx) / depth, np.nan)


def picture_of(mark, pose, rng):
    """Draw what the camera sees: a grey wall, a dark board, bright bars; the brightness of every column is a mean of 8."""
    pixels = np.tile(120.0 + 25.0 * np.linspace(0, 1, WIDE), (HIGH, 1))
    if mark is not None:
        phi, dx, dy = pose
        u = ((np.arange(8 * WIDE) + 0.5) / 8 - 0.5 - 0.5 * WIDE) / FOCAL
        bottom = np.cos(phi) - u * np.sin(phi)
        x = (u * dy - dx) / bottom
        depth = np.sin(phi) * x + dy
        edges = mark.edges
        is_board = (x > edges[0] - 0.03) & (x < edges[-1] + 0.03) & (depth > 0.05) & (bottom > 0)
        is_bar = np.searchsorted(edges, x) % 2 == 1
        grey = np.where(is_board, np.where(is_bar, 215.0, 45.0), np.repeat(pixels[0], 8)).reshape(WIDE, 8).mean(axis=1)
        half = FOCAL * 0.5 * mark.height / np.maximum(depth, 0.05).reshape(WIDE, 8).mean(axis=1)
        pixels = np.where(np.abs(np.arange(HIGH)[:, None] - ROW) < half, grey, pixels)
    pixels = pixels + rng.normal(0, 2.5, pixels.shape)
    return np.clip(np.round(pixels), 0, 255).astype(np.uint8)


def image_event(stamp, pixels):
    height, width = pixels.shape
    return Image(
        stamp=stamp, source="image", topic="/camera/image_raw", encoding="mono8", data=pixels.reshape(-1), width=width,
        height=height, step=width,
    )  # fmt: skip


def mark_sighting(stamp, mark=None, pose=None, status="ok", rng=None, truth=None):
    """Return a sighting of a mark; with ``truth`` its pose is that and noise as large as its covariance says."""
    nothing = {
        "mark": NO_ID, "status": "no_mark", "pose": np.full(3, np.nan), "cov": np.full((3, 3), np.nan),
        "attitude": np.zeros(2), "robot": np.full(3, np.nan), "robot_cov": np.full((3, 3), np.nan), "row": ROW,
        "lines": np.empty((0, 5)), "members": np.empty(0, dtype=np.int64),
    }  # fmt: skip
    head = {"stamp": stamp, "source": "stripe-pose", "frame_id": "map"}
    if mark is None:
        return MarkSighting(**head, **nothing)
    columns = columns_of(mark, truth if truth is not None else pose)
    bearing = lambda p: (np.cos(p[0]) * mark.edges + p[1]) / (np.sin(p[0]) * mark.edges + p[2])  # noqa: E731
    jacobian = numeric_jacobian(bearing, truth if truth is not None else pose)
    cov = np.linalg.inv(jacobian.T @ jacobian) * EDGE_SD**2
    if truth is not None:
        pose = truth + rng.multivariate_normal(np.zeros(3), cov)
    turn = numeric_jacobian(lambda p: robot_of(mark, p), pose)
    half = FOCAL * 0.5 * mark.height / (np.sin(pose[0]) * mark.edges + pose[2])
    left = np.zeros(len(columns)) if rng is None else rng.normal(0, 0.04, len(columns))
    lines = np.column_stack([columns + left, 0.0 * columns, ROW - half, ROW + half, left])
    found = {
        "mark": mark.id, "status": status, "pose": pose, "cov": cov, "robot": robot_of(mark, pose),
        "robot_cov": turn @ cov @ turn.T, "lines": lines, "members": np.arange(len(lines)),
    }  # fmt: skip
    return MarkSighting(**head, **{**nothing, **found})


def planar_covariance(cov):
    six = 1e-6 * np.eye(6)
    six[np.ix_([0, 1, 5], [0, 1, 5])] = cov
    return six


def room_events(n=400, seed=5, *, with_images=True, with_odometry=True, with_truth=True):
    """Yield a drive around the room: images with what was found in them, truth, dead reckoning, the fused trajectory."""
    rng, marks = np.random.default_rng(seed), room().marks
    t = np.linspace(0, 2 * np.pi, n)
    xy = np.column_stack([2.5 + 1.5 * np.cos(t - 2.2), 1.8 + 0.8 * np.sin(t - 2.2)])
    heading = np.arctan2(0.8 * np.cos(t - 2.2), -1.5 * np.sin(t - 2.2))
    alone, drift, error, counts = 0.0, np.zeros(3), np.zeros(3), {}
    for i in range(n):
        stamp, truth = START_NS + i * 100_000_000, np.array([*xy[i], heading[i]])
        seen, pose = None, None
        for mark in marks[:4]:
            at = level_pose_of(mark, truth)
            columns = columns_of(mark, at)
            if abs(at[0]) < 1.3 and np.isfinite(columns).all() and (columns > 12).all() and (columns < WIDE - 12).all():
                seen, pose = mark, at
        if with_images:
            yield image_event(stamp, picture_of(seen, pose, rng))
        sighting = mark_sighting(stamp)
        if seen is not None and not 40 < i % 150 < 44:
            status = "poor_geometry" if abs(pose[0]) > 1.0 else "ok"
            sighting = mark_sighting(stamp, seen, status=status, rng=rng, truth=pose)
        counts[sighting.status] = counts.get(sighting.status, 0) + 1
        yield sighting
        alone = 0.0 if sighting.status == "ok" else alone + 0.1
        if with_truth:
            yield pose_event(stamp, truth, "truth")
        if with_odometry:
            drift = drift + np.array([0.0004, 0.0003, 0.0006])
            yield pose_event(stamp, truth + drift, "dead-reckon")
            sd = np.array([0.004, 0.004, 0.003]) + alone * np.array([0.004, 0.004, 0.003])
            error = 0.95 * error + 0.25 * rng.normal(size=3)
            yield pose_event(stamp, truth + sd * error, "stripe-pose", np.diag(sd**2))
        elif sighting.status == "ok":
            yield pose_event(stamp, sighting.robot, "stripe-pose", sighting.robot_cov)
    values = {
        "method": "best",
        "images": n,
        "status": counts,
        "marks": [{"id": m.id, "farthest_m": 1.5} for m in marks],
    }
    yield Summary(stamp=stamp, source="stripe-pose", values=values)


def pose_event(stamp, at, source, cov=None):
    return pose(stamp, *at, source, None if cov is None else planar_covariance(cov))


@pytest.fixture(scope="session")
def marked():
    """Makers of stripe marks, what is seen of them, and a drive around a room of them."""
    return SimpleNamespace(
        room=room, mark=stripe_mark, sighting=mark_sighting, picture=picture_of, image=image_event,
        drive=room_events, level_pose=level_pose_of, robot=robot_of, pose=pose_event, replaced=replace,
    )  # fmt: skip


@pytest.fixture(scope="session")
def mark_findings():
    """What a report keeps of the drive around the room."""
    from logpose.pipelines.report.collect import Collector

    collector = Collector([room()])
    for event in room_events(240):
        collector.take(event)
    return collector.findings()
