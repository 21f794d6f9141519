"""How fast one step of the particle filter is, against its floor and against a filter written straight down.

    python benchmarks/filter_speed.py

Prints Markdown. One step is the motion of the cloud, the association of M sightings with 297 landmarks,
weighting and resampling. All are timed in the same process, interleaved, on process CPU; figures are medians
over rounds, the ratio columns medians of the ratios per round. ``random numbers`` draws two normal numbers
per particle, which any particle filter that samples its motion must; ``brute force`` is a bootstrap filter in
numpy that compares every particle with every landmark. ``best`` draws no numbers for the motion while the
robot is known well, and corrects with every sighting as a Kalman filter does, which the brute force does not.
"""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from logpose.pipelines.geometry.motion import twist_increment
from logpose.pipelines.localize_pf.filter import ParticleFilter
from logpose.pipelines.localize_pf.paper import PaperFilter
from logpose.pipelines.localize_pf.params import LocalizePfParams

Array = npt.NDArray[np.float64]

STEP = twist_increment((0.36, 0.0, 0.1), 0.086)
SIZES, SEEN, ROUNDS, REPEAT = (200, 500, 2000), (0, 1, 3, 6), 9, 10


def random_numbers(n: int) -> Callable[[Array], None]:
    """Return the floor."""
    rng = np.random.default_rng(0)

    def step(z: Array) -> None:
        del z
        rng.standard_normal(2 * n, dtype=np.float32)

    return step


def brute_force(landmarks: Array, n: int) -> Callable[[Array], None]:
    """Return one step of the plainest bootstrap filter."""
    rng = np.random.default_rng(0)
    state = {"x": np.tile([50.0, 25.0, 0.0], (n, 1))}

    def step(z: Array) -> None:
        x = state["x"]
        v = 0.36 + 0.02 * rng.standard_normal(n)
        w = 0.1 + 0.02 * rng.standard_normal(n)
        x = x + np.column_stack([v * np.cos(x[:, 2]), v * np.sin(x[:, 2]), w]) * 0.086
        log_w = np.zeros(n)
        c, s = np.cos(x[:, 2]), np.sin(x[:, 2])
        for zx, zy in z:
            px, py = x[:, 0] + c * zx - s * zy, x[:, 1] + s * zx + c * zy
            square = (px[:, None] - landmarks[:, 0]) ** 2 + (py[:, None] - landmarks[:, 1]) ** 2
            log_w += np.log(0.9 * np.exp(-square.min(axis=1) / (2 * 0.05**2)) / (2 * np.pi * 0.05**2) + 0.02)
        weights = np.exp(log_w - log_w.max())
        chosen = np.searchsorted(np.cumsum(weights / weights.sum()), (np.arange(n) + rng.random()) / n)
        state["x"] = x[np.minimum(chosen, n - 1)]

    return step


def ours(kind: type[Any], landmarks: Array, n: int, method: str) -> Callable[[Array], None]:
    """Return one step of a filter of the product."""
    pf = kind(landmarks, 0.015**2, LocalizePfParams(map="-", particles=n, method=method))
    pf.start(np.array([50.0, 25.0, 0.0]), np.diag([0.01, 0.01, 0.001]))

    def step(z: Array) -> None:
        pf.predict(STEP)
        pf.update(z, np.tile(1e-4 * np.eye(2), (len(z), 1, 1)))
        pf.estimate()

    return step


def seconds(step: Callable[[Array], None], z: Array) -> float:
    start = time.process_time()
    for _ in range(REPEAT):
        step(z)
    return (time.process_time() - start) / REPEAT


def main() -> None:
    """Time and print."""
    rng = np.random.default_rng(1)
    landmarks = np.vstack([rng.uniform((0, 0), (100, 50), (291, 2)), rng.uniform((49, 24), (51, 26), (6, 2))])
    print(
        "| particles / seen | random numbers us | brute force us | best us | / random | / brute | paper us | / brute |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for n in SIZES:
        for m in SEEN:
            z = landmarks[-6:][:m] - (50.0, 25.0)
            steps = {
                "random": random_numbers(n),
                "brute": brute_force(landmarks, n),
                "best": ours(ParticleFilter, landmarks, n, "best"),
                "paper": ours(PaperFilter, landmarks, n, "paper"),
            }
            rounds = [{name: seconds(step, z) for name, step in steps.items()} for _ in range(ROUNDS)]
            t = {name: 1e6 * np.median([r[name] for r in rounds]) for name in steps}
            ratio = {
                (a, b): np.median([r[a] / r[b] for r in rounds])
                for a, b in (("best", "random"), ("best", "brute"), ("paper", "brute"))
            }
            print(
                f"| {n} / {m} | {t['random']:.1f} | {t['brute']:.0f} | {t['best']:.0f} "
                f"| {ratio['best', 'random']:.0f} | {ratio['best', 'brute']:.2f} | {t['paper']:.0f} "
                f"| {ratio['paper', 'brute']:.2f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
