"""The least error that any estimator could have from the edges of a mark: the Cramer-Rao bound, by own derivatives.

Measured are the column of every edge on every row that crosses it and, where the height of the bars is known, the row
of either end of every bar wide enough; all independent. Unknown are pose, tilt, roll and height; tilt and roll have a
prior.
"""

from dataclasses import replace

import numpy as np
from mark_raster import Array, Plane
from mark_scenes import Scene, Stripes, edge_columns

END_ROWS = 2.0  # at either end of an edge, rounded by the blur
LEAST_WIDTH_PX = 8.0  # of a bar whose ends count
SIDE_PX = 2.5  # of such a bar, rounded by the blur
STEP = 1e-5


def pose_bound(scene: Scene, sigma_px: float, *, tilt_sd: float, roll_sd: float, with_ends: bool) -> Array:
    """Return the standard deviations of yaw, lateral offset and depth [rad, m, m].

    Args:
        scene: with a stripe mark.
        sigma_px: standard deviation of one edge on one row.
        tilt_sd: of what is known of the tilt beforehand [rad].
        roll_sd: likewise of the roll [rad].
        with_ends: whether the height of the bars is known.
    """
    pattern, plane = scene.pattern, scene.plane
    assert isinstance(pattern, Stripes)
    edges, half = pattern.edges, 0.5 * pattern.height
    corners = _pinhole(scene, plane, edges, half)  # (2, n, 2): lower and upper ends
    rows = np.arange(np.ceil(corners[1, :, 1].min()), np.floor(corners[0, :, 1].max()) + 1)
    clear = (rows[:, None] > corners[1, :, 1] + END_ROWS) & (rows[:, None] < corners[0, :, 1] - END_ROWS)
    widths = np.diff(corners[:, :, 0].mean(axis=0))[::2]
    counted = widths >= LEAST_WIDTH_PX
    with_ends = with_ends and bool(counted.any())
    middles = 0.5 * (edges[::2] + edges[1::2])[counted]
    end_sd = sigma_px / np.sqrt(np.tile(widths[counted], 2) - 2 * SIDE_PX)

    def measured(values: Array) -> Array:
        phi, dx, dy, tilt, roll, dz = values
        moved = replace(scene, optics=replace(scene.optics, tilt=tilt, roll=roll), plane=Plane(phi, dx, dy, dz))
        columns = edge_columns(moved.optics, moved.plane, edges, rows)[clear] / sigma_px
        prior = [tilt / tilt_sd, roll / roll_sd]
        if not with_ends:
            return np.append(columns, prior)
        ends = _pinhole(moved, moved.plane, middles, half)[:, :, 1].ravel() / end_sd
        return np.concatenate([columns, prior, ends])

    at = np.array([plane.phi, plane.dx, plane.dy, scene.optics.tilt, scene.optics.roll, plane.dz])
    steps = STEP * np.eye(6)
    J = np.stack([(measured(at + step) - measured(at - step)) / (2 * STEP) for step in steps], axis=1)
    J = J if with_ends else J[:, :5]
    scale = np.linalg.norm(J, axis=0)
    return np.asarray((np.sqrt(np.diag(np.linalg.inv((J / scale).T @ (J / scale)))) / scale)[:3])


def _pinhole(scene: Scene, plane: Plane, X: Array, half: float) -> Array:
    """Return the lower and upper ends of upright lines, (2, n, 2), without distortion [px]."""
    points = np.stack([np.stack([X, np.full_like(X, z)], axis=1) for z in (-half, half)])
    return replace(scene.optics, k1=0.0, k2=0.0).project(plane.level(points))
