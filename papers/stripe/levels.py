"""Sections IV.B and IV.C of the stripe paper: what tilt, roll and height of the camera do to the pose.

The paper calculates with a mark that leans about its own X axis (its eq. (6) with phi_y = 0), and finds that tilt
leaves phi alone. A camera on a pan-tilt head or on an uneven floor is another case: there the mark stands upright and
the camera leans. Both are worked out here without approximation, for lines that go on up and down as the row needs:
where row and line meet is solved for, and the closed form is applied to the columns as if nothing leaned. Then the same
with tilt and roll taken out of the rays first (``levelling``), and with the tilt put into eqs. (12) to (15), which is
right for the paper's model only.
"""

import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from bench import FX_PX, LINES_M, QUANTITIES, TO_TABLE, Array, pose_of
from rendered import AT_ROW, METHODS, Cell, Chunk, Results, Seen, Way

from logpose.pipelines.report.tables import Column, render_table
from logpose.pipelines.stripe_pose.levelling import level_bearings
from logpose.pipelines.stripe_pose.pose import level_pose

PHI_DEG, DX_MM, DY_MM = 40, 30, 600  # the pose that all numbers are for
TILTS_DEG = (1, 2, 5, 10)
HEIGHT_M = 0.1
RENDERED = (
    "tilt 1",
    "tilt 2",
    "tilt 5",
    "tilt 10",
    "roll 2",
    "tilt 2, roll 2",
    "tilt 1, row +100 px",
    "roll 1, row +100 px",
)
"""The cases that are rendered too, after ``level`` and ``height 40 mm``."""


@dataclass(frozen=True, slots=True)
class Lean:
    """How the camera stands.

    Attributes:
        name: for the table.
        tilt, roll: of the camera [rad].
        row: above the principal point [px].
        height: of the mark's origin above the lens [m]; it moves the lines along themselves.
    """

    name: str
    tilt: float = 0.0
    roll: float = 0.0
    row: float = 0.0
    height: float = 0.0


def leans() -> list[Lean]:
    """Return the cases of the table."""
    d = float(np.radians(1.0))
    found = [Lean(f"tilt {t}", tilt=t * d) for t in TILTS_DEG]
    found += [Lean("roll 2", roll=2 * d), Lean("tilt 2, roll 2", tilt=2 * d, roll=2 * d)]
    found += [Lean("tilt 2, roll -2", tilt=2 * d, roll=-2 * d)]
    found += [Lean("tilt 1, row +100 px", tilt=d, row=100.0), Lean("roll 1, row +100 px", roll=d, row=100.0)]
    found += [Lean("row +100 px", row=100.0), Lean(f"height {1e3 * HEIGHT_M:.0f} mm", height=HEIGHT_M)]
    return [*found, Lean(f"tilt 5, height {1e3 * HEIGHT_M:.0f} mm", tilt=5 * d, height=HEIGHT_M)]


def head_rotation(tilt: float, roll: float) -> Array:
    """Return camera_R_level of a head that is first rolled and then tilted, written out here and nowhere imported."""
    about_x = np.array([[1, 0, 0], [0, np.cos(tilt), np.sin(tilt)], [0, -np.sin(tilt), np.cos(tilt)]])
    about_y = np.array([[np.cos(roll), 0, -np.sin(roll)], [0, 1, 0], [np.sin(roll), 0, np.cos(roll)]])
    return np.asarray(about_y @ about_x)


def seen(pose: Array, lean: Lean) -> Array:
    """Return the columns (3,) over f at which a row meets the lines of an upright mark.

    A point of a line is (p, z) in the level frame, p fixed and z free; z follows from Z_p / Y_p of the row.
    """
    phi, dx, dy = pose
    foot = np.stack([np.cos(phi) * LINES_M + dx, np.sin(phi) * LINES_M + dy, np.full(3, lean.height)])
    turn = head_rotation(lean.tilt, lean.roll)
    base, up = turn @ foot, turn[:, 2]
    wanted = lean.row / FX_PX
    along = (wanted * base[1] - base[2]) / (up[2] - wanted * up[1])
    points = base + up[:, None] * along
    return np.asarray(points[0] / points[1])


