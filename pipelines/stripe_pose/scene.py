"""An image of marks with its camera, and what is looked for in it."""

from dataclasses import dataclass, field
from functools import lru_cache
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from ...formats.products import StripeMark
from ..geometry.camera import Camera
from .solve import Attitude

Array: TypeAlias = npt.NDArray[np.float64]
Bytes: TypeAlias = npt.NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Eye:
    """A camera that looks at marks.

    Attributes:
        camera: its lens.
        width, height: of its images [px].
        attitude: what is known of its tilt and roll.
    """

    camera: Camera
    width: int
    height: int
    attitude: Attitude = field(default_factory=Attitude)

    @property
    def row(self) -> float:
        """The row through the principal point [px]."""
        return self.camera.cy


@dataclass(frozen=True, slots=True)
class Search:
    """What is looked for, and how strictly.

    Attributes:
        row_step: every so many rows one is searched [px].
        skips: edges within a mark that may belong to something else.
        tolerance_px: largest error of an edge of a single row [px].
        residual_px, residual_share: largest root mean square error of a mark's lines [px]: the lesser of the first,
            and the second times the least distance of two lines.
        least_rows: a mark crosses at least so many rows.
        least_gap_px: two edges of a mark are at least so far apart [px].
        blend_px: edges of a mark nearer than this are taken apart by ``profile`` [px].
        floor_px: part of a line's error that no image shows [px].
        max_angle: largest angle of a mark [rad].
        near, far: least and greatest distance of a mark [m].
        max_phi_sd: a pose less certain than this is ``poor_geometry`` [rad].
        hidden: also look for marks of which a part is hidden.
        given: the mark is known to be this one: its id, or None.
        is_leaning: tilt and roll are the mark's, about its own axes, as in the paper's eq. (6).
    """

    row_step: int = 8
    skips: int = 2
    tolerance_px: float = 0.5
    residual_px: float = 0.3
    residual_share: float = 0.04
    least_rows: int = 5
    least_gap_px: float = 2.5
    blend_px: float = 7.0
    floor_px: float = 0.002
    max_angle: float = np.radians(80.0)
    near: float = 0.05
    far: float = 50.0
    max_phi_sd: float = np.radians(10.0)
    hidden: bool = True
    given: int | None = None
    is_leaning: bool = False


@lru_cache(maxsize=1024)
def edges_of(mark: StripeMark) -> tuple[Array, npt.NDArray[np.int64]]:
    """Return abscissae [m] and polarities of a mark's edges, made once."""
    return mark.edges, mark.polarity


@lru_cache(maxsize=2)
def ray_table(camera: Camera, width: int, height: int) -> Array:
    """Return the rays x, z (height, width, 2) at y = 1 of all pixels, in the camera frame (x right, z up)."""
    u, v = np.meshgrid(np.arange(float(width)), np.arange(float(height)))
    directions = camera.unproject(np.stack([u, v], axis=-1))
    table = np.ascontiguousarray(directions[..., :2] * np.array([1.0, -1.0]))
    table.setflags(write=False)
    return table


def saturated_share(pixels: Bytes, row: float) -> float:
    """Return the share of black and white pixels in the row of an image next to ``row``."""
    values = pixels[min(max(round(row), 0), len(pixels) - 1)]
    return float(np.mean((values == 0) | (values == 255)))


@dataclass(slots=True, eq=False)
class Scene:
    """An image with what is made of it once."""

    pixels: Bytes
    eye: Eye
    search: Search
    taps: Array
    noise: float

    @property
    def rays(self) -> Array:
        """The rays of all pixels, see ``ray_table``."""
        return ray_table(self.eye.camera, self.eye.width, self.eye.height)
