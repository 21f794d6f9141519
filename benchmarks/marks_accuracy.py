"""How exact marks are measured, beside the least error that is possible; prints Markdown.

    python benchmarks/marks_accuracy.py [--scenes 16] [--first 10000]

1. Edges of single rows against their projection, over noise, contrast and blur, for each of the ways to measure them:
   the narrow filter, the wide one where edges are far apart, and the fit of the whole brightness where they are close.
2. Errors of the pose as multiples of the Cramer-Rao bound (``marks_bound``) over angle and distance, for the edge noise
   of table 1. The bound is that of independent rows; tilt and roll are unknown (sigma of 4 and 1 degrees).
   At 0.3 m the bars are 60 mm high, so that they are inside the image.
3. Errors over the standard deviations that the detector itself gives, by the smallest gap between edges.
"""

import argparse
from dataclasses import replace
from itertools import pairwise, product

import numpy as np
from mark_raster import Array
from mark_scenes import MARKS, Scene, scene
from marks_bound import pose_bound
from marks_find import ROLL_SD, TILT_SD, Finder

from logpose.pipelines.stripe_pose.edges import SIGMA_PX, WIDE_GAP_PX, WIDE_SIGMA_PX, edge_near, filter_taps
from logpose.pipelines.stripe_pose.profile import separate
from logpose.pipelines.stripe_pose.scene import Search

YAWS = (0, 20, 40, 60, 70)
DISTANCES = (0.3, 0.5, 0.7, 1.0, 1.5)
GAPS = (0.0, 3.0, 4.0, 6.0, 10.0, 20.0, np.inf)
SHORT = replace(MARKS[0], height=0.06, margin=0.02)
"""What fits into an image at 0.3 m whatever its angle."""
END_ROWS = 4
NARROW, WIDE, FIT = WAYS = (
    "narrow filter",
    f"wide filter (gaps from {WIDE_GAP_PX:g} px)",
    f"fit (gaps below {Search().blend_px:g} px)",
)
PIXEL_SD = float(np.sqrt(1 / 12))
NEVER = np.full(3, np.nan)


def clear_rows(made: Scene) -> Array:
    """Return the rows that all edges of a mark cross, clear of their ends."""
    X, half = made.pattern.edges[[0, -1]], 0.5 * made.pattern.height
    ends = made.optics.project(made.plane.level(np.array([[x, z] for x in X for z in (-half, half)])))
    low, high = ends[[1, 3], 1].max() + END_ROWS, ends[[0, 2], 1].min() - END_ROWS
    return np.arange(np.ceil(low), np.floor(high))


def filtered(made: Scene, sigma: float) -> Array:
    """Return errors of edges on single rows, (rows x edges,), found with a filter [px]."""
    taps, rows = filter_taps(sigma), clear_rows(made)
    errors = []
    for row, columns in zip(rows, made.edge_columns(rows), strict=True):
        for k, column in enumerate(columns):
            errors.append(edge_near(made.image, int(row), float(column), 1 - 2 * (k % 2), taps)[0] - column)
    return np.array(errors)


def fitted(made: Scene) -> Array:
    """Return errors of edges as the fit to the brightness of all rows gives them, times the root of the rows [px]."""
    rows = clear_rows(made)
    columns = made.edge_columns(np.arange(rows[0], rows[-1] + 1))
    m = columns.shape[1]
    values, cov = np.empty(m + 5), np.empty((m + 5, m + 5))
    polarity = 1 - 2 * (np.arange(m) % 2)
    used = separate(made.image, (int(rows[0]), int(rows[-1])), columns, polarity, values, cov)
    return values[:m] * np.sqrt(len(rows)) if used else np.full(m, np.nan)


