"""What marks add to a map: where they hang and to which side they look, lines of sight, and what one image alone says.

Marks are drawn to scale, their arrows and names are not. Ellipses of centimetres would not be seen on a map of a hall,
so they are magnified by a round factor, which the legend says. Called inside ``drawing()``.
"""

from typing import TYPE_CHECKING

import numpy as np

from ....formats.events import Array
from ....formats.products import StripeMark
from ..drawing import LIGHT
from .kept import OK, MarkFindings

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIGHT_LINES = 24
"""Most images whose lines of sight and ellipses are drawn."""

DOTS = 400
"""Most positions of single images."""

FACTORS = (200.0, 100.0, 50.0, 20.0, 10.0, 5.0, 2.0, 1.0)
LARGEST_SHARE = 0.05
"""Half axis of most of the drawn ellipses, as a share of the map's extent, at most."""


def mark_places(findings: MarkFindings, *, seen: bool) -> Array:
    """Return the ends of all marks that were recognised, or of all others: (M, 2) [m]."""
    known = () if findings.marks is None else findings.marks.marks
    chosen = [ends_of_mark(mark) for mark in known if _is_seen(findings, mark) == seen]
    return np.concatenate(chosen) if chosen else np.empty((0, 2))


def ends_of_mark(mark: StripeMark) -> Array:
    """Return where the first and the last edge of a mark are: (2, 2) [m]."""
    return on_mark(mark, mark.edges[[0, -1]])


def on_mark(mark: StripeMark, abscissae: Array) -> Array:
    """Return where points on a mark are in the map: (N, 2) [m]."""
    along = np.array([np.cos(mark.pose[2]), np.sin(mark.pose[2])])
    return np.asarray(mark.pose[:2] + np.outer(abscissae, along))


def lens_of(findings: MarkFindings, i: int, mark: StripeMark) -> Array:
    """Return where the lens was in the map by one sighting: (2,) [m]; the paper's eq. (1) in the plane."""
    phi, dx, dy = findings.pose[i]
    c, s = np.cos(mark.pose[2] - phi), np.sin(mark.pose[2] - phi)
    return np.asarray(mark.pose[:2] - np.array([c * dx - s * dy, s * dx + c * dy]))


def draw_marks(axes: "Axes", findings: MarkFindings, *, is_labelled: bool = True) -> None:
    """Draw where marks hang: their bars, an arrow to the viewer's side, and behind them their ids."""
    if findings.marks is None:
        return
    known = findings.marks.marks
    n = sum(_is_seen(findings, mark) for mark in known)
    words = {True: f"mark, recognised ({n} of {len(known)})", False: "mark, never recognised"}
    for mark in known:
        is_seen = _is_seen(findings, mark)
        role = "matched" if is_seen else "landmark"
        first, last = ends_of_mark(mark)
        axes.plot(*np.stack([first, last]).T, color=LIGHT["landmark"], linewidth=1.2, zorder=3.4)
        label = words.pop(is_seen, None) if is_labelled else None
        axes.plot(*_bars(mark).T, color=LIGHT[role], linewidth=4.0, solid_capstyle="butt", label=label, zorder=3.5)
        facing = np.array([np.sin(mark.pose[2]), -np.cos(mark.pose[2])])  # heading - 90 degrees
        middle = 0.5 * (first + last)
        axes.quiver(
            *middle, *(0.17 * facing), angles="xy", scale_units="inches", scale=1.0, units="inches", width=0.014,
            color=LIGHT[role], zorder=3.6,
        )  # fmt: skip
        axes.annotate(
            str(mark.id), tuple(middle), xytext=tuple(-10.0 * facing), textcoords="offset points", ha="center",
            va="center", fontsize=9, fontweight="bold", color=LIGHT[role], zorder=6,
        )  # fmt: skip


