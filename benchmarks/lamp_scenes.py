"""Images of a ceiling for the detector's tables, with the truth; they share no code with the package.

Every shape lies in the plane of the ceiling and is painted through a pinhole camera with radial distortion and a small
tilt, 5 x 5 samples per pixel. Around it: shading, vignetting, glare, tile joints, stripes, long panels, halos, an
optical blur, and sensor noise. What must not be taken for a lamp: squares, rounded squares and hexagons of any angle
and of the same brightness, stripes, panels.

The truth of a lamp is the projection of the centre of its circle, not the middle of its outline.
"""

from dataclasses import dataclass, field

import cv2
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

WIDTH, HEIGHT, CEILING_M = 640, 480, 2.42
SAMPLES = 5


@dataclass(frozen=True)
class Optics:
    """A camera under the ceiling: focal length, principal point [px], radial distortion, tilt about x and y [rad]."""

    f: float = 645.333333333333
    cx: float = 321.7
    cy: float = 236.4
    k1: float = 0.0
    k2: float = 0.0
    tilt: tuple[float, float] = (0.0, 0.0)

    def rotation(self) -> Array:
        """Level frame to camera frame."""
        (a, b) = self.tilt
        about_x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
        about_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
        return np.asarray(about_x @ about_y)

    def to_pixel(self, plane: Array) -> Array:
        """Project points (..., 2) of the ceiling, in units of its height, to pixels."""
        ray = np.concatenate([plane, np.ones_like(plane[..., :1])], axis=-1) @ self.rotation().T
        xy = ray[..., :2] / ray[..., 2:]
        s = (xy**2).sum(-1, keepdims=True)
        return np.asarray(self.f * xy * (1 + self.k1 * s + self.k2 * s * s) + (self.cx, self.cy))

    def to_plane(self, pixel: Array) -> Array:
        """Invert ``to_pixel``: Newton's method on the radius."""
        xy = (pixel - (self.cx, self.cy)) / self.f
        if self.k1 or self.k2:
            distorted = np.hypot(xy[..., 0], xy[..., 1])
            r = distorted
            for _ in range(5):
                s = r * r
                error = r * (1 + s * (self.k1 + s * self.k2)) - distorted
                r = r - error / (1 + s * (3 * self.k1 + s * 5 * self.k2))
            xy = xy * np.where(distorted > 0, r / np.maximum(distorted, 1e-12), 1.0)[..., None]
        ray = np.concatenate([xy, np.ones_like(xy[..., :1])], axis=-1) @ self.rotation()
        return np.asarray(ray[..., :2] / ray[..., 2:])


@dataclass
class Scene:
    """One image and what is true of it.

    Attributes:
        image: (480, 640) uint8.
        optics: the camera that took it.
        centres: (N, 2) projected true centres [px].
        radii: (N,) mean radius of the outline [px].
        contrasts: (N,) brightness over the ground [grey values].
        is_whole: (N,) whether the outline lies 2 px or more inside the image.
        kinds: of what must not be found, by name.
    """

    image: npt.NDArray[np.uint8]
    optics: Optics
    centres: Array = field(default_factory=lambda: np.empty((0, 2)))
    radii: Array = field(default_factory=lambda: np.empty(0))
    contrasts: Array = field(default_factory=lambda: np.empty(0))
    is_whole: npt.NDArray[np.bool_] = field(default_factory=lambda: np.empty(0, dtype=bool))
    kinds: list[str] = field(default_factory=list)


class _Canvas:
    """An image under construction, and the places already taken."""

    def __init__(self, optics: Optics, rng: np.random.Generator) -> None:
        self.optics, self.rng = optics, rng
        self.pixels = np.zeros((HEIGHT, WIDTH))
        self.taken: list[tuple[float, float, float]] = []

    def place(self, radius: float, margin: float, tries: int = 60) -> Array | None:
        """Return a free place for something of this radius, ``margin`` px or more from the border."""
        for _ in range(tries):
            u, v = (
                self.rng.uniform(margin, WIDTH - 1 - margin),
                self.rng.uniform(margin, HEIGHT - 1 - margin),
            )
            if all(np.hypot(u - a, v - b) > radius + r + 5 for a, b, r in self.taken):
                self.taken.append((u, v, radius))
                return np.array([u, v])
        return None

    def paint(self, centre: Array, reach: float, inside: object, value: float, *, halo: float = 0.0) -> None:
        """Blend ``value`` over the ground where ``inside`` (plane offset in px -> bool) holds, and add a halo."""
        lo = np.maximum(np.floor(centre - reach), 0).astype(int)
        hi = np.minimum(np.ceil(centre + reach) + 1, (WIDTH, HEIGHT)).astype(int)
        if (hi <= lo).any():
            return
        n = SAMPLES if reach < 200 else 2  # what lies under everything needs no finer edge
        offsets = (np.arange(n) + 0.5) / n - 0.5
        u = (np.arange(lo[0], hi[0])[:, None] + offsets).ravel()
        v = (np.arange(lo[1], hi[1])[:, None] + offsets).ravel()
        grid = np.stack(np.meshgrid(u, v), axis=-1)
        origin = self.optics.to_plane(centre)
        plane = (self.optics.to_plane(grid) - origin) * self.optics.f
        shape = (hi[1] - lo[1], n, hi[0] - lo[0], n)
        cover = inside(plane[..., 0], plane[..., 1]).reshape(shape).mean(axis=(1, 3))  # type: ignore[operator]
        patch = self.pixels[lo[1] : hi[1], lo[0] : hi[0]]
        if halo > 0:
            r = np.hypot(*np.moveaxis(plane, -1, 0)).reshape(shape).mean(axis=(1, 3))
            patch += halo * np.exp(-0.5 * (r / (0.45 * reach)) ** 2)
        patch += cover * (value - patch)


