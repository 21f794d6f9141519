"""What finding circles costs, as ratios to OpenCV within one interleaved run; prints Markdown.

    python benchmarks/detector_speed.py [--rounds 9]

Process CPU time, one thread, glibc's allocator told to keep large buffers (otherwise every OpenCV call pays for page
faults, and ratios swing by 2.5).
"""

import argparse
import ctypes
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np
from detector_accuracy import view_of
from lamp_scenes import HEIGHT, WIDTH, Optics, make_scene

from logpose.pipelines.detect_circles.detect import Search, find_circles
from logpose.pipelines.detect_circles.paper import HoughSearch, find_circles_hough

OPTICS = Optics(k1=-0.2, k2=0.04)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--images", type=int, default=40)
    args = parser.parse_args()
    if sys.platform == "linux":
        libc = ctypes.CDLL(None)
        if hasattr(libc, "mallopt"):
            libc.mallopt(-3, 32 << 20)  # M_MMAP_THRESHOLD
            libc.mallopt(-1, 512 << 20)  # M_TRIM_THRESHOLD
    cv2.setNumThreads(1)
    images = [make_scene(20000 + k, optics=OPTICS).image for k in range(args.images)]
    jpegs = [cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 90])[1] for image in images]
    view = view_of(OPTICS)
    plane, search, hough = view.plane(), Search(10.0, 44.0), HoughSearch(10.0, 44.0)
    blurred, binary = np.empty((HEIGHT, WIDTH), np.uint8), np.empty((HEIGHT, WIDTH), np.uint8)

    def floor(k: int) -> None:
        cv2.GaussianBlur(images[k], (5, 5), 0, dst=blurred)
        cv2.threshold(blurred, 140, 255, cv2.THRESH_BINARY, dst=binary)

    def to_robot(k: int) -> None:
        circles = find_circles(images[k], search, plane)
        view.sight(circles.uv, circles.cov)

    work: dict[str, Callable[[int], object]] = {
        "GaussianBlur5 + threshold": floor,
        "default": lambda k: find_circles(images[k], search, plane),
        "default, no calibration": lambda k: find_circles(images[k], search),
        "default, and in the robot frame": to_robot,
        "blur + threshold + HoughCircles": lambda k: find_circles_hough(images[k], hough),
        "JPEG decode": lambda k: cv2.imdecode(jpegs[k], cv2.IMREAD_GRAYSCALE),
    }
    times = {name: np.empty(args.rounds) for name in work}
    for step in range(-1, args.rounds):  # the first round warms up
        for name, call in work.items():
            start = time.process_time()
            for k in range(len(images)):
                call(k)
            if step >= 0:
                times[name][step] = (time.process_time() - start) / len(images)
    print("| what | us per image | x blur floor | x Hough | x JPEG |")
    print("|---|---|---|---|---|")
    for name, t in times.items():
        ratios = [
            np.median(t / times[other])
            for other in ("GaussianBlur5 + threshold", "blur + threshold + HoughCircles", "JPEG decode")
        ]
        print(f"| {name} | {1e6 * np.median(t):.0f} | " + " | ".join(f"{r:.2f}" for r in ratios) + " |")
    print(f"\nTwo threads: {_two_threads(work['default'], len(images)):.2f} times the images per second of one")


def _two_threads(call: Callable[[int], object], n: int) -> float:
    """Wall-clock gain of two threads over one, best of five."""
    order = list(range(n)) * 10
    best = {1: np.inf, 2: np.inf}
    for _ in range(5):
        for workers in (1, 2):
            with ThreadPoolExecutor(workers) as pool:
                start = time.perf_counter()
                list(pool.map(lambda part: [call(k) for k in part], [order[i::workers] for i in range(workers)]))
                best[workers] = min(best[workers], time.perf_counter() - start)
    return best[1] / best[2]


if __name__ == "__main__":
    main()
