"""What stripe marks give to reports."""

from typing import TYPE_CHECKING

import numpy as np

from ....formats.events import Array
from ....formats.products import MarkMap
from ..findings import Findings, first_of
from ..kind import Kind, Support
from ..markup import section
from .kept import OK, UNVERIFIED, MarkFindings, MarkKeeper, longest_bridged_s
from .map import draw_marks, draw_single_images, mark_places
from .record import MarkRecorder
from .table import marks_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def _over(axes: "Axes", findings: Findings, span: float | None) -> None:
    marks = findings.of(MarkFindings)
    if marks is None:
        return
    draw_marks(axes, marks, is_labelled=span is not None)
    if span is not None:
        draw_single_images(axes, marks, span)


def _places(findings: Findings) -> tuple[Array, Array]:
    marks = findings.of(MarkFindings)
    if marks is None:
        return np.empty((0, 2)), np.empty((0, 2))
    return mark_places(marks, seen=True), mark_places(marks, seen=False)


def _map_caption(findings: Findings) -> str:
    if findings.of(MarkFindings) is None:
        return ""
    return (
        "The arrows of the marks point to where they are seen from. Where dots and ellipses lie off the line, "
        "single images disagree with the rest."
    )


def _support(findings: Findings) -> Support | None:
    """Sort poses by whether a mark, which gives a whole pose, was in the image; None if all rest on images."""
    marks, track = findings.of(MarkFindings), findings.primary
    if marks is None or track is None or track.source != marks.source:
        return None
    rests = marks.rests_on_image(track.stamps)
    if rests.all():
        return None
    return Support(
        [(rests, "estimate", 1.1, "a mark in the image"), (~rests, "none", 2.8, "odometry alone")],
        "With a mark in the image, the pose follows from the image; between them it is carried by odometry alone.",
    )


def _says(findings: Findings) -> list[str]:
    """Say how many marks were recognised, in how many images, and what carried the pose in between."""
    marks = findings.of(MarkFindings)
    if marks is None:
        return []
    ids = np.unique(marks.mark[marks.of_status(OK)])
    if len(ids) == 0:
        parts = [
            "no mark was recognised "
            + ("in the only image" if len(marks.images) == 1 else f"in {len(marks.images)} images")
        ]
    elif marks.marks is None or len(marks.marks) == 1:
        names = f"mark {ids[0]} was" if len(ids) == 1 else f"{len(ids)} marks were"
        parts = [f"{names} recognised {_in_images(marks, OK)}"]
    else:
        verb = "was" if len(ids) == 1 else "were"
        parts = [f"{len(ids)} of {len(marks.marks)} marks {verb} recognised, {_in_images(marks, OK)}"]
    if marks.of_status(UNVERIFIED).any():
        parts.append(f"which mark it is was assumed {_in_images(marks, UNVERIFIED)}")
    longest = longest_bridged_s(marks, findings.primary)
    if longest > 0:
        parts.append(f"odometry alone bridged {longest:.1f} s at most")
    return parts


def _in_images(marks: MarkFindings, status: str) -> str:
    n, total = len(np.unique(marks.stamps[marks.of_status(status)])), len(marks.images)
    return "in the only image" if total == 1 else f"in {n} of {total} images"


def _section(findings: Findings) -> str:
    marks = findings.of(MarkFindings)
    return "" if marks is None else section("Marks", marks_table(marks))


MARKS = Kind(
    keeper=lambda maps: MarkKeeper(first_of(maps, MarkMap)),
    recorder=lambda log, maps, base_frame: MarkRecorder(log, first_of(maps, MarkMap), base_frame),
    over=_over,
    places=_places,
    map_caption=_map_caption,
    support=_support,
    says=_says,
    section=_section,
)
