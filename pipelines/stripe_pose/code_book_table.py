"""A code book as lines for a person, and as JSON."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...formats.products import StripeMark
from .code_book import MIN_GAP_PX, CodeBook, Confusion, Optics, View

SCHEMA = "logpose.code-book/1"
_MOST_PAIRS = 20


def as_mapping(book: CodeBook, optics: Optics) -> dict[str, object]:
    """Return everything, JSON-ready."""
    return {
        "schema": SCHEMA,
        "result": {
            "edge_sigma_px": optics.edge_sigma,
            "tolerance_px": optics.tolerance,
            "part_tolerance_px": optics.part_tolerance,
            "tolerance_share": optics.tolerance_share,
            "distances_m": list(book.distances),
            "angles_rad": list(book.angles),
            "fences": list(book.fences),
            "views": [
                {
                    "mark": v.mark,
                    "distance_m": v.distance,
                    "angle_rad": v.angle,
                    "is_inside": v.is_inside,
                    "smallest_gap_px": v.gap,
                    "rows": v.rows,
                    "sd_phi_rad": v.sd[0],
                    "sd_dx_m": v.sd[1],
                    "sd_dy_m": v.sd[2],
                }
                for v in book.views
            ],
            "pairs": [
                {
                    "seen": c.seen,
                    "taken_for": c.taken,
                    "whole_px": c.whole,
                    "hidden_px": c.hidden,
                    "turned_px": c.turned,
                    "cross_ratio_sigmas": c.cross_ratio,
                    "is_cross_ratio_same": c.is_cross_ratio_same,
                    "apart_to_m": list(c.apart_to),
                    "apart_to_hidden_m": list(c.apart_to_hidden),
                }
                for c in book.confusions
            ],
        },
    }


def table(book: CodeBook, optics: Optics, marks: Sequence[StripeMark]) -> str:
    """Return what a person reads, no line end after the last."""
    far, turned = book.distances[-1], math.degrees(book.angles[-1])
    sigma, share = f"{optics.edge_sigma:g} px", f"{100 * optics.tolerance_share:g} %"
    fits = f"{optics.tolerance:g} px (with edges hidden {optics.part_tolerance:g} px) and {share} of the smallest gap"
    lines = [
        f"{len(marks)} marks; an edge is found to {sigma} in one row, and what fits to {fits} is taken",
        "",
        *_marks(book, optics, marks, f"{far:g} m, {turned:.0f} deg"),
        "",
        "one mark taken for another: smallest residual [px] with all its edges, and with one or two of them hidden;",
        f"how far away they are still told apart [m], at {_angles(book)} deg; cross ratio in sigmas of its error",
        *_pairs(book, optics),
        "",
        "error of the pose (1 sigma) of the mark whose error is largest: angle [deg], to the right, ahead [mm]",
        *_errors(book),
    ]
    return "\n".join(lines)


def _marks(book: CodeBook, optics: Optics, marks: Sequence[StripeMark], place: str) -> list[str]:
    palindromes = {c.seen for c in book.confusions if c.seen == c.taken and _is_same(c.turned, optics)}
    rows = [["mark", "edges", "width mm", "rows", f"smallest gap px at {place}", ""]]
    for mark in marks:
        views = [v for v in book.views if v.mark == mark.id]
        last = views[-1]
        notes = ["palindrome: upside down it looks the same"] if mark.id in palindromes else []
        notes += ["equally spaced: so is every fence"] if mark.id in book.fences else []
        if not last.is_inside:
            notes.append("wider than the image")
        elif last.gap < MIN_GAP_PX:
            notes.append(f"edges nearer than {MIN_GAP_PX:g} px")
        width = 1000 * float(np.ptp(mark.edges))
        rows.append(
            [str(mark.id), str(len(mark.edges)), f"{width:.0f}", str(last.rows), _px(last.gap), "; ".join(notes)]
        )
    return _aligned(rows)


def _pairs(book: CodeBook, optics: Optics) -> list[str]:
    pairs: dict[tuple[int, int], Confusion] = {}
    for c in book.confusions:
        key = (min(c.seen, c.taken), max(c.seen, c.taken))
        pairs[key] = _worse(pairs[key], c) if key in pairs else c
    nearest = sorted(pairs.values(), key=lambda c: _nearness(c, optics))
    rows = [["seen", "taken for", "whole", "hidden", "cross ratio", "apart to", "hidden", ""]]
    for c in nearest[:_MOST_PAIRS]:
        notes = []
        if c.seen != c.taken and _is_same(c.turned, optics):
            notes.append("the same when turned upside down")
        if c.is_cross_ratio_same:
            notes.append("the same to the paper's method")
        ratio = "-" if c.cross_ratio is None else f"{c.cross_ratio:.1f}"
        taken = "itself, shifted" if c.seen == c.taken else str(c.taken)
        gaps = [_px(c.whole), _px(c.hidden)]
        rows.append(
            [str(c.seen), taken, *gaps, ratio, _metres(c.apart_to), _metres(c.apart_to_hidden), "; ".join(notes)]
        )
    lines = _aligned(rows)
    if len(pairs) > _MOST_PAIRS:
        lines.append(f"and {len(pairs) - _MOST_PAIRS} more that are farther apart")
    return lines


def _errors(book: CodeBook) -> list[str]:
    rows = [["distance m", *(f"{math.degrees(angle):.0f} deg" for angle in book.angles)]]
    for distance in book.distances:
        cells = []
        for angle in book.angles:
            views = [v for v in book.views if v.distance == distance and v.angle == angle]
            cells.append(_error(max(views, key=lambda v: (v.is_inside, v.sd[0] if v.is_inside else 0.0))))
        rows.append([f"{distance:.2f}", *cells])
    return _aligned(rows)


def _error(view: View) -> str:
    if not view.is_inside:
        return "outside"
    phi, dx, dy = view.sd
    return f"{math.degrees(phi):.3g}  {1000 * dx:.2g}  {1000 * dy:.2g}"


def _worse(a: Confusion, b: Confusion) -> Confusion:
    """Return one for both orders of a pair: the nearer of each."""
    return replace(
        a,
        whole=_least(a.whole, b.whole),
        hidden=_least(a.hidden, b.hidden),
        turned=_least(a.turned, b.turned),
        cross_ratio=_least(a.cross_ratio, b.cross_ratio),
        is_cross_ratio_same=a.is_cross_ratio_same or b.is_cross_ratio_same,
        apart_to=tuple(map(min, a.apart_to, b.apart_to)),
        apart_to_hidden=tuple(map(min, a.apart_to_hidden, b.apart_to_hidden)),
    )


def _least(a: float | None, b: float | None) -> float | None:
    return min((gap for gap in (a, b) if gap is not None), default=None)


def _nearness(c: Confusion, optics: Optics) -> float:
    whole = math.inf if c.whole is None else c.whole / optics.tolerance
    return min(whole, math.inf if c.hidden is None else c.hidden / optics.part_tolerance)


def _is_same(gap: float | None, optics: Optics) -> bool:
    return gap is not None and gap <= optics.tolerance


def _px(value: float | None) -> str:
    return "-" if value is None or not math.isfinite(value) else f"{value:.2f}"


def _metres(distances: Sequence[float]) -> str:
    return " ".join(f"{value:.2f}" if value else "never" for value in distances)


def _angles(book: CodeBook) -> str:
    return ", ".join(f"{math.degrees(angle):.0f}" for angle in book.angles)


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
