"""``report.html``: one page that needs nothing else, the same bytes for the same run.

At the top one sentence that says how it went; then the warnings, the pictures, each with a word on what to look for,
the tables, the pipeline as it ran, and what it was made from. No clock is read and no timing shown.
"""

import re
from collections.abc import Mapping
from html import escape

from ... import __version__
from .contents import PICTURES
from .drawing import DARK, LIGHT, drawing, to_svg
from .findings import Findings
from .kinds import KINDS
from .markup import figure, preformatted, section
from .page_tables import (
    counts_table,
    evaluation_tables,
    inputs_table,
    notices_table,
    topics_table,
    waypoints_table,
)
from .verdict import verdict

_STYLE = """
:root { color-scheme: light dark; %(light)s }
@media (prefers-color-scheme: dark) { :root { %(dark)s } }
@media print { :root { %(light)s } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink); font: 16px/1.5 system-ui, sans-serif; }
main { max-width: 62rem; margin: 0 auto; padding: 1.5rem 1rem 4rem; }
h1 { font-size: 1.5rem; line-height: 1.25; margin: 0 0 .75rem; }
h2 { font-size: 1.15rem; margin: 2.5rem 0 .75rem; padding-top: .75rem; border-top: 1px solid var(--grid); }
.verdict { font-size: 1.15rem; margin: 0 0 1rem; }
figure { margin: 0 0 2rem; }
.picture, .wide { overflow-x: auto; }
.picture svg { display: block; width: 100%%; min-width: 38rem; height: auto; }
svg * { stroke-linejoin: round; stroke-linecap: butt; }
svg text { paint-order: stroke; stroke: var(--paper); stroke-width: 2px; stroke-linejoin: round; }
figcaption { color: var(--muted); font-size: .92rem; margin-top: .4rem; max-width: 48rem; }
figcaption strong { color: var(--ink); }
table { border-collapse: collapse; font-size: .88rem; margin: 0 0 1.5rem; font-variant-numeric: tabular-nums; }
caption { text-align: left; font-weight: 600; padding: .25rem 0; }
th, td { padding: .25rem 1.1rem .25rem 0; text-align: left; vertical-align: top; border-bottom: 1px solid var(--grid); }
th { vertical-align: bottom; color: var(--muted); font-weight: 600; }
th.number, td.number { text-align: right; white-space: nowrap; }
tr.sum td { font-weight: 600; }
pre { overflow-x: auto; font-size: .85rem; line-height: 1.4; padding: .75rem; border: 1px solid var(--grid); }
footer { color: var(--muted); font-size: .85rem; margin-top: 3rem; }
@media print {
  body { font-size: 10pt; }
  main { max-width: none; padding: 0; }
  figure, tr { break-inside: avoid; }
  h2 { break-after: avoid; }
  .picture, .wide { overflow: visible; }
  .picture svg { min-width: 0; }
  pre { white-space: pre-wrap; }
}
"""


def render_page(findings: Findings, *, title: str = "logpose report") -> str:
    """Render the page.

    Args:
        findings: of a run that has ended; whatever is missing is left out.
        title: of the page.
    """
    run = findings.results.get("run", {})
    pipeline = run.get("pipeline")
    parts = [
        f"<h1>{escape(title)}</h1>",
        f'<p class="verdict">{escape(_unbroken(verdict(findings)))}</p>',
        section("Warnings", notices_table(findings)),
        section("Pictures", *_pictures(findings)),
        *(kind.section(findings) for kind in KINDS),
        section("Way points", waypoints_table(findings)),
        section("Results", *evaluation_tables(findings)),
        section("Messages", counts_table(findings)),
        section("Parameters", topics_table(findings), preformatted(pipeline) if isinstance(pipeline, str) else ""),
        section("Made from", inputs_table(findings)),
        f"<footer>logpose {escape(__version__)}</footer>",
    ]
    style = _STYLE % {"light": _variables(LIGHT), "dark": _variables(DARK)}
    body = "\n".join(part for part in parts if part)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{style}</style>\n</head>\n<body>\n<main>\n{body}\n</main>\n</body>\n</html>\n"
    )


def _pictures(findings: Findings) -> list[str]:
    found = []
    with drawing():
        for picture in PICTURES:
            drawn = picture.draw(findings)
            if drawn is not None:
                found.append(figure(to_svg(drawn, picture.name), picture.title, picture.caption(findings)))
    return found


def _unbroken(sentence: str) -> str:
    """Keep numbers and their units on one line."""
    return re.sub(r"(?<=\d) (?=(%|m|cm|mm|s)\b|%)", "\u00a0", sentence)


def _variables(colours: Mapping[str, str]) -> str:
    return " ".join(f"--{role}: {colour};" for role, colour in colours.items())
