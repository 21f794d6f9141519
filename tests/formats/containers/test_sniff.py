import pytest

from logpose.formats.containers.sniff import ACCEPTED, InputType, kind_of, storage_files
from logpose.formats.errors import FormatError


@pytest.mark.parametrize(
    ("head", "kind"),
    [
        (b"#ROSBAG V2.0\n", InputType.ROSBAG1),
        (b"\x89MCAP0\r\n", InputType.MCAP),
        (b"SQLite format 3\x00", InputType.SQLITE),
        (b"\x28\xb5\x2f\xfd", InputType.ZSTD),
        (b"\xff\xd8\xff\xe0", InputType.IMAGE),
        (b"\x89PNG\r\n\x1a\n", InputType.IMAGE),
        (b"P5\n2 2\n255\n....", InputType.IMAGE),
    ],
)
def test_content_says_what_a_file_is_whatever_its_name(head, kind, tmp_path):
    path = tmp_path / "name.txt"
    path.write_bytes(head)
    assert kind_of(path) is kind


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "the file is empty. Check how it was recorded or copied."),
        (b"hello, world and more", f"is not a log, it starts with 'hello, world and'. {ACCEPTED}"),
        (b"\x00\x01\x02\x03\x04\x05\x06\x07\x08", f"is not a log, it starts with 0x0001020304050607. {ACCEPTED}"),
        (b"#ROSBAG V1.2\n", "is a bag of version '1.2', not 2.0. Convert it with rosbag migrate."),
        (b"BMW is a car maker", f"is not a log, it starts with 'BMW is a car mak'. {ACCEPTED}"),
        (b"P5 is not", None),
    ],
)
def test_what_is_no_log_is_said_in_one_line(content, message, tmp_path):
    path = tmp_path / "x.bag"
    path.write_bytes(content)
    if message is None:
        assert kind_of(path) is InputType.IMAGE
        return
    with pytest.raises(FormatError) as error:
        kind_of(path)
    assert str(error.value) == f"{path}: {message}"


def test_a_folder_without_a_log_says_what_it_holds(tmp_path):
    with pytest.raises(FormatError) as error:
        kind_of(tmp_path)
    assert str(error.value) == f"{tmp_path}: the folder is empty. {ACCEPTED}"
    for name in ("d", "c", "b", "a"):
        (tmp_path / name).write_text("x")
    with pytest.raises(FormatError) as error:
        kind_of(tmp_path)
    assert str(error.value) == f"{tmp_path}: the folder holds no log, but a, b, c, .... {ACCEPTED}"


def test_a_folder_of_bags_is_not_one_log(tmp_path):
    (tmp_path / "a.bag").write_bytes(b"#ROSBAG V2.0\n")
    with pytest.raises(FormatError) as error:
        kind_of(tmp_path)
    assert str(error.value) == f"{tmp_path}: is a folder of 1 .bag files. Name the files you mean."


def test_parts_are_in_natural_order(tmp_path):
    for number in (10, 9, 1):
        (tmp_path / f"x_{number}.mcap").write_bytes(b"\x89MCAP0\r\n")
    assert [p.name for p in storage_files(tmp_path)] == ["x_1.mcap", "x_9.mcap", "x_10.mcap"]
