"""Rows of a trajectory file to a ``Trajectory``, with the checks that every format shares.

A quaternion is brought to length 1 and qw >= 0. One that is already of length 1 to 1e-8 is left as it is, so
that reading and writing a file again gives the same bytes.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..errors import FormatError
from ..events import Array
from ..products import Trajectory

QUATERNION_TOLERANCE = 0.02
"""A quaternion whose length is off by more is no rounded rotation but, say, another order of columns."""


@dataclass(slots=True)
class PoseRows:
    """Collects the poses of one file.

    Attributes:
        name: of the file, for errors.
        allow_repeats: keep poses that repeat the stamp of the one before: published references have them.
            Stamps that go back are always refused.
        frame_id: of the poses.
    """

    name: str
    allow_repeats: bool = False
    frame_id: str = "map"
    stamps: list[int] = field(default_factory=list)
    values: list[Sequence[float]] = field(default_factory=list)
    last_line: int = 0

    def add(self, line: int, stamp: int, position: Sequence[float], quaternion: Sequence[float]) -> None:
        """Append a pose: position (3) [m], quaternion (4) x, y, z, w.

        Raises:
            FormatError: the stamp does not follow the last one, or the quaternion is none.
        """
        if self.stamps and stamp <= self.stamps[-1] and not (self.allow_repeats and stamp == self.stamps[-1]):
            relation = "repeats" if stamp == self.stamps[-1] else "is before"
            raise FormatError(
                f"{self.name}:{line}: the stamp {relation} that of line {self.last_line}. "
                "Sort the file by time, one pose per stamp."
            )
        length = math.sqrt(math.fsum(v * v for v in quaternion))
        if abs(length - 1.0) > QUATERNION_TOLERANCE:
            raise FormatError(
                f"{self.name}:{line}: the quaternion has length {length:.4g}, not 1. Check the order of the columns."
            )
        self.stamps.append(stamp)
        self.values.append((*position, *unit_quaternion(quaternion)))
        self.last_line = line

    def trajectory(self) -> Trajectory:
        """Return the trajectory.

        Raises:
            FormatError: there is no pose.
        """
        if not self.stamps:
            raise FormatError(f"{self.name}: has no poses. Name a file with at least one.")
        values: Array = np.array(self.values, dtype=np.float64)
        return Trajectory(
            stamps=np.array(self.stamps, dtype=np.int64),
            positions=values[:, :3],
            orientations=values[:, 3:],
            frame_id=self.frame_id,
        )


def unit_quaternion(quaternion: Sequence[float]) -> tuple[float, ...]:
    """Return a quaternion x, y, z, w of length 1 with qw >= 0, unchanged if it is that to 1e-8."""
    square = math.fsum(v * v for v in quaternion)
    scale = 1.0 if abs(square - 1.0) < 1e-8 else 1.0 / math.sqrt(square)
    if quaternion[3] < 0:
        scale = -scale
    if scale == 1.0:
        return tuple(float(v) for v in quaternion)
    return tuple(float(v) * scale + 0.0 for v in quaternion)  # + 0.0: no negative zeros


def check_pose(position: Array, orientation: Array) -> None:
    """Refuse to write what could not be read back: position (3,) [m], orientation (4,) x, y, z, w.

    Raises:
        ValueError: a value that is not finite, or a quaternion that is none.
    """
    for name, array in (("position", position), ("orientation", orientation)):
        if not np.isfinite(array).all():
            raise ValueError(f"{name} {array.tolist()!r} is not finite")
    length = float(np.linalg.norm(orientation))
    if abs(length - 1.0) > QUATERNION_TOLERANCE:
        raise ValueError(f"the quaternion has length {length:.4g}, not 1")


class StampOrder:
    """Watches the stamps of poses that are written one by one."""

    def __init__(self) -> None:
        self._last: int | None = None

    @property
    def is_first(self) -> bool:
        """Whether no stamp has come yet."""
        return self._last is None

    def is_repeat(self, stamp: int) -> bool:
        """Take the next stamp and tell whether it repeats the last one.

        Raises:
            ValueError: it goes back.
        """
        if self._last is not None and stamp < self._last:
            raise ValueError(f"the stamp {stamp} is before that of the last pose, {self._last}")
        is_repeat = stamp == self._last
        self._last = stamp
        return is_repeat


def check_trajectory(trajectory: Trajectory, *, allow_repeats: bool = False) -> None:
    """Refuse what ``check_pose`` refuses, and stamps that do not increase.

    Raises:
        ValueError: the message names the index of the pose.
    """
    finite = np.isfinite(trajectory.positions).all(axis=1) & np.isfinite(trajectory.orientations).all(axis=1)
    length = np.linalg.norm(trajectory.orientations, axis=1)
    bad = np.flatnonzero(~finite | (np.abs(length - 1.0) > QUATERNION_TOLERANCE))
    if bad.size:
        try:
            check_pose(trajectory.positions[bad[0]], trajectory.orientations[bad[0]])
        except ValueError as err:
            raise ValueError(f"pose {bad[0]}: {err}") from err
    bad = np.flatnonzero(np.diff(trajectory.stamps) < (0 if allow_repeats else 1))
    if bad.size:
        late = bad[0] + 1
        raise ValueError(f"pose {late}: stamp {trajectory.stamps[late]} does not follow {trajectory.stamps[late - 1]}")
