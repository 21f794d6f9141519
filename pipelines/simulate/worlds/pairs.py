"""Two numbers of a world file that belong together."""

from typing import Annotated

from pydantic import AfterValidator

Point = tuple[float, float]
"""x, y."""


def ordered(span: Point) -> Point:
    """Refuse a span that begins above its end."""
    if span[0] > span[1]:
        raise ValueError("should not begin above its end")
    return span


Span = Annotated[Point, AfterValidator(ordered)]
"""From, to."""
