"""Images of a wall with a stripe mark or a tag, with the truth; they share no code with the package.

The wall, the mark and what else hangs there are painted by exact integrals over thirds of pixels (``mark_raster``),
shaded, blurred by a Gaussian, averaged to pixels, and given noise. A pose, its clutter and its noise depend only on the
seed and not on the pattern, so that a mark and tags can be compared on the same wall.

    scene(7, phi=0.3, distance=1.0)                    a mark in clutter
    scene(7, pattern=None, fence=True)                 clutter only
    scene(7, distance=1.0, pattern=tag("36h11", 0.1414))   a tag in the place of the mark, see ``tag_scenes``

    python benchmarks/mark_scenes.py --check           where edges lie in the image, against their projection
    python benchmarks/mark_scenes.py --save folder     a few scenes as PNG
"""

import argparse
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np
import numpy.typing as npt
from mark_clutter import Span, paint_wall
from mark_raster import Array, Canvas, Optics, Plane, Rectangle

RESERVED: Span = (-0.17, 0.17)  # of the wall, for the mark or the tag [m]
BEARING = np.radians(8.0)
BORDER_PX = 3.0


class Pattern(Protocol):
    """Something printed that hangs on the wall, centred on the plane's origin."""

    def paint(self, canvas: Canvas, plane: Plane, dark: float, bright: float) -> None:
        """Paint it."""

    def outline(self) -> Rectangle:
        """Return what must be inside the image."""


@dataclass(frozen=True)
class Stripes:
    """Bright bars on a dark ground: left edges and widths of the bars, height of bars, dark margin around [m]."""

    left: tuple[float, ...]
    widths: tuple[float, ...]
    height: float = 0.1
    margin: float = 0.03

    @property
    def edges(self) -> Array:
        """All edges from left to right [m]."""
        return np.stack([self.left, np.add(self.left, self.widths)], axis=1).ravel()

    def outline(self) -> Rectangle:
        """Return the dark ground."""
        edges, half = self.edges, 0.5 * self.height + self.margin
        return float(edges[0]) - self.margin, -half, float(edges[-1]) + self.margin, half

    def paint(self, canvas: Canvas, plane: Plane, dark: float, bright: float) -> None:
        """Paint ground and bars."""
        half = 0.5 * self.height
        bars = [((a, -half, a + w, half), bright) for a, w in zip(self.left, self.widths, strict=True)]
        canvas.paint(plane, self.outline(), dark, bars)


def stripes(*gaps_mm: float, height: float = 0.1, margin: float = 0.03) -> Stripes:
    """Return a mark from the distances of neighbouring edges [mm], its origin in the middle."""
    x = np.concatenate([[0.0], np.cumsum(gaps_mm)]) * 1e-3
    x -= 0.5 * x[-1]
    return Stripes(tuple(x[::2].tolist()), tuple((x[1::2] - x[::2]).tolist()), height, margin)


MARKS = (
    stripes(32, 20, 28, 40, 24, 36, 20),
    stripes(20, 32, 36, 20, 28, 24, 40),
    stripes(24, 40, 20, 24, 36, 20, 36),
)


@dataclass(frozen=True, eq=False)
class Scene:
    """One image and what is true of it.

    Attributes:
        image: (height, width) uint8.
        optics: the camera that took it, with its tilt and roll.
        plane: pose of the pattern in the level frame: phi, dx, dy, dz [rad, m].
        pattern: what hangs there, or None.
        columns: (n,) where the edges of a mark cross the row through the principal point, freed of distortion [px].
        is_visible: (n,) whether no edge of something in front comes near that edge of the mark.
        dark, bright: grey values of the pattern before shading.
        blur_px, noise: sigmas of the optical blur and of the noise [px, grey values].
        kinds: of clutter, by name.
    """

    image: npt.NDArray[np.uint8]
    optics: Optics
    plane: Plane
    pattern: Pattern | None
    columns: Array
    is_visible: npt.NDArray[np.bool_]
    dark: float
    bright: float
    blur_px: float
    noise: float
    kinds: list[str] = field(default_factory=list)

    @property
    def truth(self) -> Array:
        """Yaw, lateral offset and depth in the level frame [rad, m, m]."""
        return np.array([self.plane.phi, self.plane.dx, self.plane.dy])

    @property
    def smallest_gap_px(self) -> float:
        """Distance of the closest two edges of the mark on the row through the principal point."""
        return float(np.diff(self.columns).min())

    def edge_columns(self, rows: Array) -> Array:
        """Where the edges of a mark cross rows (m,) of the image freed of distortion: (m, n) [px]."""
        assert isinstance(self.pattern, Stripes)
        return edge_columns(self.optics, self.plane, self.pattern.edges, rows)


