"""How well circles are found: recall, precision, error of the centre, bias, false circles; prints Markdown.

    python benchmarks/detector_accuracy.py [--scenes 200] [--first 60000]

Scenes from seed 60000 on were never used to choose a number of the detector. With LOGPOSE_DATA set, also the real
negatives (checkerboards, office, street) and the round objects of smarties.png.
"""

import argparse
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
from lamp_scenes import CEILING_M, HEIGHT, WIDTH, Optics, Scene, make_scene
from recordings import NEGATIVES, fitted

from logpose.pipelines.detect_circles.detect import Circles, Plane, Search, find_circles
from logpose.pipelines.detect_circles.paper import HoughSearch, find_circles_hough
from logpose.pipelines.detect_circles.paper import sight as paper_sight
from logpose.pipelines.detect_circles.sighting import View
from logpose.pipelines.geometry.camera import Camera
from logpose.pipelines.geometry.mount import UP

RADII = (8.0, 48.0)
MATCH_PX = 8.0
Find = Callable[[np.ndarray, Plane | None, str], Circles]


def find_best(image: np.ndarray, plane: Plane | None, polarity: str) -> Circles:
    return find_circles(image, Search(*RADII, polarity=polarity), plane)


def find_in_image(image: np.ndarray, _: Plane | None, polarity: str) -> Circles:
    return find_circles(image, Search(*RADII, polarity=polarity))


def find_paper(image: np.ndarray, _: Plane | None, polarity: str) -> Circles:
    return find_circles_hough(image, HoughSearch(*RADII, polarity=polarity))


def find_otsu(image: np.ndarray, _: Plane | None, polarity: str) -> Circles:
    return find_circles_hough(image, HoughSearch(*RADII, polarity=polarity, threshold=None))


METHODS: dict[str, Find] = {
    "default": find_best,
    "default, no calibration": find_in_image,
    "paper": find_paper,
    "paper, Otsu": find_otsu,
}


def view_of(optics: Optics) -> View:
    """The detector's idea of the camera: right but for the tilt, which no log tells."""
    camera = Camera(optics.f, optics.f, optics.cx, optics.cy, "plumb_bob", (optics.k1, optics.k2, 0.0, 0.0, 0.0))
    return View(camera, WIDTH, HEIGHT, UP, np.zeros(3), CEILING_M)


def compare(scene: Scene, circles: Circles) -> tuple[list[tuple[int, int]], list[tuple[int, int]], int]:
    """Return pairs (lamp, circle) of whole lamps, of cut lamps, and the number of false circles."""
    whole, cut, n_false = [], [], 0
    taken: set[int] = set()
    for i in np.argsort(-circles.score, kind="stable"):
        distance = np.linalg.norm(scene.centres - circles.uv[i], axis=1)
        k = int(distance.argmin()) if len(distance) else -1
        if k < 0 or distance[k] > MATCH_PX or k in taken:
            n_false += 1
            continue
        taken.add(k)
        (whole if scene.is_whole[k] else cut).append((k, int(i)))
    return whole, cut, n_false


def scene_rows(first: int, n_scenes: int) -> list[str]:
    """One line per method over rendered scenes."""
    tallies: dict[str, dict[str, list[float]]] = {
        name: {key: [] for key in ("error", "nees", "cut", "counts")} for name in METHODS
    }
    for seed in range(first, first + n_scenes):
        scene = make_scene(seed)
        plane = view_of(scene.optics).plane()
        for name, find in METHODS.items():
            circles = find(scene.image, plane, "bright")
            whole, cut, n_false = compare(scene, circles)
            tally = tallies[name]
            tally["counts"].append((len(whole), int(scene.is_whole.sum()), n_false, len(cut), (~scene.is_whole).sum()))
            for pairs, key in ((whole, "nees"), (cut, "cut")):
                for k, i in pairs:
                    e = circles.uv[i] - scene.centres[k]
                    tally[key].append(float(e @ np.linalg.solve(circles.cov[i], e)))
                    if key == "nees":
                        tally["error"].append(float(np.hypot(*e)))
    rows = []
    for name, tally in tallies.items():
        hits, lamps, false, n_cut, all_cut = np.sum(tally["counts"], axis=0)
        errors = np.array(tally["error"])
        rows.append(
            f"| {name} | {hits / lamps:.4f} ({hits}/{lamps}) | {hits / max(hits + false, 1):.4f} ({false} false) | "
            f"{np.sqrt((errors**2).mean()):.4f} | {np.median(errors):.4f} | {np.quantile(errors, 0.95):.3f} | "
            f"{np.mean(tally['nees']) / 2:.2f} | {n_cut}/{all_cut} | {np.mean(np.array(tally['cut']) < 11.8):.2f} |"
        )
    return rows


