"""MRCLAM set 1, robots 1 and 2: localisation among posts that look alike, beside the same filter given the true ids.

    LOGPOSE_DATA=.../data python benchmarks/mrclam.py [--seeds 3]

Prints Markdown. The position error is not aligned and is taken on a uniform 0.1 s grid where the truth has
samples on both sides within 0.11 s; ``lost`` is an error above 1 m for more than 10 s without a break. ``ids
right``: of the sightings of posts that were given an id, the share whose post is within 0.4 m of the true
one; ``used``: the share of all sightings of posts with a right id. NEES has 3 degrees of freedom (x, y,
heading): 3 on average if honest.
"""

import argparse
import math
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import yaml
from recordings import folder

from logpose.formats.datasets.mrclam import convert_mrclam
from logpose.formats.events import Pose, Sightings
from logpose.formats.log import open_log
from logpose.formats.maps.landmarks import read_landmarks
from logpose.pipelines.localize_pf.params import LocalizePfParams
from logpose.pipelines.localize_pf.stage import localize_pf

Array = npt.NDArray[np.float64]

NOISE = Path(__file__).parent.parent / "papers" / "ceiling" / "mrclam.yaml"
ROLES = ("odometry", "sightings", "true_sightings", "initial_pose", "truth")
GRID_S, GAP_S, LOST_M, LOST_S, SAME_M = 0.1, 0.11, 1.0, 10.0, 0.4


@dataclass
class Run:
    """What one run made."""

    poses: list[Pose]
    truth: Array
    named: list[tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]]
    seconds: float
    lost_share: float


def noise(**changes: Any) -> dict[str, Any]:
    """Return the parameters of mrclam.yaml."""
    document = yaml.safe_load(NOISE.read_text())
    return {**document["stages"][0]["localize-pf"], **changes}


def run(log: Path, **changes: Any) -> Run:
    """Localise once."""
    params = LocalizePfParams(map=str(log.with_suffix(".landmarks.yaml")), **noise(**changes))
    poses: list[Pose] = []
    truth: list[tuple[float, float, float, float]] = []
    true_ids: dict[int, npt.NDArray[np.int64]] = {}
    named = []
    lost_share = 0.0
    start = time.process_time()
    for event in localize_pf(iter(open_log([log], dict.fromkeys(ROLES, "auto"))), params):
        if isinstance(event, Pose) and event.source == "localize-pf":
            poses.append(event)
        elif isinstance(event, Pose) and event.source == "truth":
            truth.append((event.stamp * 1e-9, event.position[0], event.position[1], heading(event)))
        elif isinstance(event, Sightings) and event.source == "true_sightings":
            true_ids[event.stamp] = event.ids
        elif isinstance(event, Sightings) and event.source == "localize-pf":
            named.append((event.stamp, event.ids))
        elif event.source == "localize-pf" and hasattr(event, "values"):
            lost_share = event.values["status_share"]["lost"]
    seconds = time.process_time() - start
    pairs = [(ids, true_ids[stamp]) for stamp, ids in named]
    return Run(poses, np.array(truth), pairs, seconds, lost_share)


def heading(pose: Pose) -> float:
    return 2.0 * math.atan2(pose.orientation[2], pose.orientation[3])


def score(made: Run, landmarks: dict[int, Array]) -> dict[str, float]:
    """Return the figures of one row."""
    t = np.array([p.stamp * 1e-9 for p in made.poses])
    xy = np.array([p.position[:2] for p in made.poses])
    truth = made.truth
    grid = np.arange(max(t[0], truth[0, 0]), min(t[-1], truth[-1, 0]), GRID_S)
    after = np.clip(np.searchsorted(truth[:, 0], grid), 1, len(truth) - 1)
    grid = grid[truth[after, 0] - truth[after - 1, 0] < GAP_S]
    at = [np.interp(grid, t, xy[:, i]) - np.interp(grid, truth[:, 0], truth[:, 1 + i]) for i in (0, 1)]
    error = np.hypot(*at)
    longest = run_length = 0
    for is_far in error > LOST_M:
        run_length = run_length + 1 if is_far else 0
        longest = max(longest, run_length)
    n_posts = n_named = n_right = 0
    for ids, true in made.named:
        for mine, post in zip(ids.tolist(), true.tolist(), strict=True):
            if post in landmarks:
                n_posts += 1
                n_named += mine in landmarks
                n_right += mine in landmarks and np.hypot(*(landmarks[mine] - landmarks[post])) < SAME_M
    nees = [consistency(p, truth) for p in made.poses if p.info["n_seen"]]
    return {
        "ate": float(np.sqrt(np.mean(error**2))),
        "median": float(np.median(error)),
        "max": float(error.max()),
        "lost": float(longest * GRID_S > LOST_S),
        "right": n_right / max(n_named, 1),
        "used": n_right / max(n_posts, 1),
        "nees": float(np.nanmean(nees)),
        "says_lost": made.lost_share,
        "seconds": made.seconds,
    }


def consistency(pose: Pose, truth: Array) -> float:
    """Return the normalised squared error of one pose; nan where there is no truth."""
    t = pose.stamp * 1e-9
    k = int(np.searchsorted(truth[:, 0], t))
    if k == 0 or k == len(truth) or truth[k, 0] - truth[k - 1, 0] > GAP_S or pose.covariance is None:
        return math.nan
    x, y = (np.interp(t, truth[k - 1 : k + 1, 0], truth[k - 1 : k + 1, i]) for i in (1, 2))
    turn = math.remainder(heading(pose) - truth[k, 3], 2.0 * math.pi)
    error = np.array([pose.position[0] - x, pose.position[1] - y, turn])
    cov = pose.covariance[np.ix_([0, 1, 5], [0, 1, 5])]
    return float(error @ np.linalg.solve(cov, error))


def job(task: tuple[Path, str, int]) -> dict[str, float]:
    """Run and score one seed."""
    log, association, seed = task
    landmarks = read_landmarks(log.with_suffix(".landmarks.yaml"))
    by_id = dict(zip(landmarks.ids.tolist(), landmarks.positions[:, :2], strict=True))
    return score(run(log, association=association, seed=seed), by_id)


def main() -> None:
    """Convert, run, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--set", type=int, default=1)
    parser.add_argument("--robots", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--jobs", type=int, default=2)
    args = parser.parse_args()
    data = folder()
    with tempfile.TemporaryDirectory() as temporary, ProcessPoolExecutor(args.jobs) as pool:
        tasks: list[tuple[Path, str, int]] = []
        for robot in args.robots:
            log = Path(temporary) / f"robot{robot}.mcap"
            convert_mrclam(data / "mrclam" / f"MRCLAM_Dataset{args.set}", log, robot=robot)
            tasks += [(log, "given", 0)] + [(log, "unknown", seed) for seed in range(args.seeds)]
        rows = pool.map(job, tasks)
        print(
            "| robot | ids | seed | ATE RMSE m | median m | max m | lost | ids right % | used % | NEES | says lost % "
            "| CPU s |"
        )
        print("|---|---|---|---|---|---|---|---|---|---|---|---|")
        for (log, association, seed), row in zip(tasks, rows, strict=True):
            print(
                f"| {log.stem} | {'true' if association == 'given' else 'dropped'} | {seed} | {row['ate']:.3f} "
                f"| {row['median']:.3f} | {row['max']:.2f} | {'YES' if row['lost'] else 'no'} "
                f"| {100 * row['right']:.1f} | {100 * row['used']:.1f} | {row['nees']:.1f} "
                f"| {100 * row['says_lost']:.1f} | {row['seconds']:.1f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
