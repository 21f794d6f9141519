from pathlib import Path

import pytest

from logpose.formats.errors import ConfigError
from logpose.pipelines.engine.document import Value, parse_document
from logpose.pipelines.engine.dump import dump_pipeline
from logpose.pipelines.engine.pipeline import assign, bind, overlay
from logpose.pipelines.engine.schema import pipeline_schema


def document(body, name="p.yaml", base="."):
    return parse_document(f"logpose: 1\nstages:\n{body}", name, Path(base))


def bound(stages, body, **kwargs):
    return bind(document(body, **kwargs), stages.TABLE, Path("out"))


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("  - count: {stepp: 1}", "p.yaml:3: count has no parameter 'stepp'. Did you mean 'step'?"),
        ("  - square: {qqqqqq: 1}", "p.yaml:3: square has no parameter 'qqqqqq'. There is: add, workers."),
        ("  - coutn: {}", "p.yaml:3: no stage 'coutn'. Did you mean 'count'?"),
        ("  - needs", "p.yaml:3: needs needs 'map': landmark map. Give it with --set needs.map=VALUE."),
        (
            "  - count:\n      step: many",
            "p.yaml:4: count cannot take step = 'many': input should be a valid integer. "
            "step is: how many each image counts for.",
        ),
        (
            "  - count: {step: 0}",
            "p.yaml:3: count cannot take step = 0: input should be greater than 0. step is: how many each image counts for.",
        ),
        (
            "  - count: {mode: no}",
            "p.yaml:3: count cannot take mode = False: input should be 'up' or 'down'. mode is: direction.",
        ),
        (
            "  - count: {workers: 2}",
            "p.yaml:3: count takes no workers, it keeps state from message to message. Remove it.",
        ),
        ("  - square: {workers: 0}", "p.yaml:3: workers = 0. Give a whole number of threads, 1 or more."),
        (
            "  - count: {corner_m: [.nan, 1]}",
            "p.yaml:3: count has a parameter that is not finite. Give numbers.",
        ),
    ],
)
def test_a_wrong_word_is_explained_with_file_and_line(stages, body, message):
    with pytest.raises(ConfigError) as caught:
        bound(stages, body)
    assert str(caught.value) == message


def test_files_are_relative_to_what_named_them_and_to_the_run_folder(stages):
    stage = bound(stages, "  - count: {map: maps/a.yaml}", base="pipelines").stages[0]
    assert stage.params.map == "pipelines/maps/a.yaml"
    assert stage.params.path == "out/count.txt"


def test_a_list_of_numbers_becomes_a_tuple(stages):
    assert bound(stages, "  - count: {corner_m: [1, 2.5]}").stages[0].params.corner_m == (1.0, 2.5)


def test_layers_win_in_order_and_leave_alone_what_they_do_not_mention(stages):
    base = document("  - count: {step: 2, mode: down}")
    over = document("  - count: {step: 3}", name="c.yaml")
    laid = assign(overlay(base, over), [("count.step", Value(4, "--set", Path()))])
    params = bind(laid, stages.TABLE, Path()).stages[0].params
    assert (params.step, params.mode) == (4, "down")
    assert bind(overlay(base, over), stages.TABLE, Path()).stages[0].params.step == 3


def test_a_layer_for_a_stage_that_is_not_there_is_an_error():
    base = document("  - count")
    with pytest.raises(ConfigError) as caught:
        overlay(base, document("  - conut: {}", name="c.yaml"))
    assert str(caught.value) == "c.yaml:3: p.yaml has no stage 'conut'. Did you mean 'count'?"
    with pytest.raises(ConfigError) as caught:
        assign(base, [("conut.step", Value(1, "--set", Path()))])
    assert str(caught.value) == "--set conut.step: p.yaml has no stage 'conut'. Did you mean 'count'?"
    with pytest.raises(ConfigError) as caught:
        assign(base, [("step", Value(1, "--set", Path()))])
    assert str(caught.value) == "--set step: no stage named. Write STAGE.PARAMETER=VALUE."


def test_a_dumped_pipeline_binds_to_the_same_pipeline(stages):
    first = bound(stages, "  - count: {map: maps/a.yaml, corner_m: [1, 2]}\n  - square: {workers: 3}", base="x")
    text = dump_pipeline(first, Path("out"), Path("out"))
    again = bind(parse_document(text, "run.yaml", Path("out")), stages.TABLE, Path("out"))
    assert [s.spec.name for s in again.stages] == ["count", "square"]
    assert Path(again.stages[0].params.map).resolve() == Path("x/maps/a.yaml").resolve()
    assert again.stages[0].params.corner_m == (1.0, 2.0)
    assert again.stages[0].params.path == first.stages[0].params.path
    assert "workers" not in text
    assert "workers: 3" in dump_pipeline(first, Path("out"), Path("out"), with_workers=True)


def test_schema_names_every_stage_and_refuses_unknown_keys(stages):
    schema = pipeline_schema(stages.TABLE)
    items = schema["properties"]["stages"]["items"]["anyOf"]
    assert items[0]["enum"] == ["count", "needs", "square"]
    square = next(item for item in items[1:] if item["required"] == ["square"])["properties"]["square"]
    assert set(square["properties"]) == {"add", "workers"}
    assert square["additionalProperties"] is False
    assert square["description"] == "Square the width of an image."


def test_a_needed_parameter_names_the_flag_that_gives_it(stages):
    with pytest.raises(ConfigError) as caught:
        bind(document("  - needs"), stages.TABLE, Path("out"), {"needs.map": "--map"})
    assert str(caught.value) == "p.yaml:3: needs needs 'map': landmark map. Give it with --map."
