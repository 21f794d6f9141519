"""What finding circles costs, as ratios to OpenCV within one interleaved run; prints Markdown.

    python benchmarks/detector_speed.py [--rounds 11] [--images 40]

Two kinds of 640 x 480 images: ``hard`` ones as they come from ``lamp_scenes`` (up to 12 lamps, some of which touch,
up to 4 decoys, stripes, joints, glare), and ``plain`` ones, those among them with 1 to 4 lamps and at most 2 decoys.

Process CPU time, one thread, glibc's allocator told to keep large buffers (otherwise every OpenCV call pays for page
faults, and ratios swing by 2.5). Before each call the image is copied, untimed, to one place, so that it lies in the
processor's cache as after decoding; from memory the floor alone takes 1.8 times as long. A ratio is the median of the
ratios of each round. The floor and the Hough chain (blur of 7 px, threshold 140, the radii of the default) are bare
OpenCV calls that write into buffers made before.
"""

import argparse
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import count

import cv2
import numpy as np
from detector_accuracy import view_of
from lamp_scenes import HEIGHT, WIDTH, Optics, Scene, make_scene
from timing import mean_time

from logpose.pipelines.detect_circles.detect import Search, find_circles
from logpose.pipelines.detect_circles.paper import HoughSearch, find_circles_hough
from logpose.pipelines.engine.allocator import keep_buffers

OPTICS = Optics(k1=-0.2, k2=0.04)
FIRST_SEED = 20000
RADII = (10.0, 44.0)
FLOOR, HOUGH, JPEG = "GaussianBlur5 + threshold", "blur7 + threshold + HoughCircles", "JPEG decode"
Work = dict[str, Callable[[np.ndarray], object]]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=11)
    parser.add_argument("--images", type=int, default=40)
    args = parser.parse_args()
    keep_buffers()
    cv2.setNumThreads(1)
    chosen = choose_scenes(args.images)
    work = make_work()
    times = {kind: {name: np.empty(args.rounds) for name in (*work, JPEG)} for kind in chosen}
    jpegs = {kind: [encoded(s.image) for s in items] for kind, items in chosen.items()}
    for step in range(-1, args.rounds):  # the first round warms up
        for kind, items in chosen.items():
            for name, call in work.items():
                times[kind][name][max(step, 0)] = mean_time(call, [s.image for s in items])
            times[kind][JPEG][max(step, 0)] = mean_time(decode, jpegs[kind])
    for kind, items in chosen.items():
        n_lamps, n_decoys = sum(len(s.centres) for s in items), sum(len(s.kinds) for s in items)
        print(
            f"## {kind}: n = {len(items)} images, {n_lamps / len(items):.1f} lamps and {n_decoys / len(items):.1f} "
            f"decoys in one, {args.rounds} rounds\n"
        )
        print_table(times[kind])
    gain = two_threads(work["default"], [s.image for s in chosen["hard"]])
    print(f"Two threads: {gain:.2f} times the images per second of one (wall clock, at most the idle processors)")


def choose_scenes(n: int) -> dict[str, list[Scene]]:
    """Return the first n scenes of either kind."""
    plain, hard = [], []
    for seed in count(FIRST_SEED):
        scene = make_scene(seed, optics=OPTICS)
        hard.append(scene)
        if 1 <= len(scene.centres) <= 4 and len(scene.kinds) <= 2:
            plain.append(scene)
        if len(plain) == n:
            break
    return {"plain": plain, "hard": hard[:n]}


def encoded(image: np.ndarray) -> np.ndarray:
    """Return the image as JPEG."""
    return cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 90])[1].ravel()


def decode(jpeg: np.ndarray) -> np.ndarray:
    """Return the image in a JPEG."""
    return cv2.imdecode(jpeg, cv2.IMREAD_GRAYSCALE)


def make_work() -> Work:
    """Return what is timed, by name, each a function of an image."""
    view = view_of(OPTICS)
    plane, search, hough = view.plane(), Search(*RADII), HoughSearch(*RADII)
    blurred, binary = np.empty((HEIGHT, WIDTH), np.uint8), np.empty((HEIGHT, WIDTH), np.uint8)

    def smooth(image: np.ndarray, side: int) -> None:
        cv2.GaussianBlur(image, (side, side), 0, dst=blurred)
        cv2.threshold(blurred, hough.threshold, 255, cv2.THRESH_BINARY, dst=binary)

    def vote(image: np.ndarray) -> None:
        smooth(image, hough.blur_px)
        cv2.HoughCircles(
            binary,
            cv2.HOUGH_GRADIENT,
            dp=1.0,
            minDist=2.0 * RADII[0],
            param1=hough.canny,
            param2=hough.votes,
            minRadius=int(RADII[0]),
            maxRadius=int(RADII[1]),
        )

    return {
        FLOOR: lambda image: smooth(image, 5),
        "default": lambda image: find_circles(image, search, plane),
        "default, and in the robot frame": lambda image: view.sight_circles(find_circles(image, search, plane)),
        "default, no calibration": lambda image: find_circles(image, search),
        HOUGH: vote,
        "method paper": lambda image: find_circles_hough(image, hough),
    }


def print_table(times: dict[str, np.ndarray]) -> None:
    """One line per piece of work."""
    print("| what | us per image | x blur floor | x Hough | x JPEG |")
    print("|---|---|---|---|---|")
    for name, t in times.items():
        ratios = [np.median(t / times[other]) for other in (FLOOR, HOUGH, JPEG)]
        print(f"| {name} | {1e6 * np.median(t):.0f} | " + " | ".join(f"{r:.2f}" for r in ratios) + " |")
    print()


def two_threads(call: Callable[[np.ndarray], object], images: list[np.ndarray]) -> float:
    """Wall-clock gain of two threads over one, best of five."""
    order = images * 10
    best = {1: np.inf, 2: np.inf}
    for _ in range(5):
        for workers in (1, 2):
            with ThreadPoolExecutor(workers) as pool:
                start = time.perf_counter()
                list(
                    pool.map(lambda part: [call(image) for image in part], [order[i::workers] for i in range(workers)])
                )
                best[workers] = min(best[workers], time.perf_counter() - start)
    return best[1] / best[2]


if __name__ == "__main__":
    main()
