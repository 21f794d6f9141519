"""Maps: where the robot was, where it thought it was, and what it had to go by.

Called inside ``drawing()``; each returns None when there is nothing to draw. The truth is a broad pale line with the
estimate thin on top, so both are seen where they agree. Axes are in metres and equal.
"""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ...formats.events import Array
from .drawing import LIGHT, WIDTH_IN, legend_above, new_figure
from .findings import Findings
from .kind import Support
from .kinds import KINDS
from .timeline import runs
from .track import DEAD_RECKON, Track, Waypoint, longest_step

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

OTHERS = ("other1", "other2", "other3")

View = tuple[float, float, float, float]
"""x from, x to, y from, y to [m]."""


def draw_map(findings: Findings) -> "Figure | None":
    """Draw what was seen and all trajectories (the ceiling paper's figures 6 and 7)."""
    view = view_of(findings)
    if view is None:
        return None
    figure, axes = _map_axes(view)
    fill_map(axes, findings)
    legend_above(figure, axes)
    return figure


def map_caption(findings: Findings) -> str:
    """Say what to look for."""
    words = []
    if findings.truth is not None:
        words.append("Where the estimate is right, its thin line runs inside the broad one of the truth.")
    if DEAD_RECKON in findings.estimates:
        words.append(
            "Dead reckoning starts from the same pose and uses odometry alone: "
            "how far it strays is what the method had to make up for."
        )
    words += [part for kind in KINDS if (part := kind.map_caption(findings))]
    return " ".join(words) or "The route in the map frame, both axes to the same scale."


def fill_map(axes: "Axes", findings: Findings) -> None:
    """Draw what was seen, trajectories, their ends and the way points into axes."""
    left, right, bottom, top = view_of(findings) or (0.0, 0.0, 0.0, 0.0)
    span = max(right - left, top - bottom)
    for kind in KINDS:
        kind.under(axes, findings, span)
    if findings.truth is not None and len(findings.truth):
        _line(axes, findings.truth, "truth", 3.6, label="truth")
    styles = line_styles(findings)
    for source, track in findings.estimates.items():
        role, width, dash = styles[source]
        _line(axes, track, role, width, dash, label=source)
    for kind in KINDS:
        kind.over(axes, findings, span)
    _ends(axes, findings.primary or findings.truth)
    _waypoints(axes, findings)


def draw_support(findings: Findings) -> "Figure | None":
    """Draw the estimate, coloured by how much it had to go by (the ceiling paper's figure 10)."""
    track = findings.primary
    view = view_of(findings, 0.06, with_dead_reckoning=False)
    support = support_of(findings)
    if track is None or view is None or support is None:
        return None
    figure, axes = _map_axes(view)
    for kind in KINDS:
        kind.under(axes, findings, None)
        kind.over(axes, findings, None)
    poses = len(track)
    for is_in, role, width, words in support.classes:
        found = int(is_in.sum())
        label = f"{words}: {found} poses ({100 * found / poses:.1f} %)"
        pieces = _pieces(track.xy, is_in)
        x, y = pieces.T if len(pieces) else ([], [])
        axes.plot(x, y, color=LIGHT[role], linewidth=width, label=label, zorder=3 + width / 10, solid_capstyle="butt")
    _ends(axes, track)
    legend_above(figure, axes, columns=3)
    return figure


def support_of(findings: Findings) -> Support | None:
    """Sort the poses of the primary estimate by what they had to go by; None if no kind of thing seen can."""
    return next((found for kind in KINDS if (found := kind.support(findings)) is not None), None)


def support_caption(findings: Findings) -> str:
    """Say what to look for."""
    support = support_of(findings)
    return "" if support is None else support.caption


