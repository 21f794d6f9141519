import shutil
import sqlite3

import pytest

from logpose.formats.errors import FormatError
from logpose.formats.log import open_log


def test_an_old_database_without_definitions_is_read(bag_folder, recording, tmp_path):
    folder = bag_folder(tmp_path / "x", recording, "sqlite3")
    path = folder / "x.db3"
    with sqlite3.connect(path) as database:
        database.executescript("DROP TABLE message_definitions; DROP TABLE schema; DROP TABLE metadata;")
    database.close()
    assert len(list(open_log([path], {"odometry": "auto", "image": "auto"}))) == 60


def test_a_folder_without_metadata_is_read_and_says_so(bag_folder, recording, tmp_path):
    folder = bag_folder(tmp_path / "x", recording, "sqlite3")
    (folder / "metadata.yaml").unlink()
    log = open_log([folder], {"odometry": "auto"})
    assert len(list(log)) == 40
    assert log.problems == [f"{folder}: there is no metadata.yaml; all storage files of the folder are read"]
    assert not log.has_loss


def test_metadata_that_promises_more_is_a_counted_loss(bag_folder, recording, tmp_path):
    folder = bag_folder(tmp_path / "x", recording, "mcap")
    path = folder / "metadata.yaml"
    text = path.read_text()
    assert "message_count: 40" in text
    path.write_text(text.replace("message_count: 40", "message_count: 45"))
    log = open_log([folder], {"odometry": "auto"})
    assert len(list(log)) == 40
    assert log.counts["/odom"].why == {"announced but not in the file": 5}


def test_damaged_metadata_is_one_line(bag_folder, recording, tmp_path):
    folder = bag_folder(tmp_path / "x", recording, "mcap")
    (folder / "metadata.yaml").write_text("rosbag2_bagfile_information: [1, {")
    with pytest.raises(FormatError, match=r"metadata.yaml: metadata.yaml cannot be read \(.*\). The file is damaged.$"):
        open_log([folder], {"odometry": "auto"})


def test_a_missing_storage_file_is_named(bag_folder, recording, tmp_path):
    folder = bag_folder(tmp_path / "x", recording, "mcap")
    (folder / "x.mcap").unlink()
    with pytest.raises(FormatError) as error:
        open_log([folder], {"odometry": "auto"})
    assert str(error.value) == (f"{folder}: x.mcap is named in metadata.yaml but missing. Copy it into the folder.")


def test_another_database_is_not_a_bag(tmp_path):
    path = tmp_path / "x.db3"
    with sqlite3.connect(path) as database:
        database.execute("CREATE TABLE t (a)")
    database.close()
    with pytest.raises(FormatError) as error:
        open_log([path], {"odometry": "auto"})
    assert str(error.value) == f"{path}: is an sqlite3 database but not a ROS 2 bag. Check the path."


def test_reading_leaves_no_file_beside_a_database(bag_folder, recording, tmp_path):
    folder = bag_folder(tmp_path / "x", recording, "sqlite3")
    before = sorted(p.name for p in folder.iterdir())
    list(open_log([folder / "x.db3"], {"odometry": "auto"}))
    assert sorted(p.name for p in folder.iterdir()) == before


def test_a_path_with_signs_that_mean_something_in_an_address_is_read(bag_folder, recording, tmp_path):
    folder = bag_folder(tmp_path / "x", recording, "sqlite3").rename(tmp_path / "50% #1?")
    assert len(list(open_log([folder], {"odometry": "auto"}))) == 40


def test_messages_in_a_write_ahead_log_are_read(bag_folder, recording, tmp_path):
    folder = bag_folder(tmp_path / "x", recording, "sqlite3")
    source, copy = folder / "x.db3", tmp_path / "copy.db3"
    database = sqlite3.connect(source)
    assert database.execute("PRAGMA journal_mode=WAL").fetchone() == ("wal",)
    (number,) = database.execute("SELECT id FROM topics WHERE name = '/odom'").fetchone()
    database.execute(
        "INSERT INTO messages (topic_id, timestamp, data) SELECT topic_id, timestamp + 1, data FROM messages "
        "WHERE topic_id = ?",
        (number,),
    )
    database.commit()
    # A recorder that was killed leaves its log beside the database.
    shutil.copy(source, copy)
    shutil.copy(f"{source}-wal", f"{copy}-wal")
    database.close()
    assert len(list(open_log([copy], {"odometry": "auto"}))) == 80