def leaning_mark(pose: Array, lean: float, dz: float) -> Array:
    """Return the columns (3,) over f of the paper's own model: its eq. (10) with phi_x = ``lean``, phi_y = 0.

    ``dz`` is the height of the mark's origin over the lens, in the level frame of a camera that does not lean.
    """
    phi, dx, dy = pose
    # A line's point: X along the mark, and Z along its own vertical, which leans by phi_x about X.
    up = np.array([np.sin(phi) * np.sin(lean), -np.cos(phi) * np.sin(lean), np.cos(lean)])
    foot = np.stack([np.cos(phi) * LINES_M + dx, np.sin(phi) * LINES_M + dy, np.full(3, dz)])
    points = foot - up[:, None] * foot[2] / up[2]
    return np.asarray(points[0] / points[1])


def as_paper_tilts(u: Array, lean: float) -> Array:
    """Return phi, Dx, Dy by eqs. (12) to (15) with phi_x = ``lean``, phi_y = 0, for columns (3,) over f.

    There psi = 0 and rho = cos phi_x: phi is that of the level form, and r = cos phi_x Dy_level.
    """
    phi, dx, dy = level_pose(LINES_M, u)
    B, C, E = np.sin(lean) * np.sin(phi), -np.sin(lean) * np.cos(phi), np.cos(lean)
    p, r = E * dx, E * dy
    dz = -(B * p + C * r)
    return np.array([phi, (p + B * dz) / E, (r + C * dz) / E])


def rows() -> list[dict[str, object]]:
    """Return the errors [deg, mm, mm] of each case: tilt and roll ignored, tilt in the paper's equations, levelled."""
    pose = pose_of(DY_MM, DX_MM, PHI_DEG)
    found = []
    for lean in leans():
        u = seen(pose, lean)
        rays = np.stack([u, np.full_like(u, lean.row / FX_PX)], axis=1)
        ways = {
            "ignored": level_pose(LINES_M, u),
            "in eq. (12)": as_paper_tilts(u, lean.tilt),
            "levelled": level_pose(LINES_M, level_bearings(rays, lean.tilt, lean.roll)),
        }
        row: dict[str, object] = {"case": lean.name}
        for way, estimate in ways.items():
            row |= {f"{way} {what}": e for what, e in zip(QUANTITIES, (estimate - pose) * TO_TABLE, strict=True)}
        found.append(row)
    return found


def rendered_leans(*, is_quick: bool = False) -> dict[str, Chunk]:
    """Return one log per case, with the ways that are tried on it.

    Where the camera tilts it is lowered until the row of the case crosses the middle of the mark. Poses are spread a
    little about the one of the table, so that whole pixels err by chance; heights of bars are not told, because they
    level the camera as well.
    """
    names = ("tilt 5",) if is_quick else RENDERED
    cases = [Lean("level"), *(lean for lean in leans() if lean.name in names)]
    cases += [] if is_quick else [Lean("height 40 mm", height=-0.04)]
    around = (0,) if is_quick else (-2, -1, 0, 1, 2)
    found = {}
    for lean in cases:
        up = -lean.height or -1e-3 * DY_MM * np.tan(lean.tilt + np.arctan(lean.row / FX_PX))
        tilt, roll = (float(angle) for angle in np.degrees([lean.tilt, lean.roll]))
        told = {"tilt_deg": tilt, "roll_deg": roll}
        ways: dict[str, Way] = {
            "paper": {"method": "paper"},
            "paper, tilt in eq. (12)": {"method": "paper", "tilt_model": "paper", **told},
            "paper, levelled": {"method": "paper", **told},
            "best": METHODS["best"],
        }
        found[lean.name] = Chunk(
            "lean_" + re.sub("[^a-z0-9-]+", "_", lean.name),
            [DY_MM + 3 * k for k in around],
            [DX_MM + 3 * k for k in around[1:-1] or around],
            [PHI_DEG + k for k in around],
            2 if is_quick else 1,
            {**told, "height_m": float(up)},
            ways,
            has_heights=False,
            row=lean.row,
        )
    return found


