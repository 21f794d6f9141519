"""Reproduces Tables 4 and 5 of the paper: renders its experiment five times and runs both methods on it.

``make tables`` calls it; it takes some minutes. Logs and run folders go to ``papers/ceiling/runs``; a log that is there
is used again, so delete the folder after changing the world or the renderer.
"""

import argparse
import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import tables

HERE = Path(__file__).parent
METHODS = ("paper", "best")


def logpose(*words: str | Path) -> None:
    """Run one command; a status other than 0 (or 3, data lost) ends the script."""
    command = [sys.executable, "-m", "logpose", *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode not in {0, 3}:
        sys.exit(f"{' '.join(command)}\n{done.stderr}")


def one_run(seed: int, work: Path) -> None:
    """Render one drive and localise it with both methods."""
    log = work / f"drive{seed}.mcap"
    if not log.is_file():
        logpose("simulate", HERE / "world.yaml", "-o", log, "--seed", str(seed), "-q")
    for method in METHODS:
        out = work / f"{method}{seed}"
        logpose(
            "localize-pf",
            log,
            "--map",
            log.with_suffix(".landmarks.yaml"),
            "--lamp-diameter",
            "0.135",
            "--waypoints",
            log.with_suffix(".waypoints.yaml"),
            "--method",
            method,
            "--seed",
            str(seed),
            "-q",
            "-o",
            out,
        )
        ate = json.loads((out / "report.json").read_text())["result"]["evaluation"]["ate"]
        print(f"drive {seed}, {method}: rmse {ate['rmse_m']:.4f} m, max {ate['max_m']:.4f} m", flush=True)


def main() -> int:
    """Run what is missing, then print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--work", type=Path, default=HERE / "runs")
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(args.jobs) as pool:
        list(pool.map(lambda seed: one_run(seed, args.work), range(1, args.runs + 1)))
    folders = {method: [args.work / f"{method}{seed}" for seed in range(1, args.runs + 1)] for method in METHODS}
    words = [word for method in METHODS for word in (f"--{method}", *map(str, folders[method]))]
    return tables.main(words)


if __name__ == "__main__":
    sys.exit(main())
