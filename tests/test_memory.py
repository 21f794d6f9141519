"""Runs from outside: how much memory they take, and what is left when they are stopped in the middle."""

import signal
import subprocess
import sys
import time
from dataclasses import replace

import pytest

from logpose.formats.events import CameraInfo, Image, Odometry, Pose
from logpose.formats.write_log import create_log
from logpose.pipelines.simulate.simulate import simulate
from logpose.pipelines.simulate.world import read_world
from logpose.pipelines.simulate.write import write_simulation

SHORT, LONG = 100, 400
IMAGE_MIB = 640 * 480 / 2**20
HELD_MIB = (LONG - SHORT) * IMAGE_MIB
"""What a run that kept its images would take more for the long log: 88 MiB."""
BOUND_MIB = 16.0
"""What it may: some kB per image for poses, records and indexes (< 2 MiB), and what the allocator does not give back."""

# The shell may have SIGINT ignored (a job in the background), and children inherit that.
ENTRY = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)
from logpose.cli.main import main
main()
"""
# ru_maxrss begins with the size of the process that forked this one, so that the test's own size would hide the job's.
# Between the two stands an interpreter of some MiB.
MEASURED = """
import resource, subprocess, sys
job = subprocess.run([sys.executable, "-m", "logpose", *sys.argv[1:]], stdout=subprocess.DEVNULL)
peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
print(peak / 1024**(2 if sys.platform == "darwin" else 1))
sys.exit(job.returncode)
"""


@pytest.fixture(scope="module")
def world(root):
    """The sample room, with images of 640 x 480 pixels, uncompressed."""
    camera = {"width_px": 640, "height_px": 480, "encoding": "mono8"}
    waypoints = [{"name": "A", "x_m": 2.0, "y_m": 1.8}, {"name": "B", "x_m": 2.2, "y_m": 1.8}]
    settings = [
        ("robot.waypoints", waypoints),
        ("robot.is_closed", False),
        ("sensor.blur_samples", 1),
        ("ceiling.landmarks", {"count": 24, "near_route": 2}),
        *((f"camera.{key}", value) for key, value in camera.items()),
    ]
    return read_world(root / "sample_logs" / "ceiling.world.yaml", settings)


@pytest.fixture(scope="module")
def logs(world, tmp_path_factory):
    """A robot that stands still and takes the same picture again and again: a short log, a long one, and their map."""
    folder = tmp_path_factory.mktemp("logs")
    write_simulation(world, folder / "drive.mcap", 1)
    once, first = [], {}
    for event in simulate(world, 1):
        if type(event) in (Image, CameraInfo, Odometry) or event.topic == "/ground_truth/pose":
            first.setdefault(event.topic, event)
        elif event.topic in ("/tf_static", "/initialpose"):
            once.append(event)
        if len(first) == 4:
            break
    assert {type(e) for e in first.values()} == {Image, CameraInfo, Odometry, Pose}
    for name, count in {"short": SHORT, "long": LONG}.items():
        with create_log(folder / f"{name}.mcap") as log:
            for event in once:
                log.write(event)
            for i in range(count):
                for event in first.values():
                    still = (
                        {"linear": event.linear * 0, "angular": event.angular * 0} if type(event) is Odometry else {}
                    )
                    log.write(replace(event, stamp=event.stamp + i * 125_000_000, **still))
    return folder


@pytest.fixture(scope="module")
def compiled(logs):
    """The kernels, compiled: the compiler takes more memory than any run."""
    peak_mib("localize-pf", logs / "drive.mcap", "--map", logs / "drive.landmarks.yaml", "-q", "-o", logs / "first")


def peak_mib(*words):
    done = subprocess.run(
        [sys.executable, "-S", "-c", MEASURED, *map(str, words)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return float(done.stdout)


@pytest.mark.parametrize(("command", "workers"), [("detect-circles", 4), ("localize-pf", 1), ("localize-pf", 4)])
def test_peak_memory_does_not_grow_with_the_log(logs, compiled, tmp_path, command, workers):
    words = ("--map", logs / "drive.landmarks.yaml", "-q", "--workers", workers)
    peaks = [peak_mib(command, logs / f"{n}.mcap", *words, "-o", tmp_path / n) for n in ("short", "long")]
    assert HELD_MIB > 5 * BOUND_MIB, "the logs are too short to show anything"
    assert peaks[1] - peaks[0] < BOUND_MIB, peaks


@pytest.fixture
def started(logs, tmp_path):
    """A run that is in the middle: its files have their temporary names and grow."""
    out = tmp_path / "out"
    words = ["localize-pf", logs / "long.mcap", "--map", logs / "drive.landmarks.yaml", "-o", out]
    job = subprocess.Popen(
        [sys.executable, "-c", ENTRY, *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        until = time.monotonic() + 60
        while not any(p.stat().st_size for p in out.glob(".sightings.jsonl.*.tmp")):
            assert job.poll() is None, job.communicate()
            assert time.monotonic() < until, "nothing was written within a minute"
            time.sleep(0.01)
        yield job, out
    finally:
        job.kill()
        job.communicate()


@pytest.mark.parametrize(
    ("number", "status", "word"), [(signal.SIGTERM, 143, "terminated."), (signal.SIGINT, 130, "interrupted.")]
)
def test_a_run_that_is_stopped_says_so_and_leaves_nothing(started, number, status, word):
    job, out = started
    job.send_signal(number)
    stdout, stderr = job.communicate(timeout=30)
    assert (job.returncode, stdout) == (status, "")
    assert stderr.splitlines()[-1] == word
    assert not out.exists()


def test_a_run_that_is_killed_leaves_nothing_under_a_final_name(started):
    job, out = started
    job.kill()
    assert job.wait(timeout=30) == -signal.SIGKILL
    left = [p.name for p in out.iterdir()]
    assert left, "it was not in the middle"
    assert all(name.startswith(".") and name.endswith(".tmp") for name in left), left


def test_what_an_earlier_run_wrote_outlives_one_that_is_killed(logs, started):
    job, out = started
    (out / "trajectory.tum").write_text("of an earlier run\n")
    job.kill()
    job.wait(timeout=30)
    assert (out / "trajectory.tum").read_text() == "of an earlier run\n"
