r"""One table, four notations: Markdown, LaTeX ``tabular``, CSV and JSON.

A table is rows of values and a list of columns. Markdown and LaTeX are for reading: numbers rounded, units in the
head, a dash where there is no number. CSV and JSON are for computing: all digits, keys with their units, an empty
cell or ``null`` where there is no number.
"""

import csv
import io
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

Format: TypeAlias = Literal["markdown", "latex", "csv", "json"]
Row: TypeAlias = Mapping[str, object]

NOTHING = "–"

_LATEX = {
    "\\": r"\textbackslash{}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_", "{": r"\{", "}": r"\}",
    "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "–": "--", "±": r"$\pm$", "σ": r"$\sigma$", "°": r"$^\circ$",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Column:
    """One column.

    Attributes:
        key: of the value in each row; the head of the column in CSV and JSON.
        title: the head for readers; the key when empty.
        digits: after the decimal point, for floats; None prints the shortest that reads back.
    """

    key: str
    title: str = ""
    digits: int | None = None

    @property
    def head(self) -> str:
        """What stands above the column for a reader."""
        return self.title or self.key


def render_table(rows: Sequence[Row], columns: Sequence[Column], fmt: Format) -> str:
    """Render a table as text, ending in a newline.

    Args:
        rows: one mapping per row; keys without a column are left out, missing ones are empty.
        columns: from left to right.
        fmt: ``markdown``, ``latex``, ``csv`` or ``json``.

    Raises:
        ValueError: an unknown format, or two columns of one key.
    """
    if len({column.key for column in columns}) != len(columns):
        raise ValueError(f"two columns of one key among {[column.key for column in columns]!r}")
    match fmt:
        case "markdown":
            return _markdown(rows, columns)
        case "latex":
            return _latex(rows, columns)
        case "csv":
            return _csv(rows, columns)
        case "json":
            found = [{column.key: _plain(row.get(column.key)) for column in columns} for row in rows]
            return json.dumps(found, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    raise ValueError(f"unknown table format {fmt!r}")


def format_cell(value: object, digits: int | None = None) -> str:
    """Write one value for a reader; a dash for None and for numbers that do not exist."""
    value = _plain(value)
    match value:
        case None:
            return NOTHING
        case bool():
            return "yes" if value else "no"
        case float():
            text = repr(value) if digits is None else f"{value:.{digits}f}"
            return "0" + text[2:] if text.startswith("-0") and float(text) == 0 else text
        case _:
            return str(value)


def is_right(rows: Sequence[Row], column: Column) -> bool:
    """Tell whether a column holds numbers only, and so is right-aligned."""
    found = [value for row in rows if (value := _plain(row.get(column.key))) is not None]
    return bool(found) and all(isinstance(value, int | float) and not isinstance(value, bool) for value in found)


def _plain(value: object) -> object:
    value = value.item() if hasattr(value, "item") else value
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _markdown(rows: Sequence[Row], columns: Sequence[Column]) -> str:
    def escape(text: str) -> str:
        return text.replace("|", r"\|").replace("\n", " ")

    cells = [[escape(format_cell(row.get(c.key), c.digits)) for c in columns] for row in rows]
    heads = [escape(c.head) for c in columns]
    right = [is_right(rows, c) for c in columns]
    widths = [max(3, *(len(line[i]) for line in [heads, *cells])) for i in range(len(columns))]

    def join(line: Sequence[str]) -> str:
        padded = (text.rjust(w) if r else text.ljust(w) for text, w, r in zip(line, widths, right, strict=True))
        return "| " + " | ".join(padded) + " |"

    rule = "| " + " | ".join("-" * (w - 1) + ":" if r else "-" * w for w, r in zip(widths, right, strict=True)) + " |"
    return "\n".join([join(heads), rule, *(join(line) for line in cells)]) + "\n"


def _latex(rows: Sequence[Row], columns: Sequence[Column]) -> str:
    def escape(text: str) -> str:
        return "".join(_LATEX.get(letter, letter) for letter in text.replace("\n", " "))

    spec = "".join("r" if is_right(rows, c) else "l" for c in columns)
    lines = [
        rf"\begin{{tabular}}{{{spec}}}",
        r"\hline",
        " & ".join(escape(c.head) for c in columns) + r" \\",
        r"\hline",
    ]
    lines += [" & ".join(escape(format_cell(row.get(c.key), c.digits)) for c in columns) + r" \\" for row in rows]
    return "\n".join([*lines, r"\hline", r"\end{tabular}"]) + "\n"


def _csv(rows: Sequence[Row], columns: Sequence[Column]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([c.key for c in columns])
    for row in rows:
        values = [_plain(row.get(c.key)) for c in columns]
        writer.writerow(["" if v is None else repr(v) if isinstance(v, float) else v for v in values])
    return text.getvalue()
