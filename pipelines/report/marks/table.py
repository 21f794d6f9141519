"""The table of stripe marks: how often each was seen, with what status, how far, how turned, and how well it fitted."""

import numpy as np

from ....formats.events import NO_ID, Array
from ..markup import table
from ..tables import Column, Row
from .kept import MarkFindings, Mask, ids_of
from .series import STATUS_ROLES


def marks_table(marks: MarkFindings) -> str:
    """Render one row per mark, one for images in which none was recognised, and one for all."""
    words = [w for w in STATUS_ROLES if w in marks.status_words]
    words += [w for w in marks.status_words if w not in STATUS_ROLES]
    rows: list[Row] = [_row(marks, str(identity), marks.mark == identity, words) for identity in ids_of(marks)]
    if (marks.mark == NO_ID).any():
        rows.append(_row(marks, "none", marks.mark == NO_ID, words))
    rows.append({**_row(marks, "all", np.ones(len(marks), dtype=np.bool_), words), "is_sum": True})
    columns = [
        Column("name", "mark"),
        Column("images"),
        *(Column(f"is_{word}", word) for word in words),
        Column("nearest", "nearest [m]", 2),
        Column("farthest", "farthest [m]", 2),
        Column("turned", "most turned [°]", 1),
        Column("edges", "edges, median", 0),
        Column("residual", "residual, median [px]", 3),
        Column("sd_angle", "sd of φ, median [°]", 3),
        Column("sd_distance", "sd of the position, median [mm]", 1),
    ]
    return table(rows, columns)


def _row(marks: MarkFindings, name: str, is_in: Mask, words: list[str]) -> dict[str, object]:
    """Sum up some sightings; what a pose tells is told of those that are used."""
    used = is_in & marks.is_used
    distance, phi = marks.distance[used], np.degrees(marks.pose[used, 0])
    lens = np.sqrt(np.maximum(marks.cov[used, 1, 1] + marks.cov[used, 2, 2], 0.0))
    counts = {f"is_{word}": len(np.unique(marks.stamps[is_in & marks.of_status(word)])) for word in words}
    return {
        "name": name,
        "images": len(np.unique(marks.stamps[is_in])),
        **counts,
        "nearest": float(distance.min()) if len(distance) else None,
        "farthest": float(distance.max()) if len(distance) else None,
        "turned": float(np.abs(phi).max()) if len(phi) else None,
        "edges": _median(marks.n_lines[used].astype(np.float64)),
        "residual": _median(marks.residual[used]),
        "sd_angle": _median(np.degrees(np.sqrt(np.maximum(marks.cov[used, 0, 0], 0.0)))),
        "sd_distance": _median(1000.0 * lens),
    }


def _median(values: Array) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else None
