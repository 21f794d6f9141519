"""Odometry messages as increments between instants.

From poses the motion is exact; twists are held until the next message, and the motion to it takes the mean of both. To
an instant between messages (an image) the motion is extrapolated with the last twist; what was extrapolated is taken
off the next increment.

A message may lack its pose (a driver that starts up). ``auto`` uses poses as soon as there is one, twists until then,
and twists for good after ten messages without. A message without pose among poses is skipped: the next pose knows
the whole way.
"""

import math
from collections import deque
from collections.abc import Iterator
from typing import Literal, NamedTuple

import numpy as np

from ...formats.events import Array, Notice, Odometry
from ..geometry.angles import yaw_from_quaternion
from ..geometry.motion import Increment, pose_increment, twist_increment
from ..geometry.se2 import between
from .poses import listed

MISSING_ODOMETRY = "no odometry in the log. Name its topic with --topic odometry=/NAME."

_NS = 1e-9

_PATIENCE = 10
"""After so many messages without pose ``auto`` takes the log for one of twists."""

_LEAST_S = 0.01
"""Two messages count as at least so far apart: stamps that nearly meet must not make a jump of every centimetre."""

Twist = tuple[float, float, float]


class Jump(NamedTuple):
    """Two poses of odometry that no drive connects: at ``stamp`` [ns], by how much, and in what time."""

    stamp: int
    metres: float
    radians: float
    seconds: float


