"""Small scenes: discs and polygons drawn 8 times finer, then averaged, so that their edges are true to 1/8 px."""

import numpy as np
import pytest


@pytest.fixture(scope="session")
def draw():
    """Return a function that paints shapes over a ground, with noise."""

    def paint(shapes, *, size=(120, 160), ground=70.0, value=190.0, noise=2.0, seed=0):
        n = 8
        y, x = ((np.mgrid[0 : size[0] * n, 0 : size[1] * n] + 0.5) / n) - 0.5
        cover = np.zeros(x.shape, dtype=bool)
        for inside in shapes:
            cover |= inside(x, y)
        share = cover.reshape(size[0], n, size[1], n).mean(axis=(1, 3))
        image = ground + (value - ground) * share
        image += np.random.default_rng(seed).normal(0, noise, size)
        return np.clip(np.rint(image), 0, 255).astype(np.uint8)

    return paint


def disc(u, v, r):
    return lambda x, y: (x - u) ** 2 + (y - v) ** 2 < r * r


def polygon(u, v, inner, sides, angle):
    turns = angle + 2 * np.pi * np.arange(sides) / sides
    return lambda x, y: np.max([(x - u) * np.cos(t) + (y - v) * np.sin(t) for t in turns], axis=0) < inner


@pytest.fixture(scope="session")
def shapes():
    """Return the makers of shapes."""
    return disc, polygon
