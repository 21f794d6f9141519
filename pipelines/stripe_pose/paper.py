"""The paper's method: its closed forms with their errata corrected, and its way from the image to them.

Closed forms, with lines 1, 2, 3 at X_m1 = 0, X_m2, X_m3 seen at X_pi = f u_i on the frontal image plane: each line
gives q1 X_p X_m + q2 X_m + q3 X_p = 1, solved by (12) to (15). Corrected: q3 = X_m2 X_m3 (X_p2 - X_p3) / Det (printed
with X_p2 for X_m3), the sign of (16), and the denominator of (17), which is that of (24). They are 0/0 where X_p1 =
0, which is the paper's own recommended working point; there and everywhere else ``pose.level_pose`` gives what they
mean.

In (6) the mark leans, not the camera: phi_x is a lean about the mark's own X axis, phi_y a turn in its plane.
``leaning_pose`` is that model without its singularity (``tilt_model: paper``).

From the image (section V.B): edges from dark to bright are integer maxima of the gradient of the middle row; the cross
ratio (19) of four neighbours, starting with the first and dropping one after the other, says where the mark is; the
edges of five rows are averaged; three lines give the pose by (23) to (25). Nothing is undistorted.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ...formats.products import StripeMark
from .levelling import leaning_pose, level_bearings, line_of_bearing
from .pose import Array, bearings, is_ahead, level_pose, plane_distance, pose_covariance
from .scene import Bytes, Eye
from .verdict import Found

PIXEL_SD = 1.0 / np.sqrt(12.0)
"""Standard deviation of a place that is known to the pixel [px]."""


def general_pose(X: Array, x: Array, f: float, phi_x: float, phi_y: float) -> Array:
    """Return phi_z, D_x, D_y, D_z of eqs. (12) to (15) for three lines, X[0] = 0 and x[0] not 0.

    Args:
        X: (3,) abscissae, the middle line first [m].
        x: (3,) image coordinates X_p, in the unit of ``f``.
        f: focal length.
        phi_x: lean of the mark about its X axis, known [rad].
        phi_y: its turn in its own plane, known [rad].
    """
    det = X[1] * X[2] * x[0] * (x[1] - x[2])
    q1 = (X[1] * (x[2] - x[0]) + X[2] * (x[0] - x[1])) / det
    q2 = (X[1] * x[1] * (x[0] - x[2]) + X[2] * x[2] * (x[1] - x[0])) / det
    q3 = X[1] * X[2] * (x[1] - x[2]) / det
    sx, cx, sy, cy = np.sin(phi_x), np.cos(phi_x), np.sin(phi_y), np.cos(phi_y)
    phi = np.arctan((q2 * sx * sy - q1 * f * cx) / (q2 * cx + q1 * f * sx * sy))  # (12)
    s, c = np.sin(phi), np.cos(phi)
    A = sx * sy * s + cx * c
    B = cx * sy * c + sx * s
    C = cx * sy * s - sx * c
    dx = A / (q2 * cx * cy) * (q3 * f * B * C + B**2 - 1.0)  # (13)
    dy = A / (q2 * cx * cy) * (B * C + q3 * f * (C**2 - 1.0))  # (14)
    dz = A / q2 * (B + q3 * f * C)  # (15)
    return np.array([phi, dx, dy, dz])


def simplified_pose(X: Array, x: Array, f: float) -> Array:
    """Return phi_z, D_x, D_y of eqs. (16) to (18), for a level camera; see ``general_pose``."""
    N = X[1] * (x[0] - x[2]) + X[2] * (x[1] - x[0])
    Q = X[1] * x[1] * (x[0] - x[2]) + X[2] * x[2] * (x[1] - x[0])
    phi = np.arctan(f * N / Q)  # (16)
    dy = f * X[1] * X[2] * (x[2] - x[1]) / Q * np.cos(phi)  # (17)
    return np.array([phi, x[0] / f * dy, dy])  # (18)


def pixel_pose(X: Array, columns: Array, f_px: float, middle: float) -> Array:
    """Return phi_z, D_x, D_y of eqs. (23) to (25): ``columns`` N_p [px], f / pixel pitch, and N_r [px]."""
    return simplified_pose(X, columns - middle, f_px)


def cross_ratio(x: Array) -> Array:
    """Return the cross ratio (19) of four lines (..., 4), labelled left to right: -3 for equal spacing."""
    return np.asarray(
        (x[..., 2] - x[..., 1]) * (x[..., 3] - x[..., 0]) / ((x[..., 0] - x[..., 1]) * (x[..., 3] - x[..., 2]))
    )


def least_distance(W: float, f: float, width: float, phi: float = 0.0) -> float:
    """Return from where three lines at -W, 0, W fit the sensor, eq. (20), also for a turned mark [m]."""
    return float(W * abs(np.sin(phi)) + 2.0 * W * f * np.cos(phi) / width)


@dataclass(frozen=True, slots=True)
class PaperSearch:
    """How the paper looks for a mark.

    Attributes:
        threshold: least gradient of an edge, the difference of the pixels beside it [grey levels].
        tolerance: largest relative error of the cross ratio [1].
        rows: whose edges are averaged.
        given: the mark is known to be this one: its id, or None.
    """

    threshold: float = 40.0
    tolerance: float = 0.1
    rows: int = 5
    given: int | None = None


def rising_edges(row: Bytes, threshold: float) -> npt.NDArray[np.int64]:
    """Return the integer columns where a row rises fastest, from dark to bright (N,) [px]."""
    gradient = np.zeros(len(row))
    gradient[1:-1] = row[2:].astype(float) - row[:-2]
    inner = gradient[1:-1]
    return np.flatnonzero((inner >= threshold) & (inner >= gradient[:-2]) & (inner > gradient[2:])) + 1


def find_marks_paper(
    pixels: Bytes, eye: Eye, marks: Sequence[StripeMark], search: PaperSearch, tilt_model: str = "camera"
) -> list[Found]:
    """Find the first mark of the middle row, as the paper does; see the module."""
    middle = round(eye.camera.cy)
    if not 0 <= middle < pixels.shape[0]:
        return []
    edges = rising_edges(pixels[middle], search.threshold)
    for first in range(len(edges) - 3):
        four = edges[first : first + 4].astype(float)
        for mark in marks:
            if search.given not in {None, mark.id} or len(mark.lines) < 4:
                continue
            expected = cross_ratio(mark.lines[:4])
            if abs(cross_ratio(four) / expected - 1.0) <= search.tolerance:
                return [_found(pixels, eye, mark, four, search, tilt_model)]
    return []


def _found(pixels: Bytes, eye: Eye, mark: StripeMark, four: Array, search: PaperSearch, tilt_model: str) -> Found:
    camera, attitude = eye.camera, eye.attitude
    first = round(camera.cy) - search.rows // 2
    rows = np.arange(max(first, 0), min(first + search.rows, pixels.shape[0]))
    columns = np.array([_nearest(rising_edges(pixels[row], search.threshold), four) for row in rows])
    mean = np.nanmean(columns, axis=0)[:3]
    X = mark.lines[:3] - mark.lines[1]  # the middle line is the paper's origin
    u = (mean - camera.cx) / camera.fx
    if tilt_model == "paper":
        pose = leaning_pose(X, u, attitude.tilt, attitude.roll)[:3]
    elif attitude.tilt or attitude.roll:
        u = level_bearings(np.column_stack([u, np.zeros(3)]), attitude.tilt, attitude.roll)
        pose = level_pose(X, u)
    else:
        pose = level_pose(X, u)  # eqs. (23) to (25), which is the same and has no 0/0
    # From the middle line back to the origin of the mark.
    pose = pose - np.array([0.0, np.cos(pose[0]), np.sin(pose[0])]) * mark.lines[1]
    is_seen = bool(is_ahead(pose, mark.lines) and plane_distance(pose) > 0)
    nowhere, unknown = np.full(3, np.nan), np.full((5, 5), np.nan)
    cov = np.zeros((5, 5))
    cov[:3, :3] = pose_covariance(pose, mark.lines[:3], PIXEL_SD / camera.fx)
    model = bearings(pose, mark.lines[:4])
    off = np.nanmean(columns, axis=0) - (
        line_of_bearing(model, attitude.tilt, attitude.roll)[0] * camera.fx + camera.cx
    )
    lines = np.column_stack([four, np.zeros(4), np.full(4, rows[0]), np.full(4, rows[-1]), off])
    return Found(
        mark=mark.id,
        status="ok" if is_seen else "mirrored_or_back",
        pose=pose if is_seen else nowhere,
        cov=cov if is_seen else unknown,
        attitude=np.array([attitude.tilt, attitude.roll]),
        lines=lines,
        members=np.arange(4) * (1 if mark.bars is None else 2),
        error_px=float(np.sqrt(np.mean(off[:3] ** 2))),
        gap_px=float(np.min(np.diff(four))),
        lean=0.0,
    )


def _nearest(edges: npt.NDArray[np.int64], four: Array) -> Array:
    """Return the edge of a row that is nearest to each of four columns, nan if none is within 3 px."""
    if len(edges) == 0:
        return np.full(4, np.nan)
    away = np.abs(edges[:, None] - four)
    best = np.argmin(away, axis=0)
    return np.where(away[best, np.arange(4)] <= 3.0, edges[best], np.nan)
