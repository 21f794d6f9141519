from pathlib import Path

import pytest

from logpose.formats.errors import ConfigError
from logpose.formats.yaml_file import MAX_VALUES
from logpose.pipelines.engine.document import parse_document

GOOD = """\
logpose: 1
topics: {image: /a, odometry: auto}
stages:
  - square: {add: 3, workers: 2}
  - count:
      step: 2
      mode: down
  - needs
"""


def parse(text):
    return parse_document(text, "p.yaml", Path("folder"))


def test_reads_topics_stages_parameters_and_their_lines():
    document = parse(GOOD)
    assert document.topics == {"image": "/a", "odometry": "auto"}
    assert [entry.name for entry in document.stages] == ["square", "count", "needs"]
    assert [entry.where for entry in document.stages] == ["p.yaml:4", "p.yaml:5", "p.yaml:8"]
    mode = document.stages[1].values["mode"]
    assert (mode.value, mode.where, mode.base) == ("down", "p.yaml:7", Path("folder"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("stages: []", "p.yaml:1: not a pipeline file of version 1. Its first line must be 'logpose: 1'."),
        (
            "logpose: 2\nstages: []",
            "p.yaml:1: not a pipeline file of version 1. Its first line must be 'logpose: 1'.",
        ),
        ("logpose: 1", "p.yaml: no list of stages. Write 'stages:' and one '- stage-name: {...}' per line."),
        (
            "logpose: 1\nstage: []\nstages: []",
            "p.yaml:2: unknown key 'stage'. A pipeline file has logpose, topics and stages.",
        ),
        ("logpose: 1\nlogpose: 1", "p.yaml:2: key 'logpose' stands twice. Remove one."),
        ("logpose: 1\nstages:\n  - a: {x: 1, x: 2}", "p.yaml:3: key 'x' stands twice. Remove one."),
        (
            "logpose: 1\nstages:\n  - {a: {}, b: {}}",
            "p.yaml:3: one stage per list item, '- stage-name: {...}'. Found a, b.",
        ),
        (
            "logpose: 1\ntopics: {image: 3}\nstages: []",
            "p.yaml:2: topic of 'image' is 3. Give a topic name, 'auto' or 'none'.",
        ),
        ("", "p.yaml:1: not a pipeline file of version 1. Its first line must be 'logpose: 1'."),
        ("logpose: [1", "p.yaml:1: is no YAML (expected ',' or ']', but got '<stream end>'). Correct the line."),
    ],
)
def test_says_in_one_line_what_is_wrong(text, message):
    with pytest.raises(ConfigError) as caught:
        parse(text)
    assert str(caught.value) == message


def test_refuses_an_alias_bomb_without_building_it():
    levels = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    levels += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 9)]
    text = "logpose: 1\nstages:\n  - s: {" + ", ".join(levels) + "}"
    with pytest.raises(ConfigError, match=f"more than {MAX_VALUES:,} values"):
        parse(text)
