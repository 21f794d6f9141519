"""What is promised of damaged files: a one-line LogposeError, or every loss is counted; never another exception."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from logpose.formats.containers.mcap import McapFile
from logpose.formats.containers.rosbag1 import Rosbag1File
from logpose.formats.errors import LogposeError
from logpose.formats.log import open_log
from logpose.formats.survey import survey

ROLES = {"image": "/camera/image_raw", "odometry": "/odom", "truth": "/ground_truth/pose"}
KINDS = (
    "bag-none",
    "bag-lz4",
    "bag-bz2",
    "ros2-db3",
    "mcap-none",
    "mcap-zstd",
    "mcap-lz4",
    "mcap-unchunked",
    "mcap-no-index",
)
N_EVENTS = 10 * 4
BOUNDED = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.fixture(scope="module", params=KINDS)
def whole(request, log_of, make_events, tmp_path_factory):
    """(kind, bytes) of a small log with 40 events."""
    path = log_of(request.param, tmp_path_factory.mktemp("whole"), make_events(10))
    return request.param, path.read_bytes()


def read(path):
    """Return (events, log) or None when it cannot be opened; anything but a LogposeError is a failure."""
    log, events, message = None, [], ""
    try:
        log = open_log([path], ROLES)
        events = list(log)
    except LogposeError as err:
        message = str(err)
    if message:
        assert "\n" not in message
        assert str(path) in message
        return None
    assert [e.stamp for e in events] == sorted(e.stamp for e in events)
    for count in log.counts.values():
        assert count.announced is None or count.announced <= count.read + count.outside + count.dropped
    return events, log


@BOUNDED
@given(share=st.floats(0, 1))
def test_a_file_that_is_cut_off_is_read_up_to_the_cut_or_refused(whole, tmp_path, share):
    kind, data = whole
    path = tmp_path / "cut"
    path.write_bytes(data[: int(share * (len(data) - 1))])
    result = read(path)
    if result:
        events, log = result
        # sqlite files end in pages without content, MCAP files in indexes and a summary, bags in an index.
        assert len(events) == N_EVENTS or log.has_loss
        assert log.problems or kind == "ros2-db3"


@BOUNDED
@given(at=st.floats(0, 1), bit=st.integers(0, 7))
def test_a_flipped_bit_raises_or_is_counted(whole, tmp_path, at, bit):
    kind, data = whole
    changed = bytearray(data)
    changed[int(at * (len(data) - 1))] ^= 1 << bit
    path = tmp_path / "flipped"
    path.write_bytes(changed)
    result = read(path)
    if result and kind.startswith("mcap") and kind != "mcap-unchunked":
        events, log = result
        # Chunks have checksums: whatever comes out is what went in, and what does not come out is said.
        assert len(events) >= N_EVENTS or log.has_loss or log.problems


@BOUNDED
@given(noise=st.binary(min_size=1, max_size=200), keep=st.integers(0, 4200))
def test_noise_after_a_good_start_raises_or_is_counted(whole, tmp_path, noise, keep):
    path = tmp_path / "noise"
    path.write_bytes(whole[1][:keep] + noise)
    read(path)


@settings(BOUNDED, max_examples=15)
@given(at=st.floats(0, 1), value=st.integers(0, 255))
def test_a_survey_of_a_damaged_file_raises_nothing_else(whole, tmp_path, at, value):
    changed = bytearray(whole[1])
    changed[int(at * (len(changed) - 1))] = value
    path = tmp_path / "changed"
    path.write_bytes(changed)
    message = ""
    try:
        survey([path])
    except LogposeError as err:
        message = str(err)
    assert "\n" not in message


@pytest.mark.parametrize("kind", [k for k in KINDS if k != "ros2-db3"])
@pytest.mark.parametrize("missing", [4, 100])
def test_the_last_bytes_of_a_file_cost_no_message(kind, missing, log_of, make_events, tmp_path):
    path = log_of(kind, tmp_path, make_events(10))
    path.write_bytes(path.read_bytes()[:-missing])
    events, log = read(path)
    assert len(events) == N_EVENTS
    assert log.problems


@pytest.mark.parametrize("kind", ["bag-lz4", "mcap-zstd", "mcap-none", "mcap-lz4"])
def test_half_a_file_gives_about_half_the_messages(kind, log_of, make_events, tmp_path):
    path = log_of(kind, tmp_path, make_events(100))
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    events, log = read(path)
    assert 100 < len(events) < 300
    assert log.has_loss


@pytest.mark.parametrize("kind", ["mcap-none", "mcap-zstd", "bag-lz4", "bag-bz2"])
def test_a_damaged_chunk_is_counted_by_topic_and_the_next_one_is_read(kind, log_of, make_events, tmp_path):
    path = log_of(kind, tmp_path, make_events(100))
    data = bytearray(path.read_bytes())
    chunk = (McapFile if kind.startswith("mcap") else Rosbag1File)(path)._chunks[5]
    at = chunk.offset + chunk.size // 2
    data[at : at + 8] = b"\xff" * 8
    path.write_bytes(data)
    events, log = read(path)
    dropped = sum(count.dropped for count in log.counts.values())
    assert log.has_loss
    assert 0 < dropped < 60
    assert len(events) + dropped == 400
    assert events[-1].stamp > events[0].stamp + 9_800_000_000


def test_zeros_after_the_end_cost_no_message(log_of, make_events, tmp_path):
    path = log_of("mcap-zstd", tmp_path, make_events(10))
    path.write_bytes(path.read_bytes()[:-60] + bytes(4096))
    events, _ = read(path)
    assert len(events) == N_EVENTS