def corner_rows(n: int = 60) -> list[str]:
    """Bias of range and bearing of a lamp near the image's corner, level camera, 2.42 m."""
    rng = np.random.default_rng(5)
    rows = []
    for k1 in (0.0, -0.25):
        along, across = {name: [] for name in METHODS}, {name: [] for name in METHODS}
        for trial in range(n):
            optics = Optics(k1=k1, k2=-0.2 * k1)
            r = rng.uniform(18, 32)
            corner = np.array([rng.choice([r + 6, WIDTH - 7 - r]), rng.choice([r + 6, HEIGHT - 7 - r])])
            scene = corner_scene(optics, corner + rng.uniform(-2, 2, 2), r, trial)
            view = view_of(optics)
            truth = CEILING_M * optics.to_plane(scene.centres[0]) @ np.array([[0.0, 1.0], [-1.0, 0.0]])
            outward = truth / np.hypot(*truth)
            for name, find in METHODS.items():
                circles = find(scene.image, view.plane() if name == "default" else None, "bright")
                whole, _, _ = compare(scene, circles)
                if whole:
                    uv = circles.uv[[whole[0][1]]]
                    xy = paper_sight(uv, view) if "paper" in name else view.to_robot(uv)
                    along[name].append(float((xy[0] - truth) @ outward))
                    across[name].append(float((xy[0] - truth) @ (-outward[1], outward[0])))
        for name in METHODS:
            a, b = 1e3 * np.array(along[name]), 1e3 * np.array(across[name])
            rows.append(
                f"| {name} | {k1} | {len(a)}/{n} | {a.mean():+.3f} | {b.mean():+.3f} | {a.std():.3f} | {b.std():.3f} |"
            )
    return rows


def corner_scene(optics: Optics, at: np.ndarray, radius: float, seed: int) -> Scene:
    """One lamp in an image with noise and vignetting, nothing else."""
    from lamp_scenes import _Canvas, _finish

    canvas = _Canvas(optics, np.random.default_rng([7, seed]))
    canvas.pixels += 70.0
    canvas.paint(at, 1.6 * radius + 6, lambda a, b: a * a + b * b < radius * radius, 200.0)
    return _finish(canvas, [(at, radius, 130.0)], [])


def real_rows(data: Path) -> list[str]:
    """False circles on images without lamps, bright and dark, and the round objects of smarties.png."""
    images = {name: [fitted(p) for p in sorted(data.glob(pattern))] for name, pattern in NEGATIVES.items()}
    smarties = fitted(data / "opencv_calib/smarties.png")
    rows = []
    for name, find in METHODS.items():
        if name == "default":
            continue  # these images have no calibration
        cells = [
            f"{sum(len(find(i, None, 'bright')) for i in items)} / {sum(len(find(i, None, 'dark')) for i in items)}"
            for items in images.values()
        ]
        found = find(smarties, None, "dark")
        rows.append(f"| {name} | {' | '.join(cells)} | {len(found)} |")
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=200)
    parser.add_argument("--first", type=int, default=60000)
    args = parser.parse_args()
    print(f"## Rendered scenes, seeds {args.first}..{args.first + args.scenes - 1}\n")
    print("| method | recall | precision | rmse px | median | p95 | NEES/2 | cut seen | cut in 3 sigma |")
    print("|---|---|---|---|---|---|---|---|---|")
    print("\n".join(scene_rows(args.first, args.scenes)))
    print("\n## Image corners: bias and spread along range and across it, at 2.42 m [mm]\n")
    print("| method | k1 | found | range bias | bearing bias | range sd | bearing sd |")
    print("|---|---|---|---|---|---|---|")
    print("\n".join(corner_rows()))
    if data := os.environ.get("LOGPOSE_DATA"):
        print("\n## Real images: false circles (bright / dark), and smarties.png (dark)\n")
        print("| method | 13 boards | 30 office | 20 street | smarties, of 12 in view |")
        print("|---|---|---|---|---|")
        print("\n".join(real_rows(Path(data))))


if __name__ == "__main__":
    main()
