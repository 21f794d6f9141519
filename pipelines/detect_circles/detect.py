"""The default detector: round lamps and stickers in an image, to a few hundredths of a pixel.

1. The image is made small and compared with the mean of its surroundings (``kernels.local_contrast``), which removes
   vignetting, glare and slow shading.
2. Connected regions of several levels of contrast propose circles (``kernels.find_seeds``).
3. Rays from the centre of each proposal find its edge, between pixels (``edges.cast``).
4. The edge points are mapped into the plane of the ceiling (lens and perspective undone by a table) and fitted there
   by a circle, with a little freedom for tilt; its centre is the true one, where the middle of the outline in the
   image is not (``fitting``). Without a calibration an ellipse is fitted in the image.
5. What remains decides: squares, hexagons, rectangles and half-hidden shapes are refused.

The work is one compiled call (``method.find``) that holds no interpreter lock, so threads run side by side.
"""

from dataclasses import dataclass
from functools import cache
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]
Bytes: TypeAlias = npt.NDArray[np.uint8]

LEVELS = np.array([8.0, 24.0, 65.0], dtype=np.float32)
"""Contrasts at which the image is cut into regions [grey values]."""


@dataclass(frozen=True, slots=True)
class Search:
    """What to look for.

    Attributes:
        min_radius_px, max_radius_px: mean radius in the image [px].
        polarity: bright circles on darker ground, dark ones on brighter, or both.
        sigma_px: systematic part of the error of a centre, added to every covariance [px].
    """

    min_radius_px: float
    max_radius_px: float
    polarity: Literal["bright", "dark", "both"] = "bright"
    sigma_px: float = 0.02

    def __post_init__(self) -> None:
        """Refuse a range that holds no circle."""
        if not 1.5 <= self.min_radius_px < self.max_radius_px < np.inf:
            raise ValueError(
                f"the radius range is {self.min_radius_px:.6g} to {self.max_radius_px:.6g} px; "
                "the smallest must be at least 1.5 px and below the greatest"
            )


@dataclass(frozen=True, slots=True, eq=False)
class Plane:
    """The plane of the circles as the camera sees it: a table from pixels to plane coordinates.

    Attributes:
        table: (h, w, 2) float32; plane coordinates, in pixels of the image's middle, of pixel (step j, step i).
        step: distance of the nodes [px]; the table reaches to or beyond the last pixel.
        width, height: of the images it holds for [px].
    """

    table: npt.NDArray[np.float32]
    step: float
    width: int
    height: int


@dataclass(frozen=True, slots=True, eq=False)
class Circles:
    """What was found, N circles sorted by v.

    Attributes:
        uv: (N, 2) image of the true centre with a ``Plane``, otherwise centre of the outline [px].
        radius: (N,) mean radius of the outline [px].
        cov: (N, 2, 2) covariance of uv [px^2].
        score: (N,) 0..1: how much of the outline was seen, how well it fits, how clear it is.
        arc: (N,) share of the outline that was found.
        is_cut: (N,) whether the outline leaves the image.
        is_dark: (N,) whether it is darker than its surroundings.
        xy: (N, 2) the true centre in the ``Plane``, in its units; None without one.
        cov_xy: (N, 2, 2) covariance of xy; None without a plane.
    """

    uv: Array
    radius: Array
    cov: Array
    score: Array
    arc: Array
    is_cut: npt.NDArray[np.bool_]
    is_dark: npt.NDArray[np.bool_]
    xy: Array | None = None
    cov_xy: Array | None = None

    def __len__(self) -> int:
        """Return the number of circles."""
        return len(self.uv)


@dataclass(frozen=True, slots=True)
class Gates:
    """When a fitted outline is a circle.

    Attributes:
        residual, residual_px: root mean square distance allowed, a share of the radius plus pixels.
        harmonic, harmonic_px: amplitude allowed of the 3rd, 4th and 6th harmonic, likewise.
        arc: share of the outline that must have been found.
        agree: share of the rays in view that must have found it.
        run: share of the outline that must have been found without a break.
        aspect: least ratio of the axes without a Plane.
        aspect_in_plane: and with one.
        contrast: least height of the edge [grey values].
    """

    residual: float = 0.033
    residual_px: float = 0.3
    harmonic: float = 0.016
    harmonic_px: float = 0.12
    arc: float = 0.45
    agree: float = 0.72
    run: float = 0.2
    aspect: float = 0.6
    aspect_in_plane: float = 0.85
    contrast: float = 8.0


