"""Which marks of a map could be taken for one another, and how well each tells the pose: before they are printed.

A mark stands with its middle on the optical axis, ``distance`` away and turned by ``angle``; its edges fall on known
columns. Taken for another mark, some of them are that mark's edges, in order (``pairings``). The projectivity that fits
them best leaves a residual, the root mean square over the pairs: the gap between the two marks at this place
(``gaps``). What the detector would still take for a fit is confused. The paper's cross ratio of four lines is compared
in units of its own error: two marks are one where |ln (CR / CR')| < 4 sigma + 0.005. Equally spaced lines have -3, as
every fence has. A mark that equals its own reverse cannot be told from itself upside down, and one that equals
another's reverse must not be turned on the wall.

The errors of the pose are the Cramer-Rao bound of the same edges, each with the error of one row over the root of the
number of rows that cross the mark (``pose.pose_covariance``).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from ...formats.products import StripeMark
from ..geometry.camera import Camera
from .gaps import cross_ratio_sigma, log_cross_ratios, template_gaps
from .pairings import Pairing, hidden, whole
from .plausible import ENOUGH, most_hidden
from .pose import bearings, is_ahead, pose_covariance

Array: TypeAlias = npt.NDArray[np.float64]

MIN_GAP_PX = 3.0
"""Edges nearer to each other than this are not told apart."""
CR_SIGMAS, CR_FLOOR = 4.0, 0.005
FENCE = -3.0
"""Cross ratio of equally spaced lines."""
_MOST = 60
"""Ways to take one mark for another that are looked at from everywhere: those that are nearest from the front."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Optics:
    """A camera and how well it sees edges.

    Attributes:
        fx, fy: focal lengths [px].
        field: bearings of the first and last column, right over ahead.
        height: of the image [px].
        tolerance: largest residual of a whole mark that the detector takes for a fit [px] ...
        part_tolerance: the same for a mark of which something is hidden [px] ...
        tolerance_share, part_share: and as parts of the least gap between edges [1].
        edge_sigma: error of an edge in one row [px].
        rows: that cross a mark; None is what its height says, and one where it has none.
    """

    fx: float
    fy: float
    field: tuple[float, float]
    height: int
    tolerance: float
    part_tolerance: float
    tolerance_share: float
    part_share: float
    edge_sigma: float = 0.05
    rows: int | None = None

    @classmethod
    def of(cls, camera: Camera, width: int, height: int, **more: Any) -> "Optics":
        """Return those of a camera with its lens; ``more`` are the other attributes."""
        columns = np.stack([np.arange(float(width)), np.full(width, camera.cy)], axis=-1)
        bearing = camera.unproject(columns)[:, 0]
        field = (float(np.nanmin(bearing)), float(np.nanmax(bearing)))
        return cls(fx=camera.fx, fy=camera.fy, field=field, height=height, **more)

    def rows_across(self, mark: StripeMark, distance: float) -> int:
        """Return how many rows cross a mark so far away."""
        if self.rows is not None:
            return self.rows
        if mark.height is None:
            return 1
        return int(np.clip(self.fy * mark.height / distance, 1, self.height))


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """A mark from one place: how certain its pose is.

    Attributes:
        mark: its id.
        distance, angle: of the middle of the mark, and its turn [m, rad].
        is_inside: all edges fall on the image.
        gap: between its two nearest edges [px].
        rows: that cross it.
        sd: (3,) of phi, D_x, D_y [rad, m, m].
    """

    mark: int
    distance: float
    angle: float
    is_inside: bool
    gap: float
    rows: int
    sd: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Confusion:
    """How near one mark comes to another, from the place where they are nearest.

    Attributes:
        seen, taken: ids: the mark that is there, and the one it could be taken for.
        whole, hidden: gap when all edges of ``taken`` are found, and when only a part is, as small as the detector
            takes for it; None where there is no such way [px].
        turned: gap when the mark is hung upside down and all edges are found [px].
        cross_ratio: difference of the most similar four rising lines in sigmas of its error, or None.
        is_cross_ratio_same: the paper's cross ratio does not tell them apart.
        apart_to, apart_to_hidden: for each angle the distance up to which the whole mark, or a part of it, is told
            from the other; 0 where it is not even at the least distance [m].
    """

    seen: int
    taken: int
    whole: float | None
    hidden: float | None
    turned: float | None
    cross_ratio: float | None
    is_cross_ratio_same: bool
    apart_to: tuple[float, ...]
    apart_to_hidden: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class CodeBook:
    """All of it.

    Attributes:
        distances, angles: the places looked from [m, rad].
        views: of each mark from each of them.
        confusions: of each ordered pair of marks, and of each mark with itself, at another place or turned.
        fences: ids of marks whose lines, or four of them, are as equally spaced as can be told.
    """

    distances: tuple[float, ...]
    angles: tuple[float, ...]
    views: tuple[View, ...]
    confusions: tuple[Confusion, ...]
    fences: tuple[int, ...]


