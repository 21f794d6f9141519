"""DLR Spatial Cognition: circular marks on the floor of an office building seen by a robot's camera, as a log.

``/odom`` holds the steps of the odometry, added up; ``/sightings`` the circles seen after each step, with the
covariance of the file, its quality as score, and no ids; ``/ground_truth/sightings`` the same with the ids that were
given by hand. What the data set does not say, and what is done about it:

- Axes: the file's robot looks along -Y and X points to its right, as in an image, so its angles turn clockwise. Here x
  is forward and y is left (REP-103): x = -Y, y = -X, heading = -Phi. The world of the log is the mirror image of the
  file's.
- Time: there are no stamps. Steps are taken to last one second; the log begins at 1 s, since a stamp of 0 means none.
- Truth: there is none. Map and reference trajectory are our own least squares solution over all steps and all sightings
  with the given ids (``dlr_batch.py``): what is scored against it is compared with the best that the same data give,
  not with a survey.

Source: data by J. Kurlbaum and U. Frese, University of Bremen, and the comments at the head of the file.
"""

from pathlib import Path

import numpy as np

from ..errors import FormatError
from ..events import NO_ID, Array, Odometry
from ..products import LandmarkMap
from ..text import NANOSECONDS, content_lines, parse_number, text_lines
from .dlr_batch import Recording, added_up, solve
from .imported import (
    Imported,
    Stamps,
    blind,
    identified,
    initial_pose,
    sightings,
    true_poses,
    true_trajectory,
    upright,
    write_all,
)

STEP_NS = NANOSECONDS
_AXES = np.array([[0.0, -1.0], [-1.0, 0.0]])
"""From the axes of the file to forward and left."""


def convert_dlr_circles(source: str | Path, out_path: str | Path) -> Imported:
    """Write the log, ``<stem>.landmarks.yaml`` and ``<stem>.truth.tum`` beside it.

    Args:
        source: the ``.circles`` file, or the folder with it.
        out_path: log to write, ``.mcap`` or ``.bag``.

    Raises:
        FormatError: no such file, or a line is not what it should be (it is named).
    """
    path = circles_file(Path(source))
    recording = read_circles(path)
    if not (recording.ids != NO_ID).any():
        raise FormatError(f"{path}: no circle has an id, so there is no reference. Name the file with ids.")
    try:
        solution = solve(recording)
    except ValueError as err:
        raise FormatError(f"{path}: {err}. Name the file as published.") from err
    n = len(recording.steps)
    stamps = STEP_NS * np.arange(1, n + 2, dtype=np.int64)
    positions = np.column_stack([solution.landmarks, np.zeros(len(solution.landmarks))])
    landmarks = LandmarkMap(ids=solution.ids, positions=positions)
    bounds = np.searchsorted(recording.at, np.arange(n + 1))
    xy, cov = recording.xy, recording.covariances
    events = sightings(stamps[1:], bounds, xy=xy, cov=cov, ids=recording.ids, score=recording.quality)
    streams = (
        [initial_pose(int(stamps[0]), np.zeros(3))],
        true_poses(stamps, solution.poses),
        odometry(recording.steps, stamps),
        blind(events),
        identified(events),
    )
    written = write_all(out_path, streams, {".landmarks.yaml": landmarks}, true_trajectory(stamps, solution.poses))
    counts = {
        "odometry messages": n + 1,
        "sightings messages": len(events),
        "circles seen": len(recording.ids),
        "circles seen without an id": int((recording.ids == NO_ID).sum()),
        "landmarks": len(landmarks),
        "sightings messages without a circle": n - len(np.unique(recording.at)),
    }
    remarks = (
        "there is no external truth: map and trajectory are the least squares solution with the given ids",
        f"chi2 is {solution.chi2:.0f} for {solution.dof} degrees of freedom after {solution.iterations} iterations",
        "there are no stamps: steps are taken to last one second",
    )
    return Imported(written, counts, remarks)


def circles_file(source: Path) -> Path:
    """Return the ``.circles`` file of a source.

    Raises:
        FormatError: the folder has none or several.
    """
    if not source.is_dir():
        return source
    found = sorted(source.glob("*.circles"))
    if len(found) != 1:
        names = ", ".join(p.name for p in found) or "none"
        raise FormatError(f"{source}: must hold one .circles file, there is {names}. Name the file.")
    return found[0]


def read_circles(path: Path) -> Recording:
    """Read a ``.circles`` file.

    Raises:
        FormatError: a line is not what it should be, or there are no steps.
    """
    steps: list[list[float]] = []
    seen: list[list[float]] = []
    at: list[int] = []
    ids: list[int] = []
    for number, line in content_lines(text_lines(path)):
        where = f"{path}:{number}"
        cells = line.split()
        if cells[0] == "STEP" and len(cells) == 11:
            steps.append([parse_number(cell, where, "a value") for cell in cells[2:]])
        elif cells[0] in {"LANDMARK", "LANDMARK_C"} and len(cells) >= 8:
            if not steps:
                raise FormatError(f"{where}: a circle before the first STEP. Name the file as published.")
            seen.append([parse_number(cell, where, "a value") for cell in cells[1:7]])
            at.append(len(steps) - 1)
            ids.append(_identity(cells[7], where))  # further ids are other names of the same circle
        else:
            words = f"{cells[0]!r} with {len(cells)} columns"
            raise FormatError(f"{where}: {words} is neither a STEP nor a LANDMARK_C. Name a .circles file.")
    if not steps:
        raise FormatError(f"{path}: has no steps. Name a .circles file.")
    s, c = np.array(steps), np.array(seen).reshape(-1, 6)
    xx, xy, yy, xp, yp, pp = s[:, 3:].T
    covariances = np.stack([xx, xy, xp, xy, yy, yp, xp, yp, pp], axis=-1).reshape(-1, 3, 3)
    flip = np.zeros((3, 3))
    flip[:2, :2], flip[2, 2] = _AXES, -1.0
    spread = np.stack([c[:, 3], c[:, 4], c[:, 4], c[:, 5]], axis=-1).reshape(-1, 2, 2)
    return Recording(
        steps=s[:, :3] @ flip.T,
        step_covariances=flip @ covariances @ flip.T,
        at=np.array(at, dtype=np.int64),
        xy=c[:, :2] @ _AXES.T,
        covariances=_AXES @ spread @ _AXES.T,
        quality=c[:, 2],
        ids=np.array(ids, dtype=np.int64),
    )


def odometry(steps: Array, stamps: Stamps) -> list[Odometry]:
    """Return the steps (N, 3) added up from the origin, as N + 1 odometry poses."""
    return [
        Odometry(
            stamp=stamp,
            topic="/odom",
            frame_id="odom",
            position=np.array([x, y, 0.0]),
            orientation=upright(heading),
        )
        for stamp, (x, y, heading) in zip(stamps.tolist(), added_up(steps).tolist(), strict=True)
    ]


def _identity(text: str, where: str) -> int:
    try:
        identity = int(text)
    except ValueError as err:
        raise FormatError(f"{where}: id {text!r} is no integer. Name the file as published.") from err
    return identity if identity >= 0 else NO_ID
