"""The bench of the stripe paper's section V: its numbers, and which cells of its design it can see.

Printed there: focal length 16 mm, 512 columns, three edges 60 mm apart with the second one at X = 0, distances from
300 mm in steps of 100 mm on a rail of 1.5 m, Dx 0 to 60 mm in steps of 20, phi 0 to 80 degrees in steps of 10. Not
printed, and chosen here: a sensor 8.8 mm wide (2/3 inch), the last distance (1500 mm), and phi > 0 where the right end
of the mark is the farther one. Tables are in millimetres and degrees, as the paper has them; all else is SI.
"""

from itertools import product
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from logpose.pipelines.stripe_pose.pose import bearings, level_pose

Array: TypeAlias = npt.NDArray[np.float64]

FOCAL_M, SENSOR_M, COLUMNS = 0.016, 0.0088, 512
FX_PX = FOCAL_M * COLUMNS / SENSOR_M  # 930.909
SPACING_M = 0.06
LINES_M = np.array([0.0, -SPACING_M, SPACING_M])  # in the order of the paper: middle, left, right
ALL_LINES_M = np.append(LINES_M, 2 * SPACING_M)  # and the one that tells the mark

PHI_DEG = tuple(range(0, 90, 10))
DX_MM = (0, 20, 40, 60)
DY_MM = tuple(range(300, 1600, 100))
CELLS = tuple(product(DY_MM, DX_MM, PHI_DEG))

QUANTITIES = ("phi", "Dx", "Dy")
TO_TABLE = np.array([180.0 / np.pi, 1e3, 1e3])  # rad, m, m -> deg, mm, mm


def pose_of(dy_mm: float, dx_mm: float, phi_deg: float) -> Array:
    """Return phi, Dx, Dy [rad, m, m] of a cell."""
    return np.array([phi_deg, dx_mm, dy_mm]) / TO_TABLE


def columns(pose: Array, lines: Array = LINES_M) -> Array:
    """Return where lines (n,) of a mark at phi, Dx, Dy stand, from the middle of the sensor [px]."""
    return FX_PX * bearings(pose, lines)


def is_out(pose: Array, lines: Array = LINES_M) -> bool:
    """Tell whether a line leaves the sensor."""
    return bool(np.any(np.abs(columns(pose, lines)) > COLUMNS / 2))


def shortest_distance(phi: float) -> float:
    """Return the least Dy at which all three lines are on the sensor, when the middle one is on the axis [m].

    Equation (20) is the case phi = 0.
    """
    return float(SPACING_M * abs(np.sin(phi)) + 2 * SPACING_M * np.cos(phi) * FX_PX / COLUMNS)


def pose_errors(px: Array, pose: Array) -> Array:
    """Return the errors (..., 3) of the closed form for edges at columns (..., 3), in the table's units.

    A draw without a solution, where edges coincide, gives nan.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        error = (level_pose(LINES_M, px / FX_PX) - pose) * TO_TABLE
    return np.where(np.isfinite(error).all(axis=-1, keepdims=True), error, np.nan)