def code_book(
    marks: Sequence[StripeMark], optics: Optics, distances: Sequence[float], angles: Sequence[float]
) -> CodeBook:
    """Compare all marks from all places.

    Args:
        marks: with unique ids.
        optics: the camera.
        distances: increasing [m].
        angles: >= 0, each is looked from to both sides [rad].
    """
    return CodeBook(
        distances=tuple(distances),
        angles=tuple(angles),
        views=tuple(view(mark, optics, d, a) for mark in marks for d in distances for a in angles),
        confusions=tuple(_confusion(a, b, optics, distances, angles) for a in marks for b in marks),
        fences=tuple(mark.id for mark in marks if _is_fence(mark, optics, distances, angles)),
    )


def pose_at(mark: StripeMark, distance: float, angle: float) -> Array:
    """Return the pose (3,) of a mark whose middle lies ``distance`` ahead on the optical axis."""
    middle = 0.5 * (mark.edges[0] + mark.edges[-1])
    return np.array([angle, -np.cos(angle) * middle, distance - np.sin(angle) * middle])


def view(mark: StripeMark, optics: Optics, distance: float, angle: float) -> View:
    """Tell how certain a pose is; of the two sides from which the angle can be seen, from the worse one."""
    return max(
        (_view(mark, optics, distance, turn) for turn in (angle, -angle)), key=lambda v: (not v.is_inside, v.sd[0])
    )


def _view(mark: StripeMark, optics: Optics, distance: float, angle: float) -> View:
    pose, rows = pose_at(mark, distance, angle), optics.rows_across(mark, distance)
    u = bearings(pose, mark.edges)
    is_inside = bool(is_ahead(pose, mark.edges)) and optics.field[0] <= u[0] and u[-1] <= optics.field[1]
    sigma = optics.edge_sigma / (optics.fx * np.sqrt(rows))
    return View(
        mark=mark.id,
        distance=distance,
        angle=abs(angle),
        is_inside=is_inside,
        gap=float(optics.fx * np.diff(u).min()) if is_inside else np.nan,
        rows=rows,
        sd=np.sqrt(np.diag(pose_covariance(pose, mark.edges, sigma))) if is_inside else np.full(3, np.nan),
    )


def _confusion(
    seen: StripeMark, taken: StripeMark, optics: Optics, distances: Sequence[float], angles: Sequence[float]
) -> Confusion:
    is_same = seen is taken
    polarities = tuple(seen.polarity.tolist()), tuple(taken.polarity.tolist())
    columns = _columns(seen, optics, distances, angles)
    n_hidden = max(most_hidden(has_height=taken.height is not None), len(taken.edges) - ENOUGH)
    kinds = [
        _nearest(pairings, seen.edges, taken.edges, columns)
        for pairings in (whole(*polarities, is_same=is_same), hidden(*polarities, n_hidden, is_same=is_same))
    ]
    gap = np.fmin.reduce(np.diff(columns), axis=(2, 3))
    upside_down = tuple(-p for p in reversed(polarities[0]))
    turned = None
    if seen.bars is not None or taken.bars is None:
        sign = upside_down if seen.bars is not None else polarities[0]
        turned = _nearest(
            whole(sign, polarities[1], is_same=False), -seen.edges[::-1], taken.edges, -columns[..., ::-1]
        )
    sigmas, is_same_ratio = (None, False) if is_same else _cross_ratio(seen, taken, optics, distances, angles)
    return Confusion(
        seen=seen.id,
        taken=taken.id,
        whole=_least(kinds[0]),
        hidden=_least(kinds[1]),
        turned=_least(turned),
        cross_ratio=sigmas,
        is_cross_ratio_same=is_same_ratio,
        apart_to=_apart_to(kinds[0], np.fmin(optics.tolerance, optics.tolerance_share * gap), distances),
        apart_to_hidden=_apart_to(kinds[1], np.fmin(optics.part_tolerance, optics.part_share * gap), distances),
    )


