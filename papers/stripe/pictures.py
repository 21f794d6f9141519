"""Pictures of the rendered design: errors over distance, angle and offset, of both methods and as predicted."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from bench import DX_MM, DY_MM, PHI_DEG, QUANTITIES, is_out, pose_of
from figure8 import DISTANCE_OF_C, UNITS
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rendered import Cell, Results

from logpose.pipelines.report.drawing import LIGHT, drawing, new_figure, to_png, to_svg_file

COLOURS = [LIGHT[role] for role in ("estimate", "other3", "other1", "weak", "none")]
ANGLES, DISTANCES = (0, 20, 40, 60, 80), (300, 500, 700, 1000, 1500)
LEAST_SHARE = 0.5
"""A cell with poses in a smaller share of its images is left out: the lucky ones say nothing of the rest."""


def write_pictures(results: Results, folder: Path) -> list[Path]:
    """Write ``stripe.png``, which the documentation shows, and ``errors.svg``, six panels; return their paths."""
    with drawing():
        small, all_of_it = headline(results), six_panels(results)
        made = {
            folder / "stripe.png": to_png(small, dpi=90),
            folder / "errors.svg": to_svg_file(all_of_it).encode(),
        }
    for path, data in made.items():
        path.write_bytes(data)
    return list(made)


def headline(results: Results) -> Figure:
    """Draw the three panels of Fig. 8 side by side."""
    figure = new_figure(3.3, 9.4)
    axes = figure.subplots(1, 3)
    over_distance(axes[0], "phi", results)
    over_angle(axes[1], "Dy", results)
    over_offset(axes[2], results)
    key(figure, axes[0])
    return figure


def six_panels(results: Results) -> Figure:
    """Draw the errors of phi, Dx and Dy over distance (above) and over angle (below)."""
    figure = new_figure(6.4, 9.4)
    axes = figure.subplots(2, 3)
    for i, what in enumerate(QUANTITIES):
        over_distance(axes[0, i], what, results)
        over_angle(axes[1, i], what, results)
    key(figure, axes[0, 0])
    return figure


def over_distance(axes: Axes, what: str, results: Results) -> None:
    """Draw one curve per angle; Dx = 0."""
    lines = {f"{phi}°": [(dy, 0, phi) for dy in DY_MM] for phi in ANGLES}
    panel(axes, what, DY_MM, lines, results)
    axes.set_xlabel("distance Dy [mm], Dx = 0")


def over_angle(axes: Axes, what: str, results: Results) -> None:
    """Draw one curve per distance; Dx = 0."""
    lines = {f"{dy / 1000:g} m": [(dy, 0, phi) for phi in PHI_DEG] for dy in DISTANCES}
    panel(axes, what, PHI_DEG, lines, results)
    axes.set_xlabel("angle phi [deg], Dx = 0")


def over_offset(axes: Axes, results: Results) -> None:
    """Draw the error of Dx over Dx, one curve per angle."""
    lines = {f"{phi}°": [(DISTANCE_OF_C, dx, phi) for dx in DX_MM] for phi in ANGLES}
    panel(axes, "Dx", DX_MM, lines, results)
    axes.set_xlabel(f"offset Dx [mm], Dy = {DISTANCE_OF_C} mm")


def panel(axes: Axes, what: str, x: Sequence[float], lines: dict[str, list[Cell]], results: Results) -> None:
    """Draw curves of one colour each: the paper's method dashed, the best one full, its prediction dotted."""
    i = QUANTITIES.index(what)
    for colour, (name, cells) in zip(COLOURS, lines.items(), strict=True):
        for method, dash in (("paper", "--"), ("best", "-")):
            label = name if method == "best" else None
            axes.plot(x, curve(results, method, cells, i), dash, color=colour, marker="o", ms=2.5, lw=1.2, label=label)
        predicted = [
            float(np.median(seen.sds[:, i])) if np.isfinite(y) and (seen := results["best"].get(cell)) else np.nan
            for cell, y in zip(cells, curve(results, "best", cells, i), strict=True)
        ]
        axes.plot(x, predicted, ":", color=colour, lw=1.0)
    axes.set_yscale("log")
    axes.set_ylabel(f"error of {what} (rms) [{UNITS[what]}]")
    spot = {"loc": "lower center", "bbox_to_anchor": (0.5, 0.98), "ncols": len(lines)}
    axes.legend(**spot, fontsize=7, handlelength=1.0, handletextpad=0.4, columnspacing=0.9)


def curve(results: Results, method: str, cells: Sequence[Cell], i: int) -> list[float]:
    """Return the rms of each cell; nan where it is out or hardly seen."""
    found = []
    for cell in cells:
        seen = results[method].get(cell)
        is_known = seen is not None and not is_out(pose_of(*cell)) and len(seen.errors) >= LEAST_SHARE * seen.n
        found.append(float(seen.rms[i]) if seen is not None and is_known else np.nan)
    return found


def key(figure: Figure, axes: Axes) -> None:
    """Say above the picture what dashes mean."""
    styles = {"method: paper": "--", "default": "-", "default, as predicted": ":"}
    handles = [axes.plot([], [], dash, color=LIGHT["ink"], lw=1.2)[0] for dash in styles.values()]
    figure.legend(handles, list(styles), loc="outside upper left", ncols=3, borderaxespad=0.2, handlelength=2.6)
