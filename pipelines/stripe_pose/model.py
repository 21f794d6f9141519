"""What the lines and the ends of a mark's bars look like from a pose, with derivatives: the forward model of ``solve``.

Compiled by numba; imported where it is used.
"""

import math

import numpy as np
import numpy.typing as npt
from numba import types

from ..engine.compiled import F64_1D, F64_1D_IN, F64_2D, F64_2D_IN, compiled
from .matching import fitted
from .pose import DX, DY, DZ, PHI, ROLL, TILT

Array = npt.NDArray[np.float64]

MAX_STEPS = 15
"""Gauss-Newton steps; three or four are usual."""


@compiled(types.void(types.float64, types.float64, F64_2D, F64_2D, F64_2D))
def turn(tilt: float, roll: float, Q: Array, by_tilt: Array, by_roll: Array) -> None:
    """Fill Q (3, 3) of ``levelling.levelling_matrix`` and its derivatives by tilt and by roll."""
    ct, st, cr, sr = math.cos(tilt), math.sin(tilt), math.cos(roll), math.sin(roll)
    Q[0, 0], Q[0, 1], Q[0, 2] = cr, sr * st, -sr * ct
    Q[1, 0], Q[1, 1], Q[1, 2] = 0.0, ct, st
    Q[2, 0], Q[2, 1], Q[2, 2] = sr, -cr * st, cr * ct
    by_tilt[0, 0], by_tilt[0, 1], by_tilt[0, 2] = 0.0, sr * ct, sr * st
    by_tilt[1, 0], by_tilt[1, 1], by_tilt[1, 2] = 0.0, -st, ct
    by_tilt[2, 0], by_tilt[2, 1], by_tilt[2, 2] = 0.0, -cr * ct, -cr * st
    by_roll[0, 0], by_roll[0, 1], by_roll[0, 2] = -sr, cr * st, -cr * ct
    by_roll[1, 0], by_roll[1, 1], by_roll[1, 2] = 0.0, 0.0, 0.0
    by_roll[2, 0], by_roll[2, 1], by_roll[2, 2] = cr, sr * st, -sr * ct


@compiled(types.void(F64_1D, F64_1D_IN, F64_1D_IN, F64_2D, F64_2D))
def line_model(values: Array, X: Array, z: Array, place: Array, slope: Array) -> None:
    """Say where lines stand at given heights of the image and how they slope: eqs. (1) of pose, (2) of levelling.

    Args:
        values: (5,) or more: phi, D_x, D_y, tilt, roll [rad, m].
        X: (n,) abscissae [m].
        z: (n,) heights in the camera frame at y = 1 [1].
        place: (n, 6) filled with x and its derivatives by the five unknowns.
        slope: (n, 6) filled with dx/dz and its derivatives.
    """
    c, s = math.cos(values[PHI]), math.sin(values[PHI])
    Q, by_tilt, by_roll = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    turn(values[TILT], values[ROLL], Q, by_tilt, by_roll)
    for i in range(X.size):
        right, ahead = c * X[i] + values[DX], s * X[i] + values[DY]
        u = right / ahead
        by_pose = ((-s * X[i] - u * c * X[i]) / ahead, 1.0 / ahead, -u / ahead)
        n0, n1, n2 = Q[0, 0] - u * Q[0, 1], Q[1, 0] - u * Q[1, 1], Q[2, 0] - u * Q[2, 1]
        k = -n2 / n0
        x = -n1 / n0 + k * z[i]
        place[i, 0], slope[i, 0] = x, k
        by_u = (Q[0, 1] * x + Q[1, 1] + Q[2, 1] * z[i]) / n0
        k_by_u = (Q[2, 1] + k * Q[0, 1]) / n0
        for j in range(3):
            place[i, 1 + j], slope[i, 1 + j] = by_u * by_pose[j], k_by_u * by_pose[j]
        for j in range(2):
            D = by_tilt if j == 0 else by_roll
            d0, d1, d2 = D[0, 0] - u * D[0, 1], D[1, 0] - u * D[1, 1], D[2, 0] - u * D[2, 1]
            place[i, 1 + TILT + j] = -(d0 * x + d1 + d2 * z[i]) / n0
            slope[i, 1 + TILT + j] = -(d2 + k * d0) / n0


