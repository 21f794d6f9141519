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

from .pose import Array


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


def solve(lines: Lines, attitude: Attitude, ends: Ends | None = None) -> Solution:
    """Find the pose of maximum likelihood.

    Args:
        lines: three or more.
        attitude: what is known of tilt and roll.
        ends: of the bars, if their height is known.

    Raises:
        ValueError: fewer than three lines, or lines that fix no pose.
    """
    from .model import begin, descend

    n, N = len(lines.X), 5 if ends is None else 6
    if n < 3:
        raise ValueError(f"{n} lines; a pose needs at least three")
    # Where tilt and roll are known exactly, slopes tell nothing more; where they are not what they are said to be,
    # slopes must not bend the pose.
    is_exact = attitude.tilt_sd == 0.0 and attitude.roll_sd == 0.0
    table, end_table = np.empty((n, 5)), np.empty((0 if ends is None else len(ends.X), 5))
    slope_var = np.inf if is_exact else lines.slope_var
    for column, part in enumerate((lines.X, lines.x, lines.slope, lines.z, slope_var)):
        table[:, column] = part
    if ends is not None:
        for column, part in enumerate((ends.X, ends.half, ends.x, ends.z, ends.var)):
            end_table[:, column] = part
    known = np.array([attitude.tilt, attitude.roll, attitude.tilt_sd, attitude.roll_sd])
    tilt, roll = attitude.tilt, attitude.roll
    if np.isinf(attitude.tilt_sd) or np.isinf(attitude.roll_sd):
        tilt, roll = lines_attitude(lines)
    values, cov, residuals, chi2 = np.empty(N), np.empty((N, N)), np.empty(n), np.empty(1)
    if not (
        begin(table, end_table, tilt, roll, values)
        and descend(values, table, end_table, lines.cov, known, cov, residuals, chi2)
    ):
        raise ValueError("the lines fix no pose")
    n_exact = int(np.sum(known[2:] == 0.0))
    n_known = int(np.sum(np.isfinite(known[2:]))) - n_exact
    dof = (1 if is_exact else 2) * n + len(end_table) + n_known - (N - n_exact)
    return Solution(values, cov, residuals, float(chi2[0]), dof)


def lines_attitude(lines: Lines) -> tuple[float, float]:
    """Return tilt and roll [rad] from the lines alone: the vertical is the direction that all their planes share.

    A line x = x0 + slope z lies in the plane through the lens with normal (1, -x0, -slope).
    """
    normals = np.stack([np.ones_like(lines.x), -(lines.x - lines.slope * lines.z), -lines.slope], axis=1)
    # Slopes are far less certain than places, and a tilt is told by how slopes change across the mark.
    vertical = np.linalg.svd(normals / np.sqrt(lines.slope_var)[:, None])[2][2]
    vertical = vertical if vertical[2] > 0 else -vertical
    return float(np.arcsin(np.clip(vertical[1], -1.0, 1.0))), float(np.arctan2(-vertical[0], vertical[2]))
