"""The stages ``detect-circles`` and ``write-overlays``: events to arrays and back."""

from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from ...formats.calibration import Calibration, read_calibration
from ...formats.errors import ConfigError
from ...formats.events import NO_ID, Event, Image, Mount, Notice, Sightings
from ...formats.images import DamagedImage, grey
from ...formats.maps.landmarks import read_landmarks
from ..engine.stage import per_message
from ..geometry.mount import upward
from ..geometry.so3 import as_matrix
from ..images.checks import camera_of, check_size, damaged_image, no_calibration
from ..images.overlays import overlays
from . import paper
from .detect import Array, Bytes, Circles, Plane, Search, find_circles
from .overlay import draw_overlay
from .params import DetectCirclesParams, WriteOverlaysParams
from .radius import default_radii, expected_radii
from .sighting import View

NAME = "detect-circles"
Mask: TypeAlias = npt.NDArray[np.bool_]
ALL = slice(None)
_camera_file = lru_cache(maxsize=8)(read_calibration)
LEVEL_M = 0.05
"""Landmarks whose heights differ by less lie on one ceiling [m]."""


@per_message
def detect_circles(event: Image, params: DetectCirclesParams) -> Iterable[Event]:
    """Find round lamps or stickers on the ceiling: one record per image, also when there is nothing in it.

    Where neither camera nor ceiling is known, circles are found in the image and have no place on the robot (nan).

    A damaged image is a loss and has a record without sightings.

    Raises:
        ConfigError: no calibration, one of another image size, an unknown ceiling height or one below the lens.
        ValueError: an image of depths, or of an encoding that is not supported.
    """
    try:
        pixels = grey(event)
    except DamagedImage as err:
        yield damaged_image(event, err, NAME)
        yield _sightings(event.stamp, find_circles(_NOTHING, _ANY), np.empty((0, 2)), np.empty((0, 2, 2)))
        return
    if not (event.calibration or params.camera or params.ceiling_m or params.map):
        yield from _in_image_only(event, pixels, params)
        return
    setup = _setup_of(event, params)
    check_size(event, pixels, (setup.view.width, setup.view.height), NAME)
    if params.method == "paper":
        circles = paper.find_circles_hough(pixels, setup.hough)
        _, cov = setup.view.sight(circles.uv, circles.cov, np.radians(params.tilt_deg))
        xy = paper.sight(circles.uv, setup.view)
    else:
        circles = find_circles(pixels, setup.search, setup.plane)
        xy, cov = setup.view.sight_circles(circles, np.radians(params.tilt_deg))
    if setup.notice:
        yield Notice(stamp=event.stamp, source=NAME, code="radius-range", message=setup.notice)
    is_placed: Mask = np.asarray(np.isfinite(xy).all(axis=1))  # a pixel whose ray does not rise lies on no ceiling
    yield _sightings(event.stamp, circles, xy, cov, is_placed)


def write_overlays(events: Iterator[Event], params: WriteOverlaysParams) -> Iterator[Event]:
    """Write a picture per image with what ``detect-circles`` found in it."""

    def drawn(pixels: Bytes, seen: Sequence[Sightings]) -> Bytes:
        return draw_overlay(pixels, seen[0].uv, seen[0].radius, seen[0].score)

    yield from overlays(events, Sightings, NAME, drawn, folder=params.path, every=params.every)


_NOTHING, _ANY = np.zeros((0, 0), np.uint8), Search(4.0, 8.0)


class _Setup(NamedTuple):
    """What follows from parameters, calibration and mount, made once."""

    view: View
    plane: Plane | None
    search: Search
    hough: paper.HoughSearch
    notice: str


def _setup_of(event: Image, params: DetectCirclesParams) -> _Setup:
    calibration = _camera_file(params.camera) if params.camera else event.calibration
    if calibration is None:
        raise no_calibration(event, NAME, "Pass one with --camera FILE.")
    return _setup(calibration, _mount_key(event.mount), params)


