import hashlib
import io
import sys
from types import SimpleNamespace

import pytest

from logpose.formats.containers.container import guarded
from logpose.formats.containers.inputs import InputFile
from logpose.formats.errors import ConfigError, FormatError
from logpose.formats.log import open_log


def test_the_digest_is_that_of_the_whole_file(tmp_path):
    path = tmp_path / "x"
    path.write_bytes(b"abc" * 1000)
    file = InputFile(str(path), 3000)
    assert file.digest == hashlib.blake2b(b"abc" * 1000, digest_size=32).hexdigest()


def test_a_large_file_is_known_by_its_size_and_ends(tmp_path, monkeypatch):
    from logpose.formats.containers import inputs

    monkeypatch.setattr(inputs, "_WHOLE", 100)
    monkeypatch.setattr(inputs, "_PIECE", 10)
    digests = set()
    for content in (bytes(300), b"\x01" + bytes(299), bytes(299) + b"\x01", bytes(301)):
        path = tmp_path / "x"
        path.write_bytes(content)
        digests.add(InputFile(str(path), len(content)).digest)
    assert len(digests) == 4


def test_standard_input_is_read(log_of, recording, tmp_path, monkeypatch):
    data = log_of("mcap-zstd", tmp_path, recording).read_bytes()
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=io.BytesIO(data)))
    log = open_log(["-"], {"odometry": "auto"})
    assert len(list(log)) == 40
    assert len(list(log)) == 40


def test_an_error_in_standard_input_names_it(monkeypatch):
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=io.BytesIO(b"nothing")))
    with pytest.raises(FormatError, match=r"^-: is not a log, it starts with 'nothing'"):
        open_log(["-"], {"odometry": "auto"})


def test_no_path_is_a_usage_error():
    with pytest.raises(ConfigError) as error:
        open_log([], {"image": "auto"})
    assert str(error.value) == "no log given. Name a bag, an MCAP file or a folder of images."


@pytest.mark.parametrize(
    "error",
    [
        KeyError("x"),
        AssertionError(),
        MemoryError(),
        RuntimeError("a\nb"),
        UnicodeDecodeError("utf8", b"", 0, 1, "bad"),
    ],
)
def test_every_foreign_exception_becomes_one_line(error):
    with (
        pytest.raises(FormatError, match=r"^f.bag: its index cannot be read \([^\n]+\). The file is damaged.$"),
        guarded("f.bag", "its index"),
    ):
        raise error
