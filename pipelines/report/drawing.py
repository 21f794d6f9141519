"""How pictures look, and how a figure becomes bytes that are the same every time.

Colours follow Okabe and Ito's palette, which is told apart with any colour vision; what matters is told apart by width
or dash as well. A picture names its colours by role. Inside a page each role becomes a CSS variable, so one drawing
serves a light page, a dark page and paper; a picture file of its own keeps the light colours.

Text stays text. Identifiers come from a fixed salt, no date is written, and each picture's identifiers carry its name,
so that several can stand in one page.
"""

import base64
import io
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LIGHT = {
    "ink": "#1c2733", "muted": "#5c6b7a", "grid": "#e3e8ed", "paper": "#fefefe",
    "estimate": "#0072b2", "truth": "#f2c14e", "dead": "#7d8591", "landmark": "#8995a1",
    "other1": "#009e73", "other2": "#cc79a7", "other3": "#56b4e9", "weak": "#e69f00", "none": "#d55e00",
    "seen": "#7cc4ee", "matched": "#00664b",
}  # fmt: skip
"""Colours by role, on a light ground. No two roles share a colour: the page tells them apart by it."""

DARK = {
    "ink": "#e8ecf0", "muted": "#a3afbb", "grid": "#2f3842", "paper": "#161b21",
    "estimate": "#5bb8f5", "truth": "#8f6f1f", "dead": "#8d97a3", "landmark": "#77838f",
    "other1": "#35c79d", "other2": "#e39fc6", "other3": "#9ad6f7", "weak": "#f5b83d", "none": "#ff8346",
    "seen": "#2f6f9f", "matched": "#7fe3c4",
}  # fmt: skip
"""The same roles on a dark ground."""

WIDTH_IN = 8.6
"""Width of a picture [inch]; 8.5 pt text in it reads like the page's text on a desktop."""

JPEG_QUALITY = 88
"""Of the photographs in a page; at an edge of a bar it is off by some grey levels, which nobody sees."""

_PNG = re.compile(r"data:image/png;base64,\s*([A-Za-z0-9+/=\s]+)")

_RC: Mapping[str, object] = {
    "axes.axisbelow": True, "axes.edgecolor": LIGHT["muted"], "axes.facecolor": "none", "axes.grid": True,
    "axes.labelcolor": LIGHT["ink"], "axes.labelsize": 9, "axes.linewidth": 0.6, "axes.spines.right": False,
    "axes.spines.top": False, "axes.titlesize": 9, "axes.unicode_minus": True, "figure.facecolor": "none",
    "font.family": "sans-serif", "font.sans-serif": ["DejaVu Sans"], "font.size": 8.5, "grid.color": LIGHT["grid"],
    "grid.linewidth": 0.6, "legend.fontsize": 8.5, "legend.frameon": False, "legend.labelcolor": LIGHT["ink"],
    "lines.solid_capstyle": "round", "lines.solid_joinstyle": "round", "path.simplify": True,
    "path.simplify_threshold": 0.2, "svg.fonttype": "none", "svg.hashsalt": "logpose", "svg.image_inline": True,
    "text.color": LIGHT["ink"], "xtick.color": LIGHT["muted"], "xtick.labelcolor": LIGHT["ink"],
    "xtick.labelsize": 8.5, "xtick.major.width": 0.6, "ytick.color": LIGHT["muted"],
    "ytick.labelcolor": LIGHT["ink"], "ytick.labelsize": 8.5, "ytick.major.width": 0.6,
}  # fmt: skip


@contextmanager
def drawing() -> Iterator[None]:
    """Draw and write inside this block: matplotlib's defaults, then ours, whatever the user's ``matplotlibrc`` says."""
    import matplotlib as mpl

    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_RC)  # type: ignore[arg-type]  # its keys are literals there
        yield


