"""Printed marks measured with a ruler: sizes as SVG and PDF say them."""

import re
import zlib
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from logpose.formats.errors import ConfigError
from logpose.formats.products import StripeMark
from logpose.pipelines.stripe_pose.printing import A4, print_marks

LINES = np.array([-0.06, 0.0, 0.04, 0.0985])
BARS = np.array([0.02, 0.01, 0.025, 0.0155])
POINT = 25.4 / 72


def mark(identity=1, lines=LINES, bars=BARS, height=None):
    return StripeMark(id=identity, lines=lines, bars=bars, pose=np.zeros(3), height=height)


def svg_of(mark, tmp_path):
    path = tmp_path / "m.svg"
    assert print_marks([mark], path, "marks.yaml") == [str(path)]
    root = ET.fromstring(path.read_text())
    boxes = [
        {key: float(box.get(key)) for key in ("x", "y", "width", "height")} | {"fill": box.get("fill")}
        for box in root.iter("{http://www.w3.org/2000/svg}rect")
    ]
    return root, boxes


def pdf_of(marks, tmp_path):
    """Page sizes [mm], and per page the filled boxes as (x, y, width, height) [mm], y downwards, and whether white."""
    path = tmp_path / "m.pdf"
    assert print_marks(marks, path, "marks.yaml") == [str(path)]
    data = path.read_bytes()
    sizes = [tuple(float(v) * POINT for v in m.split()[2:]) for m in re.findall(rb"/MediaBox \[([^\]]*)\]", data)]
    streams = re.findall(rb"stream\r?\n(.*?)\r?\nendstream", data, re.DOTALL)
    pages = [
        text for text in (zlib.decompress(s).decode("latin1") for s in streams if s[:1] == b"x") if "/A1 gs" in text
    ]
    return sizes, [list(filled(page, height)) for page, (_, height) in zip(pages, sizes, strict=True)]


def filled(page, height):
    """Run the few operators of a page: save and restore, grey of fills, corners, fill."""
    grey, saved, corners, operands = 0.0, [], [], []
    for word in page.split():
        if re.fullmatch(r"-?[\d.]+", word):
            operands.append(float(word) * POINT)
            continue
        if word == "q":
            saved.append(grey)
        elif word == "Q":
            grey = saved.pop()
        elif word == "g":
            grey = operands[-1] / POINT
        elif word in ("m", "l"):
            corners.append(operands[-2:])
        elif word == "f":
            x, y = np.array(corners).T
            yield x.min(), height - y.max(), np.ptp(x), np.ptp(y), grey == pytest.approx(1)
        if word not in ("m", "l", "h"):
            corners = []
        operands = []


def test_white_bars_are_to_scale_in_svg(tmp_path):
    root, boxes = svg_of(mark(height=0.12), tmp_path)
    assert (root.get("width"), root.get("height"), root.get("viewBox")) == ("260mm", "240mm", "0 0 260 240")
    white = [box for box in boxes if box["fill"] == "white"]
    assert [box["width"] for box in white] == pytest.approx([20, 10, 25, 15.5], abs=1e-5)
    assert [box["x"] - white[1]["x"] for box in white] == pytest.approx([-60, 0, 40, 98.5], abs=1e-5)
    assert {box["height"] for box in white} == {120.0}
    assert len({box["y"] for box in white}) == 1


def test_white_bars_are_to_scale_in_pdf(tmp_path):
    sizes, (boxes,) = pdf_of([mark(height=0.12)], tmp_path)
    assert sizes[0] == pytest.approx((260, 240), abs=1e-6)
    white = [box for box in boxes if box[4]]
    assert [box[2] for box in white] == pytest.approx([20, 10, 25, 15.5], abs=1e-4)
    assert [box[0] - white[1][0] for box in white] == pytest.approx([-60, 0, 40, 98.5], abs=1e-4)
    assert [box[3] for box in white] == pytest.approx([120] * 4, abs=1e-4)


def test_pdf_and_svg_are_the_same_picture(tmp_path):
    _, ours = svg_of(mark(), tmp_path)
    _, (theirs,) = pdf_of([mark()], tmp_path)
    assert len(ours) == len(theirs)
    for a, b in zip(ours, theirs, strict=True):
        assert b[:4] == pytest.approx([a["x"], a["y"], a["width"], a["height"]], abs=1e-4)
        assert b[4] == (a["fill"] == "white")


def test_there_is_black_around_the_bars(tmp_path):
    _, boxes = svg_of(mark(bars=np.array([0.02, 0.01, 0.035, 0.0155])), tmp_path)
    ground, *white = [box for box in boxes if box["fill"] == "white" or min(box["width"], box["height"]) > 100]
    assert ground["fill"] == "black"
    first, last = white[0], white[-1]
    margin = 35.0  # as wide as the widest bar
    assert first["x"] - ground["x"] == pytest.approx(margin)
    assert ground["x"] + ground["width"] - last["x"] - last["width"] == pytest.approx(margin)
    assert first["y"] - ground["y"] == pytest.approx(margin)
    assert ground["y"] + ground["height"] - first["y"] - first["height"] == pytest.approx(margin)


