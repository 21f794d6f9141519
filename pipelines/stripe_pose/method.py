"""Stripe marks in an image: which, where, and how sure.

1. Every k-th row proposes places where the edges of a mark would be (``proposals``, ``matching``).
2. From the best proposal on, its edges are followed over all rows that cross the mark (``edges.follow``), and a line is
   fitted to each (``lines``), through the lens.
3. Where edges are so close that they bias one another, the brightness across the mark is fitted as a whole
   (``profile``); where bars are wide and their height is known, their ends are found (``heights``).
4. The lines give the pose, and level the camera (``solve``).
5. What is left over decides whether it is that mark (``verdict``).

Whatever is still without an explanation is tried as a part of a mark, and as a mark seen in a mirror.
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from ...formats.products import StripeMark
from .measure import GLANCE, Measured, measure
from .plausible import FEWEST_OF_PART
from .scene import Array, Bytes, Eye, Scene, Search, edges_of
from .verdict import Found, disputed, fits, judge, mirrored

Ints = npt.NDArray[np.int64]

MOST_FAILURES = 4
"""After so many proposals that were not the mark it is taken to be elsewhere."""
LIKELY_PX = 0.15
"""A row that fits so well is most likely of the mark [px]."""
UNCERTAIN_PX = 0.05
"""Errors of a single row that differ by less may belong to one mark [px]."""


def find_marks(pixels: Bytes, eye: Eye, marks: Sequence[StripeMark], search: Search) -> list[Found]:
    """Find the marks of a map in an image.

    Args:
        pixels: (H, W) uint8.
        eye: the camera.
        marks: that may be there.
        search: what is looked for.

    Returns:
        What was found, left to right; empty where there is no mark.
    """
    from .edges import filter_taps
    from .proposals import noise_level

    tried = [mark for mark in marks if search.given is None or mark.id == search.given]
    if not tried or pixels.shape[0] < 2 or pixels.shape[1] < 2 * len(filter_taps()) + 2:
        return []
    scene = Scene(np.ascontiguousarray(pixels), eye, search, filter_taps(), 0.0)
    scene.noise = noise_level(scene.pixels, scene.taps)
    step, whole = search.row_step, (search.skips, 0)
    # Every other row first: a mark that is not far away crosses one of them, and the rest need not be searched.
    found = _explain(scene, tried, whole, (step // 2, 2 * step))
    found += _explain(scene, _missing(tried, found), whole, (step // 2 + step, 2 * step))
    if search.hidden:
        least = 3 if search.given is not None else FEWEST_OF_PART
        parts = _explain(scene, _missing(tried, found), (-1, least), (2 * step, 4 * step))
        found += [part for part in parts if not any(part.overlaps(other) for other in found)]
    if not found:
        reflected = _explain(scene, [_reflected(mark) for mark in tried], whole, (2 * step, 4 * step))
        found = mirrored(reflected, {mark.id: len(mark.edges) for mark in tried})
    return sorted(disputed(found), key=lambda item: float(np.nanmin(item.lines[:, 0])))


def _explain(
    scene: Scene, marks: Sequence[StripeMark], how: tuple[int, int], rows_from: tuple[int, int]
) -> list[Found]:
    """Follow, measure and judge proposals, best first, until each of them is explained."""
    if not marks:
        return []
    table = _proposals(scene, marks, how, rows_from)
    index, rows, errors, columns = table[:, 0].astype(int), table[:, 1].astype(int), table[:, 2], table[:, 4:]
    found: list[Found] = []
    failures = np.zeros(len(marks), int)
    best = np.full(len(marks), np.inf)
    is_open = np.ones(len(table), dtype=bool)
    likely = LIKELY_PX / scene.eye.camera.fx
    for i in range(len(table)):
        k = index[i]
        # A mark hangs in one place: once found, only what fits about as well may dispute that.
        if not is_open[i] or failures[k] == MOST_FAILURES or errors[i] > 2.0 * best[k]:
            continue
        m = len(edges_of(marks[k])[0])
        # What is too fine to be certain disputes nothing that is found.
        if best[k] < np.inf and np.min(np.diff(columns[i, :m])) < scene.search.least_gap_px:
            continue
        measured = _looked_at(
            scene, marks[k], rows[i], columns[i, :m], is_likely=errors[i] < likely and best[k] == np.inf
        )
        if measured is None:
            failures[k] += 1
            continue
        item = judge(measured, marks[k], scene)
        if item is None:
            failures[k] += 1
        else:
            found.append(item)
            best[k] = min(best[k], errors[i] + UNCERTAIN_PX / scene.eye.camera.fx)
        own = np.flatnonzero(index == k)
        is_open[own] &= ~measured.contain(rows[own], columns[own, :m])
    return found


def _looked_at(scene: Scene, mark: StripeMark, row: int, columns: Array, *, is_likely: bool) -> Measured | None:
    """Return what is measured from a proposal on; None if a glance at some rows shows that it is something else."""
    if not is_likely:
        glance = measure(scene, mark, row, columns, reach=GLANCE)
        if not fits(glance, mark, scene):
            return None
        if glance.ends_within(row, GLANCE):
            return glance
    return measure(scene, mark, row, columns)


def _missing(marks: Sequence[StripeMark], found: Sequence[Found]) -> list[StripeMark]:
    seen = {item.mark for item in found if item.status != "poor_geometry"}
    return [mark for mark in marks if mark.id not in seen]


def _proposals(scene: Scene, marks: Sequence[StripeMark], how: tuple[int, int], rows_from: tuple[int, int]) -> Array:
    """Return what the searched rows propose (n, 4 + edges), those with most edges and then least error first."""
    from .proposals import COLUMNS, ERROR, MEMBERS, MOST, propose

    X, polarity, starts = _packed(tuple(marks))
    table = np.empty((MOST, COLUMNS + int(np.max(np.diff(starts)))))
    s = scene.search
    gates = np.array([s.max_angle, s.near, s.far])
    rows = (rows_from[0], scene.eye.height, rows_from[1])
    tolerance = s.tolerance_px / scene.eye.camera.fx
    n = propose(
        scene.pixels, scene.rays, rows, scene.taps, scene.noise, X, polarity, starts, how, tolerance, gates, table
    )
    table = table[:n]
    return table[np.lexsort((table[:, ERROR], -table[:, MEMBERS]))]


@lru_cache(maxsize=64)
def _packed(marks: tuple[StripeMark, ...]) -> tuple[Array, Ints, Ints]:
    """Return the edges of all marks behind one another: abscissae [m], polarities, and where each mark begins."""
    edges = [edges_of(mark) for mark in marks]
    X = np.concatenate([X for X, _ in edges])
    polarity = np.concatenate([polarity for _, polarity in edges])
    return X, polarity, np.cumsum([0, *(len(X) for X, _ in edges)])


@lru_cache(maxsize=1024)
def _reflected(mark: StripeMark) -> StripeMark:
    """Return the mark as a mirror shows it."""
    edges = -mark.edges[::-1]
    if mark.bars is None:
        return StripeMark(id=mark.id, lines=edges, bars=None, pose=mark.pose)
    return StripeMark(id=mark.id, lines=edges[::2], bars=edges[1::2] - edges[::2], pose=mark.pose)
