"""A mark as an image shows it, by the formulas of the paper alone: no code of the package."""

import math

import numpy as np
import pytest
from scipy.special import erf

from logpose.formats.products import StripeMark
from logpose.pipelines.geometry.camera import Camera
from logpose.pipelines.stripe_pose.scene import Eye
from logpose.pipelines.stripe_pose.solve import Attitude

GAPS = (0.032, 0.020, 0.028, 0.040, 0.024, 0.036, 0.020)


def mark_of(gaps=GAPS, *, id=0, height=None, pose=(0.0, 0.0, 0.0)):  # noqa: A002
    x = np.concatenate([[0.0], np.cumsum(gaps)]) - sum(gaps) / 2
    return StripeMark(id=id, lines=x[::2], bars=x[1::2] - x[::2], pose=np.array(pose, float), height=height)


def picture(mark, pose, *, tilt=0.0, roll=0.0, dz=0.0, height=0.1, size=(640, 480), f=600.0, black=40.0, white=200.0,
            blur=0.8, noise=0.0, seed=0, wall=110.0, margin=0.03, lens=None):  # fmt: skip
    """Draw a mark before a wall: each row is a sum of error functions, each end of a bar a row of half grey."""
    width, rows = size
    cx, cy = (width - 1) / 2, (rows - 1) / 2
    phi, dx, dy = pose
    u, v = np.meshgrid(np.arange(float(width)), np.arange(float(rows)))
    x, z = (u - cx) / f, (cy - v) / f
    if lens is not None:  # k1 and k2 alone, inverted by Newton's method
        bent = np.hypot(x, z)
        r = bent.copy()
        for _ in range(20):
            r -= (r * (1 + lens[0] * r**2 + lens[1] * r**4) - bent) / (1 + 3 * lens[0] * r**2 + 5 * lens[1] * r**4)
        x, z = x * r / bent, z * r / bent
    ct, st, cr, sr = math.cos(tilt), math.sin(tilt), math.cos(roll), math.sin(roll)
    Q = np.array([[cr, 0, -sr], [0, 1, 0], [sr, 0, cr]]) @ np.array([[1, 0, 0], [0, ct, st], [0, -st, ct]])
    ray = np.stack([x, np.ones_like(x), z], -1) @ Q  # Q' ray: in the level frame
    bearing, rise = ray[..., 0] / ray[..., 1], ray[..., 2] / ray[..., 1]
    c, s = math.cos(phi), math.sin(phi)
    # Where on the mark's plane the ray ends: u = (c X + dx) / (s X + dy), Z = rise (s X + dy) - dz.
    X = (bearing * dy - dx) / (c - s * bearing)
    ahead = s * X + dy
    Z = rise * ahead - dz
    per_px = np.abs(np.gradient(X, axis=1))
    per_row = np.abs(np.gradient(Z, axis=0))

    def inside(value, low, high, scale):
        w = math.sqrt(2) * blur * scale
        return 0.5 * (erf((value - low) / w) - erf((value - high) / w))

    edges = mark.edges
    ground = inside(X, edges[0] - margin, edges[-1] + margin, per_px) * inside(
        Z, -height / 2 - margin, height / 2 + margin, per_row
    )
    bars = sum(inside(X, a, b, per_px) for a, b in zip(edges[::2], edges[1::2], strict=True))
    bars = bars * inside(Z, -height / 2, height / 2, per_row)
    light = wall + ground * (black - wall) + bars * (white - black)
    light = np.where(ahead > 0, light, wall)
    light = light + noise * np.random.default_rng(seed).standard_normal(light.shape)
    return np.clip(np.rint(light), 0, 255).astype(np.uint8)


def eye_of(*, tilt=0.0, roll=0.0, tilt_sd=0.0, roll_sd=0.0, size=(640, 480), f=600.0, lens=None):
    middle = (size[0] - 1) / 2, (size[1] - 1) / 2
    camera = Camera(f, f, *middle) if lens is None else Camera(f, f, *middle, "plumb_bob", lens)
    return Eye(camera, *size, Attitude(tilt, roll, tilt_sd, roll_sd))


@pytest.fixture
def mark():
    return mark_of()
