"""What a path is, by its content: never by its suffix."""

from enum import Enum
from pathlib import Path

from ..errors import FormatError
from . import mcap, rosbag1
from .container import guarded

ACCEPTED = "Accepted are ROS 1 bags, ROS 2 bags (folder, .db3 or .mcap), MCAP files, images and folders of images."


class InputType(Enum):
    """The kinds of input."""

    ROSBAG1 = "ROS 1 bag"
    MCAP = "MCAP"
    SQLITE = "ROS 2 bag (sqlite3)"
    ZSTD = "zstd"
    IMAGE = "image"
    ROSBAG2_FOLDER = "ROS 2 bag"
    IMAGE_FOLDER = "images"


_ZSTD = b"\x28\xb5\x2f\xfd"
_MAGICS: tuple[tuple[bytes, InputType], ...] = (
    (rosbag1.MAGIC, InputType.ROSBAG1),
    (mcap.MAGIC, InputType.MCAP),
    (b"SQLite format 3\x00", InputType.SQLITE),
    (_ZSTD, InputType.ZSTD),
)
_IMAGES: tuple[tuple[bytes, str], ...] = (
    (b"\xff\xd8\xff", "jpeg"),
    (b"\x89PNG\r\n\x1a\n", "png"),
    (b"BM", "bmp"),
    (b"II*\x00", "tiff"),
    (b"MM\x00*", "tiff"),
    (b"P2", "pgm"),
    (b"P5", "pgm"),
    (b"P3", "ppm"),
    (b"P6", "ppm"),
)


def kind_of(path: Path, name: str = "") -> InputType:
    """Return what ``path`` is; ``name`` is what to call it in messages.

    Raises:
        FormatError: it does not exist, is empty, or is no log.
    """
    name = name or str(path)
    with guarded(name, "it"):
        if path.is_dir():
            return _kind_of_folder(path)
        head = _head(path)
    if not head:
        raise FormatError(f"{name}: the file is empty. Check how it was recorded or copied.")
    for magic, kind in _MAGICS:
        if head.startswith(magic):
            return kind
    if image_encoding(head):
        return InputType.IMAGE
    if head.startswith(b"#ROSBAG V"):
        version = head[9:16].split(b"\n")[0].decode("ascii", "replace")
        raise FormatError(f"{name}: is a bag of version {version!r}, not 2.0. Convert it with rosbag migrate.")
    raise FormatError(f"{name}: is not a log, it starts with {_shown(head)}. {ACCEPTED}")


def image_encoding(head: bytes) -> str:
    """Return ``jpeg``, ``png``, ``bmp``, ``tiff``, ``pgm`` or ``ppm`` for the start of an image file, else ''."""
    for magic, encoding in _IMAGES:
        if head.startswith(magic) and (len(magic) > 2 or _is_plausible(magic, head)):
            return encoding
    return ""


_IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg")


def image_files(folder: Path) -> list[Path]:
    """Return the image files of a folder, sorted by name; also what is only called one, so that it can be counted."""
    files = sorted(p for p in folder.iterdir() if p.is_file() and not p.name.startswith("."))
    return [p for p in files if image_encoding(_head(p)) or p.suffix.lower() in _IMAGE_SUFFIXES]


def storage_files(folder: Path) -> list[Path]:
    """Return the storage files of a ROS 2 bag folder without its ``metadata.yaml``, in natural order."""
    kinds = (InputType.MCAP, InputType.SQLITE)
    files: list[Path] = []
    for path in sorted(folder.iterdir(), key=_natural):
        if not path.is_file() or path.name.startswith("."):
            continue
        head = _head(path)
        is_zstd = head.startswith(_ZSTD) and path.name.endswith((".db3.zstd", ".mcap.zstd"))
        if is_zstd or any(head.startswith(magic) for magic, kind in _MAGICS if kind in kinds):
            files.append(path)
    return files


def _kind_of_folder(folder: Path) -> InputType:
    if (folder / "metadata.yaml").is_file() or storage_files(folder):
        return InputType.ROSBAG2_FOLDER
    if image_files(folder):
        return InputType.IMAGE_FOLDER
    names = sorted(p.name for p in folder.iterdir())
    if not names:
        raise FormatError(f"{folder}: the folder is empty. {ACCEPTED}")
    if bags := [name for name in names if name.endswith(".bag")]:
        raise FormatError(f"{folder}: is a folder of {len(bags)} .bag files. Name the files you mean.")
    shown = ", ".join(names[:3]) + (", ..." if len(names) > 3 else "")
    raise FormatError(f"{folder}: the folder holds no log, but {shown}. {ACCEPTED}")


def _head(path: Path) -> bytes:
    with path.open("rb") as stream:
        return stream.read(32)


def _is_plausible(magic: bytes, head: bytes) -> bool:
    """Two letters are not enough: a Netpbm header goes on with white space, a bitmap with its small header offset."""
    if magic == b"BM":
        return len(head) > 14 and 14 < int.from_bytes(head[10:14], "little") < 4096
    return head[2:3].isspace()


def _natural(path: Path) -> tuple[tuple[int, int | str], ...]:
    """Sort key with numbers in order: ``bag_10`` after ``bag_9``."""
    import re

    return tuple((0, int(part)) if part.isdigit() else (1, part) for part in re.split(r"(\d+)", path.name))


def _shown(head: bytes) -> str:
    text = head[:16].decode("ascii", "replace")
    return repr(text) if text.isprintable() else "0x" + head[:8].hex()