def edge_errors(first: int, n: int, contrast: float, blur_px: float, noise: float) -> dict[str, Array]:
    """Return errors of edges of marks up to 30 degrees, as of single rows [px], by the way they are measured."""
    errors: dict[str, list[Array]] = {way: [] for way in WAYS}
    for k in range(5 * n):
        made = scene(
            first + k,
            phi=np.random.default_rng(first + k).uniform(-1, 1) * np.radians(30.0),
            distance=0.5 if k < n else 2.2,  # edges are 22 or 5 px apart
            dark=40.0,
            bright=40.0 + contrast,
            blur_px=blur_px,
            noise=noise,
            shading=0.0,
            clutter=False,
        )
        if k < n:
            errors[NARROW].append(filtered(made, SIGMA_PX))
            errors[WIDE].append(filtered(made, WIDE_SIGMA_PX))
        else:
            errors[FIT].append(fitted(made))
    return {way: np.concatenate(parts) for way, parts in errors.items()}


def print_edges(first: int, n: int) -> dict[str, float]:
    """Print the table of edge noise; return noise in pixels times contrast over grey noise, at a blur of 0.8 px."""
    blurs = (0.8, 1.0, 1.5)
    print(f"## Edges as of single rows: bias, rms, least possible rms [px] ({n} scenes each; {4 * n} of the fit)\n")
    print("| contrast | noise | how | " + " | ".join(f"blur {b} px" for b in blurs) + " |")
    print("|---|---|---|" + "---|" * len(blurs))
    factors: dict[str, list[float]] = {way: [] for way in WAYS}
    for contrast, noise in product((100, 150), (1.0, 1.5, 2.0, 3.0)):
        by_blur = [edge_errors(first, n, contrast, blur, noise) for blur in blurs]
        for way in WAYS:
            texts = []
            for blur, errors in zip(blurs, by_blur, strict=True):
                e = errors[way][np.isfinite(errors[way])]
                lost = len(errors[way]) - len(e)
                rms = float(np.sqrt((e**2).mean()))
                least = noise / contrast * np.sqrt(2 * np.sqrt(np.pi) * np.hypot(blur, PIXEL_SD))
                count = f"({len(e)}, {lost} lost)" if lost else f"({len(e)})"
                texts.append(f"{e.mean():+.4f}, {rms:.4f}, {least:.4f} {count}")
                if blur == blurs[0]:
                    factors[way].append(rms * contrast / noise)
            print(f"| {contrast} | {noise:g} | {way} | {' | '.join(texts)} |", flush=True)
    mean = {way: float(np.mean(values)) for way, values in factors.items()}
    texts = [f"{value:.3f} ({way})" for way, value in mean.items()]
    print(f"\nat blur 0.8 px: rms = noise / contrast times {', '.join(texts)}\n", flush=True)
    return mean


def look(finder: Finder, made: Scene) -> tuple[Array, Array]:
    """Return error and standard deviation of the pose that is found, nan where none is."""
    for found in finder.identified(made):
        return found.pose - made.truth, np.sqrt(np.diag(found.cov)[:3])
    return NEVER, NEVER


def rms(values: Array) -> str:
    """Return the root mean square of each column, and its own relative standard deviation."""
    if len(values) < 3:
        return "-"
    return " / ".join(f"{v:.2f}" for v in np.sqrt((values**2).mean(axis=0))) + f" (n {len(values)})"


