"""What a user of ``logpose run`` types and gets: pipeline files, what is laid over them, and time windows."""

import json
from pathlib import Path

import pytest
import yaml

from logpose.formats.trajectories.trajectory import read_trajectory
from logpose.pipelines.catalog import PIPELINES, STAGES

T0 = 1451606400_000000000
PIPELINE = """\
logpose: 1
topics: {image: auto, camera_info: auto, odometry: auto, initial_pose: auto}
stages:
  - detect-circles: {map: maps/landmarks.yaml}
  - localize-pf:
      map: maps/landmarks.yaml
      particles: 150
  - write-trajectory: {source: localize-pf, path: found/trajectory.tum}
"""


@pytest.fixture
def pipeline(landmarks, tmp_path):
    """A pipeline file in a folder of its own, the map it names beside it."""
    folder = tmp_path / "setup"
    (folder / "maps").mkdir(parents=True)
    (folder / "maps" / "landmarks.yaml").write_bytes(landmarks.read_bytes())
    path = folder / "p.yaml"
    path.write_text(PIPELINE)
    return path


@pytest.fixture
def shown(logpose, drive, landmarks):
    """The pipeline that would run, as YAML."""

    def show(*words):
        done = logpose("localize-pf", drive, "--map", landmarks, "--show-pipeline", *words)
        assert done.status == 0, done.err
        return done.out

    return show


def test_files_are_relative_to_the_pipeline_file_and_results_to_the_run_folder(
    logpose, pipeline, drive, tmp_path, monkeypatch
):
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    done = logpose("run", "../setup/p.yaml", drive, "-q", "-o", "../out")
    assert done.status == 0, done.err
    found = sorted(p.relative_to(tmp_path / "out").as_posix() for p in (tmp_path / "out").rglob("*") if p.is_file())
    assert found == ["found/trajectory.tum", "report.json", "run.yaml"]
    assert len(read_trajectory(tmp_path / "out/found/trajectory.tum")) == 35
    text = (tmp_path / "out/run.yaml").read_text()
    assert text.count("map: ../setup/maps/landmarks.yaml") == 2
    assert "path: found/trajectory.tum" in text


def test_a_bundled_pipeline_runs_by_its_name(logpose, drive, landmarks, tmp_path):
    words = ("--set", f"detect-circles.map={landmarks}", "--duration", "0.3", "-q")
    assert logpose("run", "detect-circles", drive, *words, "-o", tmp_path / "out").status == 0
    assert len((tmp_path / "out" / "sightings.jsonl").read_text().splitlines()) == 1 + 3


def test_the_schema_knows_every_stage_and_fits_the_bundled_pipelines(logpose):
    done = logpose("run", "--schema")
    assert (done.status, done.err) == (0, "")
    schema = json.loads(done.out)
    choices = schema["properties"]["stages"]["items"]["anyOf"]
    assert choices[0]["enum"] == sorted(STAGES)
    stages = {name: item["properties"][name] for item in choices[1:] for name in item["properties"]}
    assert stages.keys() == STAGES.keys()
    for name, stage in stages.items():
        for key, value in stage["properties"].items():
            assert value.get("description"), f"{name}.{key} has no description"
    for text in [PIPELINE, *(path.read_text() for path in PIPELINES.values())]:
        check(yaml.safe_load(text), schema, stages)


def check(document, schema, stages):
    """What a validator does, for the part of JSON schema that pipelines use."""
    assert set(schema["required"]) <= document.keys() <= schema["properties"].keys()
    assert document["logpose"] == schema["properties"]["logpose"]["const"]
    assert all(isinstance(topic, str) for topic in document["topics"].values())
    for item in document["stages"]:
        if isinstance(item, str):
            assert item in stages
            continue
        ((name, values),) = item.items()
        known = stages[name]
        assert known["additionalProperties"] is False
        for key, value in values.items():
            assert fits(value, known["properties"][key]), f"{name}.{key} = {value!r}"


