"""Pictures of landmarks: on a map, how many were seen and matched over time, and how often how many.

Called inside ``drawing()``; each returns None when there is nothing to draw.
"""

from typing import TYPE_CHECKING

import numpy as np

from ....formats.events import Array
from ..drawing import LIGHT, legend_above, new_figure
from ..findings import Findings
from ..timeline import STRETCHES, longest_run, stretches
from .kept import Counts, LandmarkFindings

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LARGEST_BIN = 15
"""The last bar of the histogram holds this number and all above."""


def draw_landmarks(axes: "Axes", findings: LandmarkFindings, *, is_labelled: bool = True) -> None:
    """Draw the map's landmarks; those that were matched filled, the others hollow."""
    landmarks = findings.landmarks
    if landmarks is None or len(landmarks) == 0:
        return
    xy, size = landmarks.positions[:, :2], 3.2 if len(landmarks) < 600 else 1.6
    is_matched = np.isin(landmarks.ids, sorted(findings.matched_ids))
    total = len(landmarks)
    groups = [(is_matched, LIGHT["landmark"], f"landmark, matched ({int(is_matched.sum())} of {total})"),
              (~is_matched, "none", "landmark, never matched")]  # fmt: skip
    if not is_matched.any():
        groups = [(~is_matched, LIGHT["landmark"], f"landmark ({total})")]
    for chosen, face, label in groups:
        if chosen.any():
            axes.plot(
                *xy[chosen].T, linestyle="", marker="o", markersize=size, markerfacecolor=face, zorder=1.5,
                markeredgecolor=LIGHT["landmark"], markeredgewidth=0.5, label=label if is_labelled else None,
            )  # fmt: skip


def draw_sightings(findings: Findings) -> "Figure | None":
    """Draw how many landmarks were seen and matched over time (the paper's figure 8)."""
    seen, matched = _counts(findings)
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


def sightings_caption(findings: Findings) -> str:
    """Say what to look for."""
    seen, _ = _counts(findings)
    words = "Where the thin line falls below the broad one, sightings were refused or belong to nothing in the map."
    if seen is None or len(seen.n) == 0:
        return words
    longest = longest_run(seen.n == 0)
    return words + (f" The longest stretch without any has {longest} images." if longest else "")


def draw_histogram(findings: Findings) -> "Figure | None":
    """Draw how often how many landmarks were seen and matched (the paper's figure 9), with the counts printed."""
    named = zip(_counts(findings), ("seen", "matched"), strict=True)
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


def histogram_caption(findings: Findings) -> str:
    """Say what to look for."""
    seen, _ = _counts(findings)
    if seen is None or len(seen.n) == 0:
        return "How many landmarks the poses rest on."
    few, n = int((seen.n < 2).sum()), len(seen.n)
    return (
        f"{few} of {n} images ({100 * few / n:.1f} %) show fewer than two landmarks; "
        f"on average {seen.n.mean():.2f} are seen."
    )


def _counts(findings: Findings) -> tuple[Counts | None, Counts | None]:
    """Return how many landmarks each image has: as seen, and as the primary estimate matched them."""
    kept = findings.of(LandmarkFindings)
    return (None, None) if kept is None else (kept.seen, kept.matched_by(findings.primary))


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