class OdometryReader:
    """Motion of the robot from instant to instant.

    Attributes:
        count: messages used.
        skipped: messages left out because they lack the pose that others have.
        gaps: (stamp [ns], length [s]) of silences longer than ``gap_s``, not yet fetched by the caller.
        jumps: motions between two poses that are faster than ``jump``, not yet fetched by the caller.
        twist: last v_x, v_y [m/s], omega [rad/s].
    """

    def __init__(
        self,
        odometry_from: Literal["auto", "pose", "twist"] = "auto",
        gap_s: float = 1.0,
        jump: tuple[float, float] = (10.0, 10.0),
    ) -> None:
        """Choose the half of the messages, the silence [s] that is a gap, the speed [m/s, rad/s] that is a jump."""
        self.odometry_from = odometry_from
        self.gap_s = gap_s
        self.jump = jump
        self.count = self.skipped = 0
        self.gaps: deque[tuple[int, float]] = deque()
        self.jumps: deque[Jump] = deque()
        self.twist: Twist | None = None
        self._pose: Array | None = None
        self._poseless = 0
        self._ahead = Increment()  # extrapolated since the last message
        self._heard: int | None = None
        self._at: int | None = None

    def read(self, event: Odometry) -> Increment:
        """Return the motion from the last instant asked for to the stamp of this message; none if it is skipped.

        Raises:
            ValueError: a number is not finite, the half that was asked for is missing, or the stamp goes
            back.
        """
        pose, twist = self._halves(event)
        if pose is None and twist is None:
            self.skipped += 1
            return Increment()
        if self._heard is not None and event.stamp < self._heard:
            raise ValueError(
                f"odometry goes back in time by {(self._heard - event.stamp) * _NS:.9f} s. "
                "Sort the log, or drop the messages that come late."
            )
        self.count += 1
        step = self._step(event.stamp, pose, twist)
        if self._heard is not None and pose is not None and self._pose is not None:
            dt = (event.stamp - self._heard) * _NS
            x, y, turn = (float(value) for value in between(self._pose, pose))
            if not self._has_jumped(event.stamp, math.hypot(x, y), abs(turn), dt) and dt > 0.0:
                self.twist = (x / dt, y / dt, turn / dt)
        if twist is not None:
            self.twist = twist
        self._pose, self._heard, self._at, self._ahead = pose, event.stamp, event.stamp, Increment()
        return step

    def until(self, stamp: int) -> Increment:
        """Return the motion from the last instant asked for to ``stamp`` [ns], extrapolated; nothing before it."""
        if self._at is None:
            self._at = stamp
        if stamp <= self._at:
            return Increment()
        dt = (stamp - self._at) * _NS
        silent = 0.0 if self._heard is None else (stamp - self._heard) * _NS
        if self.twist is None or silent > self.gap_s:
            step = Increment(dt=dt, gap=dt if self._heard is not None else 0.0)
        else:
            step = twist_increment(self.twist, dt)
        self._at = stamp
        self._ahead = self._ahead.then(step)
        return step

    def _step(self, stamp: int, pose: Array | None, twist: Twist | None) -> Increment:
        """Return the motion from the last instant to a message."""
        if self._heard is None or self._at is None:
            dt = 0.0 if self._at is None else max(0.0, (stamp - self._at) * _NS)
            return Increment(dt=dt)
        silent = (stamp - self._heard) * _NS
        dt = max(0.0, (stamp - self._at) * _NS)
        is_gap = silent > self.gap_s
        if is_gap:
            self.gaps.append((stamp, silent))
        gap = dt if is_gap else 0.0
        if pose is not None and self._pose is not None:
            done = np.array([self._ahead.dx, self._ahead.dy, self._ahead.dtheta])
            return pose_increment(between(done, between(self._pose, pose)), dt, gap)
        if twist is None or self.twist is None or dt == 0.0:
            return Increment(dt=dt, gap=gap)
        mean = tuple(0.5 * (a + b) for a, b in zip(self.twist, twist, strict=True))
        return twist_increment((mean[0], mean[1], mean[2]), dt, gap)

    def _has_jumped(self, stamp: int, metres: float, radians: float, seconds: float) -> bool:
        """Tell whether two poses are too far apart [m, rad] for the time between them [s], and remember it."""
        least = max(seconds, _LEAST_S)
        is_jump = metres > self.jump[0] * least or radians > self.jump[1] * least
        if is_jump:
            self.jumps.append(Jump(stamp, metres, radians, seconds))
        return is_jump

    def _halves(self, event: Odometry) -> tuple[Array | None, Twist | None]:
        """Return the pose (3,) or None, and the twist or None, as they were asked for; neither: skip the message."""
        for name in ("position", "orientation", "linear", "angular"):
            values = getattr(event, name)
            if values is not None and not np.all(np.isfinite(values)):
                raise ValueError(f"odometry {name} is not finite: {listed(values)}. Repair or cut the log there.")
        pose = None
        if event.position is not None and event.orientation is not None and np.any(event.orientation):
            pose = np.array([event.position[0], event.position[1], yaw_from_quaternion(event.orientation)])
        twist = None
        if event.linear is not None and event.angular is not None:
            twist = (float(event.linear[0]), float(event.linear[1]), float(event.angular[2]))
        if self.odometry_from == "auto":
            self._choose(has_pose=pose is not None)
        if self.odometry_from == "twist":
            if twist is None:
                raise ValueError("odometry has no twist. Set odometry_from to pose.")
            return None, twist
        if self.odometry_from == "pose":
            if pose is None and self._pose is None:
                raise ValueError("odometry has no pose. Set odometry_from to twist.")
            is_filled = pose is not None and event.linear is not None and bool(np.any(event.linear))
            return pose, twist if is_filled else None
        return None, twist

    def _choose(self, *, has_pose: bool) -> None:
        """Decide for poses at the first one, for twists when it has not come after some messages."""
        self._poseless += not has_pose
        if has_pose:
            self.odometry_from = "pose"
        elif self._poseless >= _PATIENCE:
            self.odometry_from = "twist"


def odometry_notices(reader: OdometryReader, source: str, after_jump: str) -> Iterator[Notice]:
    """Yield what odometry hides: gaps and jumps that have not been fetched.

    Args:
        reader: of the log.
        source: the stage that says so.
        after_jump: what becomes of poses after a jump.
    """
    while reader.gaps:
        stamp, seconds = reader.gaps.popleft()
        message = f"odometry is silent for {seconds:.3f} s; the pose is uncertain there."
        yield Notice(stamp=stamp, source=source, code="odometry-gap", message=message)
    while reader.jumps:
        jump = reader.jumps.popleft()
        message = (
            f"odometry jumps by {jump.metres:.3f} m and {math.degrees(jump.radians):.1f} deg within "
            f"{jump.seconds:.3f} s at stamp {jump.stamp} ns; {after_jump}."
        )
        yield Notice(stamp=jump.stamp, source=source, code="odometry-jump", message=message)


def skipped_notice(reader: OdometryReader, stamp: int, source: str) -> Iterator[Notice]:
    """Yield that messages were skipped, said at ``stamp`` [ns], if there were any."""
    if reader.skipped:
        message = (
            f"{reader.skipped} of {reader.skipped + reader.count} odometry messages give no pose and were skipped; "
            "their motion is in the next pose, if one comes."
        )
        yield Notice(stamp=stamp, source=source, code="odometry-without-pose", message=message)
