import json
import re
import struct

import pytest
import zstandard

from logpose.formats.containers.container import Loss
from logpose.formats.containers.inflate import MAX_CHUNK, inflate
from logpose.formats.containers.mcap import McapFile
from logpose.formats.errors import ConfigError
from logpose.formats.log import open_log

START = 1_700_000_000_000_000_000


def test_json_and_unknown_channels_do_not_disturb_the_others(mcap_file, recording, tmp_path):
    log = open_log([mcap_file(tmp_path / "x.mcap", recording, with_json=True)], {"odometry": "auto"})
    by_name = {topic.name: topic for topic in log.topics}
    assert not by_name["/config"].is_readable
    assert by_name["/config"].why_not == "no role reads my.Config"
    assert by_name["/blob"].why_not == "encoding 'protobuf' is not supported"
    assert by_name["/odom"].is_readable
    assert len(list(log)) == 40


def test_statistics_that_promise_more_than_there_is_are_a_counted_loss(mcap_file, recording, tmp_path):
    path = mcap_file(tmp_path / "x.mcap", recording, enable_crcs=False)
    data = bytearray(path.read_bytes())
    odom = next(c.id for c in McapFile(path).channels.values() if c.topic == "/odom")
    # channel_message_counts: channel id (2 bytes), count (8 bytes)
    at = data.rindex(struct.pack("<HQ", odom, 40))
    data[at : at + 10] = struct.pack("<HQ", odom, 43)
    path.write_bytes(data)
    log = open_log([path], {"odometry": "auto"})
    assert len(list(log)) == 40
    count = log.counts["/odom"]
    assert (count.announced, count.read, count.dropped) == (43, 40, 3)
    assert count.why == {"announced but not in the file": 3}


def test_messages_that_are_late_in_the_file_come_in_order(mcap_file, make_events, tmp_path):
    events = make_events(50)
    # the first ten seconds' worth of chunks at the end of the file
    path = mcap_file(tmp_path / "x.mcap", events[:2] + events[100:] + events[2:100], use_chunking=False)
    stamps = [e.stamp for e in open_log([path], {"odometry": "auto"})]
    assert stamps == sorted(stamps)
    assert len(stamps) == 100


def test_chunks_without_wanted_channels_are_not_inflated(mcap_file, recording, tmp_path):
    path = mcap_file(tmp_path / "x.mcap", recording)
    container = McapFile(path)
    transforms = next(c.id for c in container.channels.values() if c.topic == "/tf_static")
    for chunk in container._chunks[1:]:
        chunk.compression = "not to be touched"
    losses: list[Loss] = []
    assert len(list(container.records(frozenset([transforms]), losses))) == 1
    assert not losses


def test_damage_between_chunks_costs_no_other_chunk(mcap_file, recording, tmp_path):
    path = mcap_file(tmp_path / "x.mcap", recording)
    data = bytearray(path.read_bytes())
    second = McapFile(path)._chunks[1]
    at = second.offset + second.size  # its first index record
    data[at + 1 : at + 9] = b"\xff" * 8
    path.write_bytes(data)
    log = open_log([path], {"odometry": "auto", "image": "auto"})
    assert len(list(log)) == 60
    assert log.problems == [f"{path}: the file is damaged at byte {at}; the rest is found by the summary"]


def test_a_wrong_checksum_is_noticed(mcap_file, recording, tmp_path):
    path = mcap_file(tmp_path / "x.mcap", recording)
    data = bytearray(path.read_bytes())
    at = data.index(b"mono8")
    data[at] ^= 1
    path.write_bytes(data)
    log = open_log([path], {"image": "auto"})
    list(log)
    assert any("its checksum is wrong" in why for why in log.counts["/camera/image_raw"].why)


def test_a_summary_with_a_wrong_checksum_is_not_believed(mcap_file, recording, tmp_path):
    path = mcap_file(tmp_path / "x.mcap", recording)
    data = bytearray(path.read_bytes())
    at = data.rindex(b"/odom")
    data[at : at + 5] = b"/0dom"
    path.write_bytes(data)
    log = open_log([path], {"odometry": "/odom"})
    assert len(list(log)) == 40
    assert log.problems == [f"{path}: the summary at the end of the file is damaged; all messages are there"]


def test_impossible_log_times_are_a_counted_loss(mcap_file, recording, tmp_path):
    path = mcap_file(tmp_path / "x.mcap", recording, use_chunking=False)
    data = bytearray(path.read_bytes())
    at = data.index(struct.pack("<QQ", START + 50_000_000, START + 50_000_000))
    data[at + 7] = 0xFF
    path.write_bytes(data)
    log = open_log([path], {"odometry": "/odom"})
    assert len(list(log)) == 39
    assert log.counts["/odom"].why == {"damaged message (impossible log time)": 1}


def test_a_topic_that_damage_hides_is_explained(mcap_file, recording, tmp_path):
    path = mcap_file(tmp_path / "x.mcap", recording)
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(ConfigError) as error:
        open_log([path], {"odometry": "/odom"})
    message, note = str(error.value).split(" Note that ")
    assert message == f"{path}: no topic '/odom' of type Odometry. Topics of this type: none."
    assert re.fullmatch(r".*: the file is cut off at byte \d+ of 200; what came before it is read\.", note)


@pytest.mark.parametrize("compression", ["zstd", "lz4", "bz2"])
def test_a_bomb_is_not_inflated(compression):
    import bz2

    import lz4.frame

    zeros = bytes(8 << 20)
    packed = {
        "zstd": zstandard.compress(zeros),
        "lz4": lz4.frame.compress(zeros),
        "bz2": bz2.compress(zeros),
    }[compression]
    with pytest.raises(ValueError, match="announces"):
        inflate(packed, compression, 1000)
    with pytest.raises(ValueError, match="more than"):
        inflate(packed, compression, MAX_CHUNK + 1)
    assert inflate(packed, compression, len(zeros)) == zeros


def test_a_zstd_frame_without_its_size_is_stopped_at_the_announced_size():
    packed = zstandard.ZstdCompressor(write_content_size=False).compress(bytes(1 << 20))
    with pytest.raises((ValueError, zstandard.ZstdError)):
        inflate(packed, "zstd", 1000)
    assert len(inflate(packed, "zstd", 1 << 20)) == 1 << 20


def test_sightings_on_a_json_channel_are_read_beside_ros_messages(tmp_path, some_sightings):
    from mcap.writer import Writer

    from logpose.formats.events import Sightings
    from logpose.formats.log import open_log
    from logpose.formats.sightings import sightings_to_json

    path = tmp_path / "json.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2")
        schema = writer.register_schema("logpose.Sightings", "jsonschema", b"{}")
        channel = writer.register_channel("/seen", "json", schema)
        line = json.dumps(sightings_to_json(some_sightings)).encode()
        writer.add_message(channel, some_sightings.stamp, line, some_sightings.stamp)
        writer.finish()
    (event,) = open_log([path], {"sightings": "auto"})
    assert isinstance(event, Sightings)
    assert event.xy.tolist() == some_sightings.xy.tolist()
    assert event.ids.tolist() == some_sightings.ids.tolist()
