"""Figure 7 of the stripe paper in numbers: what half a pixel on each of three edges does to the pose.

The mark stands on the axis (Dx = 0, which the paper does not say) at one and at two times the distance Dmin at which it
just fills the sensor, equation (20). Four answers, absolute errors in degrees and millimetres:

- A: +, -, + half a pixel on the middle, left and right edge, which the paper calls the worst case;
- B: the same signs from left to right;
- C: the worst of all eight choices of signs;
- R: the rms for independent errors, uniform within half a pixel, to first order: the slopes d(pose)/d(column) of each
  edge, times the standard deviation 1 / sqrt(12) px.
"""

import sys
from itertools import product

import numpy as np
from bench import (
    COLUMNS,
    FX_PX,
    LINES_M,
    PHI_DEG,
    QUANTITIES,
    TO_TABLE,
    Array,
    columns,
    pose_errors,
    shortest_distance,
)

from logpose.pipelines.report.tables import Column, render_table
from logpose.pipelines.stripe_pose.pose import pose_covariance

TIMES = (1, 2)  # Mdis, equation (21)
CASES = ("A", "B", "C", "R")
OF_PAPER, LEFT_TO_RIGHT = np.array([0.5, -0.5, 0.5]), np.array([-0.5, 0.5, 0.5])  # middle, left, right [px]
SIGNS = np.array(list(product((0.5, -0.5), repeat=3)))
UNIFORM_PX = 1.0 / np.sqrt(12.0)
HEADS = [Column("phi", "phi [deg]"), *(Column(f"{case} {what}", digits=4) for case in CASES for what in QUANTITIES)]


def main() -> int:
    """Print the tables."""
    print(page())
    return 0


def cell(times: int, phi_deg: float) -> dict[str, Array]:
    """Return A, B, C and R, each (3,) of phi, Dx, Dy [deg, mm, mm], at ``times`` Dmin."""
    pose = np.array([np.radians(phi_deg), 0.0, times * shortest_distance(0.0)])
    px = columns(pose)
    return {
        "A": np.abs(pose_errors(px + OF_PAPER, pose)),
        "B": np.abs(pose_errors(px + LEFT_TO_RIGHT, pose)),
        "C": np.abs(pose_errors(px + SIGNS, pose)).max(axis=0),
        # Three edges and three unknowns: the covariance is that of the inverse Jacobian.
        "R": np.sqrt(np.diag(pose_covariance(pose, LINES_M, UNIFORM_PX / FX_PX))) * TO_TABLE,
    }


def rows(times: int) -> list[dict[str, object]]:
    """Return the table of one distance, one row per phi; a star where the mark does not fit the sensor."""
    found: list[dict[str, object]] = []
    for phi in PHI_DEG:
        is_cut = shortest_distance(np.radians(phi)) > times * shortest_distance(0.0) + 1e-9
        row: dict[str, object] = {"phi": f"{phi}*" if is_cut else f"{phi}"}
        for case, values in cell(times, phi).items():
            row |= {f"{case} {what}": value for what, value in zip(QUANTITIES, values, strict=True)}
        found.append(row)
    return found


def page() -> str:
    """Return the tables, and the paper's statements beside them, as Markdown."""
    text = (
        "# Figure 7\n\nAbsolute errors of quantisation: phi [deg], Dx and Dy [mm]. "
        f"f / pixel = {FX_PX:.3f} px, {COLUMNS} columns, lines 60 mm apart, Dx = 0.\n"
        "A, B: half a pixel of signs +, -, + in the order middle, left, right and left, middle, right; C: the worst of "
        "all signs; R: rms of uniform errors.\n"
    )
    for times in TIMES:
        dy = 1e3 * times * shortest_distance(0.0)
        text += f"\n## Mdis = {times} (Dy = {dy:.4f} mm)\n\n" + render_table(rows(times), HEADS, "markdown")
    return f"{text}\n## The paper's statements\n\n" + render_table(statements(), STATEMENT, "markdown") + notes()


STATEMENT = [Column("paper", "the paper says"), Column("ours", "computed"), Column("holds")]


def statements() -> list[dict[str, object]]:
    """Compare what section IV.A says with the tables."""
    first, last = ({times: cell(times, phi) for times in TIMES} for phi in (PHI_DEG[0], PHI_DEG[-1]))
    growth = {case: [last[m][case] / first[m][case] for m in TIMES] for case in CASES}
    low = [min(cell(m, phi)["C"][0] / cell(m, phi)["A"][0] for phi in PHI_DEG) for m in TIMES]

    def times_of(case: str, i: int) -> str:
        return " and ".join(f"{ratio[i]:.2f}" for ratio in growth[case])

    percent = ", ".join(f"{100 * cell(1, phi)['C'][0] / phi:.2f}" for phi in (10, 40, 80))
    return [
        {"paper": "signs +, -, + are the worst case",
         "ours": "for phi, from left to right; in the paper's order (middle, left, right) the worst is "
                 + " and ".join(f"{ratio:.2f}" for ratio in low) + " times larger or more", "holds": "in part"},
        {"paper": "the error of phi is smallest near phi = 0 and grows gently",
         "ours": f"from 0 to 80 deg it grows {times_of('C', 0)} times (C); in pattern A it falls ({times_of('A', 0)})",
         "holds": "yes, C"},
        {"paper": "the error of Dx grows somewhat", "ours": f"{times_of('C', 1)} times (C)", "holds": "yes"},
        {"paper": "the error of Dy grows somewhat", "ours": f"{times_of('C', 2)} times (C)", "holds": "no"},
        {"paper": "the percentage error of phi falls with phi (section V)",
         "ours": f"{percent} % at 10, 40, 80 deg (C, Mdis = 1)", "holds": "yes"},
    ]  # fmt: skip


def notes() -> str:
    """Return Dmin of each phi and why rows have a star."""
    shortest = ", ".join(f"{1e3 * shortest_distance(np.radians(phi)):.2f}" for phi in PHI_DEG)
    return (
        "\n- Two numbers given for growth are for Mdis = 1 and 2.\n"
        f"- Dmin(phi) at 0, 10, .. 80 deg: {shortest} mm. Equation (20) has phi = 0 only; with a star, the mark does "
        "not fit the sensor.\n"
    )


if __name__ == "__main__":
    sys.exit(main())
