"""Whether what was measured can be the mark it is taken for, beyond its lines.

A mark has one black and one white, so its edges are of one strength; its bars are of one height, which is known of some
marks; and if only a part of it is seen, that must be enough to tell it by, and fit nowhere else on the mark.
"""

import numpy as np

from ...formats.products import StripeMark
from .levelling import line_of_bearing
from .measure import Measured
from .pose import DY, PHI, ROLL, TILT, Array, bearings, is_ahead, level_pose, plane_distance
from .scene import Scene, edges_of
from .solve import Solution

PART_GAP_PX = 4.0
"""Least distance of two lines of a part of a mark [px]."""
FEWEST_OF_PART = 6
"""A hidden mark shows at least so many edges: three fix the pose, three tell that it is this mark."""
ENOUGH = 8
"""So many edges of a mark are as good as all of one."""
LEAST_SHIFTED = 5
"""Fewer lines fit other edges too easily to say anything."""
WEAKEST, STRONGEST = 0.35, 2.5
"""Least and greatest strength of a mark's edges, as part of their median."""
SHORTEST = 0.35
"""Least number of rows of an edge, as part of the median."""
LOWEST, HIGHEST = 0.4, 1.2
"""Least and greatest part of the expected rows of a bar whose height is known: something may hide rows, nothing adds
any."""
BORDER_PX = 8.0
"""So near the border of the image an edge may not be seen [px]."""
BORDER_ROWS = 3
"""Bars that end within so many rows of the image's border may go on beyond it."""
ROUNDED_ROWS = 2.0
"""The rows of a bar are counted to so many, for blur."""
AS_GOOD, FLOOR_PX = 2.0, 0.05
"""Two explanations of the same edges are disputed if their errors differ by less than this factor, or by less than an
error of this size [px]."""


def is_enough(measured: Measured, mark: StripeMark, scene: Scene) -> bool:
    """Tell whether a part tells of the whole: many edges, or few hidden ones and, if two, bars of the right height."""
    n = len(measured.members)
    if scene.search.given is not None:
        return True
    has_height = mark.height is not None and not _is_cut(measured, scene)
    hidden = len(edges_of(mark)[0]) - n
    return n >= ENOUGH or (measured.gap_px >= PART_GAP_PX and hidden <= most_hidden(has_height=has_height))


def most_hidden(*, has_height: bool) -> int:
    """Return how many edges of a mark of few may be hidden: a bar's height tells of it what an edge would."""
    return 2 if has_height else 1


def _is_cut(measured: Measured, scene: Scene) -> bool:
    """Tell whether bars may go on beyond the image."""
    rows = measured.rows
    return bool(rows[:, 0].min() < BORDER_ROWS or rows[:, 1].max() >= scene.eye.height - BORDER_ROWS)


def is_cut_off(measured: Measured, mark: StripeMark, solution: Solution, scene: Scene) -> bool:
    """Tell whether all edges that are not seen would lie beyond the border of the image: nothing need hide them."""
    hidden = np.delete(edges_of(mark)[0], measured.members)
    pose, camera = solution.values[:3], scene.eye.camera
    tilt, roll = solution.values[TILT], solution.values[ROLL]
    z = float(measured.lines.z.mean())
    x, _ = line_of_bearing(bearings(pose, hidden), tilt, roll, z)
    columns = camera.cx + camera.fx * camera.distort(np.stack([x, np.full_like(x, -z)], axis=-1))[..., 0]
    return bool(np.all(~((columns >= BORDER_PX) & (columns <= scene.eye.width - BORDER_PX))))  # nan: not in the image


def may_be_shifted(measured: Measured, mark: StripeMark, scene: Scene) -> bool:
    """Tell whether the lines of a part, but for two, fit other edges of the mark as well, as equally spaced ones do."""
    X, polarity = edges_of(mark)
    lines, n = measured.lines, len(measured.members)
    places = lines.x + lines.slope * (float(lines.z.mean()) - lines.z)
    for shift in range(1 - len(X), len(X)):
        others = measured.members + shift
        inside = (others >= 0) & (others < len(X))
        if shift == 0 or inside.sum() < max(LEAST_SHIFTED, n - 2):
            continue
        u, others = places[inside], others[inside]
        if np.any(polarity[others] != polarity[measured.members[inside]]):
            continue
        pose = level_pose(X[others], u)
        if not (is_ahead(pose, X) and plane_distance(pose) > 0 and abs(pose[PHI]) <= scene.search.max_angle):
            continue
        error_px = float(np.sqrt(np.mean((bearings(pose, X[others]) - u) ** 2))) * scene.eye.camera.fx
        if error_px <= AS_GOOD * measured.misfit_px + FLOOR_PX:
            return True
    return False


def is_uniform(measured: Measured) -> bool:
    """Tell whether all edges are of about one strength and one length."""
    strengths, rows = measured.strengths, measured.rows[:, 1] - measured.rows[:, 0]
    usual, long = _middle(strengths), _middle(rows)
    return bool(
        strengths.min() >= WEAKEST * usual and strengths.max() <= STRONGEST * usual and rows.min() >= SHORTEST * long
    )


def _middle(values: Array) -> float:
    """Return the upper median of some values; numpy's takes twenty times as long for eight of them."""
    return float(sorted(values.tolist())[len(values) // 2])


def is_as_high(measured: Measured, mark: StripeMark, pose: Array, scene: Scene) -> bool:
    """Tell whether the bars are as high as they should be at this distance; some rows may be hidden or cut off."""
    if mark.height is None:
        return True
    seen = measured.rows[:, 1] - measured.rows[:, 0] + 1
    expected = scene.eye.camera.fy * mark.height / (np.sin(pose[PHI]) * measured.lines.X + pose[DY])
    share = _middle(seen / expected)
    is_whole = len(measured.members) == len(edges_of(mark)[0])
    lowest = 0.0 if _is_cut(measured, scene) else LOWEST if is_whole else 1.0 / HIGHEST
    rounded = ROUNDED_ROWS / _middle(expected)
    return lowest - rounded <= share <= HIGHEST + rounded
