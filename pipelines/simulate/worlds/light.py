"""Light in a room: what comes from everywhere, lamps under the ceiling, and a slope along the floor plan.

The light on a surface with normal n at p, relative to 1, is ::

    e = (ambient + sum_k strength (n . d_k) (z . d_k) / r_k^2) (1 + slope . (p - middle))                        (1)

with d_k the direction to lamp k, r_k away, and z upwards.

A lamp shines downwards and is a square of some decimetres, so r is never taken below 0.5 m.
"""

import numpy as np

from ....formats.events import Array
from ...engine.params import Field, Params
from ..renderer import Patch
from .pairs import Point

NODE_M = 0.12
"""Distance between the points of a surface at which the light is computed; in between it is linear."""
NEAREST_M = 0.5
DARKEST = 0.02


class LightParams(Params):
    """Where the light comes from."""

    ambient: float = Field(0.55, ge=0, description="light from everywhere [1]")
    lamp_pitch_m: float = Field(2.4, ge=0, description="distance between the lamps along both walls; 0 for none [m]")
    lamp_strength: float = Field(4.0, ge=0, description="light of one lamp on a floor 1 m below [1]")
    slope_per_m: Point = Field((0.0, 0.0), description="relative change along x and along y [1/m]")


def lit(patch: Patch, params: LightParams, lamps: Array, middle: Array) -> Array:
    """Return the light on a patch at nodes from border to border (R, C), by eq. (1).

    Args:
        patch: its place.
        params: where the light comes from.
        lamps: (K, 3) their places [m].
        middle: (2,) of the room [m].
    """
    width, height = patch.size
    columns, rows = (max(int(np.ceil(side / NODE_M)), 1) + 1 for side in (width, height))
    s, t = np.linspace(0, 1, columns), np.linspace(0, 1, rows)
    points = patch.corner + s[None, :, None] * patch.side_u + t[:, None, None] * patch.side_v
    normal = np.cross(patch.side_v, patch.side_u)
    normal = normal / np.linalg.norm(normal)
    light = np.full((rows, columns), params.ambient)
    for lamp in lamps:
        ray = lamp - points
        r = np.maximum(np.linalg.norm(ray, axis=2), NEAREST_M)
        light += params.lamp_strength * np.maximum(ray @ normal, 0) * np.maximum(ray[..., 2], 0) / r**4
    light *= 1 + (points[..., :2] - middle) @ np.array(params.slope_per_m)
    return np.asarray(np.maximum(light, DARKEST))
