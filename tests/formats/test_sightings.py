import io
import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logpose.formats.errors import FormatError
from logpose.formats.events import NO_ID, Sightings
from logpose.formats.sightings import (
    HEADER,
    read_sightings,
    sightings_from_json,
    sightings_line,
    sightings_to_json,
    write_sightings,
)

NUMBER = st.floats(allow_nan=False, allow_infinity=False, width=64)
OPTIONAL = NUMBER | st.just(math.nan)


@st.composite
def covariances(draw):
    a, b = draw(st.floats(0, 1e3)), draw(st.floats(0, 1e3))
    c = draw(st.floats(-0.99, 0.99)) * math.sqrt(a) * math.sqrt(b)
    return [[a, c], [c, b]]


@st.composite
def events(draw):
    n = draw(st.integers(0, 4))

    def column(strategy):
        return np.array(draw(st.lists(strategy, min_size=n, max_size=n)))

    return Sightings(
        stamp=draw(st.integers(0, 2**63 - 1)),
        source="sightings",
        frame_id=draw(st.sampled_from(["base_link", "robot 1", "über"])),
        xy=column(st.tuples(NUMBER, NUMBER)).reshape(-1, 2),
        cov=column(covariances()).reshape(-1, 2, 2),
        uv=column(st.tuples(OPTIONAL, OPTIONAL)).reshape(-1, 2),
        radius=column(OPTIONAL).astype(float),
        score=column(OPTIONAL).astype(float),
        ids=column(st.integers(-1, 2**40)).astype(np.int64),
    )


def one(stamp=5, **changes):
    values = {
        "xy": np.array([[1.0, 2.0]]),
        "cov": np.array([[[0.01, 0.002], [0.002, 0.04]]]),
        "uv": np.array([[320.5, 240.25]]),
        "radius": np.array([12.0]),
        "score": np.array([0.9]),
        "ids": np.array([NO_ID]),
    }
    return Sightings(stamp=stamp, frame_id="base_link", **(values | changes))


@given(events())
def test_a_line_gives_the_event_back_bit_by_bit(event):
    back = sightings_from_json(json.loads(sightings_line(event)))
    assert (back.stamp, back.source, back.frame_id) == (event.stamp, event.source, event.frame_id)
    for name in ("xy", "cov", "uv", "radius", "score", "ids"):
        np.testing.assert_array_equal(getattr(back, name), getattr(event, name), strict=True)


def test_the_line_is_laid_out_as_documented():
    assert sightings_to_json(one(radius=np.array([math.nan]))) == {
        "stamp_ns": 5,
        "frame_id": "base_link",
        "sightings": [
            {
                "x_m": 1.0,
                "y_m": 2.0,
                "cov_m2": [0.01, 0.002, 0.04],
                "u_px": 320.5,
                "v_px": 240.25,
                "radius_px": None,
                "score": 0.9,
                "id": None,
            }
        ],
    }
    assert sightings_to_json(one(ids=np.array([7])))["sightings"][0]["id"] == 7


def test_nan_is_never_written():
    line = sightings_line(one(uv=np.full((1, 2), np.nan), radius=np.array([np.inf]), score=np.array([np.nan])))
    assert "nan" not in line.lower()
    assert "inf" not in line.lower()


def test_a_file_has_a_header_and_a_line_also_for_an_empty_image(tmp_path):
    empty = sightings_from_json({"stamp_ns": 9, "frame_id": "base_link", "sightings": []})
    path = tmp_path / "s.jsonl"
    assert write_sightings([one(5), empty], path) == 2
    lines = path.read_text().splitlines()
    assert lines[0] + "\n" == HEADER == '{"logpose": "sightings/1"}\n'
    assert len(lines) == 3
    back = list(read_sightings(path))
    assert [e.stamp for e in back] == [5, 9]
    assert back[1].xy.shape == (0, 2)
    assert back[1].cov.shape == (0, 2, 2)
    assert back[1].ids.dtype == np.int64


def test_the_header_may_be_missing(tmp_path):
    path = tmp_path / "s.jsonl"
    path.write_text(sightings_line(one(5)))
    assert [e.stamp for e in read_sightings(path)] == [5]


