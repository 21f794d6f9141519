"""The paper's way: blur, threshold, Hough circles, then range, azimuth and elevation of each centre.

u, v are pixels from the principal point (u right, v down), f the focal length [px], h the distance from the lens to the
plane of the features [m]; the camera looks up, the top of its image forward.

- eq. (1), printed with an undefined c for f: P = sqrt(u^2 + v^2 + f^2) h / f, the slant range;
- what a map in the plane needs: r = sqrt(u^2 + v^2) h / f, the horizontal range;
- eq. (2): theta = atan2(u, -v), counter-clockwise in the robot frame, because image right is the robot's left;
- eq. (3): phi = atan2(f, sqrt(u^2 + v^2)), the elevation; so r = P cos(phi).

Source: Noh, Ko and Kuc, "Localization of a mobile robot using ceiling image with identical features", 2016, section 2.
Differs from it in: c is f; the lens distortion is removed before, the mount's offset and yaw applied after; the
parameters of blur, threshold and Hough transform are not printed and are ours.
"""

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np

from .detect import Array, Bytes, Circles
from .sighting import View


@dataclass(frozen=True, slots=True)
class HoughSearch:
    """What the paper's detector looks for, and how.

    Attributes:
        min_radius_px, max_radius_px: radius in the image [px].
        polarity: bright or dark circles, or both.
        blur_px: side of the Gaussian kernel, odd [px].
        threshold: brightness that separates circle from ground; None takes Otsu's.
        canny: upper threshold of the edge detector inside the Hough transform.
        votes: least number of votes for a centre.
        sigma_px: standard deviation of a centre [px]; the Hough transform gives none.
    """

    min_radius_px: float
    max_radius_px: float
    polarity: Literal["bright", "dark", "both"] = "bright"
    blur_px: int = 7
    threshold: float | None = 140.0
    canny: float = 100.0
    votes: float = 14.0
    sigma_px: float = 1.5


def slant_range(u: Array, v: Array, f: float, h: float) -> Array:
    """Return P, the distance from lens to feature [m], of pixels from the principal point: eq. (1)."""
    return np.sqrt(u * u + v * v + f * f) * (h / f)


def horizontal_range(u: Array, v: Array, f: float, h: float) -> Array:
    """Return r, the distance in the plane of the floor [m]; r = P cos(phi)."""
    return np.hypot(u, v) * (h / f)


def azimuth(u: Array, v: Array) -> Array:
    """Return theta, counter-clockwise from the robot's x axis [rad]; 0 at the principal point: eq. (2)."""
    return np.arctan2(u, 0.0 - np.asarray(v, dtype=np.float64))  # 0 - v is +0 at v = 0, where -v is -0


def elevation(u: Array, v: Array, f: float) -> Array:
    """Return phi, the angle of the ray above the plane of the floor [rad]: eq. (3)."""
    return np.arctan2(f, np.hypot(u, v))


def to_robot(u: Array, v: Array, f: float, h: float) -> Array:
    """Return x, y (..., 2) in the robot frame [m] from range and azimuth."""
    r, theta = horizontal_range(u, v, f, h), azimuth(u, v)
    return np.stack([r * np.cos(theta), r * np.sin(theta)], axis=-1)


def sight(uv: Array, view: View) -> Array:
    """Return where pixels (N, 2) of an image lie in the robot frame (N, 2) [m] by eqs (1)-(3)."""
    camera = view.camera
    if view.is_flipped:
        uv = np.stack([view.width - 1 - uv[:, 0], uv[:, 1]], axis=-1)
    xy = camera.unproject(uv)[:, :2]
    f = float(np.sqrt(camera.fx * camera.fy))
    seen = to_robot(f * xy[:, 0], f * xy[:, 1], f, view.lens_to_ceiling)
    forward = -view.rotation[:2, 1]  # where the top of the image points
    c, s = forward / np.hypot(*forward)
    return np.asarray(view.translation[:2] + seen @ np.array([[c, s], [-s, c]]))


def find_circles_hough(grey: Bytes, search: HoughSearch) -> Circles:
    """Find circles by blur, threshold and Hough transform.

    Args:
        grey: (H, W) uint8; never written to.
        search: what to look for, and how.

    Returns:
        The circles; every score is 1, every covariance sigma_px^2.

    Raises:
        ValueError: not an (H, W) uint8 image.
    """
    if grey.ndim != 2 or grey.dtype != np.uint8:
        raise ValueError(f"a grey image is (H, W) uint8, not {grey.shape} {grey.dtype}")
    darks = {"bright": (False,), "dark": (True,), "both": (False, True)}[search.polarity]
    rows, is_dark = [], []
    for dark in darks if min(grey.shape) >= 8 else ():
        found = _hough(grey, search, dark=dark)
        rows.append(found)
        is_dark.append(np.full(len(found), dark))
    found = np.concatenate(rows) if rows else np.empty((0, 3))
    order = np.lexsort((found[:, 0], found[:, 1]))
    u, v, radius = found[order].T
    height, width = grey.shape
    n = len(found)
    return Circles(
        uv=np.stack([u, v], axis=-1),
        radius=radius,
        cov=np.broadcast_to(search.sigma_px**2 * np.eye(2), (n, 2, 2)).copy(),
        score=np.ones(n),
        arc=np.ones(n),
        is_cut=(u < radius) | (v < radius) | (u > width - 1 - radius) | (v > height - 1 - radius),
        is_dark=(np.concatenate(is_dark) if is_dark else np.empty(0, dtype=bool))[order],
    )


def _hough(grey: Bytes, search: HoughSearch, *, dark: bool) -> Array:
    blurred = cv2.GaussianBlur(np.ascontiguousarray(grey), (search.blur_px, search.blur_px), 0)
    kind = cv2.THRESH_BINARY_INV if dark else cv2.THRESH_BINARY
    if search.threshold is None:
        kind |= cv2.THRESH_OTSU
    _, binary = cv2.threshold(blurred, search.threshold or 0.0, 255, kind)
    circles = cv2.HoughCircles(
        binary,
        cv2.HOUGH_GRADIENT,
        dp=1.0,
        minDist=2.0 * search.min_radius_px,
        param1=search.canny,
        param2=search.votes,
        minRadius=int(search.min_radius_px),
        maxRadius=int(np.ceil(search.max_radius_px)),
    )
    return np.empty((0, 3)) if circles is None else np.asarray(circles, dtype=np.float64).reshape(-1, 3)