def edge_columns(optics: Optics, plane: Plane, edges: Array, rows: Array) -> Array:
    """Columns (m, n) where upright lines at abscissae (n,) cross rows (m,), without distortion [px]."""
    ends = plane.level(np.stack([np.repeat(edges, 2), np.tile([-1.0, 1.0], len(edges))], axis=1))
    p = replace(optics, k1=0.0, k2=0.0).project(ends).reshape(-1, 2, 2)
    slope = (p[:, 1, 0] - p[:, 0, 0]) / (p[:, 1, 1] - p[:, 0, 1])
    return np.asarray(p[:, 0, 0] + slope * (np.reshape(rows, (-1, 1)) - p[:, 0, 1]))


def scene(
    seed: int,
    *,
    pattern: Pattern | None = MARKS[0],
    phi: float | None = None,
    distance: float | None = None,
    bearing: float | None = None,
    optics: Optics | None = None,
    blur_px: float = 0.8,
    noise: float | None = None,
    dark: float | None = None,
    bright: float | None = None,
    shading: float = 0.15,
    clutter: bool = True,
    fence: bool = False,
    hidden: float = 0.0,
    samples: int = 3,
) -> Scene:
    """Render one wall; whatever is None is drawn from the seed.

    Args:
        seed: of everything.
        pattern: what hangs at the origin of the wall; None for clutter only.
        phi: yaw of the wall [rad]; drawn up to 60 degrees.
        distance: depth of the origin [m]; drawn between 0.5 and 3.
        bearing: of the origin [rad]; drawn up to 8 degrees, and again until the pattern is inside the image.
        optics: the camera; its tilt is drawn up to 5 degrees and its roll with a sigma of 0.4.
        blur_px: sigma of the blur [px].
        noise: sigma of the noise; drawn from 2 to 4 [grey values].
        dark: grey value of a mark's ground.
        bright: grey value of its bars.
        shading: change of brightness from the left to the right border, as a share.
        clutter: whether anything else hangs on the wall.
        fence: whether there is a large fence.
        hidden: share of the mark's width that something in front of it hides.
        samples: per pixel and direction.

    Raises:
        ValueError: the pattern does not fit into the image.
    """
    pose_rng, wall_rng, light_rng, front_rng = (np.random.default_rng([19910501, seed, k]) for k in range(4))
    phi = pose_rng.uniform(-1, 1) * np.radians(60.0) if phi is None else phi
    distance = pose_rng.uniform(0.5, 3.0) if distance is None else distance
    optics, plane = _place(pose_rng, pattern, phi, distance, bearing, optics)
    dark = light_rng.uniform(15, 60) if dark is None else dark
    bright = light_rng.uniform(170, 230) if bright is None else bright
    noise = light_rng.uniform(2.0, 4.0) if noise is None else noise

    canvas = Canvas(optics, wall_rng.uniform(40, 180), samples)
    kinds = []
    if clutter:
        kinds = paint_wall(canvas, plane, wall_rng, keep=RESERVED if pattern else None, fence=fence)
        _stain(canvas, wall_rng)
    if pattern is not None:
        pattern.paint(canvas, plane, dark, bright)
    stripe = pattern if isinstance(pattern, Stripes) else None
    edges = np.empty(0) if stripe is None else stripe.edges
    is_visible = np.ones(len(edges), dtype=bool)
    if hidden and pattern is not None:
        is_visible = _hide(canvas, plane, pattern, edges, hidden, front_rng)
    image = np.clip(np.rint(_expose(canvas, light_rng, shading, blur_px, noise)), 0, 255).astype(np.uint8)
    columns = edge_columns(optics, plane, edges, np.array([optics.cy]))[0]
    return Scene(image, optics, plane, pattern, columns, is_visible, dark, bright, blur_px, noise, kinds)


def _place(
    rng: np.random.Generator,
    pattern: Pattern | None,
    phi: float,
    distance: float,
    bearing: float | None,
    optics: Optics | None,
) -> tuple[Optics, Plane]:
    """Draw attitude, bearing and height until the pattern is inside the image."""
    x0, z0, x1, z1 = (-0.13, -0.08, 0.13, 0.08) if pattern is None else pattern.outline()
    corners = np.array([[x0, z0], [x1, z0], [x1, z1], [x0, z1]])
    for _ in range(100):
        drawn = optics or Optics(tilt=np.radians(rng.uniform(-5, 5)), roll=np.radians(rng.normal(0, 0.4)))
        beta = rng.uniform(-BEARING, BEARING) if bearing is None else bearing
        up = rng.uniform(-1, 1) * np.radians(5.0)
        dy = distance
        plane = Plane(phi, dy * np.tan(beta), dy, dy * np.tan(drawn.tilt + up))
        level = plane.level(corners)
        if (level[:, 1] < 0.05).any():
            continue
        p = drawn.project(level)
        if (p > BORDER_PX).all() and (p < (drawn.width - 1 - BORDER_PX, drawn.height - 1 - BORDER_PX)).all():
            return drawn, plane
    raise ValueError(
        f"scene: a pattern {x1 - x0:.3f} m wide at {distance} m and {phi} rad is not inside the image. "
        "Take another distance or bearing."
    )


