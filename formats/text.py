"""Text files line by line: opening, numbers and stamps, with errors that name file and line.

Stamps are decimal seconds in many files. They are turned into integer nanoseconds by decimal arithmetic on
the text, never through a float: a float holds today's seconds only to about 240 ns.
"""

import math
import sys
from collections.abc import Iterable, Iterator
from decimal import ROUND_HALF_EVEN, Decimal, InvalidOperation
from pathlib import Path

from .errors import FormatError

NANOSECONDS = 1_000_000_000
_STAMP_LIMIT = 2**63


def text_lines(path: str | Path) -> Iterator[tuple[int, str]]:
    """Yield the lines of a UTF-8 text file with their numbers from 1, without line ends.

    Args:
        path: the file; ``-`` is standard input, read as it comes.

    Raises:
        FormatError: there is no such file, it cannot be read, or it is not text.
    """
    try:
        if str(path) == "-":
            yield from _stripped(sys.stdin)
            return
        with Path(path).open(encoding="utf-8-sig", newline=None) as stream:
            yield from _stripped(stream)
    except FileNotFoundError as err:
        raise FormatError(f"{path}: no such file. Check the path.") from err
    except IsADirectoryError as err:
        raise FormatError(f"{path}: is a folder. Name a file in it.") from err
    except UnicodeDecodeError as err:
        raise FormatError(f"{path}: is no text file (byte {err.start} is no UTF-8). Check the path.") from err
    except OSError as err:
        raise FormatError(f"{path}: cannot be read ({err.strerror}). Check the permissions.") from err


def read_text(path: str | Path) -> str:
    """Return a whole text file; errors as ``text_lines``."""
    return "\n".join(line for _, line in text_lines(path))


def content_lines(lines: Iterable[tuple[int, str]]) -> Iterator[tuple[int, str]]:
    """Yield numbered lines without the space around them; not those that are empty or begin with ``#``."""
    for number, line in lines:
        text = line.strip()
        if text and not text.startswith("#"):
            yield number, text


def comment_value(line: str, key: str) -> str | None:
    """Return what a line ``# key: value`` says, None where it is none of this key."""
    found, _, value = line.lstrip("# \t").partition(":")
    return value.strip() if found.strip() == key else None


def parse_number(text: str, where: str, name: str) -> float:
    """Turn text into a finite number.

    Raises:
        FormatError: it is no number, or it is nan or infinite; ``where`` and ``name`` say of what.
    """
    try:
        value = float(text)
    except ValueError as err:
        raise FormatError(f"{where}: {name} is {text!r}, not a number. Correct or remove the line.") from err
    if not math.isfinite(value):
        raise FormatError(f"{where}: {name} is {text!r}. Every value must be finite; remove the line.")
    return value


def parse_seconds(text: str, where: str, name: str = "the stamp") -> int:
    """Turn decimal seconds (also in scientific notation) into integer nanoseconds, exactly.

    Digits below a nanosecond are rounded half to even.

    Raises:
        FormatError: it is no number, is not finite, or does not fit into 64 bits.
    """
    try:
        seconds = Decimal(text)
    except InvalidOperation as err:
        raise FormatError(f"{where}: {name} is {text!r}, not a number. Correct or remove the line.") from err
    if not seconds.is_finite():
        raise FormatError(f"{where}: {name} is {text!r}. Every value must be finite; remove the line.")
    # First compare, then scale: '1e999999' must not become a number of a million digits.
    if abs(seconds) >= Decimal(_STAMP_LIMIT) / NANOSECONDS:
        raise FormatError(f"{where}: {name} {text!r} is out of range. Stamps are seconds since 1970.")
    return int((seconds * NANOSECONDS).to_integral_value(ROUND_HALF_EVEN))


def parse_nanoseconds(text: str, where: str, name: str = "the stamp") -> int:
    """Turn an integer of nanoseconds into an int; errors as ``parse_seconds``."""
    try:
        stamp = int(text)
    except ValueError as err:
        raise FormatError(f"{where}: {name} is {text!r}, not integer nanoseconds. Correct the line.") from err
    if abs(stamp) >= _STAMP_LIMIT:
        raise FormatError(f"{where}: {name} {text!r} is out of range. Stamps are nanoseconds since 1970.")
    return stamp


def format_seconds(stamp: int) -> str:
    """Write integer nanoseconds as ``sec.nanosec`` with nine digits; the inverse of ``parse_seconds``."""
    sign = "-" if stamp < 0 else ""
    seconds, nanoseconds = divmod(abs(int(stamp)), NANOSECONDS)
    return f"{sign}{seconds}.{nanoseconds:09d}"


def _stripped(stream: Iterator[str]) -> Iterator[tuple[int, str]]:
    for number, line in enumerate(stream, 1):
        yield number, line.rstrip("\r\n")
