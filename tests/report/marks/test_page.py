"""The page of a run with stripe marks: its sentence, its tables, its pictures."""

import re
from html.parser import HTMLParser

import numpy as np
import pytest

from logpose.formats.errors import FormatError
from logpose.formats.events import Summary
from logpose.formats.maps.marks import write_marks
from logpose.formats.products import MarkMap
from logpose.pipelines.report.contents import PICTURES, draw_picture
from logpose.pipelines.report.marks.kept import MarkFindings
from logpose.pipelines.report.page import render_page
from logpose.pipelines.report.stage import WritePictureParams, WriteReportParams, write_picture, write_report
from logpose.pipelines.report.verdict import verdict

NAMES = ["map", "images", "support", "strip", "errors", "distance"]


class Links(HTMLParser):
    def __init__(self):
        super().__init__()
        self.found, self.ids = [], []

    def handle_starttag(self, tag, attrs):
        self.found += [value for name, value in attrs if name in {"src", "href", "xlink:href"}]
        self.ids += [value for name, value in attrs if name == "id"]

    handle_startendtag = handle_starttag


@pytest.fixture(scope="module")
def page(mark_findings):
    return render_page(mark_findings, title="a room")


def table_of(page, heading):
    """Return the rows of the table under a heading, or with a caption."""
    start = page.index(heading)
    body = page[start : page.index("</table>", start)]
    return [re.findall(r"<t[hd][^>]*>([^<]*)</t[hd]>", row) for row in re.findall(r"<tr.*?</tr>", body)]


def test_all_pictures_of_marks_are_there_in_the_order_of_the_table(page):
    titles = [picture.title for picture in PICTURES if picture.name in NAMES]
    assert re.findall(r'<svg role="img" aria-label="([^"]*)"', page) == titles


def test_every_picture_has_a_caption(mark_findings):
    for picture in PICTURES:
        if picture.name in NAMES:
            assert picture.caption(mark_findings).endswith(".") or picture.caption(mark_findings).endswith("?")


def test_the_page_needs_nothing_else_and_its_identifiers_are_unique(page):
    links = Links()
    links.feed(page)
    assert all(link.startswith(("#", "data:image/jpeg;base64,")) for link in links.found)
    assert len(links.ids) == len(set(links.ids))
    assert not re.search(r"@import|url\((?!#)|<script|<link", page)


def test_the_table_of_marks_counts_every_image_once_per_mark(page, mark_findings):
    marks = mark_findings.of(MarkFindings)
    head, *rows = table_of(page, "<h2>Marks</h2>")
    assert head[:4] == ["mark", "images", "ok", "no_mark"]
    assert [row[0] for row in rows] == ["1", "2", "3", "4", "7", "none", "all"]
    for row in rows[:4]:
        assert row[1] == row[2] == str(int((marks.mark == int(row[0])).sum()))
    assert rows[-1][1] == "240"
    assert rows[4][1:5] == ["0", "0", "0", "–"]
    is_third = marks.mark == 3
    assert rows[2][4] == f"{marks.distance[is_third].min():.2f}"
    assert rows[2][6] == f"{np.degrees(np.abs(marks.pose[is_third, 0]).max()):.1f}"
    assert rows[2][8] == f"{np.median(marks.residual[is_third]):.3f}"


def test_what_the_stage_summed_up_is_shown_with_lists_as_tables(page, mark_findings):
    rows = table_of(page, "<caption>stripe-pose</caption>")
    counts = mark_findings.results["stripe-pose"]["status"]
    assert ["status.ok", str(counts["ok"]), ""] in rows
    assert not any("marks" in row[0] for row in rows)
    assert table_of(page, "<caption>stripe-pose: marks</caption>")[:2] == [["id", "farthest_m [m]"], ["1", "1.5"]]


def test_a_list_of_one_entry_per_message_is_not_shown(collect, marked):
    end = Summary(stamp=1, source="poses", values=[{"mark": 1}])
    assert "poses<" not in render_page(collect([marked.sighting(1), end]))


