import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logpose.formats.errors import FormatError
from logpose.formats.maps.marks import check_marks, read_marks, write_marks
from logpose.formats.products import MarkMap, StripeMark

LINES = np.array([-0.06, 0.0, 0.04, 0.12])


@st.composite
def mark(draw, identity):
    gaps = draw(st.lists(st.floats(1e-3, 0.5), min_size=3, max_size=8))
    lines = draw(st.floats(-2, 2)) + np.cumsum(gaps)
    bars = None
    if draw(st.booleans()):
        # A bar fills less than nine tenths of the gap to the next line, so rounding makes none touch it.
        shares = draw(st.lists(st.floats(0.05, 0.9), min_size=len(gaps), max_size=len(gaps)))
        bars = np.array(shares) * np.append(np.diff(lines), 0.1)
    elif draw(st.booleans()):
        bars = np.full(len(gaps), 0.5 * np.diff(lines).min())
    pose = [draw(st.floats(-1e6, 1e6)), draw(st.floats(-1e6, 1e6)), draw(st.floats(-math.pi, math.pi))]
    height = draw(st.none() | st.floats(1e-3, 3))
    return StripeMark(id=identity, lines=lines, bars=bars, pose=np.array(pose), height=height)


@st.composite
def maps(draw):
    ids = draw(st.lists(st.integers(0, 2**63 - 1), min_size=1, max_size=5, unique=True))
    frame = draw(st.sampled_from(["map", "odom", "my map: 1", "null", "1.5", ""]))
    return MarkMap(marks=tuple(draw(mark(identity)) for identity in ids), frame_id=frame)


@settings(max_examples=50, deadline=None)
@given(maps())
def test_the_file_gives_the_marks_back_bit_by_bit(tmp_path_factory, marks):
    path = tmp_path_factory.mktemp("marks") / "m.yaml"
    write_marks(marks, path)
    back = read_marks(path)
    assert back.frame_id == marks.frame_id
    assert [m.id for m in back.marks] == [m.id for m in marks.marks]
    for a, b in zip(back.marks, marks.marks, strict=True):
        np.testing.assert_array_equal(a.lines, b.lines)
        np.testing.assert_array_equal(a.pose, b.pose)
        assert a.height == b.height
        assert (a.bars is None) == (b.bars is None)
        if b.bars is not None:
            np.testing.assert_array_equal(a.bars, b.bars)


def test_the_file_is_laid_out_as_documented(tmp_path):
    path = tmp_path / "m.yaml"
    pose = np.array([1.0, -2.5, 0.5])
    marks = (
        StripeMark(id=1, lines=LINES, bars=np.full(4, 0.03), pose=pose, height=0.2),
        StripeMark(id=2, lines=LINES, bars=np.array([0.03, 0.01, 0.03, 0.02]), pose=pose),
        StripeMark(id=3, lines=LINES[:3], bars=None, pose=np.zeros(3)),
    )
    write_marks(MarkMap(marks=marks), path)
    assert path.read_text() == (
        "logpose: marks/1\nframe: map\nmarks:\n"
        "  - {id: 1, lines_m: [-0.06, 0.0, 0.04, 0.12], bar_m: 0.03, height_m: 0.2, x_m: 1.0, y_m: -2.5, heading_rad: 0.5}\n"
        "  - {id: 2, lines_m: [-0.06, 0.0, 0.04, 0.12], bar_m: [0.03, 0.01, 0.03, 0.02], x_m: 1.0, y_m: -2.5, heading_rad: 0.5}\n"
        "  - {id: 3, lines_m: [-0.06, 0.0, 0.04], x_m: 0.0, y_m: 0.0, heading_rad: 0.0}\n"
    )


def test_one_width_is_that_of_every_bar_and_edges_alternate(tmp_path):
    path = tmp_path / "m.yaml"
    path.write_text(
        "logpose: marks/1\nmarks:\n- {id: 7, lines_m: [-6e-2, 0, 0.04], bar_m: 3e-2, x_m: 0, y_m: 0, heading_rad: 0}\n"
    )
    (read,) = read_marks(path).marks
    np.testing.assert_array_equal(read.bars, [0.03, 0.03, 0.03])
    np.testing.assert_allclose(read.edges, [-0.06, -0.03, 0.0, 0.03, 0.04, 0.07], atol=1e-15)
    np.testing.assert_array_equal(read.polarity, [1, -1, 1, -1, 1, -1])


