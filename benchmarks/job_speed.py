"""How fast the whole job is: images per second of ``localize-pf`` on a raw and on a JPEG log, and what takes the time.

    python benchmarks/job_speed.py

Prints Markdown: medians over ROUNDS rounds, in each of which the raw and the JPEG log take turns, with the least and
the greatest value in brackets. Both logs are the same rendered drive. Every round is a process of its own, as a user
starts it, so that imports count; the kernels were compiled by a round before that does not count.

Shares are of the seconds of all stages, as ``report.json`` has them. What decoding the images takes is measured in the
same round on the same images, in a process that only reads the log, in turns with and without decoding; the fastest
pass of each counts. Imports, compiled kernels and pictures take the same time for any log; this one is short, so the
last row says how fast images go through detector and filter once all of that is loaded.
"""

import json
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path
from statistics import median

ROOT = Path(__file__).parent.parent
WORLD = ROOT / "sample_logs" / "ceiling.world.yaml"
LAMP_M = 0.12
ROUNDS = 3
READING = """
import sys, time
import cv2
from logpose.formats.events import Image
from logpose.formats.images import grey
from logpose.formats.log import open_log
from logpose.pipelines.engine.allocator import keep_buffers

keep_buffers()
cv2.setNumThreads(1)
best = {True: 1e9, False: 1e9}
for is_decoded in (True, False) * 4:
    start, n = time.perf_counter(), 0
    for event in open_log([sys.argv[1]], {"image": "auto"}):
        if isinstance(event, Image):
            n += 1
            if is_decoded:
                grey(event)
    best[is_decoded] = min(best[is_decoded], time.perf_counter() - start)
print(n, best[False], best[True])
"""
LOADED = """
import contextlib, os, sys, time
from logpose.cli.main import call

words = ["localize-pf", *sys.argv[1:], "-q", "-o", "-"]
with open(os.devnull, "w") as nowhere, contextlib.redirect_stdout(nowhere):
    call([*words, "--duration", "2"])
    start = time.perf_counter()
    call(words)
    seconds = time.perf_counter() - start
print(seconds)
"""


def python(*words: object) -> str:
    return subprocess.run([sys.executable, *map(str, words)], check=True, capture_output=True, text=True).stdout


def one_round(log: Path, out: Path) -> dict[str, float]:
    """Run the job once and return its figures."""
    landmarks = log.with_suffix(".landmarks.yaml")
    start = time.perf_counter()
    words = ("--map", landmarks, "--set", f"detect-circles.lamp_diameter_m={LAMP_M}")
    python("-m", "logpose", "localize-pf", log, *words, "-q", "-o", out)
    wall = time.perf_counter() - start
    report = json.loads((out / "report.json").read_text())
    seconds: dict[str, float] = defaultdict(float)
    for stage in report["stages"]:
        seconds[stage["name"]] += stage["seconds"]
    job = sum(seconds.values())
    n, plain, decoded = map(float, python("-c", READING, log).split())
    figures = {
        "images": n,
        "images/s, the whole process": n / wall,
        "images/s, its stages": n / job,
        "images/s, without write-report": n / (job - seconds["write-report"]),
        "decoding / stages": (decoded - plain) / job,
        "reading + decoding / stages": decoded / job,
        "start, imports, end / process": 1 - job / wall,
    }
    loaded = python("-c", LOADED, log, *words)
    shares = {f"{name} / stages": value / job for name, value in seconds.items()}
    return figures | shares | {"images/s, loaded, no report": n / float(loaded)}


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        logs = {}
        for name, encoding in (("raw", "mono8"), ("JPEG", "jpeg")):
            logs[name] = Path(folder) / f"{name}.mcap"
            python("-m", "logpose", "simulate", WORLD, "-o", logs[name], "-q", "--set", f"camera.encoding={encoding}")
        rounds: dict[str, list[dict[str, float]]] = {name: [] for name in logs}
        for i in range(ROUNDS + 1):
            for name, log in logs.items():
                figures = one_round(log, Path(folder) / f"{name}.out")
                if i > 0:
                    rounds[name].append(figures)
    print(
        f"n = {ROUNDS} rounds, {rounds['raw'][0]['images']:.0f} images of 480 x 360 px each; median [least, greatest]\n"
    )
    print("| | " + " | ".join(rounds) + " |")
    print("|---|" + "---|" * len(rounds))
    for key in list(rounds["raw"][0])[1:]:
        columns = [[figures[key] for figures in rounds[name]] for name in rounds]
        digits = 0 if key.startswith("images") else 3
        cells = [f"{median(c):.{digits}f} [{min(c):.{digits}f}, {max(c):.{digits}f}]" for c in columns]
        print(f"| {key} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
