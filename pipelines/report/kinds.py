"""The kinds of things seen that a report knows, and the maps that stages name for them."""

from ...formats.maps.landmarks import read_landmarks
from ...formats.maps.marks import read_marks
from .kind import Maps
from .landmarks.kind import LANDMARKS
from .marks.kind import MARKS

KINDS = (LANDMARKS, MARKS)


def read_maps(landmarks: str | None, marks: str | None) -> Maps:
    """Read the maps that are given; a stage does so before the log is read."""
    return [
        *([] if landmarks is None else [read_landmarks(landmarks)]),
        *([] if marks is None else [read_marks(marks)]),
    ]
