"""Which pictures a page has, in which order, and what to look for in each.

This is the one table of them, for all systems: a picture for which a run has nothing is left out.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

from .drawing import LIGHT, drawing, to_png, to_svg_file
from .errors import draw_errors, errors_caption
from .findings import Findings
from .headline import draw_headline
from .landmarks.pictures import draw_histogram, draw_sightings, histogram_caption, sightings_caption
from .marks.images import draw_images, images_caption
from .marks.series import by_distance_caption, draw_by_distance, draw_strip, strip_caption
from .pictures import draw_map, draw_passes, draw_support, map_caption, passes_caption, support_caption

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PictureName: TypeAlias = Literal[
    "map", "images", "support", "strip", "errors", "distance", "passes", "sightings", "histogram", "headline"
]


@dataclass(frozen=True, slots=True)
class Picture:
    """One picture of a page.

    Attributes:
        name: letters only; unique in the page.
        title: what it shows.
        draw: draws it, or returns None.
        caption: says what to look for.
    """

    name: str
    title: str
    draw: Callable[[Findings], "Figure | None"]
    caption: Callable[[Findings], str]


PICTURES = (
    Picture("map", "Map and trajectories", draw_map, map_caption),
    Picture("images", "What was found in the images", draw_images, images_caption),
    Picture("support", "What each pose had to go by", draw_support, support_caption),
    Picture("strip", "What each image had to go by", draw_strip, strip_caption),
    Picture("errors", "Error over time", draw_errors, errors_caption),
    Picture("distance", "Error of single images over distance", draw_by_distance, by_distance_caption),
    Picture("passes", "Way points, close up", draw_passes, passes_caption),
    Picture("sightings", "Landmarks seen and matched over time", draw_sightings, sightings_caption),
    Picture("histogram", "Landmarks per image", draw_histogram, histogram_caption),
)


def draw_picture(findings: Findings, name: PictureName, fmt: Literal["png", "svg"]) -> bytes:
    """Draw one picture as a file, on a light ground.

    Raises:
        ValueError: the run has nothing for it.
    """
    draw = draw_headline if name == "headline" else next(p.draw for p in PICTURES if p.name == name)
    with drawing():
        figure = draw(findings)
        if figure is None:
            raise ValueError(f"the run has nothing for the picture {name!r}")
        figure.set_facecolor(LIGHT["paper"])
        return to_png(figure) if fmt == "png" else to_svg_file(figure).encode()