def draw_passes(findings: Findings) -> "Figure | None":
    """Draw the surroundings of each way point, large: truth, estimate, and the estimate that is judged."""
    track = findings.primary
    points = [point for point in findings.waypoints if np.isfinite([point.x, point.y, point.distance]).all()]
    if track is None or not points:
        return None
    columns = min(4, len(points))
    rows = -(-len(points) // columns)
    figure = new_figure(0.35 + rows * WIDTH_IN / columns * 1.06)
    reach = _reach(points)
    for i, point in enumerate(points):
        axes = figure.add_subplot(rows, columns, i + 1)
        _pass(axes, findings, point, reach)
        if i == 0:
            legend_above(figure, axes)
    return figure


def passes_caption(_: Findings) -> str:
    """Say what to look for."""
    return (
        "All squares have the same scale, in metres of the map. "
        "The red line leads from the way point to the estimate at its pass: the error in the table."
    )


def line_styles(findings: Findings) -> dict[str, tuple[str, float, str]]:
    """Give each estimate a colour role, a width and a dash; the same in every picture."""
    styles: dict[str, tuple[str, float, str]] = {}
    primary, others = findings.primary, 0
    for source in findings.estimates:
        if primary is not None and source == primary.source:
            styles[source] = ("estimate", 1.1, "-")
        elif source == DEAD_RECKON:
            styles[source] = ("dead", 1.1, "--")
        else:
            styles[source] = (OTHERS[others % len(OTHERS)], 1.0, "-.")
            others += 1
    return styles


def view_of(findings: Findings, reach: float = 0.5, *, with_dead_reckoning: bool = True) -> View | None:
    """Choose what part of the plane is shown.

    The route, and of what was seen what its kind asks for, in full; the rest and dead reckoning as far as ``reach``
    times its extent beyond, lest it become small.
    """
    tracks = [findings.truth, *(t for s, t in findings.estimates.items() if s != DEAD_RECKON)]
    core = [track.xy for track in tracks if track is not None and len(track)]
    if not core:
        core = [track.xy for track in findings.estimates.values() if len(track)]
    if not core:
        return None
    seen = [kind.places(findings) for kind in KINDS]
    points = np.concatenate([*core, *(always for always, _ in seen)])
    points = points[np.isfinite(points).all(axis=1)]
    if len(points) == 0:
        return None
    low, high = points.min(axis=0), points.max(axis=0)
    grow = reach * max(1.0, float((high - low).max()))
    rest = [
        track.xy for s, track in findings.estimates.items() if len(track) and (with_dead_reckoning or s != DEAD_RECKON)
    ]
    for xy in (*rest, *(near for _, near in seen)):
        inside = xy[((xy >= low - grow) & (xy <= high + grow)).all(axis=1)]
        points = np.concatenate([points, inside])
    low, high = points.min(axis=0), points.max(axis=0)
    margin = max(0.25, 0.03 * float((high - low).max()))
    return (float(low[0] - margin), float(high[0] + margin), float(low[1] - margin), float(high[1] + margin))


def _map_axes(view: View) -> "tuple[Figure, Axes]":
    """Make a figure as wide as the page, as tall as the view asks for within reason; the view is grown to fill it."""
    usable, chrome = WIDTH_IN - 0.7, 1.0
    height = min(max(usable * (view[3] - view[2]) / (view[1] - view[0]), 2.2), 6.6)
    figure = new_figure(height + chrome)
    axes = figure.add_subplot()
    frame_map(axes, view, (usable, height))
    return figure, axes


def frame_map(axes: "Axes", view: View, size: tuple[float, float]) -> None:
    """Show at least ``view`` in equal axes of about ``size`` (wide, high), with square grid squares."""
    from matplotlib.ticker import MultipleLocator

    left, right, bottom, top = view
    scale = max((right - left) / size[0], (top - bottom) / size[1])
    x, y, half_x, half_y = (left + right) / 2, (bottom + top) / 2, scale * size[0] / 2, scale * size[1] / 2
    axes.set_xlim(x - half_x, x + half_x)
    axes.set_ylim(y - half_y, y + half_y)
    axes.set_aspect("equal", adjustable="box", anchor="W")
    step = grid_step(2 * max(half_x, half_y))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MultipleLocator(step))
        axis.set_major_formatter("{x:g}")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")


def grid_step(span: float) -> float:
    """Choose the side of a map's grid squares [m]: 1, 2 or 5 times a power of ten, at most eleven over the span."""
    power = 10.0 ** math.floor(math.log10(span / 11.0))
    return next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= span / 11.0)


def _line(axes: "Axes", track: Track, role: str, width: float, dash: str = "-", *, label: str | None = None) -> None:
    dashes: object = (0, (4, 1.6)) if dash == "--" else dash
    way, lonely = _unbroken(track)
    if len(lonely):
        axes.plot(*lonely.T, color=LIGHT[role], linestyle="", marker="o", markersize=width + 1.0, markeredgewidth=0)
    axes.plot(
        *way.T, color=LIGHT[role], linewidth=width, linestyle=dashes, label=label,
        zorder=2.0 if role == "truth" else 2.3 if role == "dead" else 3.0, solid_capstyle="round",
    )  # fmt: skip