@compiled(types.void(F64_1D, F64_1D_IN, F64_1D_IN, F64_2D))
def end_model(values: Array, X: Array, half: Array, height: Array) -> None:
    """Say how high the ends of bars are seen.

    An end is seen where the bar's line and its upper or lower border cross; along the line only z is measured.

    Args:
        values: (6,) phi, D_x, D_y, tilt, roll, D_z [rad, m].
        X: (k,) abscissae of the middles of the bars [m].
        half: (k,) plus or minus half their height [m].
        height: (k, 7) filled with z and its derivatives by the six unknowns.
    """
    c, s = math.cos(values[PHI]), math.sin(values[PHI])
    Q, by_tilt, by_roll = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    turn(values[TILT], values[ROLL], Q, by_tilt, by_roll)
    d = np.zeros((6, 3))
    for i in range(X.size):
        right, ahead, up = c * X[i] + values[DX], s * X[i] + values[DY], values[DZ] + half[i]
        d[PHI, 0], d[PHI, 1] = -s * X[i], c * X[i]
        d[DX, 0], d[DY, 1], d[DZ, 2] = 1.0, 1.0, 1.0
        y = Q[1, 0] * right + Q[1, 1] * ahead + Q[1, 2] * up
        z = (Q[2, 0] * right + Q[2, 1] * ahead + Q[2, 2] * up) / y
        height[i, 0] = z
        for j in range(6):
            if j in (TILT, ROLL):
                D = by_tilt if j == TILT else by_roll
                dy = D[1, 0] * right + D[1, 1] * ahead + D[1, 2] * up
                dz = D[2, 0] * right + D[2, 1] * ahead + D[2, 2] * up
            else:
                dy = Q[1, 0] * d[j, 0] + Q[1, 1] * d[j, 1] + Q[1, 2] * d[j, 2]
                dz = Q[2, 0] * d[j, 0] + Q[2, 1] * d[j, 1] + Q[2, 2] * d[j, 2]
            height[i, 1 + j] = (dz - z * dy) / y


@compiled(types.boolean(F64_2D_IN, F64_2D_IN, types.float64, types.float64, F64_1D))
def begin(lines: Array, ends: Array, tilt: float, roll: float, values: Array) -> bool:
    """Start from the closed form of ``pose.py`` on the levelled lines; False where they fix no pose.

    Args:
        lines: as for ``descend``.
        ends: likewise.
        tilt: of the camera [rad].
        roll: likewise.
        values: (5,), or (6,) with ends, filled.
    """
    n, k = lines.shape[0], ends.shape[0]
    Q, by_tilt, by_roll = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    turn(tilt, roll, Q, by_tilt, by_roll)
    X, u = np.empty(n), np.empty(n)
    for i in range(n):
        x, z = lines[i, 1], lines[i, 3]
        X[i] = lines[i, 0]
        u[i] = (Q[0, 0] * x + Q[1, 0] + Q[2, 0] * z) / (Q[0, 1] * x + Q[1, 1] + Q[2, 1] * z)
    a, b, c = fitted(X, u, n)
    size = math.hypot(a, b)
    if not (size > 0.0 and np.isfinite(size) and np.isfinite(c)):
        return False
    values[PHI], values[DX], values[DY] = math.atan2(b, a), c / size, 1.0 / size
    values[TILT], values[ROLL] = tilt, roll
    if k > 0:
        values[DZ] = 0.0
        for i in range(k):
            x, z = ends[i, 2], ends[i, 3]
            rise = (Q[0, 2] * x + Q[1, 2] + Q[2, 2] * z) / (Q[0, 1] * x + Q[1, 1] + Q[2, 1] * z)
            ahead = math.sin(values[PHI]) * ends[i, 0] + values[DY]
            values[DZ] += (rise * ahead - ends[i, 1]) / k
    return True


@compiled(types.void(F64_1D, F64_2D_IN, F64_2D, F64_2D, F64_1D, F64_1D, F64_1D))
def add_lines(
    values: Array, lines: Array, weight: Array, normal: Array, right: Array, residual: Array, chi2: Array
) -> None:
    """Add places and slopes of lines to the normal equations; ``weight`` (n, n) is the information of the places."""
    n = lines.shape[0]
    X, z = np.ascontiguousarray(lines[:, 0]), np.ascontiguousarray(lines[:, 3])
    place, slope, weighed = np.empty((n, 6)), np.empty((n, 6)), np.empty((n, 6))
    line_model(values, X, z, place, slope)
    for i in range(n):
        residual[i] = lines[i, 1] - place[i, 0]
    for i in range(n):  # weight times (residual, Jacobian)
        for a in range(6):
            total = 0.0
            for j in range(n):
                total += weight[i, j] * (residual[j] if a == 0 else place[j, a])
            weighed[i, a] = total
    for i in range(n):
        chi2[0] += residual[i] * weighed[i, 0]
        r, w = lines[i, 2] - slope[i, 0], 1.0 / lines[i, 4]
        chi2[0] += r * r * w
        for a in range(5):
            right[a] += place[i, 1 + a] * weighed[i, 0] + slope[i, 1 + a] * r * w
            for b in range(5):
                normal[a, b] += place[i, 1 + a] * weighed[i, 1 + b] + slope[i, 1 + a] * slope[i, 1 + b] * w


