"""Whether what was measured is the mark it is taken for, and how sure its pose is.

Sub-pixel lines make a strict judge: a mark of eight edges fulfils five conditions to a fraction of a pixel, so that a
fence or a blind is not taken for one. What else a mark must be is in ``plausible``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ...formats.products import StripeMark
from .levelling import MAX_ANGLE, leaning_pose, line_of_bearing
from .measure import SAME_PX, Measured, sharpen
from .plausible import AS_GOOD, FLOOR_PX, is_as_high, is_cut_off, is_enough, is_uniform, may_be_shifted
from .pose import MAX_CONDITION, PHI, ROLL, TILT, Array, bearings, condition, is_ahead, plane_distance
from .scene import Scene, edges_of
from .solve import Solution, solve

Ints = npt.NDArray[np.int64]

PART_PX, PART_SHARE = 0.05, 0.008
"""A part of a mark has fewer lines to be told by, which must fit the better: to so much [px], and to so much of the
least distance of two lines."""
BLENDED_PX = 0.25
"""Neighbours that blend may be off by so much before they are taken apart [px]."""
SURE = np.radians(1.0)
"""A pose whose angle is as certain as this is far from degenerate [rad]."""
LIKELY = 2.0
"""A mean square below this needs no second look."""
END_CHI2 = 9.0
"""Ends that raise the mean square beyond this are not those of the bars."""


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """A mark in an image.

    Attributes:
        mark: its id.
        status: see ``events.MarkSighting``.
        pose: (3,) phi, D_x, D_y [rad, m, m]; nan without pose.
        cov: (5, 5) of phi, D_x, D_y, tilt, roll; nan without pose.
        attitude: (2,) tilt and roll [rad].
        lines: (n, 5) column at the principal row [px], its change per row, first and last row [px], distance from
            where the pose has the line [px].
        members: (n,) which edges of the mark they are.
        error_px: root mean square of the distances [px].
        gap_px: least distance of two lines [px].
        lean: largest difference of a line's slope from that of a camera with the expected tilt and roll [1].
    """

    mark: int
    status: str
    pose: Array
    cov: Array
    attitude: Array
    lines: Array
    members: Ints
    error_px: float
    gap_px: float
    lean: float

    def is_again(self, other: "Found") -> bool:
        """Tell whether two explanations are the same one, found from two rows."""
        if self.mark != other.mark or not np.array_equal(self.members, other.members):
            return False
        return bool(np.median(np.abs(self.lines[:, 0] - other.lines[:, 0])) < SAME_PX)

    def overlaps(self, other: "Found") -> bool:
        """Tell whether two explanations share edges: their columns and rows meet."""
        mine, others = _box(self.lines), _box(other.lines)
        return bool(np.all(mine[:, 0] < others[:, 1]) and np.all(others[:, 0] < mine[:, 1]))

    def is_elsewhere(self, other: "Found") -> bool:
        """Tell whether both say of one mark that it hangs in their place."""
        return self.mark == other.mark and "poor_geometry" not in {self.status, other.status}


def fits(measured: Measured, mark: StripeMark, scene: Scene) -> bool:
    """Tell whether lines may be the mark's before neighbours are taken apart; those that blend may be further off."""
    return measured.misfit_px <= _tolerance(measured, mark, scene) + BLENDED_PX * measured.is_blended


def _tolerance(measured: Measured, mark: StripeMark, scene: Scene) -> float:
    """Return how far the lines of a mark, or of a part of it, may be off, root mean square [px]."""
    if len(measured.members) < len(edges_of(mark)[0]):
        return min(PART_PX, PART_SHARE * measured.gap_px)
    return min(scene.search.residual_px, scene.search.residual_share * measured.gap_px)


def judge(measured: Measured, mark: StripeMark, scene: Scene) -> Found | None:
    """Return the mark with its pose and status, or None if what was measured is something else."""
    n, search, camera = len(measured.members), scene.search, scene.eye.camera
    # Three lines fit any mark: they are one only where it is said which.
    if n < (4 if search.given is None else 3) or not (n == len(edges_of(mark)[0]) or is_enough(measured, mark, scene)):
        return None
    if not is_uniform(measured) or not fits(measured, mark, scene):
        return None
    tolerance = _tolerance(measured, mark, scene)
    measured = sharpen(measured, mark, scene)
    try:
        solution = _solved(measured, scene)
    except (ValueError, np.linalg.LinAlgError):
        return None
    error_px = float(np.sqrt(np.mean(solution.residuals**2))) * camera.fx
    if not np.all(np.isfinite(solution.values)) or error_px > tolerance:
        return None
    pose = solution.values[:3]
    if not (is_ahead(pose, edges_of(mark)[0]) and plane_distance(pose) > 0 and search.near <= pose[2] <= search.far):
        return None
    if not is_as_high(measured, mark, pose, scene):
        return None
    if abs(pose[PHI]) > search.max_angle + 0.1 or np.max(np.abs(solution.values[[TILT, ROLL]])) > MAX_ANGLE:
        return None
    # What the lines leave over beyond what chance explains (two standard deviations of chi2) is an error of the lens
    # or of the print, and counts as well.
    pose, cov = _leaning(measured, scene) if search.is_leaning else (pose, solution.cov[:5, :5])
    if solution.dof > 0:
        cov = cov * max(1.0, solution.chi2 / (solution.dof + 2.0 * np.sqrt(2.0 * solution.dof)))
    return Found(
        mark=mark.id,
        status=_status(measured, mark, solution, cov, scene),
        pose=pose,
        cov=cov,
        attitude=solution.values[[TILT, ROLL]],
        lines=_lines(measured, solution, scene),
        members=measured.members,
        error_px=error_px,
        gap_px=measured.gap_px,
        lean=_lean(measured, pose, scene),
    )


