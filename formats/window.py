"""A time window over a log: half-open, in seconds from its first stamp or as stamps."""

import re
from dataclasses import dataclass
from decimal import Decimal

from .errors import ConfigError


@dataclass(frozen=True, slots=True)
class Bound:
    """One end of a window: nanoseconds, from the first stamp of the log or absolute."""

    ns: int
    is_relative: bool = True

    def resolve(self, first: int) -> int:
        """Return the bound as a stamp [ns], given the first stamp of the log."""
        return self.ns + first if self.is_relative else self.ns


@dataclass(frozen=True, slots=True)
class Window:
    """Everything with start <= stamp < end; None is open."""

    start: Bound | None = None
    end: Bound | None = None

    def resolve(self, first: int) -> tuple[int | None, int | None]:
        """Return (start, end) as stamps [ns], given the first stamp of the log."""
        start = None if self.start is None else self.start.resolve(first)
        end = None if self.end is None else self.end.resolve(first)
        return start, end

    def __str__(self) -> str:
        return f"{_shown(self.start, 'the start')} to {_shown(self.end, 'the end')}"


def parse_window(start: str | None, end: str | None, duration: str | None) -> Window | None:
    """Return the window that ``--start``, ``--end`` and ``--duration`` ask for, None for none of them.

    A number is seconds from the start of the log; with ten or more digits before the point it is a stamp in seconds, a
    whole number of 16 or more digits or one that ends in ``ns`` is a stamp in nanoseconds.

    Raises:
        ConfigError: not a number, ``--end`` together with ``--duration``, or an empty window.
    """
    if end is not None and duration is not None:
        raise ConfigError("--end and --duration: only one of them can end the window. Leave one out.")
    first = None if start is None else _bound("--start", start)
    last = None if end is None else _bound("--end", end)
    if duration is not None:
        length = _bound("--duration", duration)
        if not length.is_relative or length.ns <= 0:
            raise ConfigError(f"--duration: {duration!r} is not a duration. Give seconds, like 30 or 2.5.")
        begin = first or Bound(0)
        last = Bound(begin.ns + length.ns, begin.is_relative)
    if first is None and last is None:
        return None
    if first and last and first.is_relative == last.is_relative and last.ns <= first.ns:
        raise ConfigError(f"--end: {end!r} is not after --start {start!r}. Give a later end.")
    return Window(first, last)


def _bound(option: str, text: str) -> Bound:
    cleaned = text.strip()
    if re.fullmatch(r"\d+ns|\d{16,19}", cleaned):
        return Bound(int(cleaned.removesuffix("ns")), is_relative=False)
    match = re.fullmatch(r"(\d{1,12})(\.\d{1,9})?s?", cleaned)
    if not match:
        raise ConfigError(f"{option}: {text!r} is not a time. Give seconds from the start, like 12.5, or a stamp.")
    nanoseconds = int(Decimal(match[1] + (match[2] or "")) * 10**9)
    return Bound(nanoseconds, is_relative=len(match[1]) < 10)


def _shown(bound: Bound | None, default: str) -> str:
    if bound is None:
        return default
    seconds = f"{bound.ns // 10**9}.{bound.ns % 10**9:09d} s"
    return seconds if bound.is_relative else f"stamp {seconds}"