def _columns(mark: StripeMark, optics: Optics, distances: Sequence[float], angles: Sequence[float]) -> Array:
    """Return the columns (distances, angles, 2, edges) of the edges, from both sides [px from the middle]."""
    poses = np.array([[[pose_at(mark, d, turn) for turn in (a, -a)] for a in angles] for d in distances])
    return np.where(is_ahead(poses, mark.edges)[..., None], optics.fx * bearings(poses, mark.edges), np.nan)


def _nearest(pairings: tuple[Pairing, ...], seen: Array, taken: Array, columns: Array) -> Array | None:
    """Return the least gap (distances, angles) [px] of all pairings, from the worse side; None without any."""
    best: Array | None = None
    for pairing in pairings:
        order = np.argsort(template_gaps(taken[pairing.taken], seen[pairing.seen]), kind="stable")[:_MOST]
        gaps = template_gaps(taken[pairing.taken[order]], columns[..., pairing.seen[order]])
        least = np.fmin.reduce(gaps, axis=(2, 3))
        best = least if best is None else np.fmin(best, least)
    return best


def _least(gaps: Array | None) -> float | None:
    return None if gaps is None else float(np.fmin.reduce(gaps, axis=None))


def _apart_to(gaps: Array | None, tolerance: Array, distances: Sequence[float]) -> tuple[float, ...]:
    """Return for each angle the distance up to which a gap (distances, angles) is greater than the tolerance there."""
    if gaps is None:
        return (distances[-1],) * int(tolerance.shape[1])
    counts = [len(distances) if column.all() else int(np.argmin(column)) for column in (gaps > tolerance).T]
    return tuple(distances[n - 1] if n else 0.0 for n in counts)


def _fours(n: int) -> npt.NDArray[np.int64]:
    """Return the indices of neighbouring fours among n lines."""
    return np.arange(max(n - 3, 0))[:, None] + np.arange(4)


def _cross_ratio(
    seen: StripeMark, taken: StripeMark, optics: Optics, distances: Sequence[float], angles: Sequence[float]
) -> tuple[float | None, bool]:
    if len(seen.lines) < 4 or len(taken.lines) < 4:
        return None, False
    apart = np.abs(
        log_cross_ratios(seen.lines[_fours(len(seen.lines))])[:, None]
        - log_cross_ratios(taken.lines[_fours(len(taken.lines))])
    ).min(axis=1)
    sigma = _ratio_sigmas(seen, optics, distances, angles)
    return float(np.min(apart / sigma)), bool(np.any(apart < CR_SIGMAS * sigma + CR_FLOOR))


def _ratio_sigmas(mark: StripeMark, optics: Optics, distances: Sequence[float], angles: Sequence[float]) -> Array:
    """Return the largest error (fours,) of ln |CR| of each four of neighbouring rising lines."""
    lines = StripeMark(id=mark.id, lines=mark.lines, bars=None, pose=mark.pose, height=mark.height)
    columns = _columns(lines, optics, distances, angles)[..., _fours(len(mark.lines))]
    roots = np.sqrt([optics.rows_across(mark, d) for d in distances])
    sigma = cross_ratio_sigma(columns, optics.edge_sigma) / roots[:, None, None, None]
    return np.asarray(np.fmax.reduce(sigma, axis=(0, 1, 2)))


def _is_fence(mark: StripeMark, optics: Optics, distances: Sequence[float], angles: Sequence[float]) -> bool:
    """Tell whether lines are equally spaced: four of them by their cross ratio, three bars as a whole."""
    n = len(mark.lines)
    if n < 4:
        bars = 0.0 if mark.bars is None else float(mark.bars.mean())
        X = np.stack([np.arange(n), np.arange(n) + bars * (n - 1) / np.ptp(mark.lines)], axis=1)
        fence = X[:, 0] if mark.bars is None else X.ravel()
        gaps = template_gaps(fence, _columns(mark, optics, distances, angles))
        return bool(np.fmin.reduce(gaps, axis=None) <= optics.tolerance) and mark.bars is not None
    apart = np.abs(log_cross_ratios(mark.lines[_fours(n)]) - np.log(-FENCE))
    return bool(np.any(apart < CR_SIGMAS * _ratio_sigmas(mark, optics, distances, angles) + CR_FLOOR))