def fits(value, form):
    if "anyOf" in form:
        return any(fits(value, choice) for choice in form["anyOf"])
    if "enum" in form:
        return value in form["enum"]
    kinds = {"string": str, "integer": int, "number": (int, float), "boolean": bool, "array": list, "null": type(None)}
    return isinstance(value, kinds[form["type"]])


@pytest.mark.parametrize(
    ("line", "wrong", "message"),
    [
        (
            4, "  - detect-circels: {map: maps/landmarks.yaml}",
            "no stage 'detect-circels'. Did you mean 'detect-circles'?",
        ),
        (
            4, "  - detect-circles: {map: maps/landmarks.yaml, min_radus_px: 3}",
            "detect-circles has no parameter 'min_radus_px'. Did you mean 'min_radius_px'?",
        ),
        (
            7, "      particles: 0",
            "localize-pf cannot take particles = 0: input should be greater than",
        ),
        (
            7, "      particles: many",
            "localize-pf cannot take particles = 'many': input should be a valid integer",
        ),
        (
            7, "      workers: 4",
            "localize-pf takes no workers, it keeps state from message to message. Remove it.",
        ),
        (4, "  - detect-circles: 3", "parameters of detect-circles are no mapping. Write '- detect-circles: {key: value}'."),
        (
            8, "  - write-trajectory",
            "write-trajectory needs 'source': name of the estimator whose poses are written. "
            "Give it with --set write-trajectory.source=VALUE.",
        ),
        (2, "topics: {image: 3}", "topic of 'image' is 3. Give a topic name, 'auto' or 'none'."),
        (1, "logpose: 2", "not a pipeline file of version 1. Its first line must be 'logpose: 1'."),
        (3, "stagse:", "unknown key 'stagse'. A pipeline file has logpose, topics and stages."),
    ],
)  # fmt: skip
def test_an_error_names_the_line_of_the_file(logpose, pipeline, drive, tmp_path, line, wrong, message):
    lines = PIPELINE.splitlines()
    lines[line - 1] = wrong
    pipeline.write_text("\n".join(lines))
    done = logpose("run", pipeline, drive, "-q", "-o", tmp_path / "out")
    assert done.err.startswith(f"{pipeline}:{line}: {message}"), done.err
    assert done.err.count("\n") == 1
    assert (done.status, done.out) == (2, "")
    assert not (tmp_path / "out").exists()


def test_a_map_that_is_not_there_is_named_where_it_was_looked_for(logpose, pipeline, drive, tmp_path):
    (pipeline.parent / "maps" / "landmarks.yaml").unlink()
    done = logpose("run", pipeline, drive, "-q", "-o", tmp_path / "out")
    assert done.status == 1
    assert done.err == f"{pipeline.parent}/maps/landmarks.yaml: no such file. Check the path.\n"


def test_a_flag_wins_over_a_file_and_a_file_over_the_bundled_value(shown, tmp_path):
    over = tmp_path / "over.yaml"
    over.write_text("logpose: 1\nstages:\n  - localize-pf: {particles: 111}\n  - write-report: {title: mine}\n")
    again = tmp_path / "again.yaml"
    again.write_text("logpose: 1\ntopics: {odometry: /odom}\nstages:\n  - localize-pf: {particles: 222}\n")
    bundled = shown()
    assert "particles: 111" not in bundled
    assert "title: logpose report" in bundled
    assert "particles: 111" in shown("-c", over)
    assert "title: mine" in shown("-c", over), "what the file does not mention stays, what it does counts"
    assert "interpolate: true" in shown("-c", over), "the bundled value stays where the file is silent"
    assert "particles: 222" in shown("-c", over, "-c", again), "the later file wins"
    assert "odometry: /odom" in shown("-c", again)
    assert "particles: 333" in shown("-c", over, "--set", "localize-pf.particles=333")
    assert "odometry: none" in shown("-c", again, "--topic", "odometry=none")


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("logpose: 1\nstages:\n  - localise-pf: {particles: 3}\n", 3, "localize_pf.yaml has no stage 'localise-pf'. "
         "Did you mean 'localize-pf'?"),
        ("logpose: 1\nstages:\n  - localize-pf:\n      particels: 3\n", 4, "localize-pf has no parameter 'particels'. "
         "Did you mean 'particles'?"),
    ],
)  # fmt: skip
def test_an_error_in_a_file_laid_over_names_that_file(logpose, drive, landmarks, tmp_path, text, line, message):
    over = tmp_path / "over.yaml"
    over.write_text(text)
    done = logpose("localize-pf", drive, "--map", landmarks, "-c", over, "-q", "-o", tmp_path / "out")
    assert (done.status, done.err) == (2, f"{over}:{line}: {message}\n")


