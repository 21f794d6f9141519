"""How a robot in the plane moves: the exact arc of a constant twist, and increments that add up.

The arc (Table 2 of the ceiling paper, and any book) is written with sin(x)/x instead of v/omega, which is the
same and holds for omega = 0 too::

    x' = x + v dt sinc(omega dt / 2) cos(theta + omega dt / 2)
    y' = y + v dt sinc(omega dt / 2) sin(theta + omega dt / 2)
    theta' = theta + omega dt

An ``Increment`` is what odometry says between two instants, with what its noise grows with: the length of the
path, the angle turned, the time, and the part of the time in which odometry was silent.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .angles import Array, wrap
from .se2 import exp

_STEP_S, _STEP_RAD = 0.25, 0.1
"""Increments do not add up to more than this."""


def arc(pose: Array, v: npt.ArrayLike, omega: npt.ArrayLike, dt: float) -> Array:
    """Drive with constant speed and turn rate.

    Args:
        pose: (..., 3) start [m, m, rad].
        v: (...) forward speed [m/s].
        omega: (...) turn rate [rad/s].
        dt: time [s].

    Returns:
        (..., 3) end pose [m, m, rad], heading in (-pi, pi].
    """
    turn = np.asarray(omega, dtype=np.float64) * dt
    chord = np.asarray(v, dtype=np.float64) * dt * np.sinc(turn / (2.0 * np.pi))  # numpy's sinc has a pi in it
    middle = pose[..., 2] + 0.5 * turn
    x = pose[..., 0] + chord * np.cos(middle)
    y = pose[..., 1] + chord * np.sin(middle)
    return np.stack([x, y, wrap(pose[..., 2] + turn)], axis=-1)


class Increment(NamedTuple):
    """Motion between two instants, in the robot's frame at the first.

    Attributes:
        dx, dy, dtheta: displacement [m, m, rad]; dtheta counts full turns.
        length: length of the path [m].
        turn: sum of the absolute angles turned [rad].
        dt: time [s].
        gap: part of the time in which odometry was silent for too long [s].
    """

    dx: float = 0.0
    dy: float = 0.0
    dtheta: float = 0.0
    length: float = 0.0
    turn: float = 0.0
    dt: float = 0.0
    gap: float = 0.0

    def then(self, other: "Increment") -> "Increment":
        """Return this motion followed by ``other``."""
        c, s = math.cos(self.dtheta), math.sin(self.dtheta)
        return Increment(
            self.dx + c * other.dx - s * other.dy,
            self.dy + s * other.dx + c * other.dy,
            self.dtheta + other.dtheta,
            self.length + other.length,
            self.turn + other.turn,
            self.dt + other.dt,
            self.gap + other.gap,
        )

    @property
    def is_none(self) -> bool:
        """Whether no time went by and nothing moved."""
        return not (self.dt > 0.0 or self.length > 0.0 or self.turn > 0.0)


class Gathered:
    """Increments that add up until they amount to more than a filter may take in one step.

    So a log of fast odometry costs no more than one of slow odometry.
    """

    def __init__(self) -> None:
        """Begin with nothing."""
        self._sum = Increment()

    def add(self, u: Increment) -> Increment | None:
        """Add an increment; return what must be given to the filter before it, if it would become too much."""
        is_full = self._sum.dt + u.dt > _STEP_S or self._sum.turn + u.turn > _STEP_RAD
        due = self.take() if is_full else None
        self._sum = self._sum.then(u)
        return due

    def take(self) -> Increment:
        """Return all that has been added, and begin anew."""
        u, self._sum = self._sum, Increment()
        return u


def twist_increment(twist: tuple[float, float, float], dt: float, gap: float = 0.0) -> Increment:
    """Return the motion of a constant twist v_x, v_y [m/s], omega [rad/s] over ``dt`` [s]."""
    vx, vy, omega = twist
    dx, dy, _ = exp(np.array([vx * dt, vy * dt, omega * dt])).tolist()
    return Increment(dx, dy, omega * dt, math.hypot(vx, vy) * abs(dt), abs(omega * dt), dt, gap)


def pose_increment(delta: Array, dt: float, gap: float = 0.0) -> Increment:
    """Return the motion to the pose ``delta`` (3,) as seen from the first, reached in ``dt`` [s]."""
    dx, dy, dtheta = (float(value) for value in delta)
    return Increment(dx, dy, dtheta, math.hypot(dx, dy), abs(dtheta), dt, gap)
