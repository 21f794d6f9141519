"""The pose of a mark, and the camera's tilt and roll, from the lines of all its edges: maximum likelihood.

Each line gives two numbers, where it stands and how it slopes; both follow from its bearing u and from tilt and roll
(``levelling.py``, eq. (2)), the bearing from the pose (``pose.py``, eq. (1)). Slopes tell tilt and roll as well as an
encoder would, so the camera levels itself on the mark; what else is known of them (a mount, an inclinometer) enters
as a measurement with its own standard deviation. The ends of the bars, where their height is known, add where the
mark is vertically and how far away: its height in the image is not foreshortened when it is turned.

Unknown are phi, D_x, D_y, tilt, roll and, with ends, the height D_z of the middle of the bars above the lens. The
start is the closed form; Gauss-Newton needs three or four steps.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .levelling import levelling_matrix
from .pose import Array, pose_of

PHI, DX, DY, TILT, ROLL, DZ = range(6)


@dataclass(frozen=True, slots=True)
class Attitude:
    """What is known of a camera's tilt and roll before it sees a mark.

    Attributes:
        tilt, roll: expected values [rad].
        tilt_sd, roll_sd: their standard deviations [rad]; 0 is exact, infinite is nothing known.
    """

    tilt: float = 0.0
    roll: float = 0.0
    tilt_sd: float = 0.0
    roll_sd: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Lines:
    """Lines as measured: of n edges of one mark.

    Attributes:
        X: (n,) abscissae on the mark [m].
        x: (n,) places at ``z``, in the camera frame at y = 1 [1].
        slope: (n,) dx/dz [1].
        z: (n,) heights at which they are given [1].
        cov: (n, n) covariance of the places [1].
        slope_var: (n,) variances of the slopes; independent of the places [1].
    """

    X: Array
    x: Array
    slope: Array
    z: Array
    cov: Array
    slope_var: Array


@dataclass(frozen=True, slots=True, eq=False)
class Ends:
    """Ends of bars as measured.

    Attributes:
        X: (k,) abscissae of the middles of the bars [m].
        half: (k,) plus or minus half the height of the bars: the upper or the lower end [m].
        x, z: (k,) where in the camera frame at y = 1 [1].
        var: (k,) variances of z [1].
    """

    X: Array
    half: Array
    x: Array
    z: Array
    var: Array


class Solution(NamedTuple):
    """A pose with all that was found with it.

    Attributes:
        values: (5,) or (6,) phi, D_x, D_y, tilt, roll (, D_z) [rad, m].
        cov: their covariance.
        residuals: (n,) of the places, measured minus model [1].
        chi2: sum of squared normalised residuals of places, slopes, ends and attitude.
        dof: their number minus that of the unknowns.
    """

    values: Array
    cov: Array
    residuals: Array
    chi2: float
    dof: int


def solve(lines: Lines, attitude: Attitude, ends: Ends | None = None, *, iterations: int = 15) -> Solution:
    """Find the pose of maximum likelihood.

    Args:
        lines: three or more.
        attitude: what is known of tilt and roll.
        ends: of the bars, if their height is known.
        iterations: the most Gauss-Newton steps.

    Raises:
        ValueError: fewer than three lines, or lines that fix no pose.
    """
    from .model import descend, line_model

    values = _start(lines, attitude, ends)
    N = len(values)
    normal, chi2 = np.empty((N, N)), np.empty(1)
    table = np.empty((len(lines.X), 5))
    # Where tilt and roll are known exactly, slopes tell nothing more; where they are not what they are said to be,
    # slopes must not bend the pose.
    is_exact = attitude.tilt_sd == 0.0 and attitude.roll_sd == 0.0
    slope_var = np.full(len(lines.X), np.inf) if is_exact else lines.slope_var
    for column, part in enumerate((lines.X, lines.x, lines.slope, lines.z, slope_var)):
        table[:, column] = part
    end_table = np.empty((0, 5)) if ends is None else np.column_stack([ends.X, ends.half, ends.x, ends.z, ends.var])
    known = np.array([attitude.tilt, attitude.roll, attitude.tilt_sd, attitude.roll_sd])
    if (
        descend(
            values, table, end_table, np.asarray(np.linalg.inv(lines.cov), np.float64), known, iterations, normal, chi2
        )
        == 0
    ):
        raise ValueError("the lines fix no pose")
    scale = np.sqrt(np.diag(normal))
    cov = np.linalg.inv(normal / np.outer(scale, scale)) / np.outer(scale, scale)
    exact = np.flatnonzero(known[2:] == 0.0) + TILT
    cov[exact, :], cov[:, exact] = 0.0, 0.0
    place, slope = np.empty((len(lines.X), 6)), np.empty((len(lines.X), 6))
    line_model(values, lines.X, lines.z, place, slope)
    n_known = int(np.sum(np.isfinite(known[2:]) & (known[2:] > 0)))
    dof = (1 if is_exact else 2) * len(table) + len(end_table) + n_known - (N - len(exact))
    return Solution(values, cov, lines.x - place[:, 0], float(chi2[0]), dof)


def lines_attitude(lines: Lines) -> tuple[float, float]:
    """Return tilt and roll [rad] from the lines alone: the vertical is the direction that all their planes share.

    A line x = x0 + slope z lies in the plane through the lens with normal (1, -x0, -slope).
    """
    normals = np.stack([np.ones_like(lines.x), -(lines.x - lines.slope * lines.z), -lines.slope], axis=1)
    # Slopes are far less certain than places, and a tilt is told by how slopes change across the mark.
    vertical = np.linalg.svd(normals / np.sqrt(lines.slope_var)[:, None])[2][2]
    vertical = vertical if vertical[2] > 0 else -vertical
    return float(np.arcsin(np.clip(vertical[1], -1.0, 1.0))), float(np.arctan2(-vertical[0], vertical[2]))


def _start(lines: Lines, attitude: Attitude, ends: Ends | None) -> Array:
    from .matching import fitted

    if len(lines.X) < 3:
        raise ValueError(f"{len(lines.X)} lines; a pose needs at least three")
    tilt, roll = attitude.tilt, attitude.roll
    if np.isinf(attitude.tilt_sd) or np.isinf(attitude.roll_sd):
        tilt, roll = lines_attitude(lines)
    Q = levelling_matrix(tilt, roll)
    u = (Q[0, 0] * lines.x + Q[1, 0] + Q[2, 0] * lines.z) / (Q[0, 1] * lines.x + Q[1, 1] + Q[2, 1] * lines.z)
    pose = pose_of(np.array(fitted(lines.X, u, len(u))))
    if not np.all(np.isfinite(pose)):
        raise ValueError("the lines fix no pose")
    values = np.array([*pose, tilt, roll])
    if ends is None:
        return values
    level = np.stack([ends.x, np.ones_like(ends.x), ends.z], axis=1) @ Q
    ahead = np.sin(pose[0]) * ends.X + pose[2]
    return np.append(values, np.mean(level[:, 2] / level[:, 1] * ahead - ends.half))
