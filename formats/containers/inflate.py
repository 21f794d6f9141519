"""Decompression that never makes more bytes than were announced, nor more than a chunk may have.

A few kilobytes can announce one size and inflate to gigabytes; so the announced size is checked before anything is
inflated, and the decompressor is stopped one byte after it.
"""

import bz2
import shutil
from pathlib import Path

MAX_CHUNK = 256 << 20
"""No chunk of a sane log is larger [bytes]; writers make 1 to 4 MiB."""

MAX_FILE = 64 << 30
"""No compressed storage file is inflated to more [bytes]."""


def inflate(data: bytes, compression: str, size: int) -> bytes:
    """Return ``data`` decompressed.

    Args:
        data: the compressed bytes.
        compression: empty, ``none``, ``lz4``, ``zstd`` or ``bz2``.
        size: the announced size of the result [bytes].

    Raises:
        ValueError: unknown compression, or the result is not of the announced size.
    """
    if size > MAX_CHUNK:
        raise ValueError(f"a chunk announces {size} bytes, more than {MAX_CHUNK}")
    if compression in ("", "none"):
        plain = data
    elif compression == "lz4":
        import lz4.frame

        plain = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1)
    elif compression == "bz2":
        plain = bz2.BZ2Decompressor().decompress(data, max_length=size + 1)
    elif compression == "zstd":
        plain = inflate_zstd(data, size)
    else:
        raise ValueError(f"compression {compression!r} is not known")
    if len(plain) != size:
        raise ValueError(f"a chunk announces {size} bytes but holds {'more' if len(plain) > size else len(plain)}")
    return plain


def inflate_zstd(data: bytes, limit: int) -> bytes:
    """Return one zstd frame decompressed to at most ``limit`` bytes.

    Raises:
        ValueError: it is larger.
    """
    import zstandard

    announced = zstandard.frame_content_size(data)
    if announced > limit:
        raise ValueError(f"a zstd frame announces {announced} bytes, more than {limit}")
    plain: bytes = zstandard.ZstdDecompressor().decompress(data, max_output_size=limit)
    return plain


def inflate_file(path: Path, folder: Path) -> Path:
    """Inflate a ``.zstd`` storage file into ``folder`` and return the new file.

    Raises:
        ValueError: it does not fit the space left, or is larger than MAX_FILE.
    """
    import zstandard

    target = folder / path.stem
    limit = min(MAX_FILE, shutil.disk_usage(folder).free // 2)
    written = 0
    with path.open("rb") as source, target.open("wb") as sink:
        for block in zstandard.ZstdDecompressor().read_to_iter(source):
            written += len(block)
            if written > limit:
                raise ValueError(f"it inflates to more than {limit} bytes")
            sink.write(block)
    return target
