"""What hangs on a wall besides a mark: doors, posters, shelves, blinds, fences, radiators, bar codes, pipes.

Everything has upright edges; fences, blinds and radiators have them equally spaced, shelves and bar codes at random,
and bar codes look like marks but for their widths. Placed from left to right on the wall, clear of a reserved stretch.
"""

from collections.abc import Callable

import numpy as np
from mark_raster import Canvas, Plane, Rectangle

Random = np.random.Generator
Parts = list[tuple[Rectangle, float]]
Span = tuple[float, float]  # left and right end on the wall [m]

WALL: Rectangle = (-4.0, -1.1, 4.0, 1.6)


def paint_wall(canvas: Canvas, plane: Plane, rng: Random, *, keep: Span | None, fence: bool) -> list[str]:
    """Paint a wall with clutter; return the names of what hangs there.

    Args:
        canvas: the image.
        plane: of the wall, its origin where a mark hangs or may hang.
        rng: of everything.
        keep: a stretch of the wall that stays empty.
        fence: whether a fence covers most of the view.
    """
    base = rng.uniform(70, 170)
    canvas.paint(plane, WALL, base, [((WALL[0], WALL[1], WALL[2], -0.95), rng.uniform(30, 90))])
    scale = float(np.clip(plane.dy / 1.5, 0.25, 1.0))
    kinds = []
    if fence:
        width = scale * rng.uniform(0.5, 1.6)
        shift = scale * rng.uniform(-0.3, 0.3)
        _fence(canvas, plane, rng, (shift - 0.5 * width, shift + 0.5 * width), base)
        keep = keep or (shift - 0.5 * width, shift + 0.5 * width)
        kinds.append("fence")
    x = WALL[0] + 0.1
    while x < WALL[2] - 0.1:
        x += scale * rng.exponential(0.15) + 0.01
        name = str(rng.choice(list(KINDS)))
        width = min(scale * rng.uniform(*SIZES[name]), WALL[2] - 0.05 - x)
        if keep and x + width > keep[0] and x < keep[1]:
            room = keep[0] - 0.01 - x
            if room < 0.1:
                x = keep[1]
                continue
            width = min(width, room)
        if width > 0.03:
            KINDS[name](canvas, plane, rng, (x, x + width), base)
            kinds.append(name)
        x += width
    return kinds


def _other(rng: Random, base: float, least: float = 15.0) -> float:
    """Return a grey value that differs from the base."""
    while True:
        value = float(rng.uniform(10, 240))
        if abs(value - base) > least:
            return value


def _run(span: Span, low: float, high: float, widths: Callable[[], tuple[float, float]]) -> Parts:
    """Return bars side by side over a span, from ``low`` to ``high``; each call of ``widths`` gives bar and gap."""
    parts: Parts = []
    x = span[0]
    while True:
        bar, gap = widths()
        if x + bar > span[1]:
            return parts
        parts.append(((x, low, x + bar, high), 0.0))
        x += bar + gap


def _door(canvas: Canvas, plane: Plane, rng: Random, span: Span, base: float) -> None:
    frame = 0.09 * (span[1] - span[0])
    leaf = _other(rng, base)
    a, b = span[0] + frame, span[1] - frame
    window = ((a + 0.3 * (b - a), 0.1, b - 0.3 * (b - a), 0.7), _other(rng, leaf))
    canvas.paint(plane, (span[0], WALL[1], span[1], 1.0), _other(rng, base))
    canvas.paint(plane, (a, WALL[1], b, 1.0 - frame), leaf, [window] if rng.random() < 0.5 else [])


def _poster(canvas: Canvas, plane: Plane, rng: Random, span: Span, base: float) -> None:
    paper = _other(rng, base)
    w = span[1] - span[0]
    tall = w * rng.uniform(0.7, 1.5)
    z = rng.uniform(-0.5, 0.4) * tall - 0.5 * tall
    edge = 0.06 * w
    parts: Parts = []
    lines = int(rng.integers(3, 12))
    for k in range(lines):
        low = z + edge + (tall - 2 * edge) * k / lines
        high = low + 0.6 * (tall - 2 * edge) / lines
        x = span[0] + edge
        while x < span[1] - 2 * edge:  # words
            end = min(x + w * rng.uniform(0.04, 0.25), span[1] - edge)
            parts.append(((x, low, end, high), _other(rng, paper)))
            x = end + w * rng.uniform(0.02, 0.06)
    canvas.paint(plane, (span[0], z, span[1], z + tall), paper, parts)


