"""Which pictures a page has, in which order, and what to look for in each.

This is the one table of them, for all systems: a picture for which a run has nothing is left out.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

from .deviation import deviation
from .drawing import LIGHT, drawing, to_png, to_svg_file
from .errors import draw_errors
from .findings import Findings
from .headline import draw_headline
from .landmarks.pictures import draw_histogram, draw_sightings, histogram_caption, sightings_caption
from .marks.images import draw_images, images_caption
from .marks.series import by_distance_caption, draw_by_distance, draw_strip, strip_caption
from .pictures import draw_map, draw_passes, draw_support, support_counts
from .timeline import longest_run
from .track import DEAD_RECKON
from .verdict import aligned_by

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


def _map(findings: Findings) -> str:
    words = []
    if findings.truth is not None:
        words.append("Where the estimate is right, its thin line runs inside the broad one of the truth.")
    if DEAD_RECKON in findings.estimates:
        words.append(
            "Dead reckoning starts from the same pose and uses odometry alone: "
            "how far it strays is what the method had to make up for."
        )
    if findings.matched_ids:
        words.append("Filled dots are landmarks that were matched at least once.")
    if findings.marks is not None:
        words.append(
            "The arrows of the marks point to where they are seen from. Where dots and ellipses lie off the line, "
            "single images disagree with the rest."
        )
    return " ".join(words) or "The route in the map frame, both axes to the same scale."


def _support(findings: Findings) -> str:
    counts, word = support_counts(findings)
    if findings.is_by_marks:
        return (
            "With a mark in the image, the pose follows from the image; between them it is carried by odometry alone."
        )
    if counts is None:
        return ""
    longest = longest_run(counts == 0)
    text = (
        f"With two or more landmarks {word}, the pose follows from the image; with one it is only partly fixed; "
        "with none it is carried by odometry alone. Errors are to be expected at the end of long coloured stretches."
    )
    return text + (f" The longest stretch with none has {longest} poses." if longest else "")


def _passes(_: Findings) -> str:
    return (
        "All squares have the same scale, in metres of the map. "
        "The red line leads from the way point to the estimate at its pass: the error in the table."
    )


def _errors(findings: Findings) -> str:
    truth, track = findings.truth, findings.primary
    if truth is None or track is None:
        return ""
    words = (
        "The distance stands on a logarithmic axis, so that centimetres and a lost estimate show in one picture; "
        "of long runs it is the mean, and pale the range, of short stretches."
    )
    if aligned_by(findings):
        words += f" Drawn as estimated, without the {aligned_by(findings)} alignment of the evaluation."
    share = deviation(track, truth).share_within(3.0)
    if share is None:
        return words + " The estimator gave no covariance, so there is no band."
    return words + (
        f" The band is three standard deviations as the estimator claims them: {100 * share:.1f} % of the poses lie "
        "inside it in x, y and heading at once (99.2 % would, were the claim exact and the three independent)."
    )


def draw_picture(findings: Findings, name: PictureName, fmt: Literal["png", "svg"]) -> bytes:
    """Draw one picture as a file.

    Raises:
        ValueError: the run has nothing for it.
    """
    if name == "headline":
        return draw_headline(findings, fmt)
    with drawing():
        figure = next(picture for picture in PICTURES if picture.name == name).draw(findings)
        if figure is None:
            raise ValueError(f"the run has nothing for the picture {name!r}")
        figure.set_facecolor(LIGHT["paper"])
        return to_png(figure) if fmt == "png" else to_svg_file(figure).encode()


PICTURES = (
    Picture("map", "Map and trajectories", draw_map, _map),
    Picture("images", "What was found in the images", draw_images, images_caption),
    Picture("support", "What each pose had to go by", draw_support, _support),
    Picture("strip", "What each image had to go by", draw_strip, strip_caption),
    Picture("errors", "Error over time", draw_errors, _errors),
    Picture("distance", "Error of single images over distance", draw_by_distance, by_distance_caption),
    Picture("passes", "Way points, close up", draw_passes, _passes),
    Picture("sightings", "Landmarks seen and matched over time", draw_sightings, sightings_caption),
    Picture("histogram", "Landmarks per image", draw_histogram, histogram_caption),
)
