"""Picture of a few images with what was found in them: the edges, the row, the marks' ids, and the poses in words.

Left the whole image; right its mark close up, and under it the brightness along the row, so that every edge can be seen
to lie on a step. Edges from dark to bright are blue, from bright to dark orange; without a map of the marks it is not
known which is which, and all are blue. Called inside ``drawing()``.
"""

from typing import TYPE_CHECKING

import numpy as np

from ....formats.events import NO_ID, MarkSighting
from ..drawing import LIGHT, WIDTH_IN, new_figure
from ..findings import Findings
from .kept import USED, MarkFindings
from .snapshots import Snapshot, residual_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROW_IN, TITLE_IN, HEAD_IN, FOOT_IN = 3.7, 0.2, 0.32, 0.42
"""Height of an image's row, of a line of its title, of the legend over all, and of the labels under an image [inch]."""

LEFT_IN, WHOLE_IN, CLOSE_IN = 0.55, 4.1, 3.05
"""Where the whole image begins, how wide it is, and how wide what stands beside it is [inch]."""

FRAME = "truth"
"""Role of the colour of what is shown close up."""

RISING, FALLING, UNKNOWN = "other3", "weak", "other2"
"""Roles of the colours of edges: from dark to bright, from bright to dark, and those that belong to no mark."""


def draw_images(findings: Findings) -> "Figure | None":
    """Draw what was found in the images that were kept."""
    marks = findings.of(MarkFindings)
    if marks is None or not marks.snapshots:
        return None
    figure = new_figure(HEAD_IN + ROW_IN * len(marks.snapshots))
    figure.set_layout_engine("none")  # all places are known, and the solver's last bits differ from run to run
    for i, snapshot in enumerate(marks.snapshots):
        _draw_snapshot(figure, HEAD_IN + ROW_IN * i, snapshot, marks, findings.start)
    _legend(figure, marks)
    return figure


def images_caption(findings: Findings) -> str:
    """Say what to look for."""
    marks = findings.of(MarkFindings)
    words = (
        "The edges as found, over the image they were found in; the dashed line is the row at which they are measured. "
        "Every edge must lie on a step of the brightness along that row, and the ids must be those of the marks that "
        "hang there."
    )
    if marks is not None and any(s.kind == "worst" for s in marks.snapshots):
        words += " The one with the largest residual shows what the worst accepted image looks like."
    if marks is not None and any(s.kind == "refused" for s in marks.snapshots):
        words += " The last one was not used: is there a mark in it?"
    return words


def title_of(snapshot: Snapshot) -> str:
    """Say why an image is shown."""
    left = residual_of(snapshot.main)
    match snapshot.kind:
        case "typical":
            return f"typical of {snapshot.of} images used" if snapshot.of > 1 else "the only image used"
        case "worst":
            return f"largest residual of {snapshot.of} images used: {left:.3f} px"
        case "refused":
            return f"one of {snapshot.of} images not used" if snapshot.of > 1 else "the only image not used"


def pose_in_words(event: MarkSighting) -> str:
    """Say what one sighting amounts to."""
    name = "no mark" if event.mark == NO_ID else f"mark {event.mark}"
    if not np.isfinite(event.pose).all():
        return name if event.status == "no_mark" and event.mark == NO_ID else f"{name}: {event.status}"
    distance = float(np.hypot(event.pose[1], event.pose[2]))
    toward = np.array([0.0, event.pose[1], event.pose[2]]) / max(distance, 1e-9)
    sd_angle = float(np.degrees(np.sqrt(max(float(event.cov[0, 0]), 0.0))))
    sd_distance = float(np.sqrt(max(float(toward @ event.cov @ toward), 0.0)))
    words = f"{name}: φ {np.degrees(event.pose[0]):.2f}°±{sd_angle:.2f}°, {distance:.3f} m±{1000 * sd_distance:.1f} mm"
    words += f", {len(event.lines)} edges, residual {residual_of(event):.3f} px"
    return words if event.status == "ok" else f"{words}, {event.status}"


