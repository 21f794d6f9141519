"""Small worlds that render in a second, and the references that the renderer is measured against."""

import numpy as np
import pytest

from logpose.pipelines.simulate.camera import rays_through
from logpose.pipelines.simulate.pose import View, rpy
from logpose.pipelines.simulate.scene import Run
from logpose.pipelines.simulate.sensors.pictures import pictures
from logpose.pipelines.simulate.world import parse_world
from logpose.pipelines.simulate.worlds.corridor import build_corridor

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
def look():
    """Return a function that makes the pose of a camera somewhere that looks along yaw and pitch, image top up [rad]."""

    def view(position, yaw, pitch):
        forward = np.array([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)])
        right = np.array([np.sin(yaw), -np.cos(yaw), 0.0])
        return View(np.stack([right, np.cross(forward, right), forward], axis=1), np.asarray(position, float))

    return view


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


ROOM = """\
logpose: world/1
kind: stripe
robot:
  waypoints: [{name: A, x_m: 1.0, y_m: 1.2}, {name: B, x_m: 2.0, y_m: 1.4}]
  is_closed: false
  speed_sd_mps: 0.0
odometry: {rate_hz: 20.0}
camera:
  rate_hz: 5.0
  width_px: 320
  height_px: 240
  fx_px: 300.0
  fy_px: 300.0
  cx_px: 158.3
  cy_px: 121.2
  mount: {x_m: 0.1, y_m: 0.05, z_m: 0.9, yaw_deg: 80.0}
sensor:
  {exposure_ms: 0.0, psf_px: 0.0, vignetting: 0.0, gain_sd: 0.0, read_noise_dn: 0.0, shot_noise_dn: 0.0}
corridor:
  outline_m: [[0.0, 0.0], [4.0, 0.0], [4.0, 2.4], [0.0, 2.4]]
  height_m: 2.5
  marks: [{id: 4, at_m: [1.4, 2.4], z_m: 0.9, lines_m: [-0.12, -0.02, 0.1], bar_m: [0.05, 0.04, 0.06]}]
  clutter: {per_m: 0.0}
  light: {ambient: 1.0, lamp_pitch_m: 0.0}
"""

BENCH = """\
logpose: world/1
kind: stripe-bench
mark: {lines_m: [-0.06, 0.0, 0.03, 0.06], bar_m: 0.015, height_m: 0.12, margin_m: 0.02}
bench: {distances_m: [0.4, 0.7], offsets_m: [0.0, 0.02], angles_deg: [0.0, 40.0, -30.0], phase_px: 0.0}
camera: {width_px: 512, height_px: 384, fx_px: 930.909, fy_px: 930.909, cx_px: 255.5, cy_px: 191.0}
sensor:
  {exposure_ms: 0.0, psf_px: 0.0, vignetting: 0.0, gain_sd: 0.0, read_noise_dn: 0.0, shot_noise_dn: 0.0}
"""


def _maker(text, name):
    def make(**settings):
        return parse_world(text, name, [(key.replace("__", "."), value) for key, value in settings.items()])

    return make


@pytest.fixture
def room():
    """Return a function that makes a room with one mark, under even light and before a perfect sensor."""
    return _maker(ROOM, "room.yaml")


@pytest.fixture
def room_text():
    """The room's file."""
    return ROOM


@pytest.fixture
def bench():
    """Return a function that makes a bench with twelve combinations before a perfect sensor."""
    return _maker(BENCH, "bench.yaml")


@pytest.fixture
def edge_near():
    """Return the column of one edge on a row of grey levels, by the balance of light between the two grounds beside it."""

    def measure(row, expected, reach=3):
        left, right = round(expected) - reach, round(expected) + reach
        window = row[left : right + 1].astype(float)
        before, after = window[0], window[-1]
        assert abs(after - before) > 100, "no edge between the two grounds"
        return left - 0.5 + (window - after).sum() / (before - after)

    return measure


class Standing:
    """A robot that stands where it is put, on a floor that tilts as it is told."""

    duration = 0.0

    def __init__(self, pose, tilt):
        self.pose, self.tilt = np.array(pose, float), np.array(tilt, float)

    def at(self, _time):
        return self.pose, 0.0, self.tilt

    def view(self, _time):
        return View(rpy(*self.tilt, self.pose[2]), np.array([*self.pose[:2], 0.0]))


@pytest.fixture
def picture():
    """Return what takes a picture (H, W) from a pose x, y, heading of the robot."""

    def take(world, pose, *, tilt=(0.0, 0.0), time=0.0):
        run, patches = Run(Standing(pose, tilt), 0, 0), build_corridor(world.corridor).patches
        image = next(pictures(run, patches, world.camera, world.sensor, lambda _now: world.eye(time)))
        return image.data.reshape(image.height, image.width)

    return take


@pytest.fixture
def columns_of():
    """Return the columns of upright edges of a world's first mark for a level pinhole camera, from the floor plan alone.

    With the mark's pose phi, D_x, D_y in the camera's frame they are u = (c X + D_x) / (s X + D_y).
    """

    def project(world, pose, abscissae, pan=0.0):
        mark = world.build().maps[".marks.yaml"].marks[0]
        (x, y, heading), mount = pose, world.camera.mount
        c, s = np.cos(heading), np.sin(heading)
        lens = np.array([x + c * mount.x_m - s * mount.y_m, y + s * mount.x_m + c * mount.y_m])
        azimuth = heading + np.radians(mount.yaw_deg) + pan
        ahead, right = np.array([np.cos(azimuth), np.sin(azimuth)]), np.array([np.sin(azimuth), -np.cos(azimuth)])
        phi, d_x, d_y = (
            mark.pose[2] - azimuth + np.pi / 2,
            (mark.pose[:2] - lens) @ right,
            (mark.pose[:2] - lens) @ ahead,
        )
        u = (np.cos(phi) * abscissae + d_x) / (np.sin(phi) * abscissae + d_y)
        return world.camera.cx_px + world.camera.fx_px * u

    return project
