"""A synthetic drive along the paper's route: enough for every picture, made in a fraction of a second."""

from types import SimpleNamespace

import numpy as np
import pytest

from logpose.formats.events import Odometry, Pose, Sightings, Summary
from logpose.formats.products import LandmarkMap

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
    from logpose.pipelines.report.stage import Collector

    collector = Collector()
    for event in drive_events():
        collector.take(event)
    return collector.findings(landmarks)


@pytest.fixture(scope="session")
def collect():
    """Return the findings of some events."""
    from logpose.pipelines.report.stage import Collector

    def findings_of(events, landmarks=None):
        collector = Collector()
        for event in events:
            collector.take(event)
        return collector.findings(landmarks)

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
