"""HTML, piece by piece: everything that comes from a log or a user is escaped here and nowhere else."""

from collections.abc import Sequence
from html import escape

from .tables import Column, Row, format_cell, is_right


def section(title: str, *parts: str) -> str:
    """Put a heading over parts that are HTML already; nothing when all are empty."""
    body = "\n".join(part for part in parts if part)
    return f"<section>\n<h2>{escape(title)}</h2>\n{body}\n</section>" if body else ""


def figure(svg: str, title: str, caption: str) -> str:
    """Frame a picture; on a narrow screen it scrolls sideways rather than becoming too small to read."""
    drawn = svg.replace("<svg ", f'<svg role="img" aria-label="{escape(title)}" ', 1)
    return (
        f'<figure>\n<div class="picture">{drawn}</div>\n'
        f"<figcaption><strong>{escape(title)}.</strong> {escape(caption)}</figcaption>\n</figure>"
    )


def table(rows: Sequence[Row], columns: Sequence[Column], caption: str = "") -> str:
    """Render a table; numbers stand right-aligned, the last rows may be marked by a true ``is_sum``."""
    if not rows:
        return ""
    right = {column.key for column in columns if is_right(rows, column)}
    marks = dict.fromkeys(right, ' class="number"')
    head = "".join(f"<th{marks.get(column.key, '')}>{escape(column.head)}</th>" for column in columns)
    lines = [f"<caption>{escape(caption)}</caption>"] if caption else []
    lines += [f"<thead><tr>{head}</tr></thead>", "<tbody>"]
    for row in rows:
        is_sum = bool(row.get("is_sum"))
        cells = [
            f"<td{marks.get(c.key, '')}>"
            + ("" if is_sum and row.get(c.key) is None else escape(format_cell(row.get(c.key), c.digits)))
            for c in columns
        ]
        lines.append(('<tr class="sum">' if is_sum else "<tr>") + "</td>".join(cells) + "</td></tr>")
    inner = "\n".join([*lines, "</tbody>"])
    return f'<div class="wide"><table>\n{inner}\n</table></div>'


def preformatted(text: str) -> str:
    """Show text as it is."""
    return f"<pre>{escape(text)}</pre>"