def _stain(canvas: Canvas, rng: np.random.Generator) -> None:
    """Lay uneven brightness over the wall."""
    coarse = rng.normal(0, 4.0, (8, 10)).astype(np.float32)
    canvas.fine += cv2.resize(coarse, canvas.fine.shape[::-1], interpolation=cv2.INTER_CUBIC)


def _hide(
    canvas: Canvas, plane: Plane, pattern: Pattern, edges: Array, share: float, rng: np.random.Generator
) -> npt.NDArray[np.bool_]:
    """Put a post in front of the pattern; return which edges stay clear of it."""
    left, _, right, _ = pattern.outline()
    width = share * (right - left)
    x = rng.uniform(left - 0.5 * width, right - 0.5 * width)
    canvas.paint(plane, (x, -1.0, x + width, 1.0), rng.uniform(10, 240))
    clearance = 8.0 * plane.dy / canvas.optics.f / max(np.cos(plane.phi), 0.2)  # eight pixels
    return np.asarray((edges < x - clearance) | (edges > x + width + clearance))


def _expose(canvas: Canvas, rng: np.random.Generator, shading: float, blur_px: float, noise: float) -> Array:
    """Shade, blur, average to pixels, and add noise."""
    height, width, n = canvas.optics.height, canvas.optics.width, canvas.samples
    fine = canvas.fine * (1.0 + shading * (np.linspace(-0.5, 0.5, width * n, dtype=np.float32)))
    if blur_px > 0:
        reach = 2 * int(np.ceil(4.5 * blur_px * n)) + 1
        fine = cv2.GaussianBlur(fine, (reach, reach), blur_px * n)
    pixels = fine.reshape(height, n, width, n).mean(axis=(1, 3), dtype=np.float64)
    return np.asarray(pixels + rng.normal(0, 1.0, pixels.shape) * noise)


def check() -> float:
    """Return the largest distance between an edge of a rendered mark, unrounded, and its projection [px].

    The place of an edge is the centroid of the brightness steps across it, on one row of pixels.
    """
    worst = 0.0
    poses = [(0, 0.5, 0.0), (40, 0.5, 0.0), (-65, 0.4, 0.0), (20, 1.0, 0.0), (30, 0.5, -0.2)]
    for degrees, distance, k1 in poses:
        optics = Optics(k1=k1, k2=-0.2 * k1, tilt=np.radians(3.0), roll=np.radians(1.0))
        plane = Plane(np.radians(degrees), 0.05, distance, 0.05)
        canvas = Canvas(optics, 100.0)
        MARKS[0].paint(canvas, plane, 30.0, 200.0)
        pixels = _expose(canvas, np.random.default_rng(0), 0.0, 0.8, 0.0)
        middle = optics.project(plane.level(np.array([[0.0, 0.0]])))[0, 1]
        rows = np.arange(int(middle) - 8, int(middle) + 9)
        heights = np.linspace(-0.45, 0.45, 4000) * MARKS[0].height
        for X in MARKS[0].edges:
            curve = optics.project(plane.level(np.stack([np.full(4000, X), heights], axis=1)))[::-1]
            for row, at in zip(rows, np.interp(rows, curve[:, 1], curve[:, 0]), strict=True):
                worst = max(worst, abs(_centroid(pixels[row], at) - at))
    return worst


def _centroid(row: Array, at: float) -> float:
    """Return the centroid of the brightness steps within 6 pixels of a place."""
    k = np.arange(round(at) - 6, round(at) + 6)
    steps = row[k + 1] - row[k]
    return float(((k + 0.5) * steps).sum() / steps.sum())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--save", type=Path)
    args = parser.parse_args()
    if args.check:
        print(f"largest distance between an edge and its projection: {check():.4f} px")
    if args.save:
        args.save.mkdir(parents=True, exist_ok=True)
        for seed in range(4):
            for name, options in {
                "mark": {},
                "hidden": {"hidden": 0.3},
                "fence": {"pattern": None, "fence": True},
            }.items():
                cv2.imwrite(str(args.save / f"{name}{seed}.png"), scene(seed, **options).image)


if __name__ == "__main__":
    main()