def _unbroken(track: Track) -> tuple[Array, Array]:
    """Return a track's way with nan where it pauses, and the poses that stand alone between two pauses."""
    is_pause = np.diff(track.stamps) > longest_step(track.stamps)
    if not is_pause.any():
        return track.xy, np.empty((0, 2))
    is_alone = np.concatenate([[True], is_pause]) & np.concatenate([is_pause, [True]])
    way = np.insert(track.xy, np.flatnonzero(is_pause) + 1, np.nan, axis=0)
    return way, track.xy[is_alone]


def _ends(axes: "Axes", track: Track | None) -> None:
    if track is None or len(track) == 0:
        return
    marks = ((0, "o", 7.5, "none", "start"), (-1, "s", 4.5, LIGHT["ink"], "end"))
    for index, marker, size, face, label in marks:
        axes.plot(
            *track.xy[index], linestyle="", marker=marker, markersize=size, markerfacecolor=face, zorder=5,
            markeredgecolor=LIGHT["ink"], markeredgewidth=1.2, label=label,
        )  # fmt: skip


def _waypoints(axes: "Axes", findings: Findings) -> None:
    """Mark and name the way points, the names outside the route."""
    points = [point for point in findings.waypoints if np.isfinite([point.x, point.y]).all()]
    if not points:
        return
    xy = np.array([(point.x, point.y) for point in points])
    middle, extent = (xy.max(axis=0) + xy.min(axis=0)) / 2, np.maximum(np.ptp(xy, axis=0), 1e-9)
    for i, point in enumerate(points):
        away = (xy[i] - middle) / extent  # in a long thin route too, names go to the nearest outside
        away = away / max(float(np.abs(away).max()), 1e-9)
        away = np.where(np.abs(away) < 0.95, 0.0, away) if np.abs(away).any() else np.array([0.0, 1.0])
        axes.plot(
            point.x, point.y, linestyle="", marker="D", markersize=4.2, markerfacecolor=LIGHT["paper"], zorder=4,
            markeredgecolor=LIGHT["ink"], markeredgewidth=0.9, label="way point" if i == 0 else None,
        )  # fmt: skip
        axes.annotate(
            point.name, (point.x, point.y), xytext=tuple(13.0 * away), textcoords="offset points",
            ha="center", va="center", zorder=6, fontsize=9,
        )  # fmt: skip


def _pass(axes: "Axes", findings: Findings, point: Waypoint, reach: float) -> None:
    """Draw one way point, ``reach`` metres to each side."""
    if findings.truth is not None:
        _line(axes, findings.truth, "truth", 5.0, label="truth")
    if findings.primary is not None:
        _line(axes, findings.primary, "estimate", 1.1, label=findings.primary.source)
    axes.plot(
        point.x, point.y, linestyle="", marker="D", markersize=5, markerfacecolor=LIGHT["paper"],
        markeredgecolor=LIGHT["ink"], label="way point", zorder=4,
    )  # fmt: skip
    axes.plot(
        [point.x, point.estimate_x], [point.y, point.estimate_y], color=LIGHT["none"], linewidth=1.4,
        marker="o", markersize=3.5, markevery=[1], label="error", zorder=5,
    )  # fmt: skip
    axes.set_title(f"{point.name}: {point.distance:.3f} m")
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlim(point.x - reach, point.x + reach)
    axes.set_ylim(point.y - reach, point.y + reach)
    axes.tick_params(labelsize=7)
    axes.locator_params(nbins=4)


def _reach(points: Sequence[Waypoint]) -> float:
    """Choose how much around a way point is shown [m]: every error in it, and the same for all."""
    largest = max(point.distance for point in points)
    return next((reach for reach in (0.15, 0.3, 0.6, 1.5, 3.0, 6.0, 15.0) if largest <= 0.7 * reach), 1.5 * largest)


def _pieces(xy: Array, is_in: npt.NDArray[np.bool_]) -> Array:
    """Return the pieces of a path that lie in a class, each up to the next pose, with nan between them: (M, 2)."""
    gap = np.full((1, 2), np.nan)
    pieces = [part for first, last in runs(is_in) for part in (xy[first : last + 2], gap)]
    return np.concatenate(pieces) if pieces else np.empty((0, 2))
