"""What finding a stripe mark costs, as ratios to tag detectors within one interleaved run; prints Markdown.

    python benchmarks/marks_speed.py [--rounds 9] [--images 24]

Detection and pose in 640 x 480 images of clutter, marks and tags at 0.5 to 3 m, up to 50 degrees; every method sees
images with its own pattern in the same places. Process CPU time, one thread, the allocator told to keep large buffers.
Before each call the image is copied, untimed, to one place. A ratio is the median of the ratios of each round.
"""

import argparse
from collections.abc import Callable

import cv2
import numpy as np
from mark_raster import Optics
from mark_scenes import MARKS, Pattern, scene
from marks_find import Finder, eye_of
from tag_scenes import NOT_INSTALLED, Detector, Locate, locate_cv2, locate_pupil, tag
from timing import mean_time

from logpose.pipelines.engine.allocator import keep_buffers
from logpose.pipelines.stripe_pose.method import find_marks

SIDE = float(np.sqrt(0.2 * 0.1))
OURS, FLOOR = "stripe mark", "GaussianBlur 5 x 5"
Call = Callable[[np.ndarray], object]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--images", type=int, default=24)
    parser.add_argument("--first", type=int, default=70000)
    args = parser.parse_args()
    keep_buffers()
    cv2.setNumThreads(1)
    work = make_work()
    shown = {id(pattern): images(pattern, args.first, args.images) for pattern, _ in work.values()}
    times = {name: np.empty(args.rounds) for name in work}
    for step in range(-1, args.rounds):  # the first round warms up
        for name, (pattern, call) in work.items():
            times[name][max(step, 0)] = mean_time(call, shown[id(pattern)])
    print(f"## {args.images} images, {args.rounds} rounds\n")
    print("| what | ms per image | the mark's time over it |\n|---|---|---|")
    for name, t in times.items():
        print(f"| {name} | {1e3 * np.median(t):.2f} | {np.median(times[OURS] / t):.3f} |")
    if Detector is None:
        print(f"\n{NOT_INSTALLED}")


def make_work() -> dict[str, tuple[Pattern | None, Call]]:
    """Return what is timed, by name: the pattern in its images, and a function of an image."""
    optics = Optics()
    blurred = np.empty((optics.height, optics.width), np.uint8)
    h11, x4 = tag("36h11", SIDE), tag("4x4", SIDE)

    def by_mark(n: int, *, with_height: bool = False) -> Call:
        finder, eye = Finder(MARKS[:n], with_height=with_height), eye_of(optics)
        return lambda image: find_marks(image, eye, finder.marks, finder.search)

    def by_tag(locate: Locate) -> Call:
        return lambda image: locate(image, optics)

    work: dict[str, tuple[Pattern | None, Call]] = {
        OURS: (MARKS[0], by_mark(1)),
        "same, height of bars known": (MARKS[0], by_mark(1, with_height=True)),
        "same, three marks in the map": (MARKS[0], by_mark(3)),
        "same, no mark in the image": (None, by_mark(1)),
        "cv2 4x4_50": (x4, by_tag(locate_cv2("4x4", SIDE))),
        "cv2 36h11": (h11, by_tag(locate_cv2("36h11", SIDE))),
    }
    if Detector is not None:
        for decimate in (1.0, 2.0):
            work[f"pupil-apriltags, quad_decimate {decimate:g}"] = (h11, by_tag(locate_pupil(SIDE, decimate)))
    return work | {FLOOR: (MARKS[0], lambda image: cv2.GaussianBlur(image, (5, 5), 0, dst=blurred))}


def images(pattern: Pattern | None, first: int, n: int) -> list[np.ndarray]:
    """Return images of one pattern, at places that depend only on their numbers."""
    rng = np.random.default_rng(first)
    made = []
    for k in range(n):
        phi, distance = np.radians(rng.uniform(-50, 50)), rng.uniform(0.5, 3.0)
        made.append(scene(first + k, pattern=pattern, phi=phi, distance=distance).image)
    return made


if __name__ == "__main__":
    main()
