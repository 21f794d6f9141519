from pathlib import Path

import numpy as np
import pytest

from logpose.formats.errors import FormatError, StageError
from logpose.formats.events import Image, Odometry, Pose
from logpose.pipelines.engine.chain import Chain
from logpose.pipelines.engine.document import parse_document
from logpose.pipelines.engine.pipeline import bind


def image(stamp, width=2, topic="/ceiling/image_raw"):
    return Image(stamp=stamp, topic=topic, source="image", encoding="mono8", data=np.zeros(1, np.uint8), width=width)


def pipeline(stages, *lines):
    text = "logpose: 1\nstages:\n" + "\n".join(f"  - {line}" for line in lines)
    return bind(parse_document(text, "p.yaml", Path()), stages.TABLE, Path())


def test_everything_is_forwarded_and_made_events_follow(stages):
    events = [image(1), Odometry(stamp=2), image(3, 5)]
    out = list(Chain(pipeline(stages, "square", "count"), events))
    kinds = [(type(e).__name__, e.stamp) for e in out]
    assert kinds == [
        ("Image", 1),
        ("Pose", 1),
        ("Odometry", 2),
        ("Pose", 2),
        ("Image", 3),
        ("Pose", 3),
        ("Pose", 10**12),
    ]
    assert [e.position[0] for e in out if isinstance(e, Pose)] == [4, 1, 25, 1]


@pytest.mark.parametrize("workers", [1, 2, 4, 9])
def test_threads_give_the_serial_result(stages, workers):
    events = [image(i, i) if i % 3 else Odometry(stamp=i) for i in range(14, 200)]
    serial = list(Chain(pipeline(stages, "square"), events))
    threaded = list(Chain(pipeline(stages, f"square: {{workers: {workers}}}"), events))
    assert [(type(e), e.stamp) for e in threaded] == [(type(e), e.stamp) for e in serial]
    assert [e.position[0] for e in threaded if isinstance(e, Pose)] == [
        e.position[0] for e in serial if isinstance(e, Pose)
    ]


def test_threads_read_ahead_no_further_than_twice_their_number(stages):
    given = []

    def source():
        for i in range(14, 100):
            given.append(i)
            yield image(i, i)

    stream = iter(Chain(pipeline(stages, "square: {workers: 2}"), source()))
    next(stream)
    assert len(given) <= 2 * 2 + 1


@pytest.mark.parametrize("line", ["square", "square: {workers: 3}"])
def test_failure_in_a_stage_names_line_stage_event_and_reason(stages, line):
    events = [image(1), image(5_000_000_000, 13)]
    with pytest.raises(StageError) as caught:
        list(Chain(pipeline(stages, line), events))
    assert str(caught.value) == (
        "p.yaml:3: stage 'square' failed at Image t=5.000000000 s on /ceiling/image_raw: "
        "KeyError: 'thirteen'. This is a fault of logpose; --traceback shows where."
    )


def test_a_value_error_is_taken_as_the_reason(stages):
    with pytest.raises(StageError) as caught:
        list(Chain(pipeline(stages, "square", "count"), [Odometry(stamp=666, topic="/odom")]))
    assert str(caught.value) == (
        "p.yaml:4: stage 'count' failed at Odometry t=0.000000666 s on /odom: the odometer says nan."
    )


def test_an_error_closes_every_stage_so_that_writers_clean_up(stages, tmp_path):
    from logpose.formats.files import replacing

    def source():
        with replacing(tmp_path / "half.bin") as file:
            file.write(b"half")
            yield Odometry(stamp=1)
            yield Odometry(stamp=666)

    with pytest.raises(StageError):
        list(Chain(pipeline(stages, "count"), source()))
    assert list(tmp_path.iterdir()) == []


def test_each_stage_is_timed_and_counted_by_itself(stages):
    chain = Chain(pipeline(stages, "square", "count"), [image(1), Odometry(stamp=2)])
    list(chain)
    assert [(t.name, t.events_in, t.events_out) for t in chain.tallies] == [("square", 2, 3), ("count", 3, 5)]
    assert list(chain.seconds()) == ["read", "square", "count"]
    assert all(s >= 0 for s in chain.seconds().values())


def test_the_same_stage_twice_has_two_names(stages):
    chain = Chain(pipeline(stages, "count", "count"), [])
    assert list(chain.seconds()) == ["read", "count", "count#2"]


@pytest.mark.parametrize(
    ("error", "kind", "words"),
    [
        (BrokenPipeError(), BrokenPipeError, ""),
        (
            OSError(28, "No space left on device"),
            FormatError,
            "count: cannot write (No space left on device). Free some space or choose another place with -o.",
        ),
    ],
)
def test_a_pipe_or_a_disk_that_ends_is_no_fault_of_a_stage(stages, error, kind, words):
    def source():
        yield Odometry(stamp=1)
        raise error

    with pytest.raises(kind) as caught:
        list(Chain(pipeline(stages, "count"), source()))
    assert words in str(caught.value)