def _ground(canvas: _Canvas, sample_rng: np.random.Generator) -> float:
    """Paint shading, glare, tile joints, stripes and panels; return the brightness of the ground."""
    rng = sample_rng
    base = rng.uniform(45, 105)
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(float)
    canvas.pixels += base + rng.uniform(-12, 12) * (x / WIDTH - 0.5) + rng.uniform(-12, 12) * (y / HEIGHT - 0.5)
    for _ in range(rng.integers(0, 3)):
        u, v, size = rng.uniform(0, WIDTH), rng.uniform(0, HEIGHT), rng.uniform(35, 110)
        canvas.pixels += rng.uniform(8, 45) * np.exp(-((x - u) ** 2 + (y - v) ** 2) / (2 * size * size))
    centre = np.array([WIDTH / 2, HEIGHT / 2])
    if rng.random() < 0.6:  # joints between tiles
        pitch, angle, width, depth = (
            rng.uniform(90, 180),
            rng.uniform(0, np.pi),
            rng.uniform(1.5, 4),
            rng.uniform(8, 30),
        )
        shift = rng.uniform(0, pitch, 2)

        def joints(a: Array, b: Array) -> Array:
            p, q = a * np.cos(angle) + b * np.sin(angle), b * np.cos(angle) - a * np.sin(angle)
            return ((p + shift[0]) % pitch < width) | ((q + shift[1]) % pitch < width)

        canvas.paint(centre, 420.0, joints, base - depth)
    for _ in range(rng.integers(0, 3)):  # stripes right across, brighter or darker
        angle, offset, width = rng.uniform(0, np.pi), rng.uniform(-220, 220), rng.uniform(3, 14)
        value = base + rng.choice([-1, 1]) * rng.uniform(15, 60)
        canvas.paint(
            centre,
            420.0,
            lambda a, b, t=angle, o=offset, w=width: np.abs(a * np.cos(t) + b * np.sin(t) - o) < 0.5 * w,
            value,
        )
    return float(base)


def _polygon(sides: int, radius: float, rounding: float, angle: float) -> object:
    """Return a test for a regular polygon of this inner radius, corners rounded by a share of it."""
    normals = angle + 2 * np.pi * np.arange(sides) / sides
    inner = radius * (1.0 - rounding)
    corners = (
        inner
        / np.cos(np.pi / sides)
        * np.stack([np.cos(normals + np.pi / sides), np.sin(normals + np.pi / sides)], axis=-1)
    )

    def inside(a: Array, b: Array) -> Array:
        distances = [a * np.cos(t) + b * np.sin(t) for t in normals]
        core = np.max(distances, axis=0)
        if rounding == 0.0:
            return np.asarray(core < radius)
        result = core < inner
        for k in range(sides):
            p, q = corners[k - 1], corners[k]
            along = np.clip(((a - p[0]) * (q - p)[0] + (b - p[1]) * (q - p)[1]) / ((q - p) ** 2).sum(), 0, 1)
            near = np.hypot(a - p[0] - along * (q - p)[0], b - p[1] - along * (q - p)[1]) < radius * rounding
            result |= near
        return np.asarray(result)

    return inside


def _decoys(canvas: _Canvas, base: float, n: int) -> list[str]:
    rng = canvas.rng
    kinds = []
    for _ in range(n):
        kind = rng.choice(["square", "rounded", "hexagon", "panel"])
        value = min(base + rng.uniform(35, 170), 262.0)
        angle = rng.uniform(0, 2 * np.pi)
        if kind == "panel":
            half = np.array([rng.uniform(8, 30), 0.0])
            half[1] = half[0] * rng.uniform(1.6, 4.0)
            radius = float(np.hypot(*half))
        else:
            half = np.array([rng.uniform(6, 20)] * 2)
            radius = float(half[0] * (1.42 if kind != "hexagon" else 1.16))
        at = canvas.place(radius, 0.5 * radius)
        if at is None:
            continue
        if kind == "panel":
            canvas.paint(
                at,
                1.3 * radius + 3,
                lambda a, b, h=half, t=angle: (
                    (np.abs(a * np.cos(t) + b * np.sin(t)) < h[0]) & (np.abs(b * np.cos(t) - a * np.sin(t)) < h[1])
                ),
                value,
            )
        else:
            sides = 6 if kind == "hexagon" else 4
            rounding = rng.uniform(0.1, 0.45) if kind == "rounded" else 0.0
            canvas.paint(at, 1.3 * radius + 3, _polygon(sides, half[0], rounding, angle), value)
        kinds.append(str(kind))
    return kinds


