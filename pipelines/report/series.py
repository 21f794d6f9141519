"""Pictures over time: landmarks seen and matched, their histogram, and the errors with the claimed three sigma.

Called inside ``drawing()``; each returns None when there is nothing to draw. Long series are drawn as the mean and the
range of a few hundred equal stretches of time, short ones as they are; nothing else is thinned.
"""

from typing import TYPE_CHECKING

import numpy as np

from ...formats.events import Array
from .deviation import Deviation, deviation
from .drawing import LIGHT, legend_above, logarithmic, new_figure
from .findings import Findings
from .pictures import line_styles
from .timeline import EXTREMES, STRETCHES, extremes, stretches, with_pauses
from .track import Counts, longest_step

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LARGEST_BIN = 15
"""The last bar of the histogram holds this number and all above."""

SMALLEST_DRAWN_M = 1e-4
"""The logarithmic axis of errors ends here; smaller errors are drawn on its edge."""


def draw_sightings(findings: Findings) -> "Figure | None":
    """Draw how many landmarks were seen and matched over time (the paper's figure 8)."""
    seen, matched = findings.seen, findings.matched
    if (seen is None or len(seen.n) == 0) and (matched is None or len(matched.n) == 0):
        return None
    from matplotlib.ticker import MaxNLocator

    figure = new_figure(2.6)
    axes = figure.add_subplot()
    unit, per = findings.time_unit
    top = 1.0
    if seen is not None and len(seen.n):
        t, n = (seen.stamps - findings.start) / per, seen.n.astype(np.float64)
        _series(axes, t, n, unit, ("seen", _label("seen", seen)))
        blind = t[n == 0]
        ticks = np.repeat(blind, 3), np.tile([-0.55, -0.2, np.nan], len(blind))
        axes.plot(
            *ticks,
            color=LIGHT["none"],
            linewidth=0.8,
            label=f"no landmark in the image ({len(blind)} of {len(n)} images)",
        )
        top = max(top, float(n.max()))
    if matched is not None and len(matched.n):
        t, n = (matched.stamps - findings.start) / per, matched.n.astype(np.float64)
        _series(axes, t, n, unit, ("matched", _label("matched", matched)))
        top = max(top, float(n.max()))
    axes.set_ylim(-0.7, top + 0.5)
    axes.margins(x=0.01)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel(f"time since the start [{unit}]")
    axes.set_ylabel("landmarks per image")
    legend_above(figure, axes, columns=2)
    return figure


def draw_histogram(findings: Findings) -> "Figure | None":
    """Draw how often how many landmarks were seen and matched (the paper's figure 9), with the counts printed."""
    named = ((findings.seen, "seen"), (findings.matched, "matched"))
    groups = [(counts.n, role, _label(role, counts)) for counts, role in named if counts is not None and len(counts.n)]
    if not groups:
        return None
    top = min(LARGEST_BIN, max(int(n.max()) for n, _, _ in groups))
    figure = new_figure(2.9)
    axes = figure.add_subplot()
    width = 0.8 / len(groups)
    for i, (n, role, label) in enumerate(groups):
        counts = np.bincount(np.minimum(n, top), minlength=top + 1)
        at = np.arange(top + 1) + (i - (len(groups) - 1) / 2) * width
        bars = axes.bar(at, counts, width * 0.94, color=LIGHT[role], label=label)
        axes.bar_label(bars, labels=[str(c) for c in counts], padding=2, fontsize=8 if top < 9 else 6)
    words = [str(k) for k in range(top + 1)]
    if any(n.max() > top for n, _, _ in groups):
        words[-1] += "+"
    axes.set_xticks(np.arange(top + 1), words)
    axes.set_xlim(-0.6, max(top, 3) + 0.6)
    axes.margins(y=0.12)
    axes.grid(visible=False, axis="x")
    axes.tick_params(axis="x", length=0)
    axes.set_xlabel("landmarks per image")
    axes.set_ylabel("images")
    legend_above(figure, axes)
    return figure


def draw_errors(findings: Findings) -> "Figure | None":
    """Draw the distance from the truth of all estimates, and the signed errors of the one in question."""
    truth, track = findings.truth, findings.primary
    if truth is None or track is None:
        return None
    told = {source: deviation(estimate, truth) for source, estimate in findings.estimates.items()}
    if not told[track.source].is_known:
        return None
    unit, per = findings.time_unit
    figure = new_figure(7.2)
    rows = figure.subplots(4, 1, sharex=True, height_ratios=[1.5, 1, 1, 1])
    draw_distances(rows[0], findings, told)
    rows[0].set_ylabel("distance from\nthe truth [m]")
    error = told[track.source]
    t = (track.stamps - findings.start) / per
    signed = ((error.dx, error.sigma[:, 0], "x error [m]"), (error.dy, error.sigma[:, 1], "y error [m]"),
              (np.degrees(error.turn), np.degrees(error.sigma[:, 2]), "heading error [°]"))  # fmt: skip
    for axes, (value, sigma, label) in zip(rows[1:], signed, strict=True):
        _signed(axes, t, (value, sigma), longest_step(track.stamps) / per)
        axes.set_ylabel(label)
    handles, labels = rows[1].get_legend_handles_labels()
    rows[1].legend(handles, labels, loc="upper right", ncols=2, borderaxespad=0.0, fontsize=8)
    rows[-1].set_xlabel(f"time since the start [{unit}]")
    figure.align_ylabels(rows)
    legend_above(figure, rows[0])
    return figure


