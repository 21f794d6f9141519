"""A mark measured: the lines of its edges, and the ends of its bars, from one proposal on."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ...formats.products import StripeMark
from .scene import Array, Scene, edges_of
from .solve import Ends, Lines

Ints = npt.NDArray[np.int64]

WHOLE, GLANCE = 1 << 20, 12
"""Rows that edges are followed up and down: all of them, or a few."""
SAME_PX = 2.0
"""A proposal whose edges are nearer than this to lines that were followed is about the same thing [px]."""
BLENDED_PX = 0.1
"""Error of an edge whose neighbour is too near and could not be taken apart from it [px]."""
ROUNDED_ROWS = 2
"""Rows at either end of a mark where blur mixes in what is above and below it."""
END_FLOOR_PX = 0.005
"""Part of the error of a bar's end that does not average out: ends are cut less straight than sides [px]."""


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """What was measured of a mark.

    Attributes:
        members: (n,) which edges of the mark have a line, left to right.
        lines: of these.
        ends: of the bars that are wide enough, where the mark says how high they are.
        columns: (n,) of the lines at ``middle`` [px].
        slopes: (n,) change of the column per row.
        middle: row.
        rows: (n, 2) first and last row of each edge [px].
        strengths: (n,) mean responses [grey levels per pixel].
        found: (m, H) columns that were followed [px], nan where there are none.
        gap_px: least distance of two neighbouring lines [px].
        misfit_px: how far the lines are from those of any view of the mark, before neighbours are taken apart [px].
        taps: of the filter that was used.
        is_blended: whether neighbours may bias one another.
    """

    members: Ints
    lines: Lines
    ends: Ends | None
    columns: Array
    slopes: Array
    middle: float
    rows: Array
    strengths: Array
    found: Array
    gap_px: float
    misfit_px: float
    taps: Array
    is_blended: bool

    def ends_within(self, row: int, reach: int) -> bool:
        """Tell whether all edges ended nearer to a row than they were followed: there is no more of them."""
        return bool(np.all(self.rows[:, 0] > row - reach) and np.all(self.rows[:, 1] < row + reach))

    def contain(self, rows: Ints, columns: Array) -> npt.NDArray[np.bool_]:
        """Tell of proposals whether their edges are those that were followed here.

        Args:
            rows: (N,) of the proposals.
            columns: (N, m) of their edges [px], nan for what is hidden.
        """
        near = np.abs(self.found[:, rows].T - columns) < SAME_PX
        return np.asarray(2 * near.sum(axis=1) >= np.isfinite(columns).sum(axis=1))


def measure(scene: Scene, mark: StripeMark, row: int, columns: Array, *, reach: int = WHOLE) -> Measured:
    """Follow the edges of a proposal over all rows that cross the mark, and fit their lines.

    Args:
        scene: the image.
        mark: whose edges they would be.
        row: of the proposal.
        columns: (m,) of the edges there [px], nan for what is hidden.
        reach: follow them no further than so many rows: enough to see what is no mark, in a fraction of the time.
    """
    from .edges import WIDE_GAP_PX, WIDE_SIGMA_PX, filter_taps, follow
    from .lines import FIRST, LAST, N_COLUMNS, ROWS, SLOPE, STRENGTH, VAR_SLOPE, VAR_X, X, Z, fit_lines, misfit

    mark_edges, polarity = edges_of(mark)
    m, height = len(mark_edges), scene.pixels.shape[0]
    found, size = np.empty((m, height)), np.empty((m, height))
    threshold = max(4.0 * scene.noise, 0.5)
    seen = columns[np.isfinite(columns)]
    # What hides a part of a mark may end anywhere, also near one of its edges.
    is_wide = len(seen) == m and float(np.min(np.diff(seen))) >= WIDE_GAP_PX
    taps = filter_taps(WIDE_SIGMA_PX) if is_wide else scene.taps
    follow(scene.pixels, row, reach, columns, polarity, taps, threshold, found, size)
    table = np.empty((m, N_COLUMNS))
    floor = scene.search.floor_px / scene.eye.camera.fx
    fit_lines(found, size, scene.rays, scene.search.least_rows, floor, table)
    members = np.flatnonzero(table[:, ROWS] > 0)
    table = table[members]
    by = np.ascontiguousarray(table.T)
    lines = Lines(mark_edges[members], by[X], by[SLOPE], by[Z], np.diag(by[VAR_X]), by[VAR_SLOPE])
    first, last = by[FIRST], by[LAST]
    middle = round(0.5 * float(first.sum() + last.sum()) / len(members)) if len(members) else row
    at, slopes = _in_image(scene, lines, middle)
    gap_px = float(np.min(np.diff(at))) if len(at) > 1 else 0.0
    error = misfit(table, lines.X) * scene.eye.camera.fx if len(members) >= 3 else np.inf
    return Measured(
        members=members,
        lines=lines,
        ends=None,
        columns=at,
        slopes=slopes,
        middle=middle,
        rows=np.stack([first, last], axis=1),
        strengths=by[STRENGTH],
        found=found,
        gap_px=gap_px,
        misfit_px=error,
        taps=taps,
        is_blended=gap_px < scene.search.blend_px,
    )


