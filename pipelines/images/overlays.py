"""Pictures of images with what was found in them: what all stages that write them have in common."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

from ...formats.events import Bytes, Event, Image
from ...formats.images import DamagedImage, grey
from ...formats.png import write_png

S = TypeVar("S", bound=Event)


def overlays(
    events: Iterator[Event],
    kind: type[S],
    source: str,
    draw: Callable[[Bytes, Sequence[S]], Bytes],
    *,
    folder: str,
    every: int,
) -> Iterator[Event]:
    """Write a picture per image with what a stage saw in it, when the next image comes or the log ends.

    Args:
        events: what passes; sightings have the stamp of their image and follow it.
        kind: of the sightings.
        source: name of the stage that made them.
        draw: from an image (H, W) and its sightings, at least one, to a picture (H, W, 3) blue, green, red.
        folder: where the pictures go, named by the stamps of the images.
        every: write every n-th only of the images that have sightings.
    """
    image: Image | None = None
    seen: list[S] = []
    n = 0

    def write() -> None:
        if image is not None and seen and n % every == 0:
            with suppress(DamagedImage):  # the stage that looked at it has said so
                write_png(Path(folder) / f"{image.stamp}.png", draw(grey(image), seen))

    for event in events:
        if isinstance(event, Image):
            write()
            n += bool(seen)
            image, seen = event, []
        elif isinstance(event, kind) and event.source == source and image is not None and event.stamp == image.stamp:
            seen.append(event)
        yield event
    write()
