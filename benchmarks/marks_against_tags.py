"""A stripe mark against fiducial tags of the same printed area, in the same places; prints Markdown.

    python benchmarks/marks_against_tags.py [--scenes 8] [--first 30000]

The mark's bars cover 200 mm x 100 mm, the black squares of the tags 141.4 mm x 141.4 mm; margins are not counted.
Every pose, wall, light and noise is rendered with each pattern. Errors are in the level camera frame, which the camera
does not know (tilt up to 5 degrees, roll of 0.4): the mark levels itself by its edges, a tag by its own attitude.
"""

import argparse
from collections.abc import Callable

import cv2
import numpy as np
from mark_scenes import MARKS, Pattern, Scene, scene
from marks_find import Finder
from tag_scenes import NOT_INSTALLED, Detector, Locate, locate_cv2, locate_pupil, tag

SIDE = float(np.sqrt(0.2 * 0.1))
DISTANCES = (0.5, 1.0, 2.0, 3.0)
YAWS = (0, 20, 40, 60, 70)
WITH, WITHOUT = "stripe mark, height of bars known", "stripe mark, not known"
PUPIL, CV2 = "pupil-apriltags, quad_decimate 1", "cv2 36h11"
UNITS = (180 / np.pi, 1e3, 1e3)
NAMES = ("yaw", "lateral", "depth")
Errors = dict[str, dict[tuple[float, int], np.ndarray]]
Look = Callable[[Scene], np.ndarray | None]


def methods() -> dict[str, tuple[Pattern, Look]]:
    """Return what is compared: the pattern, and a function from a scene to yaw, lateral offset and depth."""

    def mark(*, with_height: bool) -> Look:
        finder = Finder((MARKS[0],), with_height=with_height)
        return lambda made: next((found.pose for found in finder.identified(made)), None)

    def by(locate: Locate) -> Look:
        return lambda made: locate(made.image, made.optics)

    h11, x4 = tag("36h11", SIDE), tag("4x4", SIDE)
    chosen: dict[str, tuple[Pattern, Look]] = {
        WITH: (MARKS[0], mark(with_height=True)),
        WITHOUT: (MARKS[0], mark(with_height=False)),
    }
    if Detector is not None:
        chosen[PUPIL] = (h11, by(locate_pupil(SIDE, 1.0)))
        chosen["pupil-apriltags, quad_decimate 2"] = (h11, by(locate_pupil(SIDE, 2.0)))
    chosen[CV2] = (h11, by(locate_cv2("36h11", SIDE)))
    chosen["cv2 4x4_50"] = (x4, by(locate_cv2("4x4", SIDE)))
    return chosen


def measure(first: int, n: int) -> Errors:
    """Return errors (n, 3) of each method in each cell, nan where it gave no pose [degrees, mm, mm]."""
    looks = methods()
    errors: Errors = {name: {} for name in looks}
    for i, distance in enumerate(DISTANCES):
        for j, yaw in enumerate(YAWS):
            cell = {name: np.full((n, 3), np.nan) for name in looks}
            for k in range(n):
                seed = first + (i * len(YAWS) + j) * 1000 + k
                phi = np.radians(yaw if k % 2 else -yaw)
                images: dict[int, Scene] = {}
                for name, (pattern, look) in looks.items():
                    if id(pattern) not in images:
                        images[id(pattern)] = scene(seed, pattern=pattern, phi=phi, distance=distance)
                    made = images[id(pattern)]
                    pose = look(made)
                    if pose is not None:
                        cell[name][k] = (pose - made.truth) * UNITS
            for name in looks:
                errors[name][distance, yaw] = cell[name]
    return errors


def gather(errors: Errors, name: str, distances: tuple[float, ...], yaws: tuple[int, ...]) -> np.ndarray:
    """Return the errors of one method in several cells."""
    return np.concatenate([errors[name][d, y] for d in distances for y in yaws])


def ratios(errors: Errors, name: str, peer: str, distances: tuple[float, ...], yaws: tuple[int, ...]) -> str:
    """Return ratios of median errors where both give a pose, and in how many scenes."""
    ours, theirs = gather(errors, name, distances, yaws), gather(errors, peer, distances, yaws)
    both = np.isfinite(ours[:, 0]) & np.isfinite(theirs[:, 0])
    if both.sum() < 3:
        return f"- (n {both.sum()})"
    ratio = np.median(np.abs(ours[both]), axis=0) / np.median(np.abs(theirs[both]), axis=0)
    return " / ".join(f"{r:.2f}" for r in ratio) + f" (n {both.sum()} of {len(both)})"


def print_errors(errors: Errors) -> None:
    """Medians and 90th percentiles of each cell."""
    for distance in DISTANCES:
        print(f"\n## {distance} m: median |error| [90 %] of yaw degrees, lateral mm, depth mm; number found\n")
        print("| method | " + " | ".join(f"{yaw} degrees" for yaw in YAWS) + " |")
        print("|---|" + "---|" * len(YAWS))
        for name, cells in errors.items():
            texts = []
            for yaw in YAWS:
                e = np.abs(cells[distance, yaw])
                e = e[np.isfinite(e[:, 0])]
                text = f"{len(e)}/{len(cells[distance, yaw])}"
                if len(e):
                    pairs = zip(np.median(e, axis=0), np.quantile(e, 0.9, axis=0), strict=True)
                    text = ", ".join(f"{m:.3g} [{q:.3g}]" for m, q in pairs) + f"; {text}"
                texts.append(text)
            print(f"| {name} | {' | '.join(texts)} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=8, help="in each cell")
    parser.add_argument("--first", type=int, default=30000)
    args = parser.parse_args()
    cv2.setNumThreads(1)
    print(f"# Stripe mark and tags: {args.scenes} scenes in each cell, seeds from {args.first}")
    if Detector is None:
        print(f"\n{NOT_INSTALLED}")
    errors = measure(args.first, args.scenes)
    print_errors(errors)
    for peer in (PUPIL, CV2):
        if peer not in errors:
            continue
        print(f"\n## Median errors over those of {peer}: {' / '.join(NAMES)}, where both give a pose\n")
        print("| method, yaw | " + " | ".join(f"{distance} m" for distance in DISTANCES) + " |")
        print("|---|" + "---|" * len(DISTANCES))
        for name in (WITH, WITHOUT):
            for yaws in ((0,), (20, 40), (60, 70), (0, 20, 40)):
                cells = " | ".join(ratios(errors, name, peer, (distance,), yaws) for distance in DISTANCES)
                print(f"| {name}, {', '.join(map(str, yaws))} degrees | {cells} |")
    print("\n## Poses off by more than 5 degrees of yaw\n\n| method | off | poses |\n|---|---|---|")
    for name in errors:
        e = gather(errors, name, DISTANCES, YAWS)[:, 0]
        print(f"| {name} | {int((np.abs(e) > 5).sum())} | {int(np.isfinite(e).sum())} |")


if __name__ == "__main__":
    main()
