import struct

import pytest

from logpose.formats.containers.container import Loss
from logpose.formats.containers.rosbag1 import Rosbag1File
from logpose.formats.errors import FormatError
from logpose.formats.log import open_log


def header(**fields: bytes) -> bytes:
    parts = b"".join(struct.pack("<I", len(k) + 1 + len(v)) + k.encode() + b"=" + v for k, v in fields.items())
    return struct.pack("<I", len(parts)) + parts


def test_a_bag_that_was_never_closed_is_read(bag_file, recording, tmp_path):
    path = bag_file(tmp_path / "x.bag", recording)
    data = path.read_bytes()
    (index,) = struct.unpack_from("<Q", data, data.index(b"index_pos=") + 10)
    head = data[:index].replace(b"index_pos=" + struct.pack("<Q", index), b"index_pos=" + bytes(8))
    path.write_bytes(head)
    log = open_log([path], {"odometry": "auto", "image": "auto"})
    assert len(list(log)) == 60
    assert log.problems == [f"{path}: the bag was never closed (no index); all complete chunks are read"]
    assert not log.has_loss


def test_a_chunk_without_index_records_is_read_by_inflating_it(bag_file, recording, tmp_path):
    path = bag_file(tmp_path / "x.bag", recording, "lz4")
    third = Rosbag1File(path)._chunks[2]
    path.write_bytes(path.read_bytes()[: third.offset + third.size])
    container = Rosbag1File(path)
    assert "/camera/image_raw" in {c.topic for c in container.channels.values()}
    losses: list[Loss] = []
    records = list(container.records(frozenset(container.channels), losses))
    assert len(records) == sum(c.announced or 0 for c in container.channels.values()) > 5
    assert not losses


def test_damage_between_chunks_costs_no_other_chunk(bag_file, recording, tmp_path):
    path = bag_file(tmp_path / "x.bag", recording, "lz4")
    data = bytearray(path.read_bytes())
    second = Rosbag1File(path)._chunks[1]
    at = second.offset + second.size  # its first index record
    data[at : at + 4] = b"\xff" * 4
    path.write_bytes(data)
    log = open_log([path], {"odometry": "auto", "image": "auto"})
    assert len(list(log)) == 60
    assert log.problems == [f"{path}: the file is damaged at byte {at}; the rest is found by the index"]


def test_a_gap_before_the_index_is_jumped(bag_file, recording, tmp_path):
    path = bag_file(tmp_path / "x.bag", recording)
    data = path.read_bytes()
    (index,) = struct.unpack_from("<Q", data, data.index(b"index_pos=") + 10)
    moved = data[:index] + bytes(49) + data[index:]
    moved = moved.replace(b"index_pos=" + struct.pack("<Q", index), b"index_pos=" + struct.pack("<Q", index + 49))
    path.write_bytes(moved)
    log = open_log([path], {"odometry": "auto"})
    assert len(list(log)) == 40
    assert not log.problems


def test_an_encrypted_bag_is_refused(tmp_path):
    path = tmp_path / "x.bag"
    fields = header(op=b"\x03", index_pos=bytes(8), conn_count=bytes(4), chunk_count=bytes(4), encryptor=b"aes")
    path.write_bytes(b"#ROSBAG V2.0\n" + fields + struct.pack("<I", 0))
    with pytest.raises(FormatError, match="the bag is encrypted"):
        Rosbag1File(path)


def test_a_chunk_that_announces_too_much_is_counted(bag_file, recording, tmp_path):
    path = bag_file(tmp_path / "x.bag", recording, "bz2")
    data = bytearray(path.read_bytes())
    at = data.rindex(b"size=") + 5
    data[at : at + 4] = struct.pack("<I", 1 << 30)
    path.write_bytes(data)
    log = open_log([path], {"odometry": "auto"})
    events = list(log)
    count = log.counts["/odom"]
    assert count.read == len(events) < 40
    assert count.read + count.dropped == 40
    assert any("a chunk announces 1073741824 bytes" in why for why in count.why)