def disputed(found: Sequence[Found]) -> list[Found]:
    """Keep the best explanation of the same edges, and all that are as good, marked ``ambiguous``.

    A mark hangs in one place, so one that seems to hang in two is disputed as well.
    """
    kept: list[Found] = []
    found = [item for i, item in enumerate(found) if not any(item.is_again(other) for other in found[:i])]
    for item in found:
        rivals = [other for other in found if other is not item and (item.overlaps(other) or item.is_elsewhere(other))]
        # Fewer edges explain less: a part of a mark does not dispute a whole one.
        rivals = [other for other in rivals if len(other.members) >= len(item.members)]
        if any(
            len(other.members) > len(item.members) or item.error_px > AS_GOOD * other.error_px + FLOOR_PX
            for other in rivals
        ):
            continue
        is_disputed = any(other.error_px <= AS_GOOD * item.error_px + FLOOR_PX for other in rivals)
        kept.append(replace(item, status="ambiguous") if is_disputed else item)
    return kept


def mirrored(found: Sequence[Found], n_edges: Mapping[int, int]) -> list[Found]:
    """Return marks that were found in their mirror image: they have no pose.

    Args:
        found: of reflected marks.
        n_edges: how many edges each mark has, by its id.
    """
    nowhere, unknown = np.full(3, np.nan), np.full((5, 5), np.nan)
    return [
        replace(
            item, status="mirrored_or_back", pose=nowhere, cov=unknown, members=n_edges[item.mark] - 1 - item.members
        )
        for item in found
        if item.status in {"ok", "ambiguous"}
    ]


def _solved(measured: Measured, scene: Scene) -> Solution:
    """Return the pose, by the ends of the bars as well where they fit."""
    attitude, ends = scene.eye.attitude, measured.ends
    if ends is None or len(ends.X) < 2:
        return solve(measured.lines, attitude)
    better = solve(measured.lines, attitude, ends)
    if better.chi2 < LIKELY * better.dof:
        return better
    plain = solve(measured.lines, attitude)
    return better if better.chi2 - plain.chi2 < END_CHI2 * (len(ends.X) - 1) else plain


def _leaning(measured: Measured, scene: Scene) -> tuple[Array, Array]:
    """Return the pose and the covariance (5, 5) in the paper's model: a level camera, and a mark that leans."""
    lines, attitude = measured.lines, scene.eye.attitude
    u = lines.x - lines.slope * lines.z  # on the row through the principal point
    pose = leaning_pose(lines.X, u, attitude.tilt, attitude.roll)[:3]
    J = np.empty((3, len(u)))
    for i in range(len(u)):
        step = np.zeros(len(u))
        step[i] = 1e-6
        J[:, i] = (leaning_pose(lines.X, u + step, attitude.tilt, attitude.roll)[:3] - pose) / 1e-6
    cov = np.zeros((5, 5))
    cov[:3, :3] = J @ (lines.cov + np.diag(lines.slope_var * lines.z**2)) @ J.T
    return pose, cov


def _status(measured: Measured, mark: StripeMark, solution: Solution, cov: Array, scene: Scene) -> str:
    search, lines = scene.search, measured.lines
    phi_sd = float(np.sqrt(cov[PHI, PHI]))
    if measured.gap_px < search.least_gap_px or not phi_sd <= search.max_phi_sd:
        return "poor_geometry"
    if phi_sd > SURE and condition(lines.X, lines.x) > MAX_CONDITION:
        return "poor_geometry"
    is_whole = len(measured.members) == len(edges_of(mark)[0])
    if not (is_whole or is_cut_off(measured, mark, solution, scene)) and may_be_shifted(measured, mark, scene):
        return "ambiguous"
    redundant = len(measured.members) - 3
    return "ok" if redundant >= (1 if is_whole else 2) else "unverified"


def _lines(measured: Measured, solution: Solution, scene: Scene) -> Array:
    at = measured.columns + measured.slopes * (scene.eye.row - measured.middle)
    off = solution.residuals * scene.eye.camera.fx
    return np.column_stack([at, measured.slopes, measured.rows, off])


def _lean(measured: Measured, pose: Array, scene: Scene) -> float:
    attitude, lines = scene.eye.attitude, measured.lines
    _, slope = line_of_bearing(bearings(pose, lines.X), attitude.tilt, attitude.roll)
    return float(np.max(np.abs(lines.slope - slope)))


def _box(lines: Array) -> Array:
    """Return first and last column and row of lines, (2, 2)."""
    return np.array([[lines[:, 0].min(), lines[:, 0].max()], [lines[:, 2].min(), lines[:, 3].max()]])
