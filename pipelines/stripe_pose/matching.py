"""Which edges of one row could be those of a mark: by polarity, and by the projectivity that a mark obeys.

The bearings of a mark's lines are a projectivity of their abscissae, u = (a X + c) / (b X + 1) (``pose.py``). Three
edges fix it and every further one tests it; the cross ratio (the paper's eq. (19)) is this test for four lines.
``match_row`` tries every run of edges with the mark's polarities, skipping up to two edges that do not belong to it;
``match_part`` starts from three neighbours and grows to both sides, for a mark that is partly hidden. Both compare
with a loose tolerance: what a single row proposes, all rows together must confirm.

Compiled by numba; imported where it is used.
"""

import math

import numpy as np
import numpy.typing as npt
from numba import types

from ..engine.compiled import F64_1D, F64_1D_IN, I64_1D, I64_1D_IN, compiled, floats

Array = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

I64_2D = types.Array(types.int64, 2, "A")

NONE = -1


@compiled(floats(3)(floats(3), floats(3)))
def projectivity(X: tuple[float, float, float], u: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return (a, b, c) with a X - b u X + c = u for three lines; a = nan where two coincide."""
    p, q = u[1] - u[0], u[2] - u[0]
    first_a, second_a = X[1] - X[0], X[2] - X[0]
    first_b, second_b = u[0] * X[0] - u[1] * X[1], u[0] * X[0] - u[2] * X[2]
    det = first_a * second_b - first_b * second_a
    if det == 0.0:
        return np.nan, np.nan, np.nan
    a = (p * second_b - q * first_b) / det
    b = (first_a * q - second_a * p) / det
    return a, b, u[0] - X[0] * a + u[0] * X[0] * b


@compiled(floats(3)(F64_1D, F64_1D, types.int64))
def fitted(X: Array, u: Array, n: int) -> tuple[float, float, float]:
    """Return (a, b, c) of n lines by linear least squares."""
    if n == 3:
        return projectivity((X[0], X[1], X[2]), (u[0], u[1], u[2]))
    # The rows (X, -u X, 1), with u from its mean so that the normal equations keep their digits.
    mean = 0.0
    for k in range(n):
        mean += u[k] / n
    A, y = np.zeros((3, 3)), np.zeros(3)
    for k in range(n):
        v = u[k] - mean
        row = (X[k], -v * X[k], 1.0)
        for i in range(3):
            y[i] += row[i] * v
            for j in range(3):
                A[i, j] += row[i] * row[j]
    for i in range(3):  # Gauss without pivoting: the matrix is symmetric and positive
        for j in range(i + 1, 3):
            factor = A[j, i] / A[i, i]
            for k in range(3):
                A[j, k] -= factor * A[i, k]
            y[j] -= factor * y[i]
    c = y[2] / A[2, 2]
    b = (y[1] - A[1, 2] * c) / A[1, 1]
    a = (y[0] - A[0, 1] * b - A[0, 2] * c) / A[0, 0]
    return a + mean * b, b, c + mean  # u - mean obeys (a, b, c)


@compiled(types.boolean(floats(3), F64_1D_IN, F64_1D_IN))
def is_possible(abc: tuple[float, float, float], X: Array, gates: Array) -> bool:
    """Tell whether a projectivity is a view of a mark: ahead, from its front, not too turned, near or far.

    Args:
        abc: the projectivity.
        X: (m,) abscissae of all edges of the mark [m].
        gates: largest angle [rad], least and greatest distance [m].
    """
    a, b, c = abc
    size = math.hypot(a, b)
    if not size > 0.0 or a - b * c <= 0.0:
        return False
    if b * X[0] + 1.0 <= 0.0 or b * X[X.size - 1] + 1.0 <= 0.0:
        return False
    return bool(abs(math.atan2(b, a)) <= gates[0] and gates[1] <= 1.0 / size <= gates[2])


@compiled(types.int64(F64_1D, F64_1D, types.int64, types.float64, types.float64, types.int64, types.float64))
def nearest(u: Array, strengths: Array, n: int, place: float, sign: float, after: int, tolerance: float) -> int:
    """Return which edge after ``after`` of one sign is nearest to a place, ``NONE`` if it is not within tolerance."""
    best, at = tolerance, NONE
    for k in range(after + 1, n):
        if u[k] > place + best:
            break
        if strengths[k] * sign > 0.0 and abs(u[k] - place) <= best:
            best, at = abs(u[k] - place), k
    return at


@compiled(
    types.int64(
        F64_1D, F64_1D, types.int64, F64_1D_IN, I64_1D_IN, types.int64, types.float64, F64_1D_IN, I64_2D, F64_1D
    )
)
def match_row(  # noqa: C901, PLR0912  # a search, written out for speed
    u: Array, strengths: Array, n: int, X: Array, polarity: Ints, skips: int, tolerance: float, gates: Array,
    matches: Ints, errors: Array,
) -> int:  # fmt: skip
    """Find the whole mark among the edges of one row.

    Args:
        u: (N,) places of the edges, increasing; the first n count [1].
        strengths: (N,) their responses, positive from dark to bright.
        n: number of edges.
        X: (m,) abscissae of the mark's edges, increasing [m].
        polarity: (m,) 1 from dark to bright, -1 from bright to dark.
        skips: at most so many edges in between are not the mark's.
        tolerance: largest difference of an edge from its place [1].
        gates: see ``is_possible``.
        matches: (most, m) filled with the edges of each match.
        errors: (most,) filled with the root mean square of the differences.

    Returns:
        Number of matches.
    """
    m, count = X.size, 0
    middle = m // 2
    at_X, at_u = np.empty(m), np.empty(m)
    for i in range(n - m + 1):
        if strengths[i] * polarity[0] <= 0.0:
            continue
        for skipped in range(skips + 1):
            j = i + m - 1 + skipped
            if j >= n or strengths[j] * polarity[m - 1] <= 0.0:
                continue
            for k in range(i + middle, i + middle + skipped + 1):
                if strengths[k] * polarity[middle] <= 0.0:
                    continue
                abc = projectivity((X[0], X[middle], X[m - 1]), (u[i], u[k], u[j]))
                if not is_possible(abc, X, gates):
                    continue
                before, is_whole = i - 1, True
                for q in range(m):
                    place = (abc[0] * X[q] + abc[2]) / (abc[1] * X[q] + 1.0)
                    # Twice the tolerance: three edges alone carry their own errors into all places.
                    found = nearest(u, strengths, n, place, float(polarity[q]), before, 2.0 * tolerance)
                    if found == NONE:
                        is_whole = False
                        break
                    matches[count, q] = found
                    at_X[q], at_u[q] = X[q], u[found]
                    before = found
                if not is_whole:
                    continue
                abc = fitted(at_X, at_u, m)
                if not is_possible(abc, X, gates):
                    continue
                squares = 0.0
                for q in range(m):
                    squares += ((abc[0] * X[q] + abc[2]) / (abc[1] * X[q] + 1.0) - at_u[q]) ** 2
                error = math.sqrt(squares / m)
                if error > tolerance:
                    continue
                is_new = count == 0 or matches[count - 1, 0] != matches[count, 0] or error < errors[count - 1]
                if not is_new:
                    continue
                if count > 0 and matches[count - 1, 0] == matches[count, 0]:  # one match per first edge: the best
                    matches[count - 1] = matches[count]
                    errors[count - 1] = error
                else:
                    errors[count] = error
                    count += 1
                    if count == errors.size - 1:
                        return count
    return count


@compiled(
    types.int64(
        F64_1D, F64_1D, types.int64, F64_1D_IN, I64_1D_IN, types.int64, types.float64, F64_1D_IN, I64_1D, I64_1D
    )
)
def match_part(  # noqa: C901, PLR0912  # likewise
    u: Array, strengths: Array, n: int, X: Array, polarity: Ints, least: int, tolerance: float, gates: Array,
    best: Ints, trial: Ints,
) -> int:  # fmt: skip
    """Find the largest visible part of a mark among the edges of one row, from three neighbours outwards.

    Args:
        u: as for ``match_row``, and so are the next ones.
        strengths: likewise.
        n: likewise.
        X: likewise.
        polarity: likewise.
        least: a part has at least so many edges.
        tolerance: as for ``match_row``.
        gates: likewise.
        best: (m,) filled with the edge of each of the mark's, ``NONE`` where it is hidden.
        trial: (m,) scratch.

    Returns:
        Number of edges of the best part; 0 if there is none.
    """
    m, n_best, least_error = X.size, 0, np.inf
    at_X, at_u = np.empty(m), np.empty(m)
    for i in range(n - 2):
        for p in range(m - 2):
            if strengths[i] * polarity[p] <= 0.0 or strengths[i + 1] * polarity[p + 1] <= 0.0:
                continue
            if strengths[i + 2] * polarity[p + 2] <= 0.0:
                continue
            trial[:] = NONE
            for q in range(3):
                trial[p + q] = i + q
                at_X[q], at_u[q] = X[p + q], u[i + q]
            abc, members, is_good = fitted(at_X, at_u, 3), 3, True
            if not is_possible(abc, X, gates):
                continue
            for side in (1, -1):
                q = p + 3 if side > 0 else p - 1
                while is_good and 0 <= q < m:
                    place = (abc[0] * X[q] + abc[2]) / (abc[1] * X[q] + 1.0)
                    k = nearest(u, strengths, n, place, float(polarity[q]), -1, 2.0 * tolerance)
                    if k != NONE:
                        trial[q] = k
                        at_X[members], at_u[members] = X[q], u[k]
                        members += 1
                        abc = fitted(at_X, at_u, members)
                        is_good = is_possible(abc, X, gates)
                    q += side
            if not is_good or members < least or members < n_best:
                continue
            squares, before, runs = 0.0, NONE, 0
            for q in range(m):
                if trial[q] == NONE and (q == 0 or trial[q - 1] != NONE):
                    runs += 1
                if trial[q] != NONE:
                    squares += ((abc[0] * X[q] + abc[2]) / (abc[1] * X[q] + 1.0) - u[trial[q]]) ** 2
                    is_good &= trial[q] > before
                    before = trial[q]
            error = math.sqrt(squares / members)
            is_good &= runs <= 1  # one thing hides neighbours
            if is_good and error <= tolerance and (members > n_best or error < least_error):
                n_best, least_error = members, error
                best[:] = trial
    return n_best
