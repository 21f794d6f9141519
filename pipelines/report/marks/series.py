"""Pictures over time and over distance: what each image had to go by, and how wrong and how sure single images are.

Called inside ``drawing()``; each returns None when there is nothing to draw.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ....formats.events import NO_ID, Array
from ..deviation import deviation
from ..drawing import LIGHT, legend_above, logarithmic, new_figure
from ..findings import Findings
from ..timeline import EXTREMES, extremes, runs
from ..track import Stamps, Track
from .kept import MarkFindings, Mask, bridged, ids_of, longest_bridged_s
from .map import DOTS, evenly, share_words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

STATUS_ROLES = {
    "ok": "estimate", "ambiguous": "weak", "unverified": "other1", "poor_geometry": "other2",
    "mirrored_or_back": "ink", "no_mark": "landmark",
}  # fmt: skip
"""Colour of each status; a status that is not known here is grey."""

MOST_IDS = 12
"""With more marks than this the strip has one row for all of them."""

MOST_BINS = 12
LEAST_IN_BIN = 10
"""Sightings are summed up in at most so many equal steps of distance, so few that each could have this many."""


def draw_strip(findings: Findings) -> "Figure | None":
    """Draw over time: which mark was seen with what status, how far and how turned it was, and what was left over."""
    marks = findings.of(MarkFindings)
    if marks is None or len(marks.images) < 2:
        return None
    unit, per = findings.time_unit
    rows = _rows(marks, findings.primary)
    has_pose = bool(np.isfinite(marks.pose).all(axis=1).any())
    heights = [0.30 * len(rows) + 0.25, 0.95, 0.95, 0.95] if has_pose else [0.30 * len(rows) + 0.25]
    figure = new_figure(sum(heights) + 0.9)
    axes = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
    _draw_rows(axes[0], rows, findings, per)
    if has_pose:
        values = ((marks.distance, "distance [m]"), (np.degrees(marks.pose[:, 0]), "angle φ [°]"),
                  (marks.residual, "residual [px]"))  # fmt: skip
        for below, (value, label) in zip(axes[1:], values, strict=True):
            _draw_dots(below, marks, value, (findings.start, per))
            below.set_ylabel(label)
        axes[2].axhline(0.0, color=LIGHT["muted"], linewidth=0.6)
        for below in (axes[1], axes[3]):
            below.set_ylim(bottom=0.0)
        figure.align_ylabels(axes)
    axes[-1].set_xlabel(f"time since the start [{unit}]")
    axes[0].margins(x=0.01)
    legend_above(figure, axes[0])
    return figure


def strip_caption(findings: Findings) -> str:
    """Say what to look for."""
    marks = findings.of(MarkFindings)
    if marks is None:
        return ""
    words = "Which mark each image shows, and whether its pose could be used."
    if np.isfinite(marks.pose).all(axis=1).any():
        words += (
            " Below: how far away and how turned it was, by which the errors grow, and how far its edges are from "
            "where the pose has them, which should be the same small number everywhere."
        )
    longest = longest_bridged_s(marks, findings.primary)
    return words + (f" The longest time that odometry carried alone is {longest:.1f} s." if longest > 0 else "")


def draw_by_distance(findings: Findings) -> "Figure | None":
    """Draw the errors of single images and their standard deviations as predicted, over the distance of the mark."""
    told = by_distance(findings)
    if told is None:
        return None
    figure = new_figure(3.5)
    pair = figure.subplots(1, 2)
    labels = ("angle [°]", "position [m]")
    for axes, error, sigma, label in zip(pair, told.errors, told.sigmas, labels, strict=True):
        some = evenly(np.arange(len(error)), DOTS)
        axes.plot(
            told.distance[some], np.maximum(error[some], _floor(error)), linestyle="", marker=".", markersize=3.5,
            markeredgewidth=0, color=LIGHT["other3"], label=f"error of one image{share_words(len(some), len(error))}",
        )  # fmt: skip
        at, rms, predicted = _binned(told.distance, error, sigma)
        axes.plot(at, rms, color=LIGHT["ink"], linewidth=1.6, marker="o", markersize=4, label="root mean square of it")
        axes.plot(
            at, predicted, color=LIGHT["none"], linewidth=1.6, linestyle=(0, (4, 1.6)), marker="D", markersize=3.5,
            label="as predicted",
        )  # fmt: skip
        logarithmic(axes)
        axes.set_xlabel("distance of the mark [m]")
        axes.set_ylabel(f"error of the {label}")
    legend_above(figure, pair[0])
    return figure


def by_distance_caption(findings: Findings) -> str:
    """Say what to look for."""
    told = by_distance(findings)
    if told is None:
        return ""
    ratios = [float(np.sqrt(np.mean((e / s) ** 2))) for e, s in zip(told.errors, told.sigmas, strict=True)]
    words = (
        "Where the covariance is honest, the two lines are one: over all images the root mean square of error over "
        f"predicted standard deviation is {ratios[0]:.2f} for the angle and {ratios[1]:.2f} for the position. "
        f"Known for {len(told.distance)} sightings, each by its image alone, without odometry. Predicted is what the "
        "edges allow; the errors of the map and of the camera's mount are a floor that no mark goes below, even near."
    )
    n_wild = int((told.errors[0] > WILD * told.sigmas[0]).sum())
    if n_wild == 0:
        return words
    what = "one of them is" if n_wild == 1 else f"{n_wild} of them are"
    return f"{words} The angle of {what} off by more than {WILD:g} standard deviations, as a mark taken for another is."


WILD = 8.0
"""An error of so many standard deviations is none of measuring."""


class ByDistance(NamedTuple):
    """Single images against the truth: (N,) distances [m], sizes of errors of angle [deg] and position [m], and sd."""

    distance: Array
    errors: tuple[Array, Array]
    sigmas: tuple[Array, Array]


def by_distance(findings: Findings) -> ByDistance | None:
    """Compare what single images say with the truth; None if that is not known for enough of them.

    The error of the heading is that of the mark's angle, with the other sign: the mount between them is fixed.
    """
    marks, truth = findings.of(MarkFindings), findings.truth
    if marks is None or truth is None or not marks.is_used.any():
        return None
    error = deviation(marks.track(), truth)
    is_told = np.isfinite(error.distance) & np.isfinite(error.sigma).all(axis=1) & (error.sigma > 0).all(axis=1)
    if is_told.sum() < LEAST_IN_BIN:
        return None
    sigma = error.sigma[is_told]
    return ByDistance(
        marks.distance[marks.is_used][is_told],
        (np.degrees(np.abs(error.turn[is_told])), error.distance[is_told]),
        (np.degrees(sigma[:, 2]), np.hypot(sigma[:, 0], sigma[:, 1])),
    )


class _Row(NamedTuple):
    """One row of the strip: its name, and times from and to with their words."""

    name: str
    spans: list[tuple[int, int, str]]


def _rows(marks: MarkFindings, track: Track | None) -> list[_Row]:
    ids = ids_of(marks)
    if len(ids) > MOST_IDS:
        rows = [_Row("any mark", _status_spans(marks, marks.mark != NO_ID))]
    else:
        rows = [_Row(f"mark {identity}", _status_spans(marks, marks.mark == identity)) for identity in ids]
    if (marks.mark == NO_ID).any():
        rows.append(_Row("none", _status_spans(marks, marks.mark == NO_ID)))
    alone = bridged(marks, track)
    if alone:
        rows.append(_Row("odometry", [(start, end, ALONE) for start, end in alone]))
    return rows


ALONE = "odometry alone"


def _status_spans(marks: MarkFindings, is_in: Mask) -> list[tuple[int, int, str]]:
    """Return from when to when unbroken runs of images have each status, half an image more on both sides."""
    half = int(0.5 * marks.period)
    spans = []
    for word in marks.status_words:
        stamps: Stamps = np.unique(marks.stamps[is_in & marks.of_status(word)])
        for first, last in runs(np.isin(marks.images, stamps)):
            spans.append((int(marks.images[first]) - half, int(marks.images[last]) + half, word))
    return spans


def _draw_rows(axes: "Axes", rows: list[_Row], findings: Findings, per: float) -> None:
    """Draw the strip, one row over the other."""
    words = [word for word in STATUS_ROLES if any(w == word for row in rows for *_, w in row.spans)]
    words += [*sorted({w for row in rows for *_, w in row.spans} - {*words, ALONE}), ALONE]
    longest = max((end for row in rows for _, end, _ in row.spans), default=0) - findings.start
    thin = max(longest / per / EXTREMES, 1e-9)
    for word in words:
        role = "none" if word == ALONE else STATUS_ROLES.get(word, "landmark")
        label: str | None = word
        for i, row in enumerate(rows):
            bars = [
                ((start - findings.start) / per, max((end - start) / per, thin))
                for start, end, w in row.spans
                if w == word
            ]
            if bars:
                axes.broken_barh(_merged(bars, thin), (i - 0.36, 0.72), color=LIGHT[role], linewidth=0, label=label)
                label = None
    axes.set_yticks(range(len(rows)), [row.name for row in rows])
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0)


def _merged(bars: list[tuple[float, float]], gap: float) -> list[tuple[float, float]]:
    """Join bars whose gap could not be seen."""
    joined: list[tuple[float, float]] = []
    for start, length in sorted(bars):
        if joined and start - sum(joined[-1]) <= gap:
            first, _ = joined[-1]
            joined[-1] = (first, max(sum(joined[-1]), start + length) - first)
        else:
            joined.append((start, length))
    return joined


def _draw_dots(axes: "Axes", marks: MarkFindings, value: Array, time: tuple[int, float]) -> None:
    """Draw one number per sighting, in the colour of its status."""
    start, per = time
    for word in marks.status_words:
        is_in = marks.of_status(word) & np.isfinite(value) & np.isfinite(marks.pose).all(axis=1)
        t, y = (marks.stamps[is_in] - start) / per, value[is_in]
        at = extremes(t, y)
        axes.plot(
            t[at], y[at], linestyle="", marker=".", markersize=3.2,
            markeredgewidth=0, color=LIGHT[STATUS_ROLES.get(word, "landmark")],
        )  # fmt: skip
    axes.margins(x=0.01)


def _binned(distance: Array, error: Array, sigma: Array) -> tuple[Array, Array, Array]:
    """Sum up errors in equal steps of distance: mean distances, root mean squares of errors and of predictions.

    A step with few sightings is nan: no line goes there.
    """
    n = int(np.clip(len(distance) // LEAST_IN_BIN, 1, MOST_BINS))
    steps = np.linspace(distance.min(), distance.max(), n + 1)[1:-1]
    index = np.searchsorted(steps, distance)
    rows = np.full((n, 3), np.nan)
    for i in range(n):
        is_in = index == i
        if is_in.sum() >= LEAST_IN_BIN // 2:
            rows[i] = distance[is_in].mean(), np.sqrt(np.mean(error[is_in] ** 2)), np.sqrt(np.mean(sigma[is_in] ** 2))
    at, rms, predicted = rows.T
    return at, rms, predicted


def _floor(error: Array) -> float:
    """Return the least error that is drawn: an error of nothing has no place on a logarithmic axis."""
    return max(float(np.quantile(error, 0.02)), 1e-9)