def _label(word: str, counts: Counts) -> str:
    return f"{word}, as logged" if counts.source == "sightings" else f"{word} by {counts.source}"


def _series(axes: "Axes", t: Array, n: Array, unit: str, what: tuple[str, str]) -> None:
    """Draw counts over time; what was seen broad and pale, what was matched thin on top of it."""
    role, label = what
    width = 3.2 if role == "seen" else 1.0
    if len(t) <= STRETCHES:
        axes.plot(t, n, color=LIGHT[role], linewidth=width, drawstyle="steps-mid", label=label)
        return
    middle, mean, low, high = stretches(t, n)
    length = (t[-1] - t[0]) / STRETCHES
    axes.plot(middle, mean, color=LIGHT[role], linewidth=width, label=f"{label}, mean of {length:.2g} {unit}")
    if role == "seen":
        axes.fill_between(
            middle, low, high, step="mid", color=LIGHT["grid"], linewidth=0, zorder=1, label="fewest to most seen in it"
        )


def draw_distances(axes: "Axes", findings: Findings, told: dict[str, Deviation], n: int = STRETCHES) -> None:
    """Draw the distances from the truth on a logarithmic axis: centimetres and lost estimates in one picture.

    Long series as the mean of each of n stretches of time, with the range in it pale behind.
    """
    styles, per = line_styles(findings), findings.time_unit[1]
    for source, error in told.items():
        if not error.is_known:
            continue
        role, width, dash = styles[source]
        is_told = np.isfinite(error.distance)
        stamps = findings.estimates[source].stamps[is_told]
        t, longest = (stamps - findings.start) / per, longest_step(stamps) / per
        distance = np.maximum(error.distance[is_told], SMALLEST_DRAWN_M)
        if len(t) > 2 * n:
            longest = max(longest, 1.5 * float(t[-1] - t[0]) / n)
            t, distance, low, high = stretches(t, distance, n)
            at, low, high = with_pauses(t, longest, low, high)
            axes.fill_between(at, low, high, color=LIGHT[role], alpha=0.22, linewidth=0)
        t, distance = with_pauses(t, longest, distance)
        dashes: object = (0, (4, 1.6)) if dash == "--" else dash
        axes.plot(t, distance, color=LIGHT[role], linewidth=width, linestyle=dashes, label=source)
    logarithmic(axes)
    usual = next(error.distance for source, error in told.items() if styles[source][0] == "estimate")
    bottom = max(float(np.nanquantile(usual, 0.05)), SMALLEST_DRAWN_M)
    axes.set_ylim(bottom=10.0 ** np.floor(np.log10(bottom)))
    axes.margins(x=0.01)


def _signed(axes: "Axes", t: Array, what: tuple[Array, Array], longest: float) -> None:
    """Draw a signed error over the band in which 99.7 % of it would lie were the covariance right.

    Args:
        axes: to draw into.
        t: (N,) times.
        what: the error and its standard deviation, (N,) each.
        longest: time that a line may bridge.
    """
    value, sigma = what
    if len(t) > 2 * EXTREMES:
        longest = max(longest, 2.0 * float(t[-1] - t[0]) / EXTREMES)
    if np.isfinite(sigma).any():
        at = extremes(t, sigma)
        times, band = with_pauses(t[at], longest, 3 * sigma[at])
        axes.fill_between(
            times, -band, band, color=LIGHT["estimate"], alpha=0.16, linewidth=0, label="±3σ as estimated"
        )
    axes.margins(x=0.01)
    axes.axhline(0.0, color=LIGHT["muted"], linewidth=0.6)
    at = extremes(t, value)
    axes.plot(*with_pauses(t[at], longest, value[at]), color=LIGHT["estimate"], linewidth=0.8, label="error")
    finite = np.abs(value[np.isfinite(value)])
    known = 3 * sigma[np.isfinite(sigma)]
    # A start spread or a gap must not flatten everything else: the axis follows the errors, and the band's usual size.
    reach = max(float(finite.max()) if len(finite) else 0.0, float(np.quantile(known, 0.98)) if len(known) else 0.0)
    if reach > 0:
        axes.set_ylim(-1.1 * reach, 1.1 * reach)