def _draw_snapshot(figure: "Figure", down: float, snapshot: Snapshot, marks: MarkFindings, start: int) -> None:
    """Draw one image's row, ``down`` inches from the top."""
    lines = [f"{title_of(snapshot)}, t = {(snapshot.stamp - start) / 1e9:.2f} s"]
    lines += [pose_in_words(event) for event in _worth_words(snapshot)]
    top = down + TITLE_IN * len(lines) + 0.06
    height = min(ROW_IN - FOOT_IN - (top - down), WHOLE_IN * snapshot.height / snapshot.width)
    _words(figure, lines, down)
    _draw_whole(
        _axes(figure, (LEFT_IN, top, min(WHOLE_IN, height * snapshot.width / snapshot.height), height)), snapshot, marks
    )
    beside, split = WIDTH_IN - CLOSE_IN - 0.1, 0.56 * height if snapshot.is_close else 0.0
    close = None
    if snapshot.is_close:
        close = _axes(figure, (beside, top, CLOSE_IN, split - 0.06 if snapshot.profile.size else height))
        _draw_close(close, snapshot, marks)
    if snapshot.profile.size:
        profile = _axes(figure, (beside, top + split, CLOSE_IN, height - split))
        _draw_profile(profile, snapshot, marks)
    if close is not None and snapshot.profile.size:
        close.tick_params(labelbottom=False)


def _axes(figure: "Figure", place: tuple[float, float, float, float]) -> "Axes":
    """Add axes at left, top, width, height, counted from the top left corner [inch]."""
    left, top, width, height = place
    high = figure.get_figheight()
    return figure.add_axes((left / WIDTH_IN, 1.0 - (top + height) / high, width / WIDTH_IN, height / high))


def _words(figure: "Figure", lines: list[str], down: float) -> None:
    for i, line in enumerate(lines):
        figure.text(
            LEFT_IN / WIDTH_IN, 1.0 - (down + TITLE_IN * (i + 0.75)) / figure.get_figheight(), line, va="baseline",
            fontweight="bold" if i == 0 else "normal",
        )  # fmt: skip


def _worth_words(snapshot: Snapshot) -> list[MarkSighting]:
    """Return what is put into words: the sighting it was chosen for first, three in all."""
    rest = [event for event in snapshot.sightings if event is not snapshot.main]
    return [snapshot.main, *rest][:3]


def _draw_whole(axes: "Axes", snapshot: Snapshot, marks: MarkFindings) -> None:
    """Draw the image with all edges, the rows, and the names of the marks."""
    extent = (-0.5, snapshot.width - 0.5, snapshot.height - 0.5, -0.5)
    axes.imshow(snapshot.pixels, cmap="gray", vmin=0, vmax=255, extent=extent, interpolation="none")
    named: list[float] = []
    for event in snapshot.sightings:
        _draw_row(axes, event.row, (extent[0], extent[1]))
        _draw_edges(axes, event, marks, 1.0)
        ends = event.ends.reshape(-1, 2)
        ends = ends[np.isfinite(ends).all(axis=1)]
        if event.mark != NO_ID and len(ends):
            middle, top = 0.5 * (ends[:, 0].min() + ends[:, 0].max()), float(ends[:, 1].min())
            at = np.clip([middle, top], 0, [snapshot.width - 1, snapshot.height - 1])
            above = sum(abs(other - middle) < 0.06 * snapshot.width for other in named)  # candidates for one place
            named.append(middle)
            axes.annotate(
                str(event.mark), tuple(at), xytext=(0, 3 + 17 * above), textcoords="offset points", ha="center",
                va="bottom", fontsize=11, fontweight="bold",
                color=LIGHT["ink" if event.status in USED else "none"],
                bbox={"boxstyle": "round,pad=0.15", "facecolor": LIGHT["paper"], "edgecolor": "none", "alpha": 0.8},
            )  # fmt: skip
    if snapshot.is_close:
        left, right, top_row, bottom = snapshot.window
        axes.plot(
            [left, right, right, left, left], [top_row, top_row, bottom, bottom, top_row], color=LIGHT[FRAME],
            linewidth=0.9,
        )  # fmt: skip
    _as_image(axes, (extent[0], extent[1]), (extent[2], extent[3]))
    axes.set_xlabel("column [px]")
    axes.set_ylabel("row [px]")


