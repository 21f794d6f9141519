"""Marks where there are none, and marks missed in clutter; prints Markdown.

    python benchmarks/marks_false.py [--images 1000] [--scenes 900] [--first 50000]

Images without a mark show walls with doors, posters, shelves, blinds, radiators, pipes, and bright and dark bars of
random widths; every third has a large picket fence. The map has three marks. Scenes with a mark have the same clutter;
in every fourth of them a post hides a tenth to three tenths of the mark, counted apart.
"""

import argparse
from collections import Counter
from itertools import pairwise

import numpy as np
from mark_scenes import MARKS, Scene, scene
from marks_find import OK, Finder

GAPS = (2.0, 3.0, 4.0, 6.0, 10.0, 20.0, np.inf)
NEAR_PX = 3.0


def is_right(made: Scene, found: object, mark: int) -> bool:
    """Tell whether a mark was identified as what it is, where it is: its ends within three pixels."""
    c, s = np.cos(found.pose[0]), np.sin(found.pose[0])
    ends = np.array([MARKS[mark].edges[0], MARKS[mark].edges[-1]])
    seen = (c * ends + found.pose[1]) / (s * ends + found.pose[2])
    phi, dx, dy = made.truth
    true = (np.cos(phi) * ends + dx) / (np.sin(phi) * ends + dy)
    return found.mark == mark and bool((np.abs(seen - true) * made.optics.f < NEAR_PX).all())


def print_false(first: int, n: int) -> None:
    finder = Finder(MARKS)
    false = Counter()
    seeds = []
    for seed in range(first, first + n):
        made = scene(seed, pattern=None, fence=seed % 3 == 0)
        found = finder(made)
        false["fence" if seed % 3 == 0 else "no fence"] += any(item.status == OK for item in found)
        for item in found:
            false[f"status {item.status}"] += 1
        if any(item.status == OK for item in found):
            seeds.append(seed)
    total = false["fence"] + false["no fence"]
    print(f"## {n} images without a mark, a third with a fence, {len(MARKS)} marks in the map\n")
    print(f"false identifications: {total} ({100 * total / n:.2f} %), {false['fence']} with a fence; seeds {seeds}")
    print(f"all that was reported: { {k: v for k, v in false.items() if k.startswith('status')} }\n")


def print_missed(first: int, n: int) -> None:
    finder = Finder(MARKS)
    rng = np.random.default_rng(first)
    rows = []
    for k in range(n):
        mark = k % len(MARKS)
        phi = rng.uniform(-1, 1) * np.radians(70.0)
        distance = float(np.exp(rng.uniform(np.log(0.4), np.log(3.5))))
        hidden = rng.uniform(0.1, 0.3) if k % 4 == 3 else 0.0
        made = scene(first + k, pattern=MARKS[mark], phi=phi, distance=distance, hidden=hidden)
        found = finder.identified(made)
        right = [is_right(made, item, mark) for item in found]
        gap = made.smallest_gap_px
        rows.append((gap, hidden > 0, any(right), len(found) - sum(right), made.is_visible.sum(), first + k))
    print(f"## {n} scenes with a mark in clutter, by the smallest gap\n")
    print("| gap px | found, nothing hidden | found, partly hidden, 5 or more edges clear | false |\n|---|---|---|---|")
    table = np.array(rows)
    for low, high in pairwise(GAPS):
        part = table[(table[:, 0] >= low) & (table[:, 0] < high)]
        whole, cut = part[part[:, 1] == 0], part[(part[:, 1] == 1) & (part[:, 4] >= 5)]
        cells = [
            f"{int(p[:, 2].sum())}/{len(p)} ({100 * p[:, 2].mean():.1f} %)" if len(p) else "-" for p in (whole, cut)
        ]
        print(f"| {low:g} to {high:g} | {' | '.join(cells)} | {int(part[:, 3].sum())} |")
    wide = table[(table[:, 0] >= 3.0) & (table[:, 1] == 0)]
    print(f"\n3 px and more, nothing hidden: {int(wide[:, 2].sum())}/{len(wide)} ({100 * wide[:, 2].mean():.2f} %)")
    print(f"missed: seeds {wide[wide[:, 2] == 0][:, 5].astype(int).tolist()}")
    print(f"false: seeds {table[table[:, 3] > 0][:, 5].astype(int).tolist()}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--images", type=int, default=1000)
    parser.add_argument("--scenes", type=int, default=900)
    parser.add_argument("--first", type=int, default=50000)
    args = parser.parse_args()
    print_false(args.first, args.images)
    print_missed(args.first + 100000, args.scenes)


if __name__ == "__main__":
    main()
