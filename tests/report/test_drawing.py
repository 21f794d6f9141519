import re

import pytest
from matplotlib.layout_engine import ConstrainedLayoutEngine

from logpose.pipelines.report.drawing import DARK, LIGHT, drawing, new_figure, to_png, to_svg, to_svg_file


def small_figure():
    figure = new_figure(2.0)
    axes = figure.add_subplot()
    axes.plot([0, 1], [0, 1], color=LIGHT["estimate"], label="a < b & c")
    axes.plot([0.5], [0.5], marker="o", color=LIGHT["none"])
    axes.set_xlabel("x [m]")
    axes.legend()
    return figure


def test_the_same_figure_gives_the_same_bytes():
    with drawing():
        assert to_svg(small_figure(), "a") == to_svg(small_figure(), "a")
        assert to_png(small_figure()) == to_png(small_figure())


@pytest.mark.parametrize("write", [to_svg_file, to_png])
def test_the_last_bits_of_a_layout_change_no_byte(write, monkeypatch):
    execute = ConstrainedLayoutEngine.execute

    def noisy(engine, fig):
        execute(engine, fig)
        for axes in fig.axes:
            x, y, width, height = axes.get_position(original=True).bounds
            axes._set_position((x + 1e-14, y, width, height - 1e-14))

    with drawing():
        before = write(small_figure())
        monkeypatch.setattr(ConstrainedLayoutEngine, "execute", noisy)
        assert write(small_figure()) == before


def test_an_svg_names_no_date_and_keeps_text_as_text():
    with drawing():
        text = to_svg_file(small_figure())
    assert "dc:date" not in text
    assert ">x [m]</text>" in text
    assert "a &lt; b &amp; c" in text


def test_identifiers_of_two_pictures_differ_and_every_reference_is_kept():
    with drawing():
        a, b = to_svg(small_figure(), "a"), to_svg(small_figure(), "b")
    ids = [set(re.findall(r'\bid="([^"]+)"', text)) for text in (a, b)]
    assert not ids[0] & ids[1]
    used = set(re.findall(r"url\(#([^)]+)\)", a)) | set(re.findall(r'href="#([^"]+)"', a))
    assert used
    assert used <= ids[0]


def test_colours_become_variables_of_the_page():
    with drawing():
        text = to_svg(small_figure(), "a")
    assert "var(--estimate)" in text
    assert not re.findall(r": #[0-9a-f]{6}", text)  # a literal colour would not follow a dark page


def test_every_role_has_a_colour_of_its_own_on_both_grounds():
    assert LIGHT.keys() == DARK.keys()
    assert len(set(LIGHT.values())) == len(LIGHT)


def luminance(colour):
    channels = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(a, b):
    high, low = sorted((luminance(a), luminance(b)), reverse=True)
    return (high + 0.05) / (low + 0.05)


def test_text_can_be_read_on_both_grounds():
    for colours in (LIGHT, DARK):
        assert contrast(colours["ink"], colours["paper"]) >= 7.0  # WCAG 2.1, level AAA
        assert contrast(colours["muted"], colours["paper"]) >= 4.5  # WCAG 2.1, level AA
        assert contrast(colours["estimate"], colours["paper"]) >= 3.0  # WCAG 2.1, graphical objects


def test_a_users_style_file_changes_nothing():
    import matplotlib as mpl

    with drawing():
        wanted = to_svg(small_figure(), "a")
    with mpl.rc_context({"lines.linewidth": 9.0, "font.size": 30.0, "svg.fonttype": "path"}), drawing():
        assert to_svg(small_figure(), "a") == wanted