def draw_single_images(axes: "Axes", findings: MarkFindings, span: float) -> None:
    """Draw what single images say: positions, and of some of them the line of sight and the ellipse of three sigma.

    Args:
        axes: of a map.
        findings: of the marks.
        span: extent of the map, from which the ellipses' magnification is chosen [m].
    """
    used = np.flatnonzero(findings.is_used)
    if len(used) == 0:
        return
    dots = evenly(used, DOTS)
    axes.plot(
        *findings.robot[dots, :2].T, linestyle="", marker=".", markersize=4.5, markeredgewidth=0, color=LIGHT["other2"],
        zorder=3.2, label=f"by one image alone{share_words(len(dots), len(used))}",
    )  # fmt: skip
    some = evenly(used, SIGHT_LINES)
    _draw_sight_lines(axes, findings, some, len(used))
    factor = magnification(findings.robot_cov[used, :2, :2], span)
    pieces = [ellipse(findings.robot[i, :2], findings.robot_cov[i, :2, :2], 3.0 * factor) for i in some]
    times = "" if factor == 1.0 else f", enlarged {factor:g} times"
    axes.plot(
        *_joined(pieces).T, color=LIGHT["other1"], linewidth=0.8, zorder=2.7, label=f"3σ of one image{times}"
    )  # fmt: skip


def magnification(covariances: Array, span: float) -> float:
    """Choose how many times larger than they are ellipses of three sigma are drawn.

    Args:
        covariances: (N, 2, 2) [m^2].
        span: extent of the map [m].
    """
    known = covariances[np.isfinite(covariances).all(axis=(1, 2))]
    if len(known) == 0:
        return 1.0
    large = 3.0 * float(np.quantile(np.sqrt(np.maximum(np.linalg.eigvalsh(known)[:, 1], 0.0)), 0.9))
    return next((factor for factor in FACTORS if factor * large <= LARGEST_SHARE * span), 1.0)


def ellipse(centre: Array, covariance: Array, k: float) -> Array:
    """Return the curve at k standard deviations: (M, 2) [m]; one point where there is no covariance."""
    if not np.isfinite(covariance).all():
        return centre[None, :]
    values, vectors = np.linalg.eigh(covariance)
    turn = np.linspace(0.0, 2.0 * np.pi, 33)
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return np.asarray(centre + k * (circle * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)


def evenly(values: np.ndarray[tuple[int], np.dtype[np.int64]], most: int) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Choose at most so many of some values, evenly, the first and the last among them."""
    if len(values) <= most:
        return values
    return values[np.round(np.linspace(0, len(values) - 1, most)).astype(np.int64)]


def _draw_sight_lines(
    axes: "Axes", findings: MarkFindings, some: np.ndarray[tuple[int], np.dtype[np.int64]], n: int
) -> None:
    lines = []
    for i in some:
        mark = findings.mark_of(int(findings.mark[i]))
        if mark is not None:
            lines.append(np.stack([lens_of(findings, int(i), mark), mark.pose[:2]]))
    if lines:
        label = f"line of sight{share_words(len(lines), n)}"
        axes.plot(*_joined(lines).T, color=LIGHT["seen"], linewidth=0.7, zorder=1.2, label=label)


def _bars(mark: StripeMark) -> Array:
    """Return the bars as pieces of a line; where only their left edges are known, as a hair's breadth of it."""
    widths = np.full(len(mark.lines), 1e-3) if mark.bars is None else mark.bars
    return _joined([on_mark(mark, np.array([left, left + w])) for left, w in zip(mark.lines, widths, strict=True)])


def _joined(pieces: list[Array]) -> Array:
    """Put pieces of a line after one another, with nan between them."""
    gap = np.full((1, 2), np.nan)
    return np.concatenate([part for piece in pieces for part in (piece, gap)])


def _is_seen(findings: MarkFindings, mark: StripeMark) -> bool:
    return bool((findings.of_status(OK) & (findings.mark == mark.id)).any())


def share_words(n: int, total: int) -> str:
    """Say how many are drawn, and of how many if that is not all."""
    return f" ({total})" if n == total else f" ({n} of {total})"