def make_scene(
    seed: int, *, dim: float = 0.25, optics: Optics | None = None, radii: tuple[float, float] = (10, 40)
) -> Scene:
    """Render one ceiling.

    Args:
        seed: of everything.
        dim: share of lamps whose contrast is only 28..45.
        optics: the camera; by default drawn: k1 in -0.25..0, tilt up to 1 degree.
        radii: range of the lamps' radii in the middle of the image [px].
    """
    rng = np.random.default_rng([20160225, seed])
    if optics is None:
        k1 = rng.uniform(-0.25, 0.0)
        tilt = (rng.normal(0, 0.007), rng.normal(0, 0.007))
        optics = Optics(f=rng.uniform(580, 680), k1=k1, k2=-0.2 * k1, tilt=tilt)
    canvas = _Canvas(optics, rng)
    base = _ground(canvas, rng)
    lamps = []
    for _ in range(rng.integers(0, 7)):
        r = rng.uniform(*radii)
        kind = rng.choice(["plain", "cut", "pair"], p=[0.7, 0.14, 0.16])
        contrast = rng.uniform(28, 45) if rng.random() < dim else rng.uniform(60, 190)
        if kind == "pair":
            at = canvas.place(2.05 * r, 2.2 * r + 3)
            turn = rng.uniform(0, np.pi)
            gap = r * rng.uniform(1.0, 1.04) / optics.f * np.array([np.cos(turn), np.sin(turn)])
            places = [] if at is None else [optics.to_pixel(optics.to_plane(at) + s * gap) for s in (-1, 1)]
        else:
            at = canvas.place(r, r + 4)
            if kind == "cut" and at is not None:
                canvas.taken.pop()
                at = _at_border(rng, r)
                is_free = all(np.hypot(*(at - c[:2])) > r + c[2] + 5 for c in canvas.taken)
                at = at if is_free else None
                if at is not None:
                    canvas.taken.append((at[0], at[1], r))
            places = [] if at is None else [at]
        lamps += [(place, r, contrast) for place in places]
    kinds = _decoys(canvas, base, int(rng.integers(1, 5)))
    halo = rng.uniform(0, 0.25) if rng.random() < 0.6 else 0.0
    for at, r, contrast in lamps:
        lo = np.clip(at - 1.3 * r, 0, (WIDTH - 2, HEIGHT - 2)).astype(int)
        hi = np.clip(at + 1.3 * r, lo + 1, (WIDTH, HEIGHT)).astype(int)
        value = np.median(canvas.pixels[lo[1] : hi[1], lo[0] : hi[0]]) + contrast
        canvas.paint(at, 1.9 * r + 6, lambda a, b, r=r: a * a + b * b < r * r, value, halo=halo * contrast)
    return _finish(canvas, lamps, kinds)


def _at_border(rng: np.random.Generator, r: float) -> Array:
    """Return a centre whose lamp crosses the border of the image."""
    out = rng.uniform(-0.7, 0.9) * r  # how far inside the border the centre lies
    side = rng.integers(0, 4)
    along = rng.uniform(0.1, 0.9)
    return np.array(
        [
            [along * WIDTH, out],
            [along * WIDTH, HEIGHT - 1 - out],
            [out, along * HEIGHT],
            [WIDTH - 1 - out, along * HEIGHT],
        ][side]
    )


def _finish(canvas: _Canvas, lamps: list[tuple[Array, float, float]], kinds: list[str]) -> Scene:
    """Blur, vignette, add noise, round; and collect the truth."""
    rng, optics = canvas.rng, canvas.optics
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(float)
    sigma = rng.uniform(0.45, 1.0)
    pixels = cv2.GaussianBlur(canvas.pixels, (0, 0), sigma)
    s = ((x - optics.cx) ** 2 + (y - optics.cy) ** 2) / optics.f**2
    pixels *= 1.0 - rng.uniform(0.1, 0.5) * s / (1 + s)
    pixels += rng.normal(0, rng.uniform(1.5, 6.0), pixels.shape)
    scene = Scene(np.clip(np.rint(pixels), 0, 255).astype(np.uint8), optics, kinds=kinds)
    if lamps:
        angles = np.arange(64) * np.pi / 32
        rim = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        outlines = [optics.to_pixel(optics.to_plane(at) + r / optics.f * rim) for at, r, _ in lamps]
        scene.centres = np.array([at for at, _, _ in lamps])
        scene.radii = np.array(
            [np.linalg.norm(o - at, axis=-1).mean() for o, (at, _, _) in zip(outlines, lamps, strict=True)]
        )
        scene.contrasts = np.array([c for _, _, c in lamps])
        scene.is_whole = np.array([(o > 2).all() and (o < (WIDTH - 3, HEIGHT - 3)).all() for o in outlines], dtype=bool)
    return scene
