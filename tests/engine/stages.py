"""Small stages that the tests of the engine chain."""

from collections.abc import Iterable, Iterator
from typing import Literal

from logpose.formats.events import Event, Image, Odometry, Pose
from logpose.pipelines.engine.params import Field, InputPath, OutputPath, Params
from logpose.pipelines.engine.stage import per_message


class CountParams(Params):
    step: int = Field(1, gt=0, description="how many each image counts for")
    mode: Literal["up", "down"] = Field("up", description="direction")
    map: InputPath | None = Field(None, description="a file")
    path: OutputPath = Field("count.txt", description="where to write")
    corner_m: tuple[float, float] = Field((0.0, 0.0), description="corner x, y [m]")


def count(events: Iterator[Event], params: CountParams) -> Iterator[Event]:
    """Count odometry messages.

    More text.
    """
    n = 0
    for event in events:
        yield event
        if isinstance(event, Odometry):
            n += params.step
            if event.stamp == 666:
                raise ValueError("the odometer says nan")
            yield pose(event.stamp, n)
    yield pose(10**12, n)


class NeedsParams(Params):
    map: InputPath = Field(description="landmark map")


def needs(events: Iterator[Event], params: NeedsParams) -> Iterator[Event]:
    """Need a map."""
    yield from events


class SquareParams(Params):
    add: int = Field(0, description="what to add")


@per_message
def square(event: Image, params: SquareParams) -> Iterable[Event]:
    """Square the width of an image."""
    if event.width == 13:
        raise KeyError("thirteen")
    yield pose(event.stamp, event.width**2 + params.add)


def pose(stamp: int, x: float) -> Pose:
    import numpy as np

    return Pose(stamp=stamp, source="made", position=np.array([x, 0.0, 0.0]), orientation=np.array([0.0, 0, 0, 1]))


TABLE = {"count": f"{__name__}:count", "square": f"{__name__}:square", "needs": f"{__name__}:needs"}