FLATTENING = 0.12
"""Standard deviation of the second harmonic of an outline in an image whose camera is unknown (aspect 0.79)."""

FLATTENING_IN_PLANE = 0.008
"""The same in the plane: what a tilt of the robot of half a degree does to a circle at the corner of the image."""

_NO_TABLE = np.zeros((0, 0, 2), dtype=np.float32)


def find_circles(grey: Bytes, search: Search, plane: Plane | None = None) -> Circles:
    """Find the circles of an image.

    Args:
        grey: (H, W) uint8, any size, any memory layout; never written to.
        search: what to look for.
        plane: where the circles lie, for the size of this image; None fits ellipses in the image.

    Returns:
        The circles; none in an image too small to hold one.

    Raises:
        ValueError: not an (H, W) uint8 image, or a plane of another size.
    """
    if grey.ndim != 2 or grey.dtype != np.uint8:
        raise ValueError(f"a grey image is (H, W) uint8, not {grey.shape} {grey.dtype}")
    height, width = grey.shape
    if plane is not None and (plane.width, plane.height) != (width, height):
        raise ValueError(f"the image is {width}x{height} px, the plane is for {plane.width}x{plane.height} px")
    if min(height, width) < 8:
        return _circles(np.empty((0, 24)), np.empty(0, dtype=bool), is_in_plane=plane is not None)
    grey = np.ascontiguousarray(grey)
    if search.polarity != "both":
        is_dark = search.polarity == "dark"
        rows = _find(grey, search, plane, dark=is_dark)
        return _circles(rows, np.full(len(rows), is_dark), is_in_plane=plane is not None)
    bright, dark = (_find(grey, search, plane, dark=is_dark) for is_dark in (False, True))
    rows = np.concatenate([bright, dark])
    order = np.argsort(rows[:, 1], kind="stable")
    return _circles(rows[order], order >= len(bright), is_in_plane=plane is not None)


def _find(grey: Bytes, search: Search, plane: Plane | None, *, dark: bool) -> Array:
    from .method import find

    radii = (search.min_radius_px, search.max_radius_px)
    scale = max(1, min(8, int(search.min_radius_px / 2.5)))
    scale = min(scale, *(max(1, side // 4) for side in grey.shape))
    reach = max(4, round(1.4 * search.max_radius_px / scale))
    table, step = (_NO_TABLE, 1.0) if plane is None else (plane.table, plane.step)
    flattening = FLATTENING if plane is None else FLATTENING_IN_PLANE
    numbers = _gate_numbers(search.sigma_px, is_in_plane=plane is not None)
    return find(grey, dark, scale, reach, LEVELS, radii, table, step, flattening, numbers)


@cache
def _gate_numbers(sigma_px: float, *, is_in_plane: bool) -> Array:
    gates = Gates()
    aspect = gates.aspect_in_plane if is_in_plane else gates.aspect
    return np.array(
        [
            *(gates.residual, gates.residual_px, gates.harmonic, gates.harmonic_px),
            *(gates.arc, gates.agree, gates.run, aspect, gates.contrast, sigma_px**2),
        ]
    )


def _circles(rows: Array, is_dark: npt.NDArray[np.bool_], *, is_in_plane: bool) -> Circles:
    """Name the columns of ``method.find``."""
    return Circles(
        uv=rows[:, :2],
        radius=rows[:, 2],
        cov=rows[:, 3:7].reshape(-1, 2, 2),
        score=rows[:, 7],
        arc=rows[:, 8],
        is_cut=rows[:, 9] > 0,
        is_dark=is_dark,
        xy=rows[:, 10:12] if is_in_plane else None,
        cov_xy=rows[:, 12:16].reshape(-1, 2, 2) if is_in_plane else None,
    )
