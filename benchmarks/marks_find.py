"""The package's detector of stripe marks, set up for the cameras and marks of ``mark_scenes``."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from mark_raster import Optics
from mark_scenes import Scene, Stripes

from logpose.formats.products import StripeMark
from logpose.pipelines.geometry.camera import Camera
from logpose.pipelines.stripe_pose.method import Eye, Search, find_marks
from logpose.pipelines.stripe_pose.solve import Attitude
from logpose.pipelines.stripe_pose.verdict import Found

TILT_SD, ROLL_SD = float(np.radians(4.0)), float(np.radians(1.0))
"""What the detector is told of tilt and roll: 0, with these standard deviations."""
OK = "ok"


@cache
def eye_of(optics: Optics) -> Eye:
    """The detector's idea of the camera, right but for its tilt and roll; made once, as for a log."""
    camera = Camera(optics.f, optics.f, optics.cx, optics.cy, "plumb_bob", (optics.k1, optics.k2, 0.0, 0.0, 0.0))
    return Eye(camera, optics.width, optics.height, Attitude(0.0, 0.0, TILT_SD, ROLL_SD))


def map_of(patterns: Sequence[Stripes], *, with_height: bool) -> list[StripeMark]:
    """Return patterns as marks of a map, their ids as they come."""
    return [
        StripeMark(
            id=k,
            lines=np.array(pattern.left),
            bars=np.array(pattern.widths),
            pose=np.zeros(3),
            height=pattern.height if with_height else None,
        )
        for k, pattern in enumerate(patterns)
    ]


class Finder:
    """Finds marks in scenes."""

    def __init__(self, patterns: Sequence[Stripes], *, with_height: bool = True) -> None:
        self.marks = map_of(patterns, with_height=with_height)
        self.search = Search()

    def __call__(self, scene: Scene) -> list[Found]:
        """Return all that is found in a scene."""
        return find_marks(scene.image, eye_of(replace(scene.optics, tilt=0.0, roll=0.0)), self.marks, self.search)

    def identified(self, scene: Scene) -> list[Found]:
        """Return what is found and identified without doubt."""
        return [found for found in self(scene) if found.status == OK]
