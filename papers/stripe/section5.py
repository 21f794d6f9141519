"""The design of section V by Monte Carlo: what edges of a known quality would give, before any image is rendered.

Three kinds of edges, each with the closed form on the three lines, ``DRAWS`` times per cell:

- A: whole pixels, the same in all rows: the lines of an upright mark cross all rows at one column, so the mean of five
  rows is no better than one. The grid of pixels is shifted at random between draws; a bench that stands still sees one.
- B: whole pixels, of edges that wander by 0.3 px from row to row (noise, a mark not quite upright): five rows averaged.
- C: fractions of a pixel, 0.05 px in all.

``out`` is a cell in which a line leaves the sensor. Where the mark is far away and turned, near-degenerate draws come
to dominate, the rms of a finite number of draws means little, and the median of the absolute error stands beside it.
"""

import sys
from collections.abc import Sequence

import numpy as np
from bench import DX_MM, LINES_M, QUANTITIES, Array, columns, is_out, pose_errors, pose_of

from logpose.pipelines.report.tables import Column, render_table

CASES = ("A", "B", "C")
DRAWS = 1000
ROWS, ROW_SIGMA_PX, FINE_SIGMA_PX = 5, 0.3, 0.05
SHOWN_PHI = (0, 20, 40, 60, 80)
SHOWN_DY = (300, 400, 500, 700, 1000, 1200, 1500)


def main() -> int:
    """Print the tables."""
    print(page())
    return 0


def edges(case: str, px: Array, n_draws: int, rng: np.random.Generator) -> Array:
    """Return what is measured of lines at columns (3,): (n_draws, 3) [px]."""
    if case == "C":
        return px + rng.normal(0.0, FINE_SIGMA_PX, (n_draws, len(px)))
    shift = rng.uniform(-0.5, 0.5, (n_draws, 1))
    if case == "A":
        return np.asarray(np.rint(px + shift) - shift)
    rows = (px + shift)[:, None] + rng.normal(0.0, ROW_SIGMA_PX, (n_draws, ROWS, len(px)))
    return np.asarray(np.rint(rows).mean(axis=1) - shift)


def cell(case: str, dy_mm: float, dx_mm: float, phi_deg: float, *, n_draws: int = DRAWS, seed: int = 1) -> Array | None:
    """Return the errors (n, 3) of phi, Dx, Dy [deg, mm, mm] of a cell; None where a line leaves the sensor.

    Draws in which lines coincide are left out.
    """
    pose = pose_of(dy_mm, dx_mm, phi_deg)
    if is_out(pose):
        return None
    rng = np.random.default_rng([seed, CASES.index(case), int(dy_mm), int(dx_mm), int(phi_deg)])
    found = pose_errors(edges(case, columns(pose), n_draws, rng), pose)
    return found[np.isfinite(found[:, 0])]


def rms(values: Array) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


def table(what: str, cells: Sequence[tuple[int, int]], head: str, *, n_draws: int = DRAWS) -> str:
    """Return one table as Markdown: per (Dy, Dx) and case the rms over phi, the median in brackets.

    Args:
        what: the quantity, one of phi, Dx, Dy.
        cells: pairs Dy, Dx [mm], one row each.
        head: what the first column shows, Dy or Dx.
        n_draws: per cell.
    """
    i = QUANTITIES.index(what)
    rows: list[dict[str, object]] = []
    for dy, dx in cells:
        for case in CASES:
            row: dict[str, object] = {head: dy if head == "Dy" else dx, "case": case}
            for phi in SHOWN_PHI:
                found = cell(case, dy, dx, phi, n_draws=n_draws)
                row[str(phi)] = "out" if found is None else f"{rms(found[:, i]):.3f} ({median(found[:, i]):.3f})"
            rows.append(row)
    heads = [Column(head, f"{head} [mm]"), Column("case"), *(Column(str(phi), f"phi {phi}") for phi in SHOWN_PHI)]
    return render_table(rows, heads, "markdown")


def median(values: Array) -> float:
    """Return the median of the absolute values."""
    return float(np.median(np.abs(values)))


def page(*, n_draws: int = DRAWS) -> str:
    """Return the three tables as Markdown; the first two have Dx = 0, the third Dy = 500 mm, as Fig. 8 does."""
    return (
        f"# Section V by Monte Carlo\n\nrms (median of the absolute value) of {n_draws} draws per cell. A: whole "
        f"pixels; B: whole pixels of rows with {ROW_SIGMA_PX} px noise, mean of {ROWS}; C: {FINE_SIGMA_PX} px. "
        f"{len(LINES_M)} lines, closed form.\n\n"
        "## phi [deg], Dx = 0\n\n" + table("phi", [(dy, 0) for dy in SHOWN_DY], "Dy", n_draws=n_draws) + "\n"
        "## Dy [mm], Dx = 0\n\n" + table("Dy", [(dy, 0) for dy in SHOWN_DY], "Dy", n_draws=n_draws) + "\n"
        "## Dx [mm], Dy = 500 mm\n\n" + table("Dx", [(500, dx) for dx in DX_MM], "Dx", n_draws=n_draws)
    )


if __name__ == "__main__":
    sys.exit(main())
