"""What landmarks give to reports."""

from typing import TYPE_CHECKING

import numpy as np

from ....formats.events import Array
from ....formats.products import LandmarkMap
from ..findings import Findings, first_of
from ..kind import Kind, Support
from ..timeline import longest_run
from .kept import LandmarkFindings, LandmarkKeeper
from .pictures import draw_landmarks
from .record import LandmarkRecorder

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def _under(axes: "Axes", findings: Findings, span: float | None) -> None:
    kept = findings.of(LandmarkFindings)
    if kept is not None:
        draw_landmarks(axes, kept, is_labelled=span is not None)


def _places(findings: Findings) -> tuple[Array, Array]:
    kept, nowhere = findings.of(LandmarkFindings), np.empty((0, 2))
    if kept is None or kept.landmarks is None:
        return nowhere, nowhere
    return nowhere, kept.landmarks.positions[:, :2]


def _map_caption(findings: Findings) -> str:
    kept = findings.of(LandmarkFindings)
    is_told = kept is not None and kept.matched_ids
    return "Filled dots are landmarks that were matched at least once." if is_told else ""


def _support(findings: Findings) -> Support | None:
    """Sort poses by how many landmarks they were estimated with, as the estimator says of each."""
    track = findings.primary
    if track is None or findings.is_by_images:
        return None
    told = ((track.n_seen, "seen"), (track.n_matched, "matched"))
    counts, word = next(((n, word) for n, word in told if np.isfinite(n).any()), (None, ""))
    if counts is None:
        return None
    classes = [
        (counts >= 2, "estimate", 1.1, f"2 or more {word}"),
        (counts == 1, "weak", 2.0, f"1 {word}"),
        (counts == 0, "none", 2.8, f"none {word}"),
    ]
    longest = longest_run(counts == 0)
    caption = (
        f"With two or more landmarks {word}, the pose follows from the image; with one it is only partly fixed; "
        "with none it is carried by odometry alone. Errors are to be expected at the end of long coloured stretches."
    )
    return Support(classes, caption + (f" The longest stretch with none has {longest} poses." if longest else ""))


def _says(findings: Findings) -> list[str]:
    """Say what was seen, where nothing was made of it."""
    kept = findings.of(LandmarkFindings)
    seen = None if kept is None else kept.seen
    if findings.primary is not None or seen is None:
        return []
    n, total, blind = len(seen.n), int(seen.n.sum()), int((seen.n == 0).sum())
    return [f"{seen.source} saw {total} landmarks in {n} images, none in {blind}"]


LANDMARKS = Kind(
    keeper=lambda maps: LandmarkKeeper(first_of(maps, LandmarkMap)),
    recorder=lambda log, maps, _: LandmarkRecorder(log, first_of(maps, LandmarkMap)),
    under=_under,
    places=_places,
    map_caption=_map_caption,
    support=_support,
    says=_says,
)
