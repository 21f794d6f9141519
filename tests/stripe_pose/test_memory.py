"""A run over many images with a mark takes no more memory than one over few."""

import subprocess
import sys

import numpy as np
import pytest

from logpose.formats.calibration import Calibration
from logpose.formats.events import CameraInfo, Image, Odometry
from logpose.formats.maps.marks import write_marks
from logpose.formats.products import MarkMap
from logpose.formats.write_log import create_log

from .conftest import mark_of, picture

SHORT, LONG = 60, 360
HELD_MIB = (LONG - SHORT) * 640 * 480 / 2**20
BOUND_MIB = 16.0
"""Numbers per sighting, records and indexes (< 3 MiB), and what the allocator does not give back."""
MEASURED = """
import resource, subprocess, sys
job = subprocess.run([sys.executable, "-m", "logpose", *sys.argv[1:]], stdout=subprocess.DEVNULL)
peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
print(peak / 1024**(2 if sys.platform == "darwin" else 1))
sys.exit(job.returncode)
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    write_marks(MarkMap(marks=(mark_of(id=1, height=0.1),)), folder / "marks.yaml")
    pixels = picture(mark_of(), np.array([0.3, 0.0, 0.8]), noise=1.0)
    for name, count in {"short": SHORT, "long": LONG}.items():
        with create_log(folder / f"{name}.mcap") as log:
            for i in range(count):
                stamp = 10**9 + i * 10**8
                log.write(
                    CameraInfo(
                        stamp=stamp, topic="/camera_info", calibration=Calibration(640, 480, 600, 600, 319.5, 239.5)
                    )
                )
                log.write(Odometry(stamp=stamp, topic="/odom", linear=np.zeros(3), angular=np.zeros(3)))
                log.write(
                    Image(
                        stamp=stamp,
                        topic="/image_raw",
                        encoding="mono8",
                        data=pixels.ravel(),
                        width=640,
                        height=480,
                        step=640,
                    )
                )
    return folder


def test_peak_memory_does_not_grow_with_the_log(folder, tmp_path):
    def peak(name):
        words = ["stripe-pose", folder / f"{name}.mcap", "--marks", folder / "marks.yaml", "--smooth", "-q", "-o"]
        command = [sys.executable, "-S", "-c", MEASURED, *map(str, [*words, tmp_path / name])]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return float(done.stdout)

    assert HELD_MIB > 5 * BOUND_MIB, "the logs are too short to show anything"
    peak("short")  # kernels are compiled by the first run on a machine, which takes memory
    assert peak("long") - peak("short") < BOUND_MIB
