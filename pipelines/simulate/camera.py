"""A camera as it is in the simulated world: lens, mount, and the ray through every pixel.

The simulator keeps its own forward model, so that an error of sign or of lens in the estimators cannot hide in both.

::

    x_d = x (1 + k1 r2 + k2 r2^2 + k3 r2^3) + 2 p1 x y + p2 (r2 + 2 x^2)      r2 = x^2 + y^2        (1)
    y_d = y (1 + k1 r2 + k2 r2^2 + k3 r2^3) + p1 (r2 + 2 y^2) + 2 p2 x y
    u = fx x_d + cx,   v = fy y_d + cy                                                             (2)

where (x, y, 1) is the ray in the camera frame (x right, y down, z along the view). Pixel centres are integers. Images
are rendered through the rays of the pixels, found once per camera by Newton's method on (1): the lens bends what is
drawn, not the drawing.

A camera that ``looks: up`` has the top of its image to the front of the robot, so image right is the robot's left;
one that ``looks: forward`` has the top of its image up.
"""

from functools import lru_cache
from typing import Literal

import numpy as np

from ...formats.calibration import Calibration
from ...formats.events import Array
from ..engine.params import Field, Params
from .pose import MountParams, View

NOMINAL = {
    "up": np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    "forward": np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]),
}
"""base_R_camera of a camera that is mounted straight."""


class CameraParams(Params):
    """One camera: where its images go in the log, its lens, its place on the robot."""

    topic: str = Field("/ceiling/image_raw", description="topic of the images")
    info_topic: str = Field("/ceiling/camera_info", description="topic of the calibration")
    frame: str = Field("ceiling_camera_optical_frame", description="coordinate frame of the camera")
    looks: Literal["up", "forward"] = Field("up", description="where a camera with a straight mount looks")
    rate_hz: float = Field(10.0, gt=0, le=1000, description="images per second [Hz]")
    width_px: int = Field(640, ge=16, le=8192, description="image width [px]")
    height_px: int = Field(480, ge=16, le=8192, description="image height [px]")
    fx_px: float = Field(645.33, gt=0, description="focal length, horizontal [px]")
    fy_px: float = Field(645.33, gt=0, description="focal length, vertical [px]")
    cx_px: float | None = Field(None, description="principal point, horizontal [px]; middle of the image if absent")
    cy_px: float | None = Field(None, description="principal point, vertical [px]; middle of the image if absent")
    distortion: tuple[float, float, float, float, float] = Field(
        (0.0, 0.0, 0.0, 0.0, 0.0), description="plumb_bob lens: k1, k2, p1, p2, k3 [1]"
    )
    mount: MountParams = Field(MountParams(), description="place on the robot")
    encoding: Literal["mono8", "jpeg"] = Field("mono8", description="raw grey images, or JPEG")
    jpeg_quality: int = Field(90, ge=1, le=100, description="quality of JPEG images [1]")


class LevelCameraParams(CameraParams):
    """A camera that looks about level, ahead or to a side."""

    topic: str = Field("/camera/image_raw", description="topic of the images")
    info_topic: str = Field("/camera/camera_info", description="topic of the calibration")
    frame: str = Field("camera_optical_frame", description="coordinate frame of the camera")
    looks: Literal["up", "forward"] = Field("forward", description="where a camera with a straight mount looks")


def base_camera(params: CameraParams) -> View:
    """Return base_T_camera: the mount's turn after the straight mount of ``looks``."""
    mounted = params.mount.view
    return View(mounted.rotation @ NOMINAL[params.looks], mounted.position)


def calibration_of(params: CameraParams) -> Calibration:
    """Return the calibration as the log's CameraInfo tells it."""
    cx = (params.width_px - 1) / 2 if params.cx_px is None else params.cx_px
    cy = (params.height_px - 1) / 2 if params.cy_px is None else params.cy_px
    size = (params.width_px, params.height_px)
    return Calibration(*size, params.fx_px, params.fy_px, cx, cy, "plumb_bob", params.distortion)


def _bend(x: Array, y: Array, lens: tuple[float, ...]) -> tuple[Array, Array]:
    k1, k2, p1, p2, k3 = lens
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))  # eq. (1)
    return x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y


def project(points: Array, calibration: Calibration) -> Array:
    """Project points (..., 3) in camera coordinates with z > 0 to pixels (..., 2); nan behind the camera."""
    z = np.where(points[..., 2] > 0, points[..., 2], np.nan)
    x, y = _bend(points[..., 0] / z, points[..., 1] / z, calibration.distortion)  # eqs. (1), (2)
    return np.stack([calibration.fx * x + calibration.cx, calibration.fy * y + calibration.cy], axis=-1)


def rays_through(pixels: Array, calibration: Calibration) -> Array:
    """Return the rays (x, y) with z = 1 that meet pixels (..., 2): ``project`` solved by Newton's method.

    Raises:
        ValueError: the lens folds the image over inside the frame, so some pixel has no ray.
    """
    lens = calibration.distortion
    k1, k2, p1, p2, k3 = lens
    xd = (pixels[..., 0] - calibration.cx) / calibration.fx
    yd = (pixels[..., 1] - calibration.cy) / calibration.fy
    x, y = xd.copy(), yd.copy()
    for _ in range(30):
        r2 = x * x + y * y
        radial, slope = 1 + r2 * (k1 + r2 * (k2 + r2 * k3)), 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3))
        bx, by = _bend(x, y, lens)
        a = radial + slope * x * x + 2 * p1 * y + 6 * p2 * x
        b = slope * x * y + 2 * p1 * x + 2 * p2 * y
        d = radial + slope * y * y + 6 * p1 * y + 2 * p2 * x
        det = a * d - b * b
        if not (det > 0).all():
            break
        ex, ey = bx - xd, by - yd
        x, y = x - (d * ex - b * ey) / det, y - (a * ey - b * ex) / det
        if max(np.abs(ex).max(), np.abs(ey).max()) < 1e-14:
            return np.stack([x, y], axis=-1)
    bx, by = _bend(x, y, lens)
    if not max(np.abs(bx - xd).max(), np.abs(by - yd).max()) < 1e-12:
        raise ValueError(f"the lens {lens} folds over inside the image; some pixels see nothing")
    return np.stack([x, y], axis=-1)


@lru_cache(maxsize=8)
def ray_table(calibration: Calibration) -> Array:
    """Return the rays (height + 2, width + 2, 2) of all pixels and of a border of one pixel around them."""
    u, v = np.meshgrid(np.arange(-1.0, calibration.width + 1), np.arange(-1.0, calibration.height + 1))
    table = np.ascontiguousarray(rays_through(np.stack([u, v], axis=-1), calibration))
    table.setflags(write=False)
    return table
