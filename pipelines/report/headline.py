"""One picture that shows what a run is about: the map, and beside it how the error grows without and with the map."""

from typing import TYPE_CHECKING

from .deviation import deviation
from .drawing import new_figure
from .errors import draw_distances
from .findings import Findings
from .pictures import fill_map, frame_map, view_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH_IN, HEIGHT_IN = 10.0, 3.9


def draw_headline(findings: Findings) -> "Figure":
    """Draw the picture of a run for a front page.

    Args:
        findings: of a run with at least one pose.

    Raises:
        ValueError: there is no pose to draw.
    """
    view = view_of(findings, 0.3)
    if view is None:
        raise ValueError("there is no pose to draw")
    truth, track = findings.truth, findings.primary
    told = {} if truth is None else {source: deviation(t, truth) for source, t in findings.estimates.items()}
    has_errors = track is not None and track.source in told and told[track.source].is_known
    figure = new_figure(HEIGHT_IN, WIDTH_IN)
    grid = figure.add_gridspec(1, 2, width_ratios=[1.9, 1.0]) if has_errors else figure.add_gridspec(1, 1)
    axes = figure.add_subplot(grid[0, 0])
    fill_map(axes, findings)
    frame_map(axes, view, (WIDTH_IN * (0.58 if has_errors else 0.9), HEIGHT_IN - 1.1))
    if has_errors:
        right = figure.add_subplot(grid[0, 1])
        draw_distances(right, findings, told, n=100)
        right.set_xlabel(f"time since the start [{findings.time_unit[0]}]")
        right.set_title("distance from the truth [m]", loc="left")
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper left", ncols=4, borderaxespad=0.2, columnspacing=1.6)
    return figure
