"""The images of a run that are worth a look, chosen as they pass: a typical one, the worst one, one that was refused.

A run's images do not fit into memory, and which of them is typical is known at the end. So candidates are kept: every
``step``-th image with a pose (when there are too many, every second of them goes and the step doubles), the one whose
edges are farthest from where the pose has them, and of those without a pose the one with most edges. Of a candidate
only what is drawn is kept: the image made small, the mark in full, and the brightness along the row. The choice
depends on nothing but the events.
"""

from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import cv2
import numpy as np

from ....formats.events import Array, Bytes, Image, MarkSighting
from ....formats.images import DamagedImage, grey

Choice: TypeAlias = Literal["typical", "worst", "refused"]

CANDIDATES = 8
"""Most images kept to choose the typical one from."""

WIDE_PX = 640
"""An image is kept no wider than this."""

CLOSE_PX = (480, 480)
"""Its mark no wider and higher than this."""

BAND = 3
"""Rows whose mean is the brightness along the row."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Snapshot:
    """What is drawn of one image.

    Attributes:
        kind: why it was chosen.
        of: number of images it was chosen from.
        stamp: of the image [ns].
        width, height: of the image [px].
        pixels: (h, w) the whole image, made small.
        close: (h, w) the surroundings of ``main``, made small if they are large.
        window: what they show: first column, end of the columns, first row, end of the rows [px].
        profile: (2, n) columns [px] and the brightness there at the row of ``main``; empty if the row is not in the
            image.
        main: the sighting it was chosen for.
        sightings: all of this image.
    """

    kind: Choice
    of: int
    stamp: int
    width: int
    height: int
    pixels: Bytes
    close: Bytes
    window: tuple[int, int, int, int]
    profile: Array
    main: MarkSighting
    sightings: tuple[MarkSighting, ...]

    @property
    def is_close(self) -> bool:
        """Whether there is an edge that could be shown close up."""
        return len(self.main.lines) > 0


def residual_of(event: MarkSighting) -> float:
    """Return the root mean square distance of the edges from where the pose has them [px]; nan for none."""
    left = event.lines[:, 4]
    left = left[np.isfinite(left)]
    return float(np.sqrt(np.mean(left**2))) if len(left) else float("nan")


@dataclass(slots=True)
class _Candidate:
    score: float
    view: "_View"


@dataclass(slots=True)
class SnapshotKeeper:
    """Takes the images one by one."""

    _regular: list[_Candidate] = field(default_factory=list)
    _worst: _Candidate | None = None
    _refused: _Candidate | None = None
    _step: int = 1
    _used: int = 0
    _unused: int = 0
    _scores: "array[float]" = field(default_factory=lambda: array("d"))

    def take(self, image: Image, sightings: tuple[MarkSighting, ...], used: Sequence[MarkSighting]) -> None:
        """Look at one image, with all its sightings and those that are used."""
        if not used:
            self._unused += 1
            main = max(sightings, key=lambda s: len(s.lines))
            if self._refused is None or len(main.lines) > self._refused.score:
                self._refused = _seen(image, sightings, main, float(len(main.lines))) or self._refused
            return
        main = max(used, key=lambda s: np.nan_to_num(residual_of(s)))
        score = float(np.nan_to_num(residual_of(main)))
        kept: _Candidate | None = None
        if self._used % self._step == 0:
            if len(self._regular) == CANDIDATES:
                self._regular = self._regular[::2]
                self._step *= 2
            if self._used % self._step == 0:
                kept = _seen(image, sightings, main, score)
                self._regular += [] if kept is None else [kept]
        if self._worst is None or score > self._worst.score:
            self._worst = kept or _seen(image, sightings, main, score) or self._worst
        self._used += 1
        self._scores.append(score)

    def chosen(self) -> tuple[Snapshot, ...]:
        """Return the images to show, no image twice."""
        found: list[tuple[Choice, int, _View]] = []
        if self._regular:
            median = float(np.median(self._scores))
            usual = min(self._regular, key=lambda c: abs(c.score - median))
            found.append(("typical", self._used, usual.view))
        if self._worst is not None:
            found.append(("worst", self._used, self._worst.view))
        if self._refused is not None:
            found.append(("refused", self._unused, self._refused.view))
        kept: dict[int, Snapshot] = {}
        for kind, of, view in found:
            kept.setdefault(view.sightings[0].stamp, view.snapshot(kind, of))
        return tuple(kept.values())


@dataclass(slots=True)
class _View:
    """What is kept of an image while it is not known whether it will be shown."""

    size: tuple[int, int]
    pixels: Bytes
    close: Bytes
    window: tuple[int, int, int, int]
    profile: Array
    main: MarkSighting
    sightings: tuple[MarkSighting, ...]

    def snapshot(self, kind: Choice, of: int) -> Snapshot:
        """Return what is drawn of it."""
        return Snapshot(
            kind=kind, of=of, stamp=self.main.stamp, width=self.size[0], height=self.size[1], pixels=self.pixels,
            close=self.close, window=self.window, profile=self.profile, main=self.main, sightings=self.sightings,
        )  # fmt: skip


def _seen(image: Image, sightings: tuple[MarkSighting, ...], main: MarkSighting, score: float) -> _Candidate | None:
    """Keep of an image what is drawn; nothing of a damaged one."""
    try:
        pixels = grey(image)
    except DamagedImage:
        return None
    height, width = pixels.shape
    left, right, top, bottom = window = window_of(main, width, height)
    view = _View(
        size=(width, height),
        pixels=_small(pixels, (WIDE_PX, WIDE_PX)),
        close=_small(pixels[top:bottom, left:right], CLOSE_PX),
        window=window,
        profile=_profile(pixels, main.row, (left, right)),
        main=main,
        sightings=sightings,
    )
    return _Candidate(score, view)


def window_of(main: MarkSighting, width: int, height: int) -> tuple[int, int, int, int]:
    """Choose what to show close up: all edges with a margin, and the row.

    Returns:
        First column, end of the columns, first row, end of the rows [px]; the whole image if there is no edge.
    """
    ends = main.ends.reshape(-1, 2)
    ends = ends[np.isfinite(ends).all(axis=1)]
    if len(ends) == 0:
        return 0, width, 0, height
    margin = max(10.0, 0.15 * float(np.ptp(ends[:, 0])))
    left = int(np.clip(ends[:, 0].min() - margin, 0, width - 2))
    right = int(np.clip(ends[:, 0].max() + margin + 1, left + 2, width))
    row = float(np.clip(main.row if np.isfinite(main.row) else ends[0, 1], 0, height - 1))
    first, last = min(float(ends[:, 1].min()), row) - 4, max(float(ends[:, 1].max()), row) + 4
    reach = 0.5 * (right - left)  # a mark much higher than wide is shown around its row
    top = int(np.clip(max(first, row - 2 * reach), 0, height - 2))
    bottom = int(np.clip(min(last, row + 2 * reach) + 1, top + 2, height))
    return left, right, top, bottom


def _small(pixels: Bytes, most: tuple[int, int]) -> Bytes:
    """Make an image small enough, by averaging; a small one is copied, so that the large one can go."""
    height, width = pixels.shape
    scale = min(1.0, most[0] / width, most[1] / height)
    if scale == 1.0:
        return pixels.copy()
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    return np.asarray(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _profile(pixels: Bytes, row: float, columns: tuple[int, int]) -> Array:
    """Return columns and the mean brightness of the rows around a row."""
    height = len(pixels)
    if not -0.5 <= row <= height - 0.5:
        return np.empty((2, 0))
    first = int(np.clip(round(row) - BAND // 2, 0, max(0, height - BAND)))
    band = pixels[first : first + BAND, columns[0] : columns[1]]
    return np.stack([np.arange(*columns, dtype=np.float64), band.mean(axis=0)])