def sharpen(measured: Measured, mark: StripeMark, scene: Scene) -> Measured:
    """Take neighbours apart that blend, and find the ends of the bars where the mark says how high they are."""
    lines = _separated(scene, mark, measured) if measured.is_blended else measured.lines
    ends = _ends(scene, mark, measured) if mark.height is not None and mark.bars is not None else None
    return replace(measured, lines=lines, ends=ends)


def _in_image(scene: Scene, lines: Lines, row: float) -> tuple[Array, Array]:
    """Return the columns (n,) of lines at an image row [px], and their change per row."""
    camera = scene.eye.camera
    if camera.is_pinhole:
        z = (camera.cy - row) / camera.fy
        return camera.cx + camera.fx * (lines.x + lines.slope * (z - lines.z)), lines.slope * (-camera.fx / camera.fy)
    three = _columns(scene, lines, np.array([row - 1.0, row, row + 1.0]))
    return three[1], 0.5 * (three[2] - three[0])


def _columns(scene: Scene, lines: Lines, rows: Array) -> Array:
    """Return the columns (k, n) of lines at image rows (k,) [px]: a lens bends lines.

    The height of a line that the lens shows on a row is found by Newton's method.
    """
    camera = scene.eye.camera
    if camera.is_pinhole:
        columns, slopes = _in_image(scene, lines, 0.0)
        return columns + np.multiply.outer(rows, slopes)

    def image(z: Array) -> Array:
        xy = np.stack([lines.x + lines.slope * (z - lines.z), -z], axis=-1)
        return camera.distort(xy) * (camera.fx, camera.fy) + (camera.cx, camera.cy)

    step = 1.0 / camera.fy
    z = np.repeat((camera.cy - rows)[:, None] * step, len(lines.x), axis=1)
    for _ in range(3):
        at, above = image(z), image(z + step)
        z -= step * (at[..., 1] - rows[:, None]) / (above[..., 1] - at[..., 1])
    return np.ascontiguousarray(image(z)[..., 0])


def _separated(scene: Scene, mark: StripeMark, measured: Measured) -> Lines:
    """Take neighbouring edges apart; where that fails, say how much they may bias one another."""
    from .profile import separate

    lines, n = measured.lines, len(measured.members)
    camera = scene.eye.camera
    first, last = int(measured.rows[:, 0].max()), int(measured.rows[:, 1].min())
    rounded = min(ROUNDED_ROWS, (last - first) // 4)
    rows = (first + rounded, last - rounded)
    values, cov = np.empty(n + 5), np.empty((n + 5, n + 5))
    used = 0
    middle = (rows[0] + rows[1]) // 2
    if n == len(edges_of(mark)[0]) and mark.bars is not None and rows[1] - rows[0] >= 2:
        columns = _columns(scene, lines, np.arange(rows[0], rows[1] + 1.0))
        if np.all(np.isfinite(columns)):
            used = separate(scene.pixels, rows, columns, edges_of(mark)[1], values, cov)
    offsets = values[:n]
    if used == 0 or not np.all(np.abs(offsets) < 1.0) or not np.all(np.diag(cov)[:n] > 0):
        blended = np.diag(np.full(n, (BLENDED_PX / camera.fx) ** 2))
        return Lines(lines.X, lines.x, lines.slope, lines.z, lines.cov + blended, lines.slope_var)
    # A pixel to the right on the middle row is so far to the right of the line.
    columns = columns[middle - rows[0]]
    at = np.clip(np.floor(columns).astype(np.int64), 0, scene.pixels.shape[1] - 2)
    ray, pixel = scene.rays[middle, at], scene.rays[middle, at + 1] - scene.rays[middle, at]
    per_px = pixel[:, 0] - lines.slope * pixel[:, 1]
    z = ray[:, 1] + (columns - at) * pixel[:, 1]
    x = lines.x + lines.slope * (z - lines.z) + offsets * per_px
    floor = np.diag(np.full(n, (scene.search.floor_px / camera.fx) ** 2))
    return Lines(lines.X, x, lines.slope, z, cov[:n, :n] * np.outer(per_px, per_px) + floor, lines.slope_var)


def _ends(scene: Scene, mark: StripeMark, measured: Measured) -> Ends | None:
    """Find the ends of the bars that are wide enough."""
    from .heights import find_ends

    lines, camera, n = measured.lines, scene.eye.camera, len(measured.members)
    table, ends = np.empty((n, 8)), np.empty((2 * n, 5))
    parts = (lines.X, lines.x, lines.slope, lines.z, measured.columns, measured.slopes, measured.strengths)
    for column, part in enumerate((*parts, np.diag(lines.cov))):
        table[:, column] = part
    about = (camera.fx, camera.fy, END_FLOOR_PX)
    half = 0.5 * (mark.height or 0.0)
    count = find_ends(
        scene.pixels, scene.rays, measured.members, table, measured.rows, float(measured.middle), half, about,
        measured.taps, ends,
    )  # fmt: skip
    return Ends(*np.ascontiguousarray(ends[:count].T)) if count else None
