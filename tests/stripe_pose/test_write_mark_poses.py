"""The stage that writes ``poses.jsonl``."""

import json

import numpy as np
import pytest

from logpose.formats.errors import ConfigError
from logpose.formats.events import NO_ID, MarkSighting, Notice, Summary
from logpose.formats.mark_poses import mark_pose_line, read_mark_poses
from logpose.pipelines.write import WriteMarkPosesParams, write_mark_poses


def sighting(stamp, mark=1, source="stripe-pose"):
    is_seen = mark != NO_ID
    return MarkSighting(
        stamp=stamp,
        source=source,
        frame_id="map",
        mark=mark,
        status="ok" if is_seen else "no_mark",
        pose=np.array([0.1, 0.2, 1.0]) if is_seen else np.full(3, np.nan),
        cov=np.eye(3) if is_seen else np.full((3, 3), np.nan),
        attitude=np.zeros(2),
        robot=np.full(3, np.nan),
        robot_cov=np.full((3, 3), np.nan),
        row=10.0,
        lines=np.full((3, 5), 1.5) if is_seen else np.empty((0, 5)),
        members=np.arange(3 if is_seen else 0),
    )


def run(events, path, **params):
    return list(write_mark_poses(iter(events), WriteMarkPosesParams(path=str(path), source="stripe-pose", **params)))


def test_every_event_goes_on_and_each_sighting_is_a_line(tmp_path):
    path = tmp_path / "poses.jsonl"
    events = [sighting(1), Notice(stamp=2, code="a", message="b"), sighting(3, NO_ID), sighting(3, source="other")]
    assert run(events, path) == events
    assert [(s.stamp, s.mark) for s in read_mark_poses(path)] == [(1, 1), (3, NO_ID)]


def test_the_report_holds_the_lines_without_their_edges_if_it_is_asked_to(tmp_path):
    *_, summary = run([sighting(1), sighting(3, NO_ID)], tmp_path / "p", in_report=True)
    assert isinstance(summary, Summary)
    assert (summary.source, summary.stamp) == ("poses", 3)
    lines = [json.loads(mark_pose_line(s)) for s in (sighting(1), sighting(3, NO_ID))]
    assert [{**line, "edges": 0} for line in lines] == [{**value, "edges": 0} for value in summary.values]
    assert not any("edges" in value for value in summary.values)


def test_a_stream_is_summed_up_by_nobody(capsys):
    assert [type(e) for e in run([sighting(1)], "-", in_report=True)] == [MarkSighting]
    assert capsys.readouterr().out == '{"logpose": "mark-poses/1"}\n' + mark_pose_line(sighting(1))


@pytest.mark.parametrize("path", ["-", "FILE"])
def test_a_log_without_images_is_no_result(tmp_path, path, capsys):
    target = tmp_path / "poses.jsonl" if path == "FILE" else path
    with pytest.raises(ConfigError) as error:
        run([Notice(stamp=2, code="a", message="b")], target)
    assert str(error.value) == (
        "stripe-pose: there are no images in this log, or in this part of it. "
        "Name their topic with --topic image=/NAME."
    )
    assert capsys.readouterr().out == ""
    assert list(tmp_path.iterdir()) == []
