"""Reproduces Fig. 7, the design of section V with Fig. 8, and what sections IV.B and IV.C say of tilt and height.

``make tables`` calls it; it takes some minutes. Logs and run folders go to ``papers/stripe/runs``; a log that is there
is used again, so delete the folder after changing the world or the renderer. The tables go beside this file, as
Markdown; all cells of the design (CSV, JSON, LaTeX) and the pictures go to the folder of the logs. ``--quick`` renders
a handful of images, to try the whole way.
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import figure7
import figure8
import levels
import section5
from rendered import HERE, Chunk, Results, joined, run_all

from logpose.pipelines.report.tables import Column, Format, render_table

FORMATS: Mapping[str, Format] = {"csv": "csv", "json": "json", "tex": "latex"}


def main(argv: Sequence[str] | None = None) -> int:
    """Run what is missing, write the tables, and print them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=12, help="images per cell of Fig. 8")
    parser.add_argument("--others", type=int, default=3, help="images per cell of the rest of the design")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--work", type=Path, default=HERE / "runs", help="logs, run folders, pictures, all cells")
    parser.add_argument("-o", "--output", type=Path, default=HERE, metavar="DIR", help="where to write the tables")
    parser.add_argument("--quick", action="store_true", help="a few cells with a few images only")
    args = parser.parse_args(argv)
    args.output.mkdir(parents=True, exist_ok=True)
    chunks = quick_design() if args.quick else figure8.design(repeats=args.repeats, others=args.others)
    results = joined(run_all({chunk.name: chunk for chunk in chunks}, args.work, jobs=args.jobs).values())
    leaning = run_all(levels.rendered_leans(is_quick=args.quick), args.work, jobs=args.jobs)
    tables = {
        "figure7.md": figure7.page(),
        "section5.md": section5.page(),
        "figure8.md": figure8.page(results),
        "levels.md": levels.page(levels.measured(leaning)),
    }
    for name, text in tables.items():
        (args.output / name).write_text(text, encoding="utf-8")
        print(text)
    write_cells(results, args.work)
    from pictures import write_pictures

    write_pictures(results, args.work)
    return 0


def quick_design() -> list[Chunk]:
    """Return one distance, two angles."""
    return [Chunk("shown500", (500,), (0,), (0, 40), 2)]


def write_cells(results: Results, folder: Path) -> None:
    """Write all cells of the design in all formats."""
    rows = figure8.rows(results)
    heads = [Column(key) for key in rows[0]]
    for suffix, fmt in FORMATS.items():
        (folder / f"cells.{suffix}").write_text(render_table(rows, heads, fmt), encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