@compiled(types.void(F64_1D, F64_2D_IN, F64_2D, F64_1D, F64_1D))
def add_ends(values: Array, ends: Array, normal: Array, right: Array, chi2: Array) -> None:
    """Add heights of the ends of bars to the normal equations."""
    k = ends.shape[0]
    height = np.empty((k, 7))
    end_model(values, np.ascontiguousarray(ends[:, 0]), np.ascontiguousarray(ends[:, 1]), height)
    for i in range(k):
        r, w = ends[i, 3] - height[i, 0], 1.0 / ends[i, 4]
        chi2[0] += r * r * w
        for a in range(6):
            right[a] += height[i, 1 + a] * r * w
            for b in range(6):
                normal[a, b] += height[i, 1 + a] * height[i, 1 + b] * w


@compiled(types.void(F64_1D, F64_1D_IN, F64_2D, F64_1D, F64_1D))
def add_attitude(values: Array, attitude: Array, normal: Array, right: Array, chi2: Array) -> None:
    """Add what is known of tilt and roll to the normal equations."""
    for j in range(2):
        sd = attitude[2 + j]
        if sd == 0.0:  # known exactly: no unknown
            normal[TILT + j, :], normal[:, TILT + j] = 0.0, 0.0
            normal[TILT + j, TILT + j], right[TILT + j] = 1.0, 0.0
        elif sd < np.inf:
            r = (attitude[j] - values[TILT + j]) / sd
            chi2[0] += r * r
            normal[TILT + j, TILT + j] += 1.0 / (sd * sd)
            right[TILT + j] += r / sd


@compiled(types.boolean(F64_1D, F64_2D_IN, F64_2D_IN, F64_2D_IN, F64_1D_IN, F64_2D, F64_1D, F64_1D))
def descend(  # noqa: C901, PLR0912  # sums, written out for speed
    values: Array, lines: Array, ends: Array, cov: Array, attitude: Array, result: Array, residual: Array, chi2: Array
) -> bool:
    """Find the values of maximum likelihood by Gauss-Newton.

    Args:
        values: (5,), or (6,) with ends; the start, and filled with the result.
        lines: (n, 5) X [m], x [1], slope [1], z [1], variance of the slope [1].
        ends: (k, 5) X [m], half [m], x, z [1], variance of z [1]; k may be 0.
        cov: (n, n) covariance of the places.
        attitude: (4,) tilt, roll, their standard deviations [rad]; 0 is exact, infinite is nothing known.
        result: (N, N) filled with the covariance of the values, 0 of those that are exact.
        residual: (n,) filled with the residuals of the places, measured minus model [1].
        chi2: (1,) filled with the sum of the squared normalised residuals.

    Returns:
        Whether the lines fix a pose.
    """
    N = values.size
    weight = np.ascontiguousarray(np.linalg.inv(cov))
    normal, right = np.empty((N, N)), np.empty(N)
    scaled, scaled_right = np.empty((N, N)), np.empty(N)
    for step_number in range(MAX_STEPS + 1):
        normal[:, :] = 0.0
        right[:] = 0.0
        chi2[0] = 0.0
        add_lines(values, lines, weight, normal, right, residual, chi2)
        if ends.shape[0] > 0:
            add_ends(values, ends, normal, right, chi2)
        add_attitude(values, attitude, normal, right, chi2)
        for a in range(N):
            if not normal[a, a] > 0.0:
                return False
        for a in range(N):
            scaled_right[a] = right[a] / math.sqrt(normal[a, a])
            for b in range(N):
                scaled[a, b] = normal[a, b] / math.sqrt(normal[a, a] * normal[b, b])
        step, largest = np.linalg.solve(scaled, scaled_right), 0.0
        for a in range(N):
            if not np.isfinite(step[a]):
                return False
            largest = max(largest, abs(step[a]))
        # Steps are in units of standard deviations: a thousandth of one is not worth another.
        if largest < 1e-3 or step_number == MAX_STEPS:
            break
        for a in range(N):
            values[a] += step[a] / math.sqrt(normal[a, a])
    inverse = np.linalg.inv(scaled)
    for a in range(N):
        for b in range(N):
            result[a, b] = inverse[a, b] / math.sqrt(normal[a, a] * normal[b, b])
    for j in range(2):
        if attitude[2 + j] == 0.0:
            result[TILT + j, :], result[:, TILT + j] = 0.0, 0.0
    return True
