"""What is left when the log ends: trajectories and maps, as arrays.

Each product is written and read by the file of its format (``tum.py``, ``landmarks.py``, ...), never by itself.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from .events import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trajectory:
    """Poses over time; stamps do not decrease, and increase in everything logpose writes.

    Attributes:
        stamps: (N,) int64 [ns].
        positions: (N, 3) [m].
        orientations: (N, 4) quaternions x, y, z, w.
        frame_id: the frame the poses are given in.
        covariances: (N, 6, 6) of x, y, z, roll, pitch, yaw, or None.
        columns: further values per pose, by name.
        matrices: (N, 3, 3) rotations as a file of matrices has them, rounded and so not quite orthogonal, or None;
            they decide the last digits of relative errors.
    """

    stamps: npt.NDArray[np.int64]
    positions: Array
    orientations: Array
    frame_id: str = "map"
    covariances: Array | None = None
    columns: Mapping[str, Sequence[float | int | str | None]] = field(default_factory=dict)
    matrices: Array | None = None

    def __len__(self) -> int:
        """Return the number of poses."""
        return len(self.stamps)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LandmarkMap:
    """Point landmarks.

    Attributes:
        ids: (N,) int64, unique, >= 0.
        positions: (N, 3) [m].
        covariances: (N, 3, 3) [m^2], or None.
        frame_id: the frame of the positions.
    """

    ids: npt.NDArray[np.int64]
    positions: Array
    covariances: Array | None = None
    frame_id: str = "map"

    def __len__(self) -> int:
        """Return the number of landmarks."""
        return len(self.ids)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StripeMark:
    """Bright vertical bars on a dark ground, and where they hang.

    Attributes:
        id: unique in its map, >= 0.
        lines: (n,) abscissae of the rising edges (dark to bright), left to right as a viewer sees them [m]; n >= 3.
        bars: (n,) widths of the bright bars, or None where only rising edges are known [m].
        pose: (3,) x, y of its origin and heading of its X axis, which points to the viewer's right [m, m, rad]; the
            viewer stands on the side of heading - 90 degrees.
        height: vertical extent of the bars, or None [m].
    """

    id: int
    lines: Array
    bars: Array | None
    pose: Array
    height: float | None = None

    @property
    def edges(self) -> Array:
        """(m,) abscissae of all edges, left to right [m]."""
        if self.bars is None:
            return self.lines
        return np.stack([self.lines, self.lines + self.bars], axis=1).ravel()

    @property
    def polarity(self) -> npt.NDArray[np.int64]:
        """(m,) of all edges: 1 from dark to bright, -1 from bright to dark."""
        if self.bars is None:
            return np.ones(len(self.lines), dtype=np.int64)
        return np.tile(np.array([1, -1], dtype=np.int64), len(self.lines))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MarkMap:
    """Stripe marks in one frame."""

    marks: tuple[StripeMark, ...]
    frame_id: str = "map"

    def __len__(self) -> int:
        """Return the number of marks."""
        return len(self.marks)