def test_standard_input_is_read_line_by_line(monkeypatch):
    taken = []

    def lines():
        for text in (HEADER, sightings_line(one(1)), sightings_line(one(2))):
            taken.append(text)
            yield text

    monkeypatch.setattr("sys.stdin", lines())
    stream = read_sightings("-")
    assert next(stream).stamp == 1
    assert len(taken) == 2  # the third line has not been asked for yet


def test_an_error_on_standard_input_names_the_line(monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO("{}\n"))
    with pytest.raises(FormatError, match=r"^<stdin>:1: stamp_ns is None"):
        list(read_sightings("-"))


ROW = '{"x_m": 1, "y_m": 2, "cov_m2": [1, 0, 1]}'


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("[1]", "is list, not an object. Write one JSON object per line."),
        ("{oops", "is no JSON (Expecting property name enclosed in double quotes). Correct or remove the line."),
        ('{"stamp_ns": 1.5, "sightings": []}', "stamp_ns is 1.5. It must be integer nanoseconds."),
        ('{"stamp_ns": 1}', "has no list 'sightings'. Write an empty list where nothing was seen."),
        (
            '{"stamp_ns": 1, "sightings": [{"x_m": NaN, "y_m": 2, "cov_m2": [1, 0, 1]}]}',
            "is no JSON (NaN is not allowed, missing numbers are null). Correct or remove the line.",
        ),
        (
            '{"stamp_ns": 1, "sightings": [{"x_m": null, "y_m": 2, "cov_m2": [1, 0, 1]}]}',
            "sightings[0]: x_m is None, not a number. Correct or remove the sighting.",
        ),
        (
            '{"stamp_ns": 1, "sightings": [{"x_m": 1e999, "y_m": 2, "cov_m2": [1, 0, 1]}]}',
            "sightings[0]: x_m is not finite. Correct or remove the sighting.",
        ),
        (
            '{"stamp_ns": 1, "sightings": [{"x_m": 1, "y_m": 2, "cov_m2": [1, 0]}]}',
            "sightings[0]: cov_m2 is [1, 0]. It must be [xx, xy, yy].",
        ),
        (
            '{"stamp_ns": 1, "sightings": [{"x_m": 1, "y_m": 2, "cov_m2": [1, 2, 1]}]}',
            "sightings[0]: cov_m2 [1, 2, 1] is no covariance. Its determinant must not be negative.",
        ),
        (
            '{"stamp_ns": 1, "sightings": [' + ROW[:-1] + ', "id": -1}]}',
            "sightings[0]: id is -1. It must be null or an integer from 0.",
        ),
        (
            '{"logpose": "sightings/2"}',
            "the file is 'sightings/2', not 'sightings/1'. Convert it first.",
        ),
    ],
)
def test_a_wrong_line_is_named_with_its_cure(tmp_path, line, message):
    path = tmp_path / "s.jsonl"
    path.write_text('{"stamp_ns": 0, "sightings": []}\n' + line + "\n")
    with pytest.raises(FormatError) as caught:
        list(read_sightings(path))
    where, _, rest = str(caught.value).partition(": ")
    assert where == f"{path}:2"
    assert rest == message


def test_stamps_that_go_back_are_refused_and_equal_ones_are_not(tmp_path):
    path = tmp_path / "s.jsonl"
    write_sightings([one(5), one(5)], path)
    assert len(list(read_sightings(path))) == 2
    write_sightings([one(5), one(4)], path)
    with pytest.raises(FormatError, match=r":3: stamp_ns 4 comes after 5. Sort the lines by time."):
        list(read_sightings(path))


def test_a_missing_file_is_an_error():
    with pytest.raises(FormatError, match=r"^nowhere.jsonl: no such file. Check the path.$"):
        list(read_sightings("nowhere.jsonl"))


@settings(max_examples=60, deadline=None)
@given(st.binary(max_size=200))
def test_any_bytes_are_events_or_a_format_error(tmp_path_factory, data):
    path = tmp_path_factory.mktemp("fuzz") / "s.jsonl"
    path.write_bytes(data)
    try:
        list(read_sightings(path))
    except FormatError as err:
        assert "\n" not in str(err)  # noqa: PT017
