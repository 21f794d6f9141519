import cv2
import numpy as np
import pytest

from logpose.formats.errors import FormatError
from logpose.formats.images import grey
from logpose.formats.log import open_log
from logpose.formats.write_log import create_log


def fill(folder, names):
    folder.mkdir(exist_ok=True)
    for i, name in enumerate(names):
        cv2.imwrite(str(folder / name), np.full((4, 5), i, np.uint8))
    return folder


def read(path, **options):
    return [(e.stamp, int(grey(e)[0, 0])) for e in open_log(path, {"image": "auto"}, **options)]


def test_stamps_come_from_the_table(tmp_path):
    folder = fill(tmp_path / "f", ["a.png", "b.png"])
    (folder / "stamps.csv").write_text("stamp_ns,file\n1700000000000000005,b.png\n1700000000000000001,a.png\n")
    assert read(folder) == [(1700000000000000001, 0), (1700000000000000005, 1)]


@pytest.mark.parametrize(
    ("names", "stamps"),
    [
        (["1403636579763555584.png", "1403636579813555456.png"], [1403636579763555584, 1403636579813555456]),
        (["1305031102.175304.png", "1305031102.211214.png"], [1305031102175304000, 1305031102211214000]),
    ],
)
def test_stamps_come_from_numeric_names(tmp_path, names, stamps):
    log = open_log(fill(tmp_path / "f", names), {"image": "auto"})
    assert [e.stamp for e in log] == stamps
    assert log.counts["/image"].why == {}


def test_without_stamps_the_index_counts_at_the_stated_rate(tmp_path):
    folder = fill(tmp_path / "f", ["000.png", "001.png", "002.png"])
    assert read(folder) == [(0, 0), (100_000_000, 1), (200_000_000, 2)]
    assert read(folder, rate_hz=30.0) == [(0, 0), (33_333_333, 1), (66_666_666, 2)]
    log = open_log(folder, {"image": "auto"})
    assert log.problems == [f"{folder}: no stamps: image i stands at i / (10 Hz). Write stamps.csv to change it"]


def test_single_images_keep_the_order_they_were_named_in(tmp_path):
    folder = fill(tmp_path / "f", ["b.png", "a.png"])
    assert read([folder / "b.png", folder / "a.png"]) == [(0, 0), (100_000_000, 1)]
    assert read([folder / "a.png"]) == [(0, 1)]


def test_a_missing_or_broken_image_is_counted(tmp_path):
    folder = fill(tmp_path / "f", ["a.png"])
    (folder / "c.png").write_text("no image")
    (folder / "stamps.csv").write_text("stamp_ns,file\n1,a.png\n2,b.png\n3,c.png\n")
    log = open_log(folder, {"image": "auto"})
    assert [e.stamp for e in log] == [1]
    count = log.counts["/image"]
    assert (count.announced, count.read, count.dropped) == (3, 1, 2)
    assert log.has_loss


def test_image_files_of_any_kind_survive_being_written_to_a_log(tmp_path):
    folder = fill(tmp_path / "f", ["0.pgm", "1.png", "2.bmp", "3.jpg"])
    path = tmp_path / "a.mcap"
    with create_log(path) as writer:
        for event in open_log(folder, {"image": "auto"}):
            writer.write(event)
    assert read(path) == read(folder)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a,b\n1,2\n", "stamps.csv:1: has no columns 'stamp_ns' and 'file'. Write the header stamp_ns,file."),
        (
            "stamp_ns,file\n1.5,a.png\n",
            "stamps.csv:2: stamp_ns '1.5' is no whole number. Give nanoseconds and a file.",
        ),
    ],
)
def test_a_wrong_table_names_its_line(tmp_path, text, message):
    folder = fill(tmp_path / "f", ["a.png"])
    (folder / "stamps.csv").write_text(text)
    with pytest.raises(FormatError) as error:
        open_log(folder, {"image": "auto"})
    assert str(error.value) == f"{folder}/{message}"


def test_a_file_that_is_only_called_an_image_is_counted_as_lost(tmp_path):
    folder = fill(tmp_path / "f", ["1.png", "2.png"])
    (folder / "3.png").write_bytes(b"not an image at all")
    log = open_log(folder, {"image": "auto"})
    assert len(list(log)) == 2
    (count,) = log.counts.values()
    assert (count.read, count.dropped, dict(count.why)) == (2, 1, {"not an image": 1})
    assert log.has_loss