HEAD = "logpose: marks/1\nmarks:\n"
POSE = "x_m: 0, y_m: 0, heading_rad: 0"
EXAMPLE = "{{id: 1, lines_m: [..], bar_m: .., x_m: .., y_m: .., heading_rad: ..}}"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "{p}: is empty. Name a map of stripe marks, 'logpose: marks/1'."),
        ("# only a comment\n", "{p}: is empty. Name a map of stripe marks, 'logpose: marks/1'."),
        (HEAD, "{p}: the map has no marks. Give at least one."),
        (HEAD.strip() + " []\n", "{p}: the map has no marks. Give at least one."),
        ("just words\n", "{p}: is no map of stripe marks. It must begin with 'logpose: marks/1'."),
        ("marks: []\n", "{p}:1: key 'logpose' is missing. Write 'logpose: marks/1' into the first line."),
        (
            "frame: map\nlogpose: landmarks/1\n",
            "{p}:2: the file is 'landmarks/1', not 'marks/1'. Name a map of this version.",
        ),
        ("logpose: marks/1\n", "{p}: key 'marks' is missing. Give a list of marks."),
        ("logpose: marks/1\nframe: [a]\nmarks: []\n", "{p}:2: frame is ['a']. It must be a name."),
        (HEAD.strip() + " {a: 1}\n", "{p}:2: marks is no list. Give one entry each."),
        (HEAD + "- 5\n", "{p}: marks[0] is no mapping. Write " + EXAMPLE + "."),
        (
            HEAD + "- {id: 1, lines_m: [0, 1, 2], x_m: 1, y_m: 2}\n",
            "{p}:3: key 'heading_rad' is missing. Write " + EXAMPLE + ".",
        ),
        (HEAD + f"- {{id: 1, {POSE}}}\n", "{p}:3: key 'lines_m' is missing. Write " + EXAMPLE + "."),
        (
            HEAD + f"- id: 1\n  lines_m: [0, 1, 2]\n  bars_m: 0.1\n  {POSE.replace(', ', chr(10) + '  ')}\n",
            "{p}:5: a mark has no key 'bars_m'. Known keys: bar_m, heading_rad, height_m, id, lines_m, x_m, y_m.",
        ),
        (
            HEAD + f"- {{id: 1, lines_m: [0, 1, 2], {POSE}}}\n- {{id: 1, lines_m: [0, 1, 3], {POSE}}}\n",
            "{p}:4: id 1 stands twice (first in line 3). Give each mark its own.",
        ),
        (HEAD + f"- {{id: -1, lines_m: [0, 1, 2], {POSE}}}\n", "{p}:3: id is -1. It must be an integer from 0."),
        (HEAD + f"- {{id: left, lines_m: [0, 1, 2], {POSE}}}\n", "{p}:3: id is 'left'. It must be an integer from 0."),
        (
            HEAD + f"- {{id: 1, lines_m: [0, 1], {POSE}}}\n",
            "{p}:3: lines_m has 2 lines. A pose needs 3 at least.",
        ),
        (HEAD + f"- {{id: 1, lines_m: 3, {POSE}}}\n", "{p}:3: lines_m is 3, not a list. Write lines_m: [.., .., ..]."),
        (
            HEAD + f"- id: 1\n  lines_m: [-0.06, 0.04, 0.0]\n  {POSE.replace(', ', chr(10) + '  ')}\n",
            "{p}:4: lines_m does not increase: 0.0 follows 0.04. List the rising edges from left to right.",
        ),
        (
            HEAD + f"- {{id: 1, lines_m: [0, 0.1, 0.1], {POSE}}}\n",
            "{p}:3: lines_m does not increase: 0.1 follows 0.1. List the rising edges from left to right.",
        ),
        (
            HEAD + f"- {{id: 1, lines_m: [0, 1,\n  .nan], {POSE}}}\n",
            "{p}:4: lines_m is 'nan'. Every value must be finite; remove the line.",
        ),
        (
            HEAD + f"- {{id: 1, lines_m: [0, 1, .inf], {POSE}}}\n",
            "{p}:3: lines_m is 'inf'. Every value must be finite; remove the line.",
        ),
        (
            HEAD + f"- {{id: 1, lines_m: [0, one, 2], {POSE}}}\n",
            "{p}:3: lines_m is 'one', not a number. Correct or remove the line.",
        ),
        (
            HEAD + f"- {{id: 1, lines_m: [0, yes, 2], {POSE}}}\n",
            "{p}:3: lines_m is True, not a number. Correct or remove the mark.",
        ),
        (
            HEAD + f"- {{id: 1, lines_m: [-60, 0, 60], {POSE}}}\n",
            "{p}:3: the mark is 120 m wide. No mark is that large; the unit is metres.",
        ),
        (
            HEAD + f"- {{id: 1, lines_m: [0, 30, 60], bar_m: [10, 10, 50], {POSE}}}\n",
            "{p}:3: the mark is 110 m wide. No mark is that large; the unit is metres.",
        ),
        (
            HEAD + f"- {{id: 1, lines_m: [0, 0.1, 0.2], bar_m: [0.05, 0.05], {POSE}}}\n",
            "{p}:3: bar_m has 2 widths for 3 lines. Give one number, or one a line.",
        ),
        (
            HEAD + f"- {{id: 1, lines_m: [0, 0.1, 0.2], bar_m: 0, {POSE}}}\n",
            "{p}:3: bar_m is 0.0. It must be greater than 0.",
        ),
        (
            HEAD + f"- {{id: 1, lines_m: [0, 0.1, 0.2], bar_m: .nan, {POSE}}}\n",
            "{p}:3: bar_m is 'nan'. Every value must be finite; remove the line.",
        ),
        (
            HEAD + f"- {{id: 1, lines_m: [0, 0.1, 0.15], bar_m: 0.06, {POSE}}}\n",
            "{p}:3: the bar that begins at 0.1 m is 0.06 m wide and touches the line at 0.15 m. Make it narrower.",
        ),
        (
            HEAD + f"- {{id: 1, lines_m: [0, 0.5, 1], bar_m: 0.5, {POSE}}}\n",
            "{p}:3: the bar that begins at 0.0 m is 0.5 m wide and touches the line at 0.5 m. Make it narrower.",
        ),
        (
            HEAD + f"- {{id: 1, lines_m: [0, 0.1, 0.2], height_m: 0.0, {POSE}}}\n",
            "{p}:3: height_m is 0.0. It must be greater than 0 and at most 100 m.",
        ),
        (
            HEAD + f"- {{id: 1, lines_m: [0, 0.1, 0.2], height_m: 200, {POSE}}}\n",
            "{p}:3: height_m is 200.0. It must be greater than 0 and at most 100 m.",
        ),
        (
            HEAD + "- {id: 1, lines_m: [0, 0.1, 0.2], x_m: .inf, y_m: 0, heading_rad: 0}\n",
            "{p}:3: x_m is 'inf'. Every value must be finite; remove the line.",
        ),
        (
            HEAD + "- {id: 1, lines_m: [0, 0.1, 0.2], x_m: 0, y_m: 2.0e+12, heading_rad: 0}\n",
            "{p}:3: y_m is 2000000000000.0 m. No map is that large; the unit is metres.",
        ),
        (
            HEAD + "- {id: 1, lines_m: [0, 0.1, 0.2], x_m: 0, y_m: 0, heading_rad: -90}\n",
            "{p}:3: heading_rad is -90.0. It is at most one turn; the unit is radians.",
        ),
        (HEAD + "- {id: 0, id: 1}\n", "{p}:3: key 'id' stands twice. Remove one."),
        (HEAD + "- {id: 0\n", "{p}:3: is no YAML (expected ',' or '}}', but got '<stream end>'). Correct the line."),
    ],
)
def test_a_wrong_map_is_explained(tmp_path, text, message):
    path = tmp_path / "marks.yaml"
    path.write_text(text)
    with pytest.raises(FormatError) as caught:
        read_marks(path)
    assert str(caught.value) == message.format(p=path)


