"""From a pixel of the ceiling to a place in the robot's frame, and what its error becomes there.

A pixel is a direction d in the optical frame (``geometry/camera.py``); the mount turns it into the robot's frame and
the ceiling, z = ceiling, cuts it:

    ray = R d,    (x, y) = t_xy + (ceiling - t_z) ray_xy / ray_z.

The nominal camera looks straight up with the top of its image forward: u -> +y, v -> -x. An unknown tilt (a, b) of
the robot about its own x and y moves what it sees by T (a, b), T = [[-yX, ceiling + xX], [-(ceiling + yY), xY]] with
(X, Y) = ray_xy / ray_z; so the covariance is h^2 J cov J^T + sd^2 T T^T, J = d(X, Y)/d(u, v). The part of a tilt is
common to all sightings of one image.

Source: Noh, Ko and Kuc, "Localization of a mobile robot using ceiling image with identical features", 2016, section 2,
eqs (1)-(3), which are this for a camera without distortion, offset or tilt (see ``paper.py``).
"""

from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np

from ..geometry.camera import Camera
from .detect import Array, Circles, Plane

_MAX_NODES = 40_000  # so that the table stays in the cache; between its nodes it is right to 0.002 px


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A camera on a robot under a ceiling.

    Attributes:
        camera: its lens.
        width, height: of its images [px].
        rotation: (3, 3) optical frame to robot frame.
        translation: (3,) the lens in the robot frame [m].
        ceiling_m: height of the features above the origin of the robot frame [m].
        is_flipped: the images are mirrored left to right.

    Raises:
        ValueError: the ceiling is not above the lens.
    """

    camera: Camera
    width: int
    height: int
    rotation: Array
    translation: Array
    ceiling_m: float
    is_flipped: bool = False

    def __post_init__(self) -> None:
        """Refuse a lens above its ceiling."""
        if not self.lens_to_ceiling > 0:
            raise ValueError(
                f"the ceiling, {self.ceiling_m:.6g} m above base_link, is not above the lens, "
                f"{self.translation[2]:.6g} m above it"
            )

    @property
    def lens_to_ceiling(self) -> float:
        """Distance from the lens to the plane of the features [m]; the paper's h."""
        return float(self.ceiling_m - self.translation[2])

    def slopes(self, uv: Array) -> Array:
        """Return (X, Y) = ray_xy / ray_z (..., 2) of pixels (..., 2); nan where the ray does not rise."""
        ray = self.camera.unproject(self._unflipped(uv)) @ self.rotation.T
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(ray[..., 2:] > 1e-6, ray[..., :2] / ray[..., 2:], np.nan)

    def to_robot(self, uv: Array) -> Array:
        """Return where on the ceiling pixels (..., 2) lie: x, y (..., 2) in the robot frame [m]."""
        return np.asarray(self.translation[:2] + self.lens_to_ceiling * self.slopes(uv))

    def to_image(self, xy: Array) -> Array:
        """Return the pixels (..., 2) of places x, y (..., 2) [m] on the ceiling; nan where none sees it."""
        xy = np.asarray(xy, dtype=np.float64)
        up = np.full((*xy.shape[:-1], 1), self.lens_to_ceiling)
        uv = self.camera.project(np.concatenate([xy - self.translation[:2], up], axis=-1) @ self.rotation)
        return self._unflipped(uv)

    def jacobian(self, uv: Array) -> Array:
        """Return d(X, Y)/d(u, v) (..., 2, 2) [1/px]."""
        return self._slopes_and_jacobian(uv)[1]

    def sight(self, uv: Array, cov_px: Array, tilt_rad: float = 0.0) -> tuple[Array, Array]:
        """Return places x, y (N, 2) in the robot frame [m], as ``to_robot``, and their covariances (N, 2, 2) [m^2].

        Args:
            uv: (N, 2) pixels.
            cov_px: (N, 2, 2) their covariance [px^2].
            tilt_rad: standard deviation of the robot's unknown tilt about either axis.
        """
        slopes, jacobian = self._slopes_and_jacobian(uv)
        return self._place(slopes, jacobian @ cov_px @ jacobian.swapaxes(-1, -2), tilt_rad)

    def sight_circles(self, circles: Circles, tilt_rad: float = 0.0) -> tuple[Array, Array]:
        """Return what ``sight`` does, for circles found in this view's ``plane``: there the lens is already undone.

        Raises:
            ValueError: circles found without a plane.
        """
        if circles.xy is None or circles.cov_xy is None:
            raise ValueError("the circles were found without a plane")
        scale = 1.0 / self._plane_scale
        return self._place(scale * circles.xy, scale * scale * circles.cov_xy, tilt_rad)

    def _place(self, slopes: Array, cov_slopes: Array, tilt_rad: float) -> tuple[Array, Array]:
        """Return places (N, 2) and their covariances (N, 2, 2) from (X, Y) and its covariance."""
        h = self.lens_to_ceiling
        xy, cov = self.translation[:2] + h * slopes, h * h * cov_slopes
        if tilt_rad > 0:
            (X, Y), (x, y), z = slopes.T, xy.T, self.ceiling_m
            T = np.empty_like(cov)
            T[:, 0, 0], T[:, 0, 1] = -y * X, z + x * X
            T[:, 1, 0], T[:, 1, 1] = -(z + y * Y), x * Y
            cov = cov + tilt_rad**2 * T @ T.swapaxes(-1, -2)
        return xy, 0.5 * (cov + cov.swapaxes(-1, -2))

    @property
    def _plane_scale(self) -> float:
        """Units of ``plane`` in one of (X, Y): pixels of the image's middle."""
        return sqrt(self.camera.fx * self.camera.fy)

    def _slopes_and_jacobian(self, uv: Array) -> tuple[Array, Array]:
        directions, derivative = self.camera.unproject_with_jacobian(self._unflipped(uv))
        ray = directions @ self.rotation.T
        turned = self.rotation[:, :2] @ derivative  # (..., 3, 2)
        with np.errstate(divide="ignore", invalid="ignore"):
            X = np.where(ray[..., 2:] > 1e-6, ray[..., :2] / ray[..., 2:], np.nan)
            result = (turned[..., :2, :] - X[..., :, None] * turned[..., 2:, :]) / ray[..., 2:, None]
        return X, np.asarray(result * (-1.0, 1.0) if self.is_flipped else result)

    def plane(self) -> Plane:
        """Tabulate the ceiling for ``find_circles``, in pixels of the image's middle."""
        step = max(1, ceil(sqrt(self.width * self.height / _MAX_NODES)))
        columns = np.arange(0, self.width + step, step, dtype=np.float64)
        rows = np.arange(0, self.height + step, step, dtype=np.float64)
        slopes = np.empty((len(rows), len(columns), 2), dtype=np.float32)
        for i in range(0, len(rows), 64):  # in strips, to stay small
            uv = np.stack(np.meshgrid(columns, rows[i : i + 64]), axis=-1)
            slopes[i : i + 64] = self._plane_scale * self.slopes(uv)
        return Plane(slopes, float(step), self.width, self.height)

    def _unflipped(self, uv: Array) -> Array:
        uv = np.asarray(uv, dtype=np.float64)
        return np.stack([self.width - 1 - uv[..., 0], uv[..., 1]], axis=-1) if self.is_flipped else uv
