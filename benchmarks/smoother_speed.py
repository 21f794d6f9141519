"""How long the smoother takes for a chain of N states, and its linear algebra against a general sparse solver.

    python benchmarks/smoother_speed.py

Prints Markdown. A point moves in the plane with nearly constant velocity (4 numbers a state) and is measured at every
state; one in twenty measurements is false, by 30 m, and the odometer that the velocities are measured with has an
unknown scale, which touches every state. ``smooth`` is the whole run with Huber's loss, covariances of all states
included. ``solve`` is one solution of such normal equations without the border, ``splu`` the same by SuperLU, which
knows nothing of the band. Times are process CPU, medians over rounds.
"""

import time
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy.sparse import block_diag, bmat, csc_matrix
from scipy.sparse.linalg import splu

from logpose.pipelines.estimation.banded import Factorised, Normal
from logpose.pipelines.estimation.losses import Loss
from logpose.pipelines.estimation.smoothing import Factor, Linear, Smoothed, smooth

Array = npt.NDArray[np.float64]

SIZES, ROUNDS, DT = (1000, 5000, 20_000), 3, 0.1
MOVE = np.block([[np.eye(2), DT * np.eye(2)], [np.zeros((2, 2)), np.eye(2)]])
PUSH = np.array([0.002, 0.002, 0.02, 0.02])


def chain(n: int) -> tuple[Array, list[Factor]]:
    """Return a start far off, and the factors."""
    rng = np.random.default_rng(0)
    truth = np.zeros((n, 4))
    truth[0, 2:] = 1.0
    for i in range(1, n):
        truth[i] = MOVE @ truth[i - 1] + PUSH * rng.standard_normal(4)
    fix = truth[:, :2] + 0.05 * rng.standard_normal((n, 2))
    fix[rng.random(n) < 0.05] += 30.0
    speed = 1.03 * truth[:, 2:] + 0.05 * rng.standard_normal((n, 2))
    at, one = np.arange(n), np.tile(np.eye(4), (n, 1, 1))
    place, velocity = one[:, :2], one[:, 2:]

    def odometer(x: Array, scale: Array) -> Linear:
        return Linear((1 + scale) * x[:, 2:] - speed, (1 + scale) * velocity, by_border=x[:, 2:, None])

    return np.hstack([np.zeros((n, 2)), speed]), [
        Factor(lambda x, _: Linear(x[:, :2] - fix, place), place[:, :, :2] / 0.05, at, loss=Loss("huber", 3.0)),
        Factor(odometer, place[:, :, :2] / 0.05, at, np.zeros((n, 1), dtype=np.intp)),
        Factor(
            lambda x, _: Linear(x[1:] - x[:-1] @ MOVE.T, np.tile(-MOVE, (n - 1, 1, 1)), one[1:]),
            one[1:] / PUSH,
            at[:-1],
        ),
    ]


def equations(n: int) -> tuple[Normal, csc_matrix]:
    """Return normal equations of such a chain, for both solvers."""
    information = np.diag(PUSH**-2)
    normal = Normal.zero(n, 4, 0)
    normal.diagonal[:] = 400.0 * np.eye(4)
    normal.diagonal[:-1] += MOVE.T @ information @ MOVE
    normal.diagonal[1:] += information
    normal.below[:] = -information @ MOVE
    normal.right[:] = 1.0
    below = bmat([[None, csc_matrix((4, 4))], [block_diag(normal.below), None]])
    return normal, csc_matrix(block_diag(normal.diagonal) + below + below.T)


def seconds(work: Callable[[], object]) -> float:
    """Return the median CPU time of some work."""
    times = []
    for _ in range(ROUNDS):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return float(np.median(times))


def main() -> None:
    """Time and print."""
    print("| states | smooth s | steps | solve ms | splu ms | solve / splu |")
    print("|---|---|---|---|---|---|")
    for n in SIZES:
        row(n)


def row(n: int) -> None:
    """Time and print one size."""
    start, factors = chain(n)
    normal, matrix = equations(n)
    results: list[Smoothed] = []
    whole = seconds(lambda: results.append(smooth(start, factors, lambda x, e: x + e, border=np.zeros(1))))
    ours = seconds(lambda: Factorised(normal).solve(normal.right, normal.right_border))
    theirs = seconds(lambda: splu(matrix).solve(normal.right.ravel()))
    print(
        f"| {n} | {whole:.2f} | {results[-1].iterations} | {1e3 * ours:.1f} | {1e3 * theirs:.1f} "
        f"| {ours / theirs:.2f} |",
        flush=True,
    )


if __name__ == "__main__":
    main()