def _draw_close(axes: "Axes", snapshot: Snapshot, marks: MarkFindings) -> None:
    """Draw the surroundings of the mark, as wide as the brightness under it."""
    left, right, top, bottom = snapshot.window
    extent = (left - 0.5, right - 0.5, bottom - 0.5, top - 0.5)
    axes.imshow(snapshot.close, cmap="gray", vmin=0, vmax=255, extent=extent, interpolation="none", aspect="auto")
    _draw_row(axes, snapshot.main.row, (extent[0], extent[1]))
    _draw_edges(axes, snapshot.main, marks, 1.1)
    _as_image(axes, (extent[0], extent[1]), (extent[2], extent[3]))
    axes.set_ylabel("row [px]")


def _draw_profile(axes: "Axes", snapshot: Snapshot, marks: MarkFindings) -> None:
    """Draw the brightness along the row, and where the edges are in it."""
    columns, brightness = snapshot.profile
    for at, role in zip(snapshot.main.lines[:, 0], edge_roles(snapshot.main, marks), strict=True):
        axes.axvline(at, color=LIGHT[role], linewidth=1.3)
    axes.plot(columns, brightness, color=LIGHT["ink"], linewidth=0.9, drawstyle="steps-mid")
    axes.set_xlim(columns[0] - 0.5, columns[-1] + 0.5)
    axes.set_ylim(-8, 263)
    axes.set_yticks([0, 128, 255])
    axes.tick_params(labelsize=7)
    axes.set_xlabel("column [px]")
    axes.set_ylabel("brightness")


def _draw_edges(axes: "Axes", event: MarkSighting, marks: MarkFindings, width: float) -> None:
    """Draw the edges as far as they were found."""
    for (start, end), role in zip(event.ends, edge_roles(event, marks), strict=True):
        axes.plot(*np.stack([start, end]).T, color=LIGHT[role], linewidth=width, solid_capstyle="butt")


def _draw_row(axes: "Axes", row: float, columns: tuple[float, float]) -> None:
    axes.plot(columns, [row, row], color=LIGHT["none"], linewidth=0.7, linestyle=(0, (5, 3)))


def edge_roles(event: MarkSighting, marks: MarkFindings) -> list[str]:
    """Return the colour role of each edge of a sighting."""
    mark = marks.mark_of(event.mark)
    if mark is None:
        return [RISING if member >= 0 else UNKNOWN for member in event.members.tolist()]
    rises = mark.polarity
    is_known = (event.members >= 0) & (event.members < len(rises))
    return [
        UNKNOWN if not known else RISING if rises[member] > 0 else FALLING
        for member, known in zip(event.members.tolist(), is_known.tolist(), strict=True)
    ]


def _as_image(axes: "Axes", columns: tuple[float, float], rows: tuple[float, float]) -> None:
    axes.set_xlim(*columns)
    axes.set_ylim(*rows)
    axes.grid(visible=False)
    axes.tick_params(labelsize=7)
    axes.locator_params(nbins=6)


def _legend(figure: "Figure", marks: MarkFindings) -> None:
    """Name the colours that are there."""
    from matplotlib.lines import Line2D

    roles = {role for s in marks.snapshots for event in s.sightings for role in edge_roles(event, marks)}
    rises = "edge" if marks.marks is None else "edge, dark to bright"
    words = ((RISING, rises), (FALLING, "edge, bright to dark"), (UNKNOWN, "edge of no mark"))
    handles = [Line2D([], [], color=LIGHT[role], linewidth=1.6, label=text) for role, text in words if role in roles]
    handles.append(Line2D([], [], color=LIGHT["none"], linewidth=0.9, linestyle=(0, (5, 3)), label="row of the edges"))
    if any(snapshot.is_close for snapshot in marks.snapshots):
        handles.append(Line2D([], [], color=LIGHT[FRAME], linewidth=1.2, label="shown close up"))
    figure.legend(handles=handles, loc="upper left", ncols=5, borderaxespad=0.2, handlelength=2.2, columnspacing=1.6)
