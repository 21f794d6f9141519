"""Pictures of errors over time, with the three sigma that the estimator claims.

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
from .track import longest_step

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SMALLEST_DRAWN_M = 1e-4
"""The logarithmic axis of errors ends here; smaller errors are drawn on its edge."""


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


def errors_caption(findings: Findings) -> str:
    """Say what to look for."""
    truth, track = findings.truth, findings.primary
    if truth is None or track is None:
        return ""
    words = (
        "The distance stands on a logarithmic axis, so that centimetres and a lost estimate show in one picture; "
        "of long runs it is the mean, and pale the range, of short stretches."
    )
    if findings.aligned_by:
        words += f" Drawn as estimated, without the {findings.aligned_by} alignment of the evaluation."
    share = deviation(track, truth).share_within(3.0)
    if share is None:
        return words + " The estimator gave no covariance, so there is no band."
    return words + (
        f" The band is three standard deviations as the estimator claims them: {100 * share:.1f} % of the poses lie "
        "inside it in x, y and heading at once (99.2 % would, were the claim exact and the three independent)."
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
