import json
from pathlib import Path

import numpy as np
import pytest

from logpose.formats.errors import ConfigError, ExitStatus, StageError
from logpose.formats.events import Image, Odometry
from logpose.formats.write_log import create_log
from logpose.pipelines.engine.document import parse_document
from logpose.pipelines.engine.report import report_json
from logpose.pipelines.engine.run import Request, run

PIPELINE = """\
logpose: 1
topics: {image: auto, odometry: auto}
stages:
  - square: {add: 1}
  - count
"""


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "drive.mcap"
    with create_log(path) as writer:
        for i in range(20):
            stamp = (i + 1) * 100_000_000
            writer.write(
                Image(
                    stamp=stamp,
                    topic="/cam",
                    frame_id="cam",
                    encoding="mono8",
                    data=np.zeros(4 * 3, np.uint8),
                    width=4,
                    height=3,
                    step=4,
                )
            )
            writer.write(
                Odometry(stamp=stamp, topic="/odom", frame_id="odom", linear=np.array([0.1, 0, 0]), angular=np.zeros(3))
            )
    return path


def request(log, out, text=PIPELINE, **kwargs):
    return Request(command=["run"], document=parse_document(text, "p.yaml", Path()), logs=[str(log)], out=out, **kwargs)


def test_a_run_counts_what_it_read_and_leaves_its_pipeline_and_report(stages, log, tmp_path):
    result = run(request(log, tmp_path / "out"), stages.TABLE)
    assert result.status is ExitStatus.DONE
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["report.json", "run.yaml"]
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["schema"] == "logpose.report/1"
    assert report["messages"]["/cam"] == {"announced": 20, "read": 20, "used": 20, "dropped": 0, "why": {}}
    assert [(s["name"], s["events_in"], s["events_out"]) for s in report["stages"]] == [
        ("read", 0, 41),
        ("square", 41, 61),
        ("count", 61, 82),
    ]
    assert report["inputs"][0]["path"] == str(log)
    assert report["peak_memory_mib"] > 10
    assert json.loads(report_json(result, ["run"]))["topics"] == {"image": "/cam", "odometry": "/odom"}


def test_the_pipeline_left_behind_gives_the_same_run_again(stages, log, tmp_path):
    run(request(log, tmp_path / "a"), stages.TABLE)
    text = (tmp_path / "a" / "run.yaml").read_text()
    run(request(log, tmp_path / "b", text), stages.TABLE)
    assert (tmp_path / "b" / "run.yaml").read_text() == text


def test_a_run_to_standard_output_leaves_nothing(stages, log, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.iterdir())
    run(request(log, None), stages.TABLE)
    assert sorted(tmp_path.iterdir()) == before


def test_a_role_can_be_left_out(stages, log, tmp_path):
    text = PIPELINE.replace("image: auto", "image: none")
    result = run(request(log, tmp_path / "out", text), stages.TABLE)
    assert set(result.log.counts) == {"/odom"}


def test_no_log_and_a_failing_stage_leave_no_folder(stages, log, tmp_path):
    with pytest.raises(ConfigError, match=r"p\.yaml: no log given\. Name a bag, an MCAP file or a folder of images\."):
        run(
            Request(command=[], document=parse_document(PIPELINE, "p.yaml", Path()), logs=[], out=tmp_path / "o"),
            stages.TABLE,
        )
    bad = tmp_path / "bad.mcap"
    with create_log(bad) as writer:
        writer.write(Odometry(stamp=666, topic="/odom", linear=np.zeros(3), angular=np.zeros(3)))
    with pytest.raises(StageError, match="the odometer says nan"):
        run(request(bad, tmp_path / "o"), stages.TABLE)
    assert not (tmp_path / "o").exists()


def test_lost_messages_make_the_status_loss(stages, log, tmp_path):
    data = log.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: int(len(data) * 0.3)])  # within the only chunk
    result = run(request(cut, tmp_path / "out"), stages.TABLE)
    assert result.status is ExitStatus.LOSS
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["status"] == "loss"
    assert "cut off" in report["problems"][0]


def test_a_pipeline_that_names_no_topic_is_a_mistake(stages, log, tmp_path):
    text = PIPELINE.replace("topics: {image: auto, odometry: auto}\n", "")
    with pytest.raises(ConfigError) as caught:
        run(request(log, tmp_path / "out", text), stages.TABLE)
    assert str(caught.value) == ("p.yaml: no topics to read. Add 'topics: {image: auto, odometry: auto}' or --topic.")
