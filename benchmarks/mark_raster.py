"""Exact box integrals of flat patterns seen through a pinhole; shares no code with the package.

A pattern is a set of rectangles in an upright plane. Their outlines are projected, through tilt, roll and radial
distortion, and the share of every pixel that lies inside is computed exactly from the outline: each piece of outline
inside one pixel adds the area between itself and the pixel's right border, and its height to all pixels further right.
Straight outlines are exact to rounding; distorted ones are cut into chords of four pixels, off by less than 0.001 px.

Level frame: x right, y along the view, z up. The camera turns by ``tilt`` (up positive), then about its own axis by
``roll``. Pixel centres are integers.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]
Rectangle = tuple[float, float, float, float]  # x0, z0, x1, z1 in the plane [m]

CHORD_PX = 4.0
REACH = (0.8, 0.7)  # what is outside these tangents is cut away: far outside the image, before the lens model folds


@dataclass(frozen=True)
class Optics:
    """A camera: size, focal length and principal point [px], radial distortion, attitude [rad]."""

    width: int = 640
    height: int = 480
    f: float = 600.0
    cx: float = 319.5
    cy: float = 239.5
    k1: float = 0.0
    k2: float = 0.0
    tilt: float = 0.0
    roll: float = 0.0

    def attitude(self) -> Array:
        """Level frame to camera frame (x right, y forward, z up)."""
        (ct, st), (cr, sr) = ((np.cos(a), np.sin(a)) for a in (self.tilt, self.roll))
        return np.array([[cr, 0.0, -sr], [0.0, 1.0, 0.0], [sr, 0.0, cr]]) @ np.array(
            [[1.0, 0.0, 0.0], [0.0, ct, st], [0.0, -st, ct]]
        )

    def pixel(self, ray: Array) -> Array:
        """Tangents (..., 2) right and up of the optical axis to pixels (..., 2)."""
        s = (ray**2).sum(-1, keepdims=True)
        bent = ray * (1.0 + self.k1 * s + self.k2 * s * s)
        return np.asarray(bent * (self.f, -self.f) + (self.cx, self.cy))

    def project(self, level: Array) -> Array:
        """Points (..., 3) in the level frame to pixels (..., 2)."""
        camera = level @ self.attitude().T
        return self.pixel(camera[..., [0, 2]] / camera[..., 1:2])


@dataclass(frozen=True)
class Plane:
    """An upright plane: (X, Z) on it lies at (cos(phi) X + dx, sin(phi) X + dy, Z + dz) in the level frame."""

    phi: float
    dx: float
    dy: float
    dz: float = 0.0

    def level(self, xz: Array) -> Array:
        """Points (..., 2) of the plane in the level frame."""
        x, z = np.moveaxis(xz, -1, 0)
        return np.stack([np.cos(self.phi) * x + self.dx, np.sin(self.phi) * x + self.dy, z + self.dz], axis=-1)

    def shifted(self, x: float, depth: float) -> "Plane":
        """Return a parallel plane, its origin ``x`` further along and ``depth`` further into the wall [m]."""
        c, s = np.cos(self.phi), np.sin(self.phi)
        return Plane(self.phi, self.dx + c * x - s * depth, self.dy + s * x + c * depth, self.dz)


class Canvas:
    """An image under construction, ``samples`` times as fine as the image in both directions."""

    def __init__(self, optics: Optics, value: float, samples: int = 3) -> None:
        self.optics, self.samples = optics, samples
        self.fine = np.full((optics.height * samples, optics.width * samples), value, dtype=np.float32)

    def paint(
        self, plane: Plane, outline: Rectangle, value: float, parts: Sequence[tuple[Rectangle, float]] = ()
    ) -> None:
        """Paint a rectangle, and on it others that lie inside it and do not overlap each other."""
        base = self._outline(plane, outline)
        if base is None:
            return
        inner = [(self._outline(plane, rectangle), v - value) for rectangle, v in parts]
        polygons = [(base, value)] + [(p, w) for p, w in inner if p is not None]
        limit = (self.fine.shape[1], self.fine.shape[0])
        lo = np.clip(np.floor(base.min(axis=0)), 0, limit).astype(int)
        hi = np.clip(np.ceil(base.max(axis=0)), 0, limit).astype(int)
        if (hi <= lo).any():
            return
        size = (int(hi[1] - lo[1]), int(hi[0] - lo[0]))
        patch = self.fine[lo[1] : hi[1], lo[0] : hi[0]]
        patch *= 1.0 - coverage([base - lo], [1.0], size)
        patch += coverage([p - lo for p, _ in polygons], [w for _, w in polygons], size)

    def _outline(self, plane: Plane, rectangle: Rectangle) -> Array | None:
        """Return the outline of a rectangle in fine pixels (corner of the image: 0, 0), or None if out of sight."""
        x0, z0, x1, z1 = rectangle
        camera = plane.level(np.array([[x0, z0], [x1, z0], [x1, z1], [x0, z1]])) @ self.optics.attitude().T
        for axis, reach in ((0, REACH[0]), (2, REACH[1])):
            for sign in (-1.0, 1.0):
                camera = _cut(camera, reach * camera[:, 1] + sign * camera[:, axis])
                if len(camera) < 3:
                    return None
        ray = camera[:, [0, 2]] / camera[:, 1:2]
        if self.optics.k1 or self.optics.k2:
            ray = _chords(ray, CHORD_PX / self.optics.f)
        return (self.optics.pixel(ray) + 0.5) * self.samples


def _cut(points: Array, side: Array) -> Array:
    """Return the part of a convex polygon where ``side``, linear in the points, is positive."""
    if (side > 0).all():
        return points
    kept = []
    for k in range(len(points)):
        p, q, a, b = points[k - 1], points[k], side[k - 1], side[k]
        if (a > 0) != (b > 0):
            kept.append(p + (q - p) * (a / (a - b)))
        if b > 0:
            kept.append(q)
    return np.array(kept).reshape(-1, 3)


def _chords(corners: Array, length: float) -> Array:
    """Return the corners with points between them, ``length`` apart or closer."""
    pieces = []
    for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        n = max(1, int(np.ceil(np.hypot(*(q - p)) / length)))
        pieces.append(p + (q - p) * (np.arange(n) / n)[:, None])
    return np.concatenate(pieces)


def coverage(polygons: Sequence[Array], weights: Sequence[float], size: tuple[int, int]) -> Array:
    """Return the sum over polygons of weight times the area that each covers of every pixel, (height, width).

    Pixel (row i, column k) is the square from (k, i) to (k + 1, i + 1); corners are (x, y).
    """
    start, end, weight = [], [], []
    for corners, w in zip(polygons, weights, strict=True):
        following = np.roll(corners, -1, axis=0)
        turn = (corners[:, 0] * following[:, 1] - corners[:, 1] * following[:, 0]).sum()
        start.append(corners)
        end.append(following)
        weight.append(np.full(len(corners), w if turn < 0 else -w))
    a, b, w = np.concatenate(start), np.concatenate(end), np.concatenate(weight)
    a, b, k, rows = _split(a, b, axis=1)
    is_inside = (rows >= 0) & (rows < size[0])
    a, b, w, rows = a[is_inside], b[is_inside], w[k[is_inside]], rows[is_inside]
    a, b, k, columns = _split(a, b, axis=0)
    rise = (b[:, 1] - a[:, 1]) * w[k]
    middle = np.where(columns < 0, 0.0, np.clip(0.5 * (a[:, 0] + b[:, 0]) - columns, 0.0, 1.0))
    stride = size[1] + 2
    place = rows[k] * stride + np.clip(columns, 0, size[1])
    total = np.bincount(place, rise * (1.0 - middle), minlength=size[0] * stride)
    total += np.bincount(place + 1, rise * middle, minlength=size[0] * stride)
    return np.cumsum(total.reshape(size[0], stride), axis=1)[:, : size[1]]


def _split(a: Array, b: Array, axis: int) -> tuple[Array, Array, Index, Index]:
    """Cut segments where they cross integers of one coordinate; also return each piece's segment and integer below."""
    p, q = a[:, axis], b[:, axis]
    first = np.floor(np.minimum(p, q)).astype(np.int64)
    count = np.maximum(np.ceil(np.maximum(p, q)).astype(np.int64) - first, 1)
    k = np.repeat(np.arange(len(a)), count)
    cell = first[k] + np.arange(len(k)) - np.repeat(np.cumsum(count) - count, count)
    run = (q - p)[k]
    is_level = run == 0.0
    safe = np.where(is_level, 1.0, run)
    ends = np.sort(np.stack([(cell - p[k]) / safe, (cell + 1 - p[k]) / safe]), axis=0).clip(0.0, 1.0)
    t0, t1 = np.where(is_level, 0.0, ends[0])[:, None], np.where(is_level, 1.0, ends[1])[:, None]
    return a[k] + t0 * (b - a)[k], a[k] + t1 * (b - a)[k], k, cell