def test_a_bar_of_100_mm_tells_whether_the_printer_scaled(tmp_path):
    _, boxes = svg_of(mark(), tmp_path)
    assert sum(box["width"] == 100 for box in boxes) == 1
    ticks = sorted(box["x"] + box["width"] / 2 for box in boxes if box["height"] == 4.4)
    assert np.diff(ticks) == pytest.approx([10] * 10)


def test_the_origin_the_sides_and_the_id_are_marked(tmp_path):
    root, boxes = svg_of(mark(identity=42), tmp_path)
    texts = {node.text: node for node in root.iter("{http://www.w3.org/2000/svg}text")}
    assert "stripe mark 42, this side up" in texts
    assert float(texts["viewer's left"].get("x")) < float(texts["viewer's right"].get("x"))
    tick = next(box for box in boxes if box["height"] == 5.0 and box["x"] + 0.1 == pytest.approx(_origin(boxes)))
    assert tick["width"] == 0.2


def _origin(boxes):
    return next(box["x"] for box in boxes if box["fill"] == "white" and box["width"] == 10)


def page_of(mark, tmp_path):
    root, boxes = svg_of(mark, tmp_path)
    page = tuple(float(root.get(key).removesuffix("mm")) for key in ("width", "height"))
    return page, {box["height"] for box in boxes if box["fill"] == "white"}


def test_a_mark_gets_a4_if_it_fits_and_otherwise_its_own_page(tmp_path):
    narrow, wide = np.array([0.0, 0.04, 0.1]), np.array([0.0, 0.1, 0.18])
    bars = np.full(3, 0.02)
    # Where the height is free, bars are lower on a lying page.
    assert page_of(mark(lines=narrow, bars=bars), tmp_path) == (A4, {150.0})
    assert page_of(mark(lines=wide, bars=bars), tmp_path) == (A4[::-1], {100.0})
    assert page_of(mark(lines=wide, bars=bars, height=0.06), tmp_path) == (A4[::-1], {60.0})
    # 820 mm of bars, 20 mm of black and 8 mm of crop marks beside them, and the margin of the printer.
    assert page_of(mark(lines=np.array([-0.3, 0.1, 0.5]), bars=bars), tmp_path)[0] == (820 + 2 * (20 + 8 + 10), 260)


@pytest.mark.parametrize("height", [None, 0.05, 0.3, 1.0])
def test_everything_lies_on_the_page_inside_the_printers_margin(height, tmp_path):
    for lines in (LINES, np.array([-0.3, 0.1, 0.5]), np.array([0.5, 0.51, 0.53])):
        m = mark(lines=lines, bars=np.full(len(lines), 0.005), height=height)
        root, boxes = svg_of(m, tmp_path)
        page = [float(root.get(key).removesuffix("mm")) for key in ("width", "height")]
        for box in boxes:
            assert box["x"] >= 10
            assert box["y"] >= 10
            assert box["x"] + box["width"] <= page[0] - 10
            assert box["y"] + box["height"] <= page[1] - 10


def test_each_mark_is_a_page_or_a_file_of_its_own(tmp_path):
    marks = [mark(3), mark(7)]
    sizes, pages = pdf_of(marks, tmp_path)
    assert len(sizes) == len(pages) == 2
    names = print_marks(marks, tmp_path / "wall.svg", "marks.yaml")
    assert names == [str(tmp_path / "wall.3.svg"), str(tmp_path / "wall.7.svg")]
    assert "stripe mark 7" in (tmp_path / "wall.7.svg").read_text()


def test_the_same_marks_give_the_same_bytes(tmp_path):
    for suffix in ("svg", "pdf"):
        for name in ("a", "b"):
            print_marks([mark()], tmp_path / f"{name}.{suffix}", "marks.yaml")
        first, second = ((tmp_path / f"{name}.{suffix}").read_bytes() for name in ("a", "b"))
        assert first == second
        assert b"CreationDate" not in first


@pytest.mark.parametrize(
    ("name", "changes", "message"),
    [
        ("m.png", {}, "{p}: marks are printed as SVG or PDF. Name a file that ends in .svg or .pdf."),
        ("m.svg", {"bars": None}, "marks.yaml: mark 1 has no bar_m. Give the width of its bars to print it."),
        (
            "m.pdf",
            {"lines": np.array([-6.0, 0.0, 6.0]), "bars": np.full(3, 0.1)},
            "marks.yaml: mark 1 needs a page of 12336 x 420 mm, more than 5000 mm. "
            "Check lines_m and height_m, whose unit is metres.",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_printed_is_explained(name, changes, message, tmp_path):
    with pytest.raises(ConfigError) as error:
        print_marks([mark(**changes)], tmp_path / name, "marks.yaml")
    assert str(error.value) == message.format(p=tmp_path / name)
    assert list(tmp_path.iterdir()) == []
