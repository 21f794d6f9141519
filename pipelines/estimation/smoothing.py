"""A smoother: the likeliest chain of states given all measurements, by robust Gauss-Newton in O(N).

States follow one another in time. A factor is a kind of measurement, given as one vectorised function: of single
states, of neighbours i and i + 1 (motion), or of the border, few unknowns that all states share (scales, biases).
Angles are the caller's business: a state may have more numbers (m) than errors (d); ``retract`` adds an error to it.

Minimised is ``sum rho(|W r|^2)``, rho a robust loss (``losses.py``) and W the whitening of each residual. Each
iteration linearises, weighs by rho', solves the banded normal equations (``banded.py``) and steps; a step that does not
lower the sum is tried again with more damping (Levenberg-Marquardt). It ends when a step would gain less than the
tolerance, which is a squared length in standard deviations and so has no unit. The covariances are those of the
weighted, undamped problem at the end.

Source: P. J. Huber, E. M. Ronchetti, "Robust statistics", 2009, section 7.8 (iterated reweighting); H. E. Rauch,
F. Tung, C. T. Striebel, "Maximum likelihood estimates of linear dynamic systems", 1965: for a linear chain without
robust losses this is their smoother, and the backward recursion of the covariances is theirs.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from .banded import Factorised, Normal
from .losses import SQUARES, Loss

Array: TypeAlias = npt.NDArray[np.float64]
Indices: TypeAlias = npt.NDArray[np.intp]

Retract: TypeAlias = Callable[[Array, Array], Array]
"""States (N, m) and errors (N, d) -> states (N, m)."""

_ROUNDING = 1e-12
"""A sum that grows by no more than this part of itself has not grown."""

_LEAST_DAMPING, _LITTLE_DAMPING, _MOST_DAMPING = 1e-6, 1e-3, 1e10
"""Parts of the diagonal: the first that is tried, what hardly shortens a step, and what leaves nothing of it."""


class Linear(NamedTuple):
    """A factor at the present states: K residuals of r numbers, and how errors change them; None for what does not.

    Attributes:
        residual: (K, r) not whitened, angles wrapped.
        by_state: (K, r, d) change with the error of the state ``at``.
        by_next: (K, r, d) change with the error of the state after it.
        by_border: (K, r, p) change with the ``columns`` of the border.
    """

    residual: Array
    by_state: Array | None = None
    by_next: Array | None = None
    by_border: Array | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Factor:
    """Measurements of one kind.

    Attributes:
        linearise: (states (N, m), border (q,)) -> Linear.
        whiten: (K, r, r) W with W'W the inverse covariance of each residual (``whitening``).
        at: (K,) the state that each is of; not used if it is of the border alone.
        columns: (K, p) the unknowns of the border that each is of; not used if it is of none.
        loss: what a residual costs.
    """

    linearise: Callable[[Array, Array], Linear]
    whiten: Array
    at: Indices | None = None
    columns: Indices | None = None
    loss: Loss = SQUARES


@dataclass(frozen=True, slots=True, eq=False)
class Smoothed:
    """The likeliest chain.

    Attributes:
        states: (N, m).
        border: (q,).
        covariances: (N, d, d) of the errors of the states.
        border_covariance: (q, q).
        squares: of each factor (K,) the squared lengths of its whitened residuals.
        cost: sum of all losses.
        iterations: steps taken.
        is_converged: whether the last step gained less than the tolerance.
    """

    states: Array
    border: Array
    covariances: Array
    border_covariance: Array
    squares: tuple[Array, ...]
    cost: float
    iterations: int
    is_converged: bool


def smooth(
    states: Array,
    factors: Sequence[Factor],
    retract: Retract,
    *,
    border: Array | None = None,
    iterations: int = 50,
    tolerance: float = 1e-12,
) -> Smoothed:
    """Find the likeliest chain.

    Args:
        states: (N, m) start; N >= 1.
        factors: the measurements; together they determine all unknowns.
        retract: adds errors (N, d) to states.
        border: (q,) start of the unknowns that all states share, if there are any.
        iterations: the most steps.
        tolerance: gain of a step below which it is the last.

    Raises:
        ValueError: the measurements do not determine every unknown.
    """
    here = _at(factors, states, np.zeros(0) if border is None else border)
    damping, steps, is_converged = 0.0, 0, False
    while steps < iterations and not is_converged:
        there, damping, gain = _step(factors, here, retract, damping, tolerance)
        steps += 1
        is_converged = gain < tolerance and damping < _LITTLE_DAMPING
        if there is None:
            break
        here, damping = there, 0.1 * damping if damping > _LEAST_DAMPING else 0.0
    covariances, border_covariance = Factorised(_normal(factors, here)).marginals()
    return Smoothed(
        states=here.states,
        border=here.border,
        covariances=covariances,
        border_covariance=border_covariance,
        squares=tuple(_squares(linear) for linear in here.linears),
        cost=here.cost,
        iterations=steps,
        is_converged=is_converged,
    )


def whitening(covariances: Array) -> Array:
    """Return W (K, r, r) with W'W the inverses of covariances (K, r, r); they are positive definite."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariances)))


