"""Which pictures a page has, in which order, and what to look for in each.

This is the one table of them, for all systems: a picture for which a run has nothing is left out.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from .deviation import deviation
from .drawing import LIGHT, drawing, to_png, to_svg_file
from .findings import Findings
from .headline import draw_headline
from .marks_images import draw_images, images_caption
from .marks_series import by_distance_caption, draw_by_distance, draw_strip, strip_caption
from .pictures import draw_map, draw_passes, draw_support, support_counts
from .series import draw_errors, draw_histogram, draw_sightings
from .timeline import runs
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
    longest = _longest(counts == 0)
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


def _sightings(findings: Findings) -> str:
    seen = findings.seen
    words = "Where the thin line falls below the broad one, sightings were refused or belong to nothing in the map."
    if seen is None or len(seen.n) == 0:
        return words
    longest = _longest(seen.n == 0)
    return words + (f" The longest stretch without any has {longest} images." if longest else "")


def _histogram(findings: Findings) -> str:
    seen = findings.seen
    if seen is None or len(seen.n) == 0:
        return "How many landmarks the poses rest on."
    few, n = int((seen.n < 2).sum()), len(seen.n)
    return (
        f"{few} of {n} images ({100 * few / n:.1f} %) show fewer than two landmarks; "
        f"on average {seen.n.mean():.2f} are seen."
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


def _longest(is_in: "np.ndarray[tuple[int], np.dtype[np.bool_]]") -> int:
    """Return the length of the longest unbroken run of true values."""
    return max((last - first + 1 for first, last in runs(is_in)), default=0)


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
    Picture("sightings", "Landmarks seen and matched over time", draw_sightings, _sightings),
    Picture("histogram", "Landmarks per image", draw_histogram, _histogram),
)