def test_ceiling_and_marks_of_one_run_are_both_shown(collect, make, marked):
    events = [make.sightings(i * 10**8, [[0, 0]]) for i in range(3)]
    events += [marked.sighting(i * 10**8) for i in range(3)]
    page = render_page(collect(sorted(events, key=lambda event: event.stamp)))
    for title in ("Landmarks per image", "What each image had to go by"):
        assert title in page


# ---- the sentence ---------------------------------------------------------------------------------------------


def test_the_sentence_of_a_drive_with_odometry_and_truth(mark_findings):
    assert re.fullmatch(
        r"stripe-pose estimated 240 poses over 23\.9 s and 7\.4 m of way; against the truth it is [\d.]+ cm off "
        r"\(RMSE; at most [\d.]+ c?m\) and [\d.]+° in heading; 4 of 5 marks were recognised, in \d+ of 240 images; "
        r"odometry alone bridged [\d.]+ s at most\.",
        verdict(mark_findings),
    )


def test_the_sentence_without_odometry_and_truth(collect, marked):
    events = list(marked.drive(80, with_images=False, with_odometry=False, with_truth=False))
    n = sum(getattr(event, "status", "") == "ok" for event in events)
    assert verdict(collect(events, None, marked.room())) == (
        f"stripe-pose estimated {n} poses over 7.9 s; the truth is not known, so neither is the error; "
        f"4 of 5 marks were recognised, in {n} of 80 images."
    )


@pytest.fixture
def one(marked):
    return marked.mark(3, 0.0, 0.0, 180.0), np.array([0.3, 0.1, 1.2])


def test_the_sentence_of_a_single_image(collect, marked, one):
    event = marked.sighting(1, *one)
    events = [event, marked.pose(1, event.robot, "stripe-pose")]
    assert verdict(collect(events, None, MarkMap(marks=one[:1]))) == (
        "stripe-pose estimated one pose; the truth is not known, so neither is the error; "
        "mark 3 was recognised in the only image."
    )


def test_the_sentence_where_nothing_was_recognised(collect, marked, one):
    assert verdict(collect([marked.sighting(1)])) == (
        "No pose was estimated; no mark was recognised in the only image."
    )
    events = [marked.sighting(i, *one, "poor_geometry") for i in range(3)]
    assert verdict(collect(events)) == "No pose was estimated; no mark was recognised in 3 images."


def test_an_assumed_identity_is_told(collect, marked, one):
    events = [marked.sighting(i, *one, "unverified") for i in range(3)]
    events += [marked.pose(event.stamp, event.robot, "stripe-pose") for event in events]
    found = verdict(collect(sorted(events, key=lambda event: event.stamp)))
    assert found.endswith("; no mark was recognised in 3 images; which mark it is was assumed in 3 of 3 images.")


# ---- the stages -----------------------------------------------------------------------------------------------


def test_write_report_reads_the_marks_and_forwards_everything(tmp_path, marked):
    write_marks(marked.room(), tmp_path / "marks.yaml")
    params = WriteReportParams(path=str(tmp_path / "report.html"), marks=str(tmp_path / "marks.yaml"))
    events = list(marked.drive(30, with_images=False))
    assert list(write_report(iter(events), params)) == events
    assert "mark, never recognised" in (tmp_path / "report.html").read_text()


def test_marks_that_are_missing_are_told_before_the_log_is_read(tmp_path):
    def never():
        pytest.fail("the log was read")
        yield

    for stage, params in ((write_report, WriteReportParams), (write_picture, WritePictureParams)):
        with pytest.raises(FormatError):
            next(stage(never(), params(path=str(tmp_path / "a.svg"), marks=str(tmp_path / "no.yaml"))))


@pytest.mark.parametrize("name", ["images", "strip"])
def test_a_picture_of_marks_can_stand_alone(mark_findings, name):
    assert draw_picture(mark_findings, name, "png").startswith(b"\x89PNG")


def test_a_run_without_marks_has_no_picture_of_them(findings):
    for name in ("images", "strip", "distance"):
        with pytest.raises(ValueError, match=f"the run has nothing for the picture '{name}'"):
            draw_picture(findings, name, "svg")
