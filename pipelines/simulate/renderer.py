"""The planar-patch renderer: rectangles in space, with a texture and flat shapes on them, seen by a camera.

A patch is a corner and two sides U, V; its front is where V x U points, so who stands before it with U to the right
has V downwards. The buffers come first, then each pixel is shaded once, through its own ray, so the lens is exact.
With the plane in camera coordinates, normal n and corner P, and the ray r = (x, y, 1) of a pixel::

    1 / z = g . r,         g = n / (n . P)                                    (1)  affine in x, y: exact, no iteration
    s = U . (z r - P) / |U|^2,   s / z = (U - (U . P) g) . r / |U|^2          (2)  likewise t with V; inside is 0..1

Shapes have edges that are exact to a hundredth of a pixel (``kernels._share``). A patch's own border is not smoothed:
put a bigger patch behind it, or render ``finer`` and average.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from ...formats.calibration import Calibration
from ...formats.events import Array, Bytes
from .camera import project, ray_table
from .pose import View
from .shapes import Drawing

NEAR = 0.05
BORDER_POINTS = 33


@dataclass(frozen=True, slots=True, eq=False)
class Texture:
    """A grey picture on a patch, with the halved pictures made from it.

    Attributes:
        levels: all levels behind each other, flat; full size first.
        sizes: per level: start, width, height.
        texels_per_m: of the full picture [1/m].
        is_tiled: repeated over the patch; otherwise its border is continued.
        white: radiance of texel value 255; 1.0 is a full pixel at gain 1.
    """

    levels: Bytes
    sizes: tuple[tuple[int, int, int], ...]
    texels_per_m: float
    is_tiled: bool
    white: float

    @staticmethod
    def of(picture: Bytes, texels_per_m: float, *, is_tiled: bool = False, white: float = 1.0) -> "Texture":
        """Make a texture of a picture (h, w): row 0, column 0 at the patch's corner, columns along U, rows along V."""
        level = picture.astype(float)
        flat, sizes, start = [], [], 0
        while True:
            flat.append(np.rint(level).astype(np.uint8).reshape(-1))
            sizes.append((start, level.shape[1], level.shape[0]))
            start += level.size
            if level.shape[0] % 2 or level.shape[1] % 2 or min(level.shape) < 4:
                break
            level = level.reshape(level.shape[0] // 2, 2, level.shape[1] // 2, 2).mean(axis=(1, 3))
        return Texture(np.concatenate(flat), tuple(sizes), texels_per_m, is_tiled, white)


@dataclass(frozen=True, slots=True, eq=False)
class Patch:
    """A rectangle in the world.

    Attributes:
        corner: (3,) where patch coordinates are 0, 0 [m].
        side_u, side_v: (3,) its sides, at right angles [m]; its front is where V x U points.
        drawing: shapes, glows and tile bars on it, in metres along U and V.
        texture: what is under the shapes, or None.
        radiance: of the bare patch without a texture.
        shading: (R, C) light that falls on it, relative, at nodes from border to border, rows along V; linear in
            between. No nodes mean even light.
    """

    corner: Array
    side_u: Array
    side_v: Array
    drawing: Drawing = field(default_factory=Drawing)
    texture: Texture | None = None
    radiance: float = 0.3
    shading: Array = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def size(self) -> Array:
        """Lengths of its sides, (2,) [m]."""
        return np.array([np.linalg.norm(self.side_u), np.linalg.norm(self.side_v)])


def plane_rows(patch: Patch, world_t_camera: View) -> Array | None:
    """Return the rows g, s, t (3, 3) of eqs. (1), (2), or None if the camera is behind the patch."""
    to_camera = world_t_camera.rotation.T
    corner = to_camera @ (patch.corner - world_t_camera.position)
    u, v = to_camera @ patch.side_u, to_camera @ patch.side_v
    normal = np.cross(v, u)
    height = normal @ corner
    if height >= 0:  # (C - P) . n > 0 is in front
        return None
    g = normal / height
    return np.stack([g, (u - (u @ corner) * g) / (u @ u), (v - (v @ corner) * g) / (v @ v)])


def _box(patch: Patch, world_t_camera: View, calibration: Calibration) -> np.ndarray | None:
    """Return the first and last column and row that the patch can cover, (4,), or None.

    The patch's border is clipped at the near plane, then followed through the lens in short steps, because a lens
    bends it. A patch that reaches outside the field where the lens model holds may be anywhere, so it gets the whole
    image.
    """
    whole = np.array([0, calibration.width - 1, 0, calibration.height - 1])
    corners = patch.corner + np.array([np.zeros(3), patch.side_u, patch.side_u + patch.side_v, patch.side_v])
    corners = (corners - world_t_camera.position) @ world_t_camera.rotation
    clipped: list[Array] = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if a[2] >= NEAR:
            clipped.append(a)
        if (a[2] >= NEAR) != (b[2] >= NEAR):
            clipped.append(a + (NEAR - a[2]) / (b[2] - a[2]) * (b - a))
    if not clipped:
        return None
    ring = np.array(clipped)
    share = np.linspace(0, 1, BORDER_POINTS)[:, None, None]
    border = (ring + share * (np.roll(ring, -1, axis=0) - ring)).reshape(-1, 3)
    if (np.abs(border[:, :2]) > reach(calibration) * border[:, 2:]).any():
        return whole
    pixels = project(border, calibration)
    low, high = np.floor(pixels.min(axis=0)) - 2, np.ceil(pixels.max(axis=0)) + 2
    box = np.array([max(low[0], 0), min(high[0], whole[1]), max(low[1], 0), min(high[1], whole[3])]).astype(np.int64)
    return box if box[0] <= box[1] and box[2] <= box[3] else None


@lru_cache(maxsize=8)
def reach(calibration: Calibration) -> float:
    """Return the tangent off the axis, along x or y, up to which the lens model holds."""
    return 1.1 * float(np.abs(ray_table(calibration)).max())


def see(
    patches: Sequence[Patch], world_t_camera: View, calibration: Calibration
) -> tuple[Array, np.ndarray, dict[int, tuple[Array, np.ndarray]]]:
    """Find which patch each pixel sees, and how far away.

    Returns:
        Inverse depth (H, W) [1/m], 0 where nothing is seen; patch index (H, W), -1 where nothing is seen; and, per
        visible patch, its rows of ``plane_rows`` and its box of pixels.
    """
    from .kernels import raster

    rays = ray_table(calibration)
    depth = np.zeros((calibration.height, calibration.width))
    ids = np.full(depth.shape, -1, np.int32)
    visible = {}
    for index, patch in enumerate(patches):
        rows = plane_rows(patch, world_t_camera)
        box = None if rows is None else _box(patch, world_t_camera, calibration)
        if rows is None or box is None:
            continue
        raster(rays, rows, (index, NEAR, box), depth, ids)
        visible[index] = (rows, box)
    return depth, ids, visible


def render(patches: Sequence[Patch], views: Sequence[View], calibration: Calibration) -> np.ndarray:
    """Return the radiance (H, W) float32 that the pixels collect, averaged over the camera poses ``views``.

    More than one pose is an exposure during which the camera moved. 1.0 is a full pixel at gain 1, and there may be
    more.
    """
    from .kernels import shade

    out = np.zeros((calibration.height, calibration.width), np.float32)
    rays = ray_table(calibration)
    for view in views:
        depth, ids, visible = see(patches, view, calibration)
        for index, (rows, box) in visible.items():
            patch = patches[index]
            texture = _level(patch, depth[box[2] : box[3] + 1, box[0] : box[1] + 1], calibration)
            surface = (texture, *patch.drawing.tables(patch.size), patch.shading)
            shade(rays, (rows, patch.size), (depth, ids, index, box), surface, out)
    out /= np.float32(len(views))
    return out


@lru_cache(maxsize=8)
def finer(calibration: Calibration, n: int) -> Calibration:
    """Return the calibration of the same camera with pixels of 1 / n of the side."""
    return replace(
        calibration,
        width=n * calibration.width,
        height=n * calibration.height,
        fx=n * calibration.fx,
        fy=n * calibration.fy,
        cx=n * calibration.cx + (n - 1) / 2,
        cy=n * calibration.cy + (n - 1) / 2,
    )


def _level(
    patch: Patch, inverse_depth: Array, calibration: Calibration
) -> tuple[Bytes, int, int, int, float, bool, float]:
    """Pick the texture's level whose texels are no smaller than half a pixel at the nearest point seen."""
    if patch.texture is None:
        return np.zeros(1, np.uint8), 0, 0, 0, 1.0, True, patch.radiance
    texture = patch.texture
    texels_per_pixel = texture.texels_per_m / float(inverse_depth.max()) / calibration.fx
    level = min(int(np.log2(max(1.0, texels_per_pixel))), len(texture.sizes) - 1)
    start, width, height = texture.sizes[level]
    return texture.levels, start, width, height, texture.texels_per_m / 2**level, texture.is_tiled, texture.white


def depth_image(patches: Sequence[Patch], view: View, calibration: Calibration) -> np.ndarray:
    """Return the depth (H, W) float32 along the camera's z axis [m], 0 where nothing is seen."""
    inverse, _, _ = see(patches, view, calibration)
    with np.errstate(divide="ignore"):
        return np.where(inverse > 0, 1.0 / inverse, 0.0).astype(np.float32)
