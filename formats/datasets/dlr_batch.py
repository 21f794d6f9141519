"""The reference of the DLR circles: all poses and landmarks at once, by sparse least squares with the given ids.

Minimises the Mahalanobis lengths of ::

    R(heading_i)^T (p_j - p_i) - step,  heading_j - heading_i - turn       (steps; i, j neighbours)
    R(heading_i)^T (l_k - p_i) - sighting                                 (sightings with an id)

over poses and landmarks, the first pose fixed at the origin: Levenberg-Marquardt on the sparse normal equations. A
first guess comes from the odometry, which has turned far enough away after 250 m that full steps would not converge.

Source: F. Dellaert, M. Kaess, "Square root SAM", International Journal of Robotics Research 25(12), 2006.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ..events import NO_ID, Array

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

MAX_ITERATIONS = 200
RELATIVE_GAIN = 1e-9


@dataclass(frozen=True, slots=True)
class Recording:
    """The rows of the file, in REP-103 axes.

    Attributes:
        steps: (N, 3) motion x, y [m], heading [rad] in the frame before it.
        step_covariances: (N, 3, 3).
        at: (M,) index of the step after which a circle was seen.
        xy: (M, 2) circles in robot coordinates [m].
        covariances: (M, 2, 2) [m^2].
        quality: (M,) 0..1.
        ids: (M,) NO_ID where none was given.
    """

    steps: Array
    step_covariances: Array
    at: npt.NDArray[np.int64]
    xy: Array
    covariances: Array
    quality: Array
    ids: npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Solution:
    """The least squares solution.

    Attributes:
        poses: (N + 1, 3) x, y [m], heading [rad], the first one at the origin.
        ids: (K,) of the landmarks, increasing.
        landmarks: (K, 2) [m].
        chi2: sum of the squared Mahalanobis lengths.
        dof: equations less unknowns.
        iterations: steps taken.
    """

    poses: Array
    ids: npt.NDArray[np.int64]
    landmarks: Array
    chi2: float
    dof: int
    iterations: int


def solve(recording: Recording) -> Solution:
    """Return the least squares solution of a recording.

    Raises:
        ValueError: a covariance is not positive, or the iteration does not end.
    """
    from scipy.sparse import diags
    from scipy.sparse.linalg import splu

    problem = _Problem(recording)
    state = problem.first_guess()
    residual, jacobian = problem.linearise(state)
    cost, damping = float(residual @ residual), 1e-3
    for iteration in range(1, MAX_ITERATIONS + 1):
        normal, gradient = (jacobian.T @ jacobian).tocsc(), jacobian.T @ residual
        accepted = False
        while not accepted and damping < 1e12:
            step = splu(normal + diags(damping * normal.diagonal(), format="csc")).solve(-gradient)
            trial = state + step
            new_residual = problem.residual(trial)
            new_cost = float(new_residual @ new_residual)
            accepted = new_cost <= cost
            damping = max(damping / 10, 1e-12) if accepted else damping * 10
        if not accepted or cost - new_cost <= RELATIVE_GAIN * cost:
            if accepted:
                state, cost = trial, new_cost
            poses, landmarks = problem.split(state)
            dof = len(residual) - len(state)
            return Solution(poses, problem.ids, landmarks, cost, dof, iteration)
        state, cost = trial, new_cost
        residual, jacobian = problem.linearise(state)
    raise ValueError(f"the least squares problem does not converge in {MAX_ITERATIONS} iterations")


def added_up(steps: Array) -> Array:
    """Return the poses (N + 1, 3) x, y [m], heading [rad] that steps (N, 3) lead to from the origin."""
    poses = np.zeros((len(steps) + 1, 3))
    for k, (dx, dy, turn) in enumerate(steps):
        x, y, heading = poses[k]
        c, s = np.cos(heading), np.sin(heading)
        poses[k + 1] = x + c * dx - s * dy, y + s * dx + c * dy, heading + turn
    return poses


class _Problem:
    """Residuals and their derivatives; the state is all poses but the first, then all landmarks, flat."""

    def __init__(self, recording: Recording) -> None:
        used = recording.ids != NO_ID
        self.steps = recording.steps
        self.at, self.xy = recording.at[used] + 1, recording.xy[used]  # pose 0 is before the first step
        self.ids, self.which = np.unique(recording.ids[used], return_inverse=True)
        self.step_roots = _roots(recording.step_covariances, "a step")
        self.sight_roots = _roots(recording.covariances[used], "a sighting")
        self.n = len(self.steps)

    def first_guess(self) -> Array:
        """Return the state with the poses of the odometry, and each landmark where it was seen first."""
        poses = added_up(self.steps)
        first = np.unique(self.which, return_index=True)[1]
        c, s = np.cos(poses[self.at[first], 2]), np.sin(poses[self.at[first], 2])
        x, y = self.xy[first].T
        landmarks = poses[self.at[first], :2] + np.column_stack([c * x - s * y, s * x + c * y])
        return np.concatenate([poses[1:].ravel(), landmarks.ravel()])

    def split(self, state: Array) -> tuple[Array, Array]:
        """Return all poses (N + 1, 3) and the landmarks (L, 2) of a state."""
        poses = np.concatenate([np.zeros((1, 3)), state[: 3 * self.n].reshape(-1, 3)])
        return poses, state[3 * self.n :].reshape(-1, 2)

    def residual(self, state: Array) -> Array:
        """Return what the steps and the sightings are off, in standard deviations (3 N + 2 M,)."""
        poses, landmarks = self.split(state)
        moved = np.column_stack([_turned_back(poses[:-1, 2], np.diff(poses[:, :2], axis=0)), np.diff(poses[:, 2])])
        off = moved - self.steps
        off[:, 2] = (off[:, 2] + np.pi) % (2 * np.pi) - np.pi
        seen = _turned_back(poses[self.at, 2], landmarks[self.which] - poses[self.at, :2]) - self.xy
        whitened = [np.einsum("nij,nj->ni", self.step_roots, off), np.einsum("nij,nj->ni", self.sight_roots, seen)]
        return np.concatenate([part.ravel() for part in whitened])

    def linearise(self, state: Array) -> tuple[Array, "csr_matrix"]:
        """Return the residual and its derivative by the state."""
        from scipy.sparse import coo_matrix

        poses, landmarks = self.split(state)
        n, m = self.n, len(self.at)
        entries: list[tuple[Array, npt.NDArray[np.int64], npt.NDArray[np.int64]]] = []

        def add(blocks: Array, rows: npt.NDArray[np.int64], columns: npt.NDArray[np.int64]) -> None:
            """Place blocks (K, a, b) with their first row and column; columns below 0 are the fixed pose."""
            kept = columns >= 0
            a, b = blocks.shape[1:]
            i = rows[kept, None, None] + np.arange(a)[None, :, None] + np.zeros((1, 1, b), np.int64)
            j = columns[kept, None, None] + np.arange(b)[None, None, :] + np.zeros((1, a, 1), np.int64)
            entries.append((blocks[kept].ravel(), i.ravel(), j.ravel()))

        from_i, to_j = np.zeros((n, 3, 3)), np.zeros((n, 3, 3))
        back, turning = _derivatives(poses[:-1, 2], np.diff(poses[:, :2], axis=0))
        from_i[:, :2, :2], from_i[:, :2, 2], from_i[:, 2, 2] = -back, turning, -1.0
        to_j[:, :2, :2], to_j[:, 2, 2] = back, 1.0
        rows = 3 * np.arange(n)
        add(self.step_roots @ from_i, rows, 3 * (np.arange(n) - 1))
        add(self.step_roots @ to_j, rows, 3 * np.arange(n))

        back, turning = _derivatives(poses[self.at, 2], landmarks[self.which] - poses[self.at, :2])
        from_pose = np.concatenate([-back, turning[:, :, None]], axis=2)
        rows = 3 * n + 2 * np.arange(m)
        add(self.sight_roots @ from_pose, rows, 3 * (self.at - 1))
        add(self.sight_roots @ back, rows, 3 * n + 2 * self.which)
        values, i, j = (np.concatenate(part) for part in zip(*entries, strict=True))
        return self.residual(state), coo_matrix((values, (i, j)), shape=(3 * n + 2 * m, len(state))).tocsr()


def _turned_back(headings: Array, vectors: Array) -> Array:
    """Return R(heading)^T v for (N,) and (N, 2)."""
    c, s = np.cos(headings), np.sin(headings)
    return np.column_stack([c * vectors[:, 0] + s * vectors[:, 1], -s * vectors[:, 0] + c * vectors[:, 1]])


def _derivatives(headings: Array, vectors: Array) -> tuple[Array, Array]:
    """Return R(heading)^T (N, 2, 2) and the derivative of R^T v by the heading (N, 2)."""
    c, s = np.cos(headings), np.sin(headings)
    back = np.stack([c, s, -s, c], axis=-1).reshape(-1, 2, 2)
    turned = _turned_back(headings, vectors)
    return back, np.column_stack([turned[:, 1], -turned[:, 0]])


def _roots(covariances: Array, what: str) -> Array:
    """Return W (N, k, k) with W^T W the inverse of each covariance."""
    try:
        return np.linalg.inv(np.linalg.cholesky(covariances))
    except np.linalg.LinAlgError as err:
        raise ValueError(f"the covariance of {what} is not positive definite") from err
