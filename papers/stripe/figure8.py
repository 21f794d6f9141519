"""Figure 8 of the stripe paper from rendered images: errors over distance, angle and offset, and what the paper says.

Panels (a) and (b) have Dx = 0, (c) has Dy = 500 mm. A cell reads ``rms (mean ± standard deviation, poses/images)`` of
the signed errors; ``out`` where one of the three lines leaves the sensor, so that the bench could not have seen it, and
``no id`` where the fourth does, and the mark was not told.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from bench import ALL_LINES_M, DX_MM, DY_MM, PHI_DEG, QUANTITIES, Array, is_out, pose_of
from rendered import METHODS, Cell, Chunk, Results, Seen
from section5 import SHOWN_PHI

from logpose.pipelines.report.tables import Column, render_table

PANELS = ("phi", "Dy", "Dx")
UNITS = {"phi": "deg", "Dx": "mm", "Dy": "mm"}
DISTANCE_OF_C = 500


def design(*, repeats: int, others: int) -> list[Chunk]:
    """Return the logs of the whole design: ``repeats`` images of a cell in the figure, ``others`` of all others."""
    chunks = []
    for dy in DY_MM:
        shown = DX_MM if dy == DISTANCE_OF_C else DX_MM[:1]
        chunks.append(Chunk(f"shown{dy}", (dy,), shown, PHI_DEG, repeats))
        if others and len(shown) < len(DX_MM):
            chunks.append(Chunk(f"other{dy}", (dy,), DX_MM[1:], PHI_DEG, others))
    return chunks


def panel_cells(what: str) -> list[tuple[float, list[Cell]]]:
    """Return the rows of a panel: what the first column shows, and the cells over phi."""
    if what == "Dx":
        return [(dx, [(DISTANCE_OF_C, dx, phi) for phi in PHI_DEG]) for dx in DX_MM]
    return [(dy, [(dy, 0, phi) for phi in PHI_DEG]) for dy in DY_MM]


def panel(what: str, results: Results) -> str:
    """Return one panel as a Markdown table."""
    head = "Dx" if what == "Dx" else "Dy"
    rows = []
    for first, cells in panel_cells(what):
        for method in METHODS:
            seen = [results[method].get(cell) for cell in cells]
            if any(seen):
                row: dict[str, object] = {head: int(first), "method": method}
                rows.append(row | {f"{c[2]}": cell_text(what, c, s) for c, s in zip(cells, seen, strict=True)})
    shown = [key for key in map(str, SHOWN_PHI) if any(row.get(key) for row in rows)]
    heads = [Column(head, f"{head} [mm]"), Column("method"), *(Column(key, f"phi {key}") for key in shown)]
    return render_table(rows, heads, "markdown")


def cell_text(what: str, cell: Cell, seen: Seen | None) -> str | None:
    """Return what a cell shows."""
    if seen is None:
        return None
    if is_out(pose_of(*cell)):
        return "out"
    if not len(seen.errors):
        return "no id" if is_out(pose_of(*cell), ALL_LINES_M) else f"0/{seen.n}"
    errors = seen.errors[:, QUANTITIES.index(what)]
    spread = f"{errors.mean():+.3f} ± {errors.std(ddof=1):.3f}" if len(errors) > 1 else f"{errors.mean():+.3f}"
    return f"{np.sqrt(np.mean(errors**2)):.3f} ({spread}, {len(errors)}/{seen.n})"


def rows(results: Results) -> list[dict[str, object]]:
    """Return all cells of the design, one row per method and cell."""
    found: list[dict[str, object]] = []
    for method, cells in results.items():
        for (dy, dx, phi), seen in sorted(cells.items()):
            row: dict[str, object] = {"method": method, "Dy_mm": dy, "Dx_mm": dx, "phi_deg": phi}
            row |= {"is_out": is_out(pose_of(dy, dx, phi)), "images": seen.n, "poses": len(seen.errors)}
            for i, what in enumerate(QUANTITIES):
                errors, unit = seen.errors[:, i], UNITS[what]
                row |= {
                    f"{what}_rms_{unit}": float(np.sqrt(np.mean(errors**2))) if len(errors) else None,
                    f"{what}_mean_{unit}": float(errors.mean()) if len(errors) else None,
                    f"{what}_sd_{unit}": float(errors.std(ddof=1)) if len(errors) > 1 else None,
                    f"{what}_predicted_{unit}": float(np.median(seen.sds[:, i])) if len(errors) else None,
                }
            found.append(row)
    return found


def pooled(cells: Mapping[Cell, Seen], wanted: Iterable[Cell], what: str) -> tuple[float, int, int]:
    """Return the rms over cells, how many poses it is of, and of how many images; nan without poses."""
    chosen = [cells[cell] for cell in wanted if cell in cells and not is_out(pose_of(*cell))]
    parts: list[Array] = [seen.errors[:, QUANTITIES.index(what)] for seen in chosen]
    errors = np.concatenate(parts) if parts else np.empty(0)
    value = float(np.sqrt(np.mean(errors**2))) if len(errors) else float("nan")
    return value, len(errors), sum(seen.n for seen in chosen)


def rises(values: Sequence[float]) -> bool:
    """Tell whether each value is greater than the one before."""
    return all(b > a for a, b in pairwise(values))


def falls(values: Sequence[float]) -> bool:
    """Tell whether each value is less than the one before."""
    return all(b < a for a, b in pairwise(values))


def stays(values: Sequence[float]) -> bool:
    """Tell whether all values are within a factor of 1.5."""
    return max(values) < 1.5 * min(values)


@dataclass(frozen=True)
class Statement:
    """A statement of section V that numbers can answer.

    Attributes:
        paper: what it says, in our words, with the groups that are compared.
        what: the quantity.
        groups: of cells, one number each.
        holds: asked of these numbers.
        percent_of: what each rms is a percentage of, instead of the rms itself.
        is_share: the numbers are percentages of images that gave a pose, instead of errors.
    """

    paper: str
    what: str
    groups: Sequence[Sequence[Cell]]
    holds: Callable[[Sequence[float]], bool]
    percent_of: Sequence[float] = ()
    is_share: bool = False

    def values(self, cells: Mapping[Cell, Seen]) -> list[float]:
        """Return one number per group."""
        found = [pooled(cells, group, self.what) for group in self.groups]
        if self.is_share:
            return [100.0 * n / max(images, 1) for _, n, images in found]
        rms = [value for value, _, _ in found]
        return [100.0 * a / b for a, b in zip(rms, self.percent_of, strict=True)] if self.percent_of else rms

    def row(self, results: Results) -> dict[str, object]:
        """Return the line of the table."""
        found = {method: self.values(results[method]) for method in METHODS}
        verdict = {
            method: "no data" if np.isnan(values).any() else "yes" if self.holds(values) else "no"
            for method, values in found.items()
        }
        shown = {method: ", ".join(f"{value:.3g}" for value in values) for method, values in found.items()}
        same = len(set(verdict.values())) == 1
        holds = verdict["paper"] if same else ", ".join(f"{method}: {word}" for method, word in verdict.items())
        return {"statement": self.paper} | shown | {"holds": holds}


TURNS = PHI_DEG[:7]
STEPS = [[(dy, 0, phi) for phi in TURNS] for dy in (500, 700, 1000, 1500)]
STATEMENTS = (
    Statement("the error of phi grows with Dy: 500, 700, 1000, 1500 mm (phi 0 to 60) [deg]", "phi", STEPS, rises),
    Statement("the error of Dx grows with Dy: the same [mm]", "Dx", STEPS, rises),
    Statement("the error of Dy grows with Dy: the same [mm]", "Dy", STEPS, rises),
    Statement(
        "the percentage error of phi falls with phi: 10, 40, 70 deg at 500 mm [%]",
        "phi", [[(DISTANCE_OF_C, 0, phi)] for phi in (10, 40, 70)], falls, percent_of=(10, 40, 70),
    ),
    Statement(
        "from 70 deg on stripes are too narrow to find: poses at 60, 70, 80 deg, all Dy [% of images]",
        "phi", [[(dy, 0, phi) for dy in DY_MM] for phi in (60, 70, 80)], falls, is_share=True,
    ),
    Statement(
        "the error of Dy is much greater from 40 deg on: 0, 20, 40, 60 deg at 500 mm [mm]",
        "Dy", [[(DISTANCE_OF_C, 0, phi)] for phi in (0, 20, 40, 60)], lambda v: rises(v) and v[2] > 2 * v[1],
    ),
    Statement(
        "the error of Dx hardly depends on phi: 0, 20, 40, 60 deg at 500 mm [mm]",
        "Dx", [[(DISTANCE_OF_C, 0, phi)] for phi in (0, 20, 40, 60)], stays,
    ),
    Statement(
        "nor on Dy: 500, 700, 1000, 1500 mm at Dx = 0 (phi 0 to 60) [mm]", "Dx", STEPS, stays,
    ),
    Statement(
        "it grows with Dx: 0, 20, 40, 60 mm at 500 mm (phi 40 to 60) [mm]",
        "Dx", [[(DISTANCE_OF_C, dx, phi) for phi in (40, 50, 60)] for dx in DX_MM], rises,
    ),
    Statement(
        "because of the lens, so also at phi = 0: 0, 20, 40, 60 mm at 700 to 900 mm [mm]",
        "Dx", [[(dy, dx, 0) for dy in (700, 800, 900)] for dx in DX_MM], rises,
    ),
)  # fmt: skip


def statements(results: Results) -> str:
    """Return the paper's statements beside our numbers, as Markdown."""
    heads = [Column("statement", "the paper says"), *(Column(m, f"method: {m}") for m in METHODS), Column("holds")]
    return render_table([statement.row(results) for statement in STATEMENTS], heads, "markdown")


def page(results: Results) -> str:
    """Return the three panels and the statements, as Markdown."""
    text = (
        "# Figure 8\n\nFrom rendered images: rms (mean ± standard deviation, poses/images) of phi [deg], Dx, Dy [mm]; "
        "`out`: a line leaves the sensor; `no id`: the fourth does.\n"
    )
    for letter, what in zip("abc", PANELS, strict=True):
        where = f"Dy = {DISTANCE_OF_C} mm" if what == "Dx" else "Dx = 0"
        text += f"\n## ({letter}) Error of {what} [{UNITS[what]}], {where}\n\n{panel(what, results)}"
    return f"{text}\n## The paper's statements\n\n{statements(results)}"
