"""A small world that renders in a second, and the reference the renderer is measured against."""

import numpy as np
import pytest

from logpose.pipelines.simulate.camera import rays_through
from logpose.pipelines.simulate.world import parse_world

SMALL = """\
logpose: world/1
kind: ceiling
robot:
  waypoints: [{name: A, x_m: 1.5, y_m: 1.5}, {name: B, x_m: 3.0, y_m: 1.5}]
  is_closed: false
  speed_sd_mps: 0.0
odometry: {rate_hz: 20.0}
camera:
  rate_hz: 5.0
  width_px: 160
  height_px: 120
  fx_px: 161.0
  fy_px: 160.0
  distortion: [-0.15, 0.02, 0.001, -0.0005, 0.0]
  mount: {x_m: 0.1, z_m: 0.3, yaw_deg: 4.0}
sensor: {blur_samples: 2}
ceiling:
  height_m: 2.7
  size_m: [5.0, 3.0]
  landmarks: {count: 9, near_route: 7, spacing_m: 0.5, radius_m: [0.07, 0.09]}
  clutter: {per_m2: 0.5, false_lights_per_m2: 0.1}
  survey_sd_m: 0.02
"""


@pytest.fixture
def small():
    """Return a function that makes the small world, with settings like those of ``--set``."""

    def make(**settings):
        return parse_world(SMALL, "small.yaml", [(key.replace("__", "."), value) for key, value in settings.items()])

    return make


@pytest.fixture
def supersampled():
    """Return the brute-force reference: the share of each pixel in a window whose sub-pixels lie inside a shape."""

    def share(view, calibration, inside, window, height, n=16):
        left, right, top, bottom = window
        offset = (np.arange(n) + 0.5) / n - 0.5
        u = (np.arange(left, right + 1)[:, None] + offset).reshape(-1)
        v = (np.arange(top, bottom + 1)[:, None] + offset).reshape(-1)
        pixels = np.stack(np.meshgrid(u, v), axis=-1)
        rays = np.concatenate([rays_through(pixels, calibration), np.ones((*pixels.shape[:2], 1))], axis=2)
        rays = rays @ view.rotation.T
        points = view.position + rays * ((height - view.position[2]) / rays[..., 2:])
        hits = inside(points[..., 0], points[..., 1]).astype(float)
        rows, columns = bottom - top + 1, right - left + 1
        return hits.reshape(rows, n, columns, n).mean(axis=(1, 3))

    return share


@pytest.fixture
def centroid():
    """Return the centroid (u, v) of an image of shares whose first pixel is (left, top)."""

    def measure(shares, left=0, top=0):
        v, u = np.mgrid[: shares.shape[0], : shares.shape[1]]
        return np.array([(shares * u).sum(), (shares * v).sum()]) / shares.sum() + [left, top]

    return measure