@lru_cache(maxsize=8)
def _setup(
    calibration: Calibration, mount: tuple[tuple[float, ...], tuple[float, ...]] | None, params: DetectCirclesParams
) -> _Setup:
    if mount is None:
        translation = np.array([params.mount_x_m, params.mount_y_m, params.mount_z_m])
        rotation = upward(np.radians(params.mount_yaw_deg))
    else:
        translation, rotation = np.array(mount[0]), as_matrix(np.array(mount[1]))
    try:
        view = View(
            camera=camera_of(calibration),
            width=calibration.width,
            height=calibration.height,
            rotation=rotation,
            translation=translation,
            ceiling_m=_ceiling_m(params),
            is_flipped=params.flip_x,
        )
        radii, notice = _radii(view, params)
        search = Search(*radii, polarity=params.polarity, sigma_px=params.sigma_px)
    except ValueError as err:
        raise ConfigError(f"{NAME}: {err}.") from err
    plane = view.plane() if params.method == "best" else None
    return _Setup(view, plane, search, _hough(radii, params), notice)


def _hough(radii: tuple[float, float], params: DetectCirclesParams) -> paper.HoughSearch:
    return paper.HoughSearch(
        *radii,
        polarity=params.polarity,
        blur_px=params.blur_px | 1,
        threshold=params.threshold,
        canny=params.hough_canny,
        votes=params.hough_votes,
        sigma_px=params.hough_sigma_px,
    )


def _in_image_only(event: Image, pixels: Bytes, params: DetectCirclesParams) -> Iterator[Event]:
    """Find circles in an image of which nothing else is known."""
    least, most = default_radii(pixels.shape[1])
    radii = (params.min_radius_px or least, params.max_radius_px or most)
    if params.method == "paper":
        circles = paper.find_circles_hough(pixels, _hough(radii, params))
    else:
        circles = find_circles(pixels, Search(*radii, polarity=params.polarity, sigma_px=params.sigma_px))
    message = (
        f"neither camera nor ceiling is known: circles of {radii[0]:.3g} to {radii[1]:.3g} px radius are given in the "
        "image, without a place on the robot. Pass --camera FILE and --ceiling M for that."
    )
    yield Notice(stamp=event.stamp, source=NAME, code="image-only", message=message)
    nowhere = np.full((len(circles.uv), 2), np.nan)
    yield _sightings(event.stamp, circles, nowhere, np.full((len(circles.uv), 2, 2), np.nan))


def _radii(view: View, params: DetectCirclesParams) -> tuple[tuple[float, float], str]:
    """Return the radius range, and what a person should know of it."""
    notice = ""
    if params.lamp_diameter_m is not None:
        least, most = expected_radii(view, params.lamp_diameter_m)
    else:
        least, most = default_radii(view.width)
        if params.min_radius_px is None or params.max_radius_px is None:
            notice = (
                f"the size of the lamps is not known, so circles of {params.min_radius_px or least:.3g} to "
                f"{params.max_radius_px or most:.3g} px radius are looked for; --lamp-diameter M narrows that."
            )
    return (params.min_radius_px or least, params.max_radius_px or most), notice


@lru_cache(maxsize=8)
def _ceiling_of_map(path: str) -> float:
    heights = read_landmarks(path).positions[:, 2]
    if heights.max() - heights.min() > LEVEL_M:
        raise ConfigError(
            f"{NAME}: the landmarks of {path} lie at heights from {heights.min():.6g} to {heights.max():.6g} m, "
            "not on one ceiling. Pass the height of the features to look for with --ceiling M."
        )
    if not heights.max() > 0:
        raise ConfigError(f"{NAME}: the landmarks of {path} have no height (z_m). Pass it with --ceiling M.")
    return float(np.median(heights))


def _ceiling_m(params: DetectCirclesParams) -> float:
    if params.ceiling_m is not None:
        return params.ceiling_m
    if params.map is not None:
        return _ceiling_of_map(params.map)
    raise ConfigError(
        f"{NAME}: the height of the ceiling is not known. Pass it with --ceiling M (above base_link), "
        "or a landmark map with --map FILE."
    )


def _mount_key(mount: Mount | None) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
    return None if mount is None else (tuple(mount.translation.tolist()), tuple(mount.rotation.tolist()))


def _sightings(stamp: int, circles: Circles, xy: Array, cov: Array, keep: Mask | slice = ALL) -> Sightings:
    uv = circles.uv[keep]
    return Sightings(
        stamp=stamp,
        source=NAME,
        frame_id="base_link",
        xy=xy[keep],
        cov=cov[keep],
        uv=uv,
        radius=circles.radius[keep],
        score=circles.score[keep],
        ids=np.full(len(uv), NO_ID, dtype=np.int64),
    )