def test_a_missing_file_is_an_error():
    with pytest.raises(FormatError, match=r"^nowhere.yaml: no such file. Check the path.$"):
        read_marks("nowhere.yaml")


def marks_of(**changes):
    values = {"id": 4, "lines": LINES, "bars": None, "pose": np.zeros(3)} | changes
    return MarkMap(marks=(StripeMark(**values),))


@pytest.mark.parametrize(
    ("marks", "message"),
    [
        (MarkMap(marks=()), "{p}: the map has no marks. Give at least one."),
        (marks_of(id=-1), "{p}: mark -1: id is -1. It must be an integer from 0."),
        (
            MarkMap(marks=marks_of().marks * 2),
            "{p}: mark 4: the id stands twice. Give each mark its own.",
        ),
        (
            marks_of(lines=np.array([0.0, np.nan, 1.0])),
            "{p}: mark 4: lines_m does not increase: nan follows 0.0. List the rising edges from left to right.",
        ),
        (
            marks_of(bars=np.array([0.01, 0.01, 0.01, np.inf])),
            "{p}: mark 4: the bar that begins at 0.12 m is inf m wide and touches the line at inf m. Make it narrower.",
        ),
        (
            marks_of(pose=np.array([0.0, 0.0, np.nan])),
            "{p}: mark 4: heading_rad is nan. It is at most one turn; the unit is radians.",
        ),
        (marks_of(height=-1.0), "{p}: mark 4: height_m is -1.0. It must be greater than 0 and at most 100 m."),
    ],
)
def test_marks_that_could_not_be_read_back_are_not_written(tmp_path, marks, message):
    path = tmp_path / "marks.yaml"
    with pytest.raises(FormatError) as caught:
        write_marks(marks, path)
    assert str(caught.value) == message.format(p=path)
    assert list(tmp_path.iterdir()) == []


def test_marks_that_can_be_are_taken():
    check_marks(marks_of(bars=np.full(4, 0.03), height=0.3), "here")


@settings(max_examples=60, deadline=None)
@given(st.text(max_size=200))
def test_any_text_is_a_map_or_a_format_error(tmp_path_factory, text):
    path = tmp_path_factory.mktemp("fuzz") / "m"
    path.write_text(text, encoding="utf-8", errors="replace")
    try:
        read_marks(path)
    except FormatError as err:
        assert "\n" not in str(err)  # noqa: PT017
