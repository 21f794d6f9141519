"""Marks to scale, for the printer: white bars on a black ground, one page each, as SVG or PDF.

Outside the ground stand crop marks, the id, which side is the viewer's left, where the origin of the mark's X axis is,
and a bar of 100 mm: who measures it on the paper knows whether the printer has scaled the page. A page is A4, upright
or lying, or as large as the mark needs. The same marks give the same bytes.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, Literal
from xml.sax.saxutils import escape

from ...formats.errors import ConfigError
from ...formats.files import replacing, replacing_text
from ...formats.products import StripeMark

if TYPE_CHECKING:
    from matplotlib.figure import Figure

A4 = (210.0, 297.0)
MARGIN = 10.0
"""No printer prints nearer to the border of a page [mm]."""
GROUND = 20.0
"""Black beside, above and below the bars, at least; as wide as the widest bar [mm]."""
HEIGHTS = (150.0, 100.0)
"""Height of bars where the map does not say it: the first that fits A4, otherwise the first [mm]."""
HEADER, FOOTER = 16.0, 34.0
CROP, SCALE = 8.0, 130.0
"""Place beside the ground for crop marks, and across the page for the bar of 100 mm and its words [mm]."""
MAX_PAGE = 5000.0
"""No PDF has a larger page [mm]."""


@dataclass(frozen=True, slots=True)
class Box:
    """A filled rectangle, from its upper left corner [mm]."""

    x: float
    y: float
    width: float
    height: float
    fill: Literal["black", "white"]


@dataclass(frozen=True, slots=True)
class Words:
    """Text on a base line that begins, ends or has its middle at (x, y) [mm]."""

    x: float
    y: float
    size: float
    text: str
    anchor: Literal["start", "middle", "end"] = "middle"


@dataclass(frozen=True, slots=True)
class Page:
    """A page; y grows downwards [mm]."""

    width: float
    height: float
    title: str
    shapes: tuple[Box | Words, ...]


def print_marks(marks: Sequence[StripeMark], path: str | Path, source: str) -> list[str]:
    """Write marks to scale and return the names of the files.

    Args:
        marks: to print.
        path: ``.pdf`` holds a page for each mark; of ``.svg`` each mark gets a file of its own, ``NAME.ID.svg``, unless
            there is only one.
        source: the file of the marks, for messages.

    Raises:
        ConfigError: another suffix, bars of unknown width, or a mark larger than a page can be.
    """
    target = Path(path)
    suffix = target.suffix.lower()
    if suffix not in {".svg", ".pdf"}:
        raise ConfigError(f"{target}: marks are printed as SVG or PDF. Name a file that ends in .svg or .pdf.")
    pages = [layout(mark, source) for mark in marks]
    if suffix == ".pdf":
        with replacing(target) as stream:
            write_pdf(pages, stream)
        return [str(target)]
    names = [target] if len(marks) == 1 else [target.with_suffix(f".{mark.id}.svg") for mark in marks]
    for name, page in zip(names, pages, strict=True):
        with replacing_text(name) as text:
            text.write(svg(page))
    return [str(name) for name in names]


def layout(mark: StripeMark, source: str) -> Page:
    """Return the page of one mark.

    Raises:
        ConfigError: the width of the bars is not known, or the mark is too large.
    """
    if mark.bars is None:
        raise ConfigError(f"{source}: mark {mark.id} has no bar_m. Give the width of its bars to print it.")
    lines, bars = 1000.0 * mark.lines, 1000.0 * mark.bars
    border = max(GROUND, float(bars.max()))
    across = float(lines[-1] + bars[-1] - lines[0]) + 2 * border
    heights = HEIGHTS if mark.height is None else (1000.0 * mark.height,)
    papers = [_paper(across, bar_height + 2 * border) for bar_height in heights]
    best = next((i for i, paper in enumerate(papers) if paper in {A4, A4[::-1]}), 0)
    bar_height, (width, height) = heights[best], papers[best]
    ground = (across, bar_height + 2 * border)
    if max(width, height) > MAX_PAGE:
        raise ConfigError(
            f"{source}: mark {mark.id} needs a page of {width:.0f} x {height:.0f} mm, more than {MAX_PAGE:.0f} mm. "
            "Check lines_m and height_m, whose unit is metres."
        )
    left, top = 0.5 * (width - ground[0]), 0.5 * (height - ground[1] - HEADER - FOOTER) + HEADER
    origin = left + border - float(lines[0])
    right, bottom = left + ground[0], top + ground[1]
    shapes: list[Box | Words] = [Box(left, top, *ground, "black")]
    shapes += [
        Box(origin + float(x), top + border, float(bar), bar_height, "white")
        for x, bar in zip(lines, bars, strict=True)
    ]
    shapes += _crop_marks(left, top, right, bottom)
    shapes += _captions(mark, (left, right, bottom, top), origin, bar_height, width)
    return Page(width, height, f"stripe mark {mark.id}", tuple(shapes))


def svg(page: Page) -> str:
    """Return a page as SVG whose user unit is a millimetre."""
    width, height = _mm(page.width), _mm(page.height)
    root = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}mm" height="{height}mm" viewBox="0 0 {width} {height}">'
    )
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', root, f"<title>{escape(page.title)}</title>"]
    for shape in page.shapes:
        if isinstance(shape, Box):
            lines.append(
                f'<rect x="{_mm(shape.x)}" y="{_mm(shape.y)}" width="{_mm(shape.width)}" height="{_mm(shape.height)}" '
                f'fill="{shape.fill}"/>'
            )
        else:
            lines.append(
                f'<text x="{_mm(shape.x)}" y="{_mm(shape.y)}" font-size="{_mm(shape.size)}" font-family="sans-serif" '
                f'text-anchor="{shape.anchor}">{escape(shape.text)}</text>'
            )
    return "\n".join([*lines, "</svg>", ""])


def write_pdf(pages: Sequence[Page], stream: BinaryIO) -> None:
    """Write pages as PDF."""
    import matplotlib as mpl
    from matplotlib.backends.backend_pdf import PdfPages

    with mpl.rc_context():
        mpl.rcdefaults()
        with PdfPages(stream, metadata={"CreationDate": None, "Title": pages[0].title}) as pdf:
            for page in pages:
                pdf.savefig(_figure(page))


def _figure(page: Page) -> "Figure":
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

    aligned = {"start": "left", "middle": "center", "end": "right"}
    figure = Figure(figsize=(page.width / 25.4, page.height / 25.4), facecolor="none")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(0.0, page.width), ylim=(page.height, 0.0))
    axes.set_axis_off()
    for shape in page.shapes:
        if isinstance(shape, Box):
            corner = (shape.x, shape.y)
            axes.add_patch(Rectangle(corner, shape.width, shape.height, facecolor=shape.fill, linewidth=0))
        else:
            size = shape.size * 72 / 25.4
            axes.text(shape.x, shape.y, shape.text, fontsize=size, ha=aligned[shape.anchor], va="baseline")
    return figure


def _paper(across: float, high: float) -> tuple[float, float]:
    """Return the page for a ground: A4 upright, A4 lying, or one of its own."""
    need = (max(across + 2 * CROP, SCALE) + 2 * MARGIN, high + HEADER + FOOTER + 2 * MARGIN)
    for paper in (A4, A4[::-1]):
        if need[0] <= paper[0] and need[1] <= paper[1]:
            return paper
    return float(-(-need[0] // 1)), float(-(-need[1] // 1))


def _crop_marks(left: float, top: float, right: float, bottom: float) -> list[Box | Words]:
    """Return two thin lines outside each corner of the ground."""
    thin, gap, length = 0.2, 1.5, 5.0
    shapes: list[Box | Words] = []
    for x, outward in ((left, -1), (right, 1)):
        for y, away in ((top, -1), (bottom, 1)):
            begin_x = x + gap if outward > 0 else x - gap - length
            begin_y = y + gap if away > 0 else y - gap - length
            shapes.append(Box(begin_x, y - 0.5 * thin, length, thin, "black"))
            shapes.append(Box(x - 0.5 * thin, begin_y, thin, length, "black"))
    return shapes


def _captions(
    mark: StripeMark, ground: tuple[float, float, float, float], origin: float, bar_height: float, width: float
) -> list[Box | Words]:
    left, right, bottom, top = ground
    middle = 0.5 * width
    shapes: list[Box | Words] = [
        Words(left + 3, top - 3, 3.0, "viewer's left", "start"),
        Words(right - 3, top - 3, 3.0, "viewer's right", "end"),
        Words(middle, top - 9, 5.0, f"stripe mark {mark.id}, this side up"),
    ]
    if left <= origin <= right:
        shapes += [
            Box(origin - 0.1, bottom + 1.5, 0.2, 5.0, "black"),
            Words(origin + 1.5, bottom + 6.0, 3.0, "x = 0", "start"),
        ]
    scale = bottom + 14.0
    shapes += [Box(middle - 50.0, scale, 100.0, 0.4, "black")]
    shapes += [Box(middle - 50.0 + 10 * i - 0.1, scale - 2, 0.2, 4.4, "black") for i in range(11)]
    note = f"print at 100 %: this bar is 100 mm long, the white bars are {_mm(bar_height)} mm high"
    return [*shapes, Words(middle, scale + 8.0, 3.0, note)]


def _mm(value: float) -> str:
    return f"{value:.6f}".rstrip("0").rstrip(".")
