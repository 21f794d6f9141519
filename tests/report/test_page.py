import re
from html.parser import HTMLParser

import pytest

from logpose.formats.events import Notice, Summary
from logpose.pipelines.report.contents import PICTURES, draw_picture
from logpose.pipelines.report.page import render_page

CEILING = {"map", "support", "errors", "passes", "sightings", "histogram"}
"""What a run with a ceiling has pictures of."""

VOID = {"meta", "br", "hr", "img", "link", "input"}


class Balance(HTMLParser):
    """Notes tags that are not closed, attributes that point outside, and identifiers."""

    def __init__(self):
        super().__init__()
        self.open, self.errors, self.ids, self.links, self.text = [], [], [], [], []

    def handle_starttag(self, tag, attrs):
        if tag not in VOID:
            self.open.append(tag)
        self.note(attrs)

    def handle_startendtag(self, tag, attrs):
        self.note(attrs)

    def note(self, attrs):
        self.ids += [value for name, value in attrs if name == "id"]
        self.links += [value for name, value in attrs if name in {"src", "href", "xlink:href"}]

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.errors.append((tag, self.getpos()))

    def handle_data(self, data):
        self.text.append(data)


def parse(page):
    parser = Balance()
    parser.feed(page)
    parser.close()
    return parser


@pytest.fixture(scope="module")
def page(findings):
    return render_page(findings, title="drive <1> & back")


def test_the_page_is_balanced_and_its_identifiers_are_unique(page):
    parser = parse(page)
    assert parser.errors == []
    assert parser.open == []
    assert len(parser.ids) == len(set(parser.ids))


def test_the_page_needs_nothing_else(page):
    assert all(link.startswith("#") for link in parse(page).links)
    assert not re.search(r"@import|url\((?!#)|<script|<link", page)


def test_the_same_run_gives_the_same_page(page, findings):
    assert render_page(findings, title="drive <1> & back") == page


def test_everything_from_outside_is_escaped(page):
    assert "<title>drive &lt;1&gt; &amp; back</title>" in page
    assert "<b>landmarks</b>" not in page
    assert "&lt;b&gt;landmarks&lt;/b&gt;" in page
    assert "drive & return.mcap" in "".join(parse(page).text)


def test_names_of_topics_and_notices_cannot_break_the_page(collect, make):
    evil = '</td><script>alert("1")</script>'
    events = [make.pose(1, 0.0, 0.0, 0.0, evil, status=evil), make.pose(2, 1.0, 0.0, 0.0, evil, status=evil)]
    events += [Notice(stamp=2, source=evil, code=evil, message=evil), make.sightings(1, [[0, 0]], source=evil)]
    events += [Summary(stamp=2, source=evil, values={evil: evil})]
    page = render_page(collect(events), title=evil)
    assert "<script" not in page
    assert parse(page).errors == []


def test_all_pictures_and_tables_are_there(page, findings):
    pictures = [picture for picture in PICTURES if picture.name in CEILING]
    assert re.findall(r'<svg role="img" aria-label="([^"]*)"', page) == [picture.title for picture in pictures]
    for words in ("Way points", "Results", "Messages", "Parameters", "Made from", "standard deviation"):
        assert words in page
    for picture in pictures:
        assert picture.caption(findings)


def test_the_waypoint_table_has_mean_and_standard_deviation(page, findings):
    import statistics

    distances = [point.distance for point in findings.waypoints]
    rows = [re.findall(r"<td[^>]*>([^<]*)</td>", row) for row in re.findall(r'<tr class="sum">.*?</tr>', page)]
    assert [row[-1] for row in rows] == [f"{statistics.mean(distances):.4f}", f"{statistics.stdev(distances):.4f}"]


def test_no_timing_reaches_the_page(collect, make):
    values = {"stages": [{"name": "x", "seconds": 12.345}], "inputs": ["a.mcap"]}
    assert "12.345" not in render_page(collect([make.pose(1, 0, 0, 0), Summary(stamp=1, source="run", values=values)]))


def test_runs_at_the_limits_have_a_page(collect, odd_runs, landmarks):
    for name, events in odd_runs.items():
        for known in (None, landmarks) if name in {"empty", "east"} else (None,):
            parser = parse(render_page(collect(events, known), title=name))
            assert parser.errors == [], name


def test_a_waypoint_that_was_not_passed_is_a_dash(collect, make):
    lost = {"name": "W1", "x_m": 1.0, "y_m": 2.0, "estimate_x_m": None, "dx_m": None, "dy_m": None, "distance_m": None}
    page = render_page(
        collect([make.pose(1, 0, 0, 0), Summary(stamp=1, source="evaluation", values={"waypoints": [lost]})])
    )
    assert '<td>W1</td><td class="number">1.000</td><td class="number">2.000</td><td>–</td>' in page


@pytest.mark.parametrize("fmt", ["png", "svg"])
def test_a_picture_can_stand_alone(findings, fmt):
    drawn = draw_picture(findings, "headline", fmt)
    assert drawn == draw_picture(findings, "headline", fmt)
    assert drawn.startswith(b"\x89PNG" if fmt == "png" else b"<?xml")


def test_a_picture_of_nothing_is_refused(collect):
    with pytest.raises(ValueError, match="the run has nothing for the picture 'errors'"):
        draw_picture(collect([]), "errors", "svg")
    with pytest.raises(ValueError, match="there is no pose to draw"):
        draw_picture(collect([]), "headline", "svg")