def print_bounds(first: int, n: int, factors: dict[str, float]) -> None:
    """Print errors over the bound, per cell and over all.

    Args:
        first: seed.
        n: scenes in a cell.
        factors: edge noise in pixels times contrast over grey noise, by how edges are measured.
    """
    flags = (False, True)
    finders = {
        (flag, s): Finder((m,), with_height=flag) for flag in flags for s, m in ((False, MARKS[0]), (True, SHORT))
    }
    cells: dict[tuple[int, float], list[Array]] = {}
    gaps = {}
    for i, yaw in enumerate(YAWS):
        for j, distance in enumerate(DISTANCES):
            is_near = distance < 0.4
            ratios, least = [], []
            for k in range(n):
                made = scene(
                    first + 1000 * (i * len(DISTANCES) + j) + k,
                    pattern=SHORT if is_near else MARKS[0],
                    phi=np.radians(yaw if k % 2 else -yaw),
                    distance=distance,
                    bearing=0.0 if is_near else None,
                )
                least.append(made.smallest_gap_px)
                factor = factors[WIDE if made.smallest_gap_px >= WIDE_GAP_PX else NARROW]
                sigma = factor * made.noise / (made.bright - made.dark)
                row = []
                for flag in flags:
                    error, _ = look(finders[flag, is_near], made)
                    row.append(error / pose_bound(made, sigma, tilt_sd=TILT_SD, roll_sd=ROLL_SD, with_ends=flag))
                ratios.append(row)
            cells[yaw, distance], gaps[yaw, distance] = np.array(ratios), float(np.min(least))
    for f, flag in enumerate(flags):
        words, own = "known" if flag else "not known", 100 / np.sqrt(2 * n)
        print(f"## RMS of error / bound, height of bars {words}: yaw / lateral / depth; its own sigma {own:.0f} %\n")
        print("| yaw | " + " | ".join(f"{d} m" for d in DISTANCES) + " |\n|---|" + "---|" * len(DISTANCES))
        for yaw in YAWS:
            texts = []
            for distance in DISTANCES:
                table = cells[yaw, distance][:, f]
                texts.append(f"{rms(table[np.isfinite(table[:, 0])])} of {n}, gap {gaps[yaw, distance]:.1f} px")
            print(f"| {yaw} | {' | '.join(texts)} |")
        for low, high in pairwise(GAPS):
            chosen = [cells[c][:, f] for c in cells if low <= gaps[c] < high]
            if chosen:
                print(f"\ngaps {low:g} to {high:g} px: {summary(np.concatenate(chosen))}")
        print(f"\nall: {summary(np.concatenate([table[:, f] for table in cells.values()]))}\n")


def summary(table: Array) -> str:
    """Return what is said of many errors over their bounds."""
    table = table[np.isfinite(table[:, 0])]
    median = " / ".join(f"{v:.2f}" for v in np.median(np.abs(table), axis=0))
    return f"{rms(table)}; median |error / bound| {median} (0.67 is the bound)"


def print_honesty(first: int, n: int) -> None:
    """Print errors over the detector's own standard deviations."""
    print("## RMS of error / own sd: yaw / lateral / depth, by the smallest gap\n")
    print("| gap px | height of bars known | not known | more than 5 sd (known, not known) | more than 5 degrees |")
    print("|---|---|---|---|---|")
    finders = {flag: Finder(MARKS, with_height=flag) for flag in (True, False)}
    ratios: dict[bool, list[Array]] = {True: [], False: []}
    gaps, far = [], []
    rng = np.random.default_rng(first)
    for k in range(n):
        phi = rng.uniform(-1, 1) * np.radians(70.0)
        distance = float(np.exp(rng.uniform(np.log(0.4), np.log(3.0))))
        made = scene(first + k, pattern=MARKS[k % len(MARKS)], phi=phi, distance=distance)
        gaps.append(made.smallest_gap_px)
        off = []
        for flag, finder in finders.items():
            error, sd = look(finder, made)
            ratios[flag].append(error / sd)
            off.append(abs(error[0]) > np.radians(5.0))
        far.append(off)
    for low, high in pairwise(GAPS):
        chosen = (np.array(gaps) >= low) & (np.array(gaps) < high)
        cells, gross = [], []
        for flag in finders:
            table = np.array(ratios[flag])[chosen]
            table = table[np.isfinite(table[:, 0])]
            cells.append(f"{rms(table)} of {chosen.sum()}")
            gross.append(str(int((np.abs(table) > 5).any(axis=1).sum())))
        wrong = np.array(far)[chosen].sum(axis=0)
        print(f"| {low:g} to {high:g} | {' | '.join(cells)} | {', '.join(gross)} | {wrong[0]}, {wrong[1]} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=16, help="in each cell")
    parser.add_argument("--first", type=int, default=10000)
    args = parser.parse_args()
    print_bounds(args.first, args.scenes, print_edges(args.first, 2))
    print_honesty(args.first + 500000, 25 * args.scenes)


if __name__ == "__main__":
    main()