@dataclass(frozen=True, slots=True, eq=False)
class _Point:
    """States, and the whitened factors at them."""

    states: Array
    border: Array
    linears: tuple[Linear, ...]
    cost: float


def _at(factors: Sequence[Factor], states: Array, border: Array) -> _Point:
    linears = tuple(_whitened(factor, states, border) for factor in factors)
    cost = sum(float(np.sum(f.loss.cost(_squares(linear)))) for f, linear in zip(factors, linears, strict=True))
    return _Point(states, border, linears, cost)


def _whitened(factor: Factor, states: Array, border: Array) -> Linear:
    linear, W = factor.linearise(states, border), factor.whiten
    parts = (None if part is None else W @ part for part in linear[1:])
    return Linear((W @ linear.residual[..., None])[..., 0], *parts)


def _step(
    factors: Sequence[Factor], here: _Point, retract: Retract, damping: float, tolerance: float
) -> tuple[_Point | None, float, float]:
    """Return where a step leads (None: no step lowers the sum), its damping, and what it gains if all were linear."""
    normal = _normal(factors, here)
    while True:
        dx, db = Factorised(normal, damping).solve(normal.right, normal.right_border)
        gain = float(np.sum(dx * normal.right) + db @ normal.right_border)
        there = _at(factors, retract(here.states, dx), here.border + db)
        if there.cost <= here.cost * (1.0 + _ROUNDING):
            return there, damping, gain
        if damping > _MOST_DAMPING or (gain < tolerance and damping < _LITTLE_DAMPING):
            return None, damping, gain
        damping = max(10.0 * damping, _LEAST_DAMPING)


def _squares(linear: Linear) -> Array:
    return np.asarray(np.sum(linear.residual**2, axis=1))


def _normal(factors: Sequence[Factor], here: _Point) -> Normal:
    """Return the normal equations of the weighted problem."""
    d = next(part.shape[2] for linear in here.linears for part in linear[1:3] if part is not None)
    normal = Normal.zero(len(here.states), d, len(here.border))
    for factor, linear in zip(factors, here.linears, strict=True):
        root = np.sqrt(factor.loss.weight(_squares(linear)))
        r = root[:, None] * linear.residual
        state, following, beside = (None if part is None else root[:, None, None] * part for part in linear[1:])
        places = np.zeros(0, dtype=np.intp) if factor.at is None else factor.at
        for J, i in ((state, places), (following, places + 1)):
            if J is None:
                continue
            T = np.swapaxes(J, 1, 2)
            _add(normal.diagonal, i, T @ J)
            _add(normal.right, i, -(T @ r[..., None])[..., 0])
            if beside is not None and factor.columns is not None:
                where = (i[:, None, None], np.arange(d)[None, :, None], factor.columns[:, None, :])
                np.add.at(normal.border, where, T @ beside)
        if state is not None and following is not None:
            _add(normal.below, places, np.swapaxes(following, 1, 2) @ state)
        if beside is not None and factor.columns is not None:
            T, columns = np.swapaxes(beside, 1, 2), factor.columns
            np.add.at(normal.corner, (columns[:, :, None], columns[:, None, :]), T @ beside)
            np.add.at(normal.right_border, columns, -(T @ r[..., None])[..., 0])
    return normal


def _add(target: Array, i: Indices, values: Array) -> None:
    """Add to rows of ``target``, of which some may come several times."""
    if len(i) < 2 or np.all(np.diff(i) > 0):
        target[i] += values
    else:
        np.add.at(target, i, values)