def measured(results: Mapping[str, Results]) -> str:
    """Return the table of the rendered cases as Markdown: mean error ± its standard error, per way."""
    ways = sorted(next(iter(results.values())), key=lambda way: (way == "best", way == AT_ROW, way))
    exact = {str(row["case"]): row for row in rows()}
    text = (
        "\n## From rendered images\n\nMean error of phi [deg] / Dx / Dy [mm] ± standard error of the mean (poses of "
        "images), at poses about that of the table above. `exact`: what that has for a camera taken as level.\n\n"
    )
    table = []
    for case, found in results.items():
        row: dict[str, object] = {"case": case}
        if case in exact:
            row["exact"] = " / ".join(f"{exact[case][f'ignored {what}']:+.3f}" for what in QUANTITIES)
        table.append(row | {way: mean_text(found[way]) for way in ways})
    heads = [Column("case", "case [deg]"), Column("exact"), *(Column(way) for way in ways)]
    return text + render_table(table, heads, "markdown")


def mean_text(cells: Mapping[Cell, Seen]) -> str | None:
    """Return what a cell of the table shows; None without poses."""
    errors, images = np.concatenate([seen.errors for seen in cells.values()]), sum(seen.n for seen in cells.values())
    if len(errors) < 2:
        return None
    mean, error = errors.mean(axis=0), errors.std(axis=0, ddof=1) / np.sqrt(len(errors))
    text = " / ".join(f"{m:+.3f} ± {e:.3f}" for m, e in zip(mean, error, strict=True))
    return text if len(errors) == images else f"{text} ({len(errors)} of {images})"


def page(measured: str = "") -> str:
    """Return the table and the paper's statements beside it, as Markdown; ``measured`` goes between them."""
    ways = [key for key in rows()[0] if key != "case"]
    heads = [Column("case", "case [deg]"), *(Column(key, digits=4) for key in ways)]
    says = [Column("paper", "the paper says"), Column("ours", "computed"), Column("holds")]
    return (
        "# Tilt and height\n\n"
        f"Errors of phi [deg], Dx, Dy [mm] at phi = {PHI_DEG} deg, Dx = {DX_MM} mm, Dy = {DY_MM} mm; exact edges. The "
        "camera leans, the mark stands upright. Tilt and roll ignored; tilt put into eqs. (12) to (15); levelled.\n\n"
        + render_table(rows(), heads, "markdown")
        + measured
        + "\n## The paper's statements\n\n"
        + render_table(statements(), says, "markdown")
    )


def statements() -> list[dict[str, object]]:
    """Compare what sections IV.B and IV.C say with what comes out."""
    pose = pose_of(DY_MM, DX_MM, PHI_DEG)
    five = float(np.radians(5.0))
    model, raised = ((level_pose(LINES_M, leaning_mark(pose, five, dz)) - pose) * TO_TABLE for dz in (0.0, 0.05))
    found = {str(row["case"]): row for row in rows()}
    tilted, off, high = found["tilt 5"], found["tilt 1, row +100 px"], found[f"height {1e3 * HEIGHT_M:.0f} mm"]
    return [
        {
            "paper": "phi does not depend on tilt",
            "ours": f"in its model (the mark leans, 5 deg) {abs(model[0]):.4f} deg; if the camera tilts by 5 deg, "
            f"{tilted['ignored phi']:.4f} deg, of second order; by 1 deg, on a row 100 px off the middle, "
            f"{off['ignored phi']:.4f} deg, of first order",
            "holds": "in its model",
        },
        {
            "paper": "Dx and Dy do",
            "ours": f"in its model, 5 deg, by {raised[1]:.2f} and {raised[2]:.2f} mm if the mark's origin is 50 mm "
            f"above the lens, and not at all at its height; if the camera tilts, by {tilted['ignored Dx']:.2f} and "
            f"{tilted['ignored Dy']:.2f} mm",
            "holds": "yes",
        },
        {
            "paper": "a tilt that is known can be put into eqs. (12) to (15)",
            "ours": f"if the camera tilts by 5 deg this leaves {tilted['in eq. (12) phi']:.4f} deg, "
            f"{tilted['in eq. (12) Dx']:.2f} and {tilted['in eq. (12) Dy']:.2f} mm; levelled rays leave nothing",
            "holds": "in its model",
        },
        {
            "paper": "height does not matter at all",
            "ours": f"{1e3 * HEIGHT_M:.0f} mm: {abs(high['ignored phi']):.4f} deg, {abs(high['ignored Dx']):.4f} and "
            f"{abs(high['ignored Dy']):.4f} mm, also under tilt, as long as the row crosses the lines",
            "holds": "yes",
        },
    ]


def main() -> int:
    """Print the table."""
    print(page())
    return 0


if __name__ == "__main__":
    sys.exit(main())