def test_a_file_laid_over_finds_its_own_files_beside_it(shown, landmarks, tmp_path):
    over = tmp_path / "over.yaml"
    over.write_text("logpose: 1\nstages:\n  - evaluate: {waypoints: points.yaml}\n")
    line = next(line for line in shown("-c", over).splitlines() if "points.yaml" in line)
    assert Path(line.split(": ")[1]).resolve() == tmp_path / "points.yaml"


@pytest.fixture
def read_stamps(logpose, drive, landmarks):
    """Stamps of the images that were used, in seconds from the first message."""

    def run(*words):
        done = logpose("detect-circles", drive, "--map", landmarks, "-q", "-o", "-", *words)
        assert done.status == 0, done.err
        return [(json.loads(line)["stamp_ns"] - T0) / 1e9 for line in done.out.splitlines()[1:]]

    return run


@pytest.mark.parametrize(
    ("words", "stamps"),
    [
        (["--start", "3.9"], [4.0, 4.125, 4.25]),
        (["--end", "0.25"], [0.0, 0.125]),
        (["--start", "1", "--duration", "0.25"], [1.0, 1.125]),
        (["--start", "1", "--end", "1.2"], [1.0, 1.125]),
        (["--start", str(T0 + 10**9), "--end", f"{T0 + 1_125_000_000}ns"], [1.0]),
        (["--start", "1451606404", "--duration", "0.2"], [4.0, 4.125]),
    ],
)
def test_a_window_is_half_open_and_takes_seconds_or_stamps(read_stamps, words, stamps):
    assert read_stamps(*words) == stamps


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["--start", "2", "--end", "1"], "--end: '1' is not after --start '2'. Give a later end."),
        (
            ["--end", "2", "--duration", "1"],
            "--end and --duration: only one of them can end the window. Leave one out.",
        ),
        (
            ["--duration", "long"],
            "--duration: 'long' is not a time. Give seconds from the start, like 12.5, or a stamp.",
        ),
    ],
)
def test_a_window_that_is_none_is_one_line(logpose, drive, landmarks, words, line):
    done = logpose("detect-circles", drive, "--map", landmarks, "-q", "-o", "-", *words)
    assert (done.status, done.err) == (2, line + "\n")


def test_a_topic_that_is_left_out_is_not_read(logpose, drive, landmarks, pipeline, tmp_path):
    words = ("--duration", "0.5", "-q", "-o", tmp_path / "out", "--json")
    done = logpose("run", pipeline, drive, *words, "--topic", "odometry=none")
    assert done.status == 2
    assert (
        done.err.splitlines()[-1] == "localize-pf: no odometry in the log. Name its topic with --topic odometry=/NAME."
    )
    done = logpose("run", pipeline, drive, *words, "--topic", "truth=none", "--topic", "odometry=/odom")
    report = json.loads(done.out)
    assert "/ground_truth/pose" not in report["messages"]
    assert report["topics"]["odometry"] == "/odom"
    assert report["topics"]["truth"] == "none"


def test_a_pipeline_with_nothing_to_stream_says_so(logpose, pipeline, drive):
    done = logpose("run", pipeline, drive, "-o", "-")
    assert (done.status, done.out) == (2, "")
    assert done.err == f"{pipeline}: several results, none of them a stream. Name a folder with -o DIR.\n"


def test_no_pipeline_is_a_usage_error(logpose):
    done = logpose("run")
    assert done.status == 2
    assert done.err == (
        "logpose run: no pipeline file. Name one, or a bundled pipeline like localize-pf. See logpose run --help.\n"
    )