def _shelf(canvas: Canvas, plane: Plane, rng: Random, span: Span, base: float) -> None:
    z = rng.uniform(-0.25, 0.05)
    dark = rng.uniform(5, 60)
    x, parts = span[0] + 0.01, []
    while True:
        width = rng.uniform(0.012, 0.05)
        if x + width > span[1] - 0.01:
            break
        parts.append(((x, z + 0.01, x + width, z + rng.uniform(0.17, 0.27)), _other(rng, base, 0.0)))
        x += width + (rng.uniform(0.001, 0.02) if rng.random() < 0.4 else 0.0)
    canvas.paint(plane, (span[0], z, span[1], z + 0.3), dark, parts)


def _even(canvas: Canvas, plane: Plane, rng: Random, span: Span, base: float, box: Span, pitch: float) -> None:
    """Bars of one width at one pitch."""
    share = rng.uniform(0.3, 0.7)
    ground = _other(rng, base) if rng.random() < 0.6 else base
    bar = _other(rng, ground, 30.0)
    parts = _run(span, *box, lambda: (pitch * share, pitch * (1 - share)))
    canvas.paint(plane, (span[0], box[0], span[1], box[1]), ground, [(r, bar) for r, _ in parts])


def _fence(canvas: Canvas, plane: Plane, rng: Random, span: Span, base: float) -> None:
    pitch = float(np.clip((span[1] - span[0]) / rng.uniform(6, 25), 0.012, 0.2))
    low = rng.uniform(-0.6, -0.1) * (span[1] - span[0])
    tall = rng.uniform(0.15, 0.8) * (span[1] - span[0])
    _even(canvas, plane, rng, span, base, (low, low + tall), pitch)


def _blinds(canvas: Canvas, plane: Plane, rng: Random, span: Span, base: float) -> None:
    _even(canvas, plane, rng, span, base, (-0.4, 0.7), (span[1] - span[0]) / rng.uniform(5, 16))


def _radiator(canvas: Canvas, plane: Plane, rng: Random, span: Span, base: float) -> None:
    _even(canvas, plane, rng, span, base, (-0.7, -0.1), (span[1] - span[0]) / rng.uniform(8, 22))


def _code(canvas: Canvas, plane: Plane, rng: Random, span: Span, _base: float) -> None:
    """Bright bars of random widths on a dark ground, or the other way round: a mark of nobody's map."""
    dark, bright = rng.uniform(10, 70), rng.uniform(130, 240)
    if rng.random() < 0.3:
        dark, bright = bright, dark
    w = span[1] - span[0]
    n = int(rng.integers(4, 8))
    cuts = rng.uniform(1.0, 3.0, 2 * n - 1)
    cuts *= 0.8 * w / cuts.sum()
    x = span[0] + 0.1 * w + np.concatenate([[0.0], np.cumsum(cuts)])
    z = rng.uniform(-0.3, 0.2)
    tall = w * rng.uniform(0.3, 0.8)
    parts = [((x[2 * k], z + 0.1 * w, x[2 * k + 1], z + tall - 0.1 * w), bright) for k in range(n)]
    canvas.paint(plane, (span[0], z, span[1], z + tall), dark, parts if tall > 0.25 * w else [])


def _pipes(canvas: Canvas, plane: Plane, rng: Random, span: Span, base: float) -> None:
    """Upright strips at random, from floor to ceiling or shorter."""
    parts = _run(span, 0.0, 0.0, lambda: (rng.uniform(0.008, 0.05), rng.exponential(0.06) + 0.004))
    for (x0, _, x1, _), _ in parts:
        low = WALL[1] if rng.random() < 0.5 else rng.uniform(-0.4, 0.0)
        canvas.paint(plane, (x0, low, x1, 1.2 if rng.random() < 0.5 else rng.uniform(0.05, 0.5)), _other(rng, base))


KINDS = {
    "door": _door,
    "poster": _poster,
    "shelf": _shelf,
    "fence": _fence,
    "blinds": _blinds,
    "radiator": _radiator,
    "code": _code,
    "pipes": _pipes,
}
SIZES = {
    "door": (0.6, 0.9),
    "poster": (0.15, 0.5),
    "shelf": (0.2, 0.8),
    "fence": (0.2, 0.7),
    "blinds": (0.3, 0.8),
    "radiator": (0.3, 0.7),
    "code": (0.12, 0.35),
    "pipes": (0.1, 0.5),
}