def new_figure(height_in: float, width_in: float = WIDTH_IN) -> "Figure":
    """Make an empty figure that lays itself out; no window, no global state."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    class Layout(ConstrainedLayoutEngine):
        """Rounds where axes stand: the solver's last bits differ from run to run; identifiers are hashes of them."""

        def execute(self, fig: Figure) -> None:
            """Lay out the figure."""
            super().execute(fig)
            for axes in fig.axes:
                bounds = axes.get_position(original=True).bounds
                # As the layout itself does: its public sister would take the axes out of the next layout.
                axes._set_position(tuple(round(value, 9) for value in bounds))  # type: ignore[attr-defined]  # noqa: SLF001

    figure = Figure(figsize=(width_in, height_in), layout=Layout(h_pad=0.06, w_pad=0.04))
    FigureCanvasAgg(figure)
    return figure


def legend_above(figure: "Figure", axes: "Axes", columns: int = 4) -> None:
    """Put the legend of ``axes`` over the picture, where it hides nothing."""
    handles, labels = axes.get_legend_handles_labels()
    if handles:
        figure.legend(
            handles,
            labels,
            loc="outside upper left",
            ncols=columns,
            borderaxespad=0.2,
            handlelength=2.2,
            columnspacing=1.6,
        )


def logarithmic(axes: "Axes") -> None:
    """Make the y axis logarithmic, its numbers written as a person would."""
    from matplotlib.ticker import LogFormatter

    class Plain(LogFormatter):
        """Labels those ticks between the powers of ten that matplotlib would, 0.02 and not 2 x 10^-2."""

        def __call__(self, x: float, pos: int | None = None) -> str:
            return f"{x:g}" if super().__call__(x, pos) else ""

    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_formatter(Plain(minor_thresholds=(1.0, 0.4)))


def to_svg(figure: "Figure", name: str) -> str:
    """Write a figure as an ``<svg>`` element for a page: scalable, themed, with identifiers of its own.

    Args:
        figure: drawn inside ``drawing()``.
        name: unique in the page; letters and digits.
    """
    text = to_svg_file(figure)
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", text, flags=re.DOTALL)
    text = re.sub(r"<style[^>]*>.*?</style>\s*", "", text, flags=re.DOTALL)  # would style the whole page
    text = re.sub(r'(<svg[^>]*?) width="[^"]*pt"', r"\1", text)
    text = re.sub(r'(<svg[^>]*?) height="[^"]*pt"', r"\1", text, count=1)
    text = re.sub(r'\bid="([^"]+)"', rf'id="{name}-\1"', text)
    text = re.sub(r"url\(#([^)]+)\)", rf"url(#{name}-\1)", text)
    text = re.sub(r'href="#([^"]+)"', rf'href="#{name}-\1"', text)
    for role, colour in LIGHT.items():
        text = text.replace(colour, f"var(--{role})")
    return _PNG.sub(_as_jpeg, text).strip()


def _as_jpeg(found: "re.Match[str]") -> str:
    """Make a photograph that matplotlib embedded as PNG, four bytes to a grey pixel, a tenth of its size."""
    import cv2
    import numpy as np

    data = base64.b64decode(found.group(1))
    pixels = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_GRAYSCALE)
    if pixels is None:
        return found.group(0)
    _, jpeg = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return f"data:image/jpeg;base64,{base64.b64encode(jpeg.tobytes()).decode()}"


def to_svg_file(figure: "Figure") -> str:
    """Write a figure as an SVG file."""
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    figure.draw_without_rendering()  # a map's equal axes settle only in the second layout
    stream = io.StringIO()
    FigureCanvasSVG(figure).print_svg(stream, metadata={"Date": None, "Creator": None})  # type: ignore[no-untyped-call]
    # Verdana has the widths of DejaVu Sans, and is where DejaVu is not.
    return stream.getvalue().replace("'DejaVu Sans'", "'DejaVu Sans', Verdana, sans-serif")


def to_png(figure: "Figure", dpi: int = 160) -> bytes:
    """Write a figure as a PNG file on the light ground."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    stream = io.BytesIO()
    figure.set_dpi(dpi)
    figure.set_facecolor(LIGHT["paper"])
    FigureCanvasAgg(figure).print_png(stream, metadata={"Software": None})  # type: ignore[no-untyped-call]
    return stream.getvalue()
