"""A wheeled robot that drives through waypoints, and the uneven floor under it.

The robot is a unicycle, integrated in steps of 10 ms during which its speed v and turn rate w are constant (an exact
arc). It follows the line between two waypoints: with the distance e to the left of the line (heading h, length ahead L
= 0.5 m) ::

    w = K (h - atan(e / L) - theta),   |w| <= max turn rate,   |dw/dt| <= turn acceleration         (1)

slows down before a corner and while it turns, and lets its speed wander as a hand on a joystick does. A waypoint is
passed over, then the robot turns. The floor tilts it: roll and pitch are two independent processes with the
autocorrelation of a first-order process of ``correlation_s``, rounded off below a tenth of that, because a wheel does
not jump.
"""

import math
from dataclasses import dataclass

import numpy as np

from ...formats.events import Array
from ..engine.params import Field, Params
from .pose import View, rpy

STEP_S = 0.01
LINE_GAIN, LENGTH_AHEAD_M = 2.5, 0.5
TIMEOUT_S = 36_000


class WaypointParams(Params):
    """A place the robot drives over."""

    name: str = Field(description="its name in the waypoint table")
    x_m: float = Field(description="in the map [m]")
    y_m: float = Field(description="in the map [m]")


class TiltParams(Params):
    """Roll and pitch of the robot on a floor that is not flat."""

    sd_deg: float = Field(0.0, ge=0, le=10, description="standard deviation of roll and of pitch [deg]")
    correlation_s: float = Field(1.0, gt=0.05, description="how long a tilt lasts [s]")


class RobotParams(Params):
    """The route and how it is driven."""

    waypoints: tuple[WaypointParams, ...] = Field(min_length=2, description="places to drive over, in this order")
    is_closed: bool = Field(True, description="drive back to the first waypoint at the end")
    cruise_mps: float = Field(0.36, gt=0, description="speed on straight parts [m/s]")
    max_speed_mps: float = Field(0.4, gt=0, description="never faster [m/s]")
    max_turn_radps: float = Field(0.7, gt=0, description="never turns faster [rad/s]")
    corner_mps: float = Field(0.1, gt=0, description="speed at a sharp corner [m/s]")
    acceleration_mps2: float = Field(0.25, gt=0, description="speeding up and braking [m/s^2]")
    turn_acceleration_radps2: float = Field(1.5, gt=0, description="change of the turn rate [rad/s^2]")
    speed_sd_mps: float = Field(0.01, ge=0, description="wandering of the speed, correlated over 5 s [m/s]")
    tilt: TiltParams = Field(TiltParams(), description="unevenness of the floor")

    @property
    def route(self) -> Array:
        """Places to drive over, (W, 2) [m]; the first again where the route is closed."""
        places = np.array([[w.x_m, w.y_m] for w in self.waypoints])
        return np.vstack([places, places[:1]]) if self.is_closed else places


@dataclass(frozen=True, slots=True, eq=False)
class Drive:
    """Where the robot truly was: states at multiples of ``STEP_S``.

    Attributes:
        pose: (N, 3) x, y [m] and heading [rad, not wrapped].
        speed, turn_rate: (N,) constant until the next state [m/s], [rad/s].
        distance: (N,) driven so far [m].
        tilt: (N, 2) roll, pitch [rad].
    """

    pose: Array
    speed: Array
    turn_rate: Array
    distance: Array
    tilt: Array

    @property
    def duration(self) -> float:
        """Length of the drive [s]."""
        return (len(self.pose) - 1) * STEP_S

    def at(self, time: float) -> tuple[Array, float, Array]:
        """Return pose (3,), distance driven and tilt (2,) at ``time`` [s] after the start; held before and after."""
        i = min(max(int(time / STEP_S), 0), len(self.pose) - 1)
        dt = min(max(time - i * STEP_S, 0.0), STEP_S) if i < len(self.pose) - 1 else 0.0
        pose = advance(self.pose[i], self.speed[i], self.turn_rate[i], dt)
        share, j = dt / STEP_S, min(i + 1, len(self.pose) - 1)
        return pose, float(self.distance[i] + self.speed[i] * dt), (1 - share) * self.tilt[i] + share * self.tilt[j]

    def view(self, time: float) -> View:
        """Return map_T_base at ``time`` [s], tilt included."""
        pose, _, (roll, pitch) = self.at(time)
        return View(rpy(roll, pitch, pose[2]), np.array([pose[0], pose[1], 0.0]))


def advance(pose: Array, speed: float, turn_rate: float, dt: float) -> Array:
    """Return the pose (3,) after ``dt`` [s] along an arc."""
    half = 0.5 * turn_rate * dt
    chord = speed * dt * (math.sin(half) / half if abs(half) > 1e-9 else 1.0)
    heading = pose[2] + half
    return np.array([pose[0] + chord * math.cos(heading), pose[1] + chord * math.sin(heading), pose[2] + 2 * half])


def drive(params: RobotParams, rng: np.random.Generator) -> Drive:
    """Drive the route from its first waypoint, standing, heading for the second.

    Raises:
        ValueError: two waypoints in the same place, or a route that takes more than ten hours.
    """
    goals = params.route
    legs = np.diff(goals, axis=0)
    lengths = np.hypot(legs[:, 0], legs[:, 1])
    if (lengths < 0.01).any():
        raise ValueError(f"waypoint {int(np.argmin(lengths)) + 2} is where the one before it is")
    headings = np.arctan2(legs[:, 1], legs[:, 0])
    pose, v, w, wander = np.array([*goals[0], headings[0]]), 0.0, 0.0, 0.0
    keep = math.exp(-STEP_S / 5.0)
    kick = params.speed_sd_mps * math.sqrt(1 - keep * keep)
    states, leg = [], 0
    while leg < len(legs):
        states.append((*pose, v, w))
        if len(states) * STEP_S > TIMEOUT_S:
            raise ValueError("the route takes more than ten hours; the robot is too slow or the route too long")
        wander = keep * wander + kick * float(rng.standard_normal())
        is_last = leg == len(legs) - 1
        corner = 0.02 if is_last else _corner_speed(params, headings[leg + 1] - headings[leg])
        ahead, v, w = _steer(params, pose, (goals[leg], headings[leg], lengths[leg]), (v, w), (corner, wander))
        pose = advance(pose, v, w, STEP_S)
        leg += ahead <= v * STEP_S
    states.append((*pose, 0.0, 0.0))
    table = np.array(states)
    # The speed of a state is the one that leads to the next.
    speed, turn_rate = np.append(table[1:-1, 3], [v, 0.0]), np.append(table[1:-1, 4], [w, 0.0])
    distance = np.concatenate([[0.0], np.cumsum(speed[:-1] * STEP_S)])
    return Drive(table[:, :3], speed, turn_rate, distance, _tilt(params.tilt, len(table), rng))


def _corner_speed(params: RobotParams, turn: float) -> float:
    sharp = min(abs(_wrap(turn)) / (math.pi / 3), 1.0)
    return params.cruise_mps + sharp * (min(params.corner_mps, params.cruise_mps) - params.cruise_mps)


def _steer(
    params: RobotParams,
    pose: Array,
    line: tuple[Array, float, float],
    now: tuple[float, float],
    wish: tuple[float, float],
) -> tuple[float, float, float]:
    """Return the distance to the end of the line, and the speed and turn rate for the next step, by eq. (1)."""
    start, heading, length = line
    (v, w), (corner, wander) = now, wish
    dx, dy = pose[0] - start[0], pose[1] - start[1]
    c, s = math.cos(heading), math.sin(heading)
    left, ahead = c * dy - s * dx, length - (c * dx + s * dy)
    error = _wrap(heading - math.atan2(left, LENGTH_AHEAD_M) - pose[2])
    goal_w = min(max(LINE_GAIN * error, -params.max_turn_radps), params.max_turn_radps)
    limit = params.turn_acceleration_radps2 * STEP_S
    w += min(max(goal_w - w, -limit), limit)
    turning = max(0.0, 1.0 - abs(error) / (math.pi / 4))
    goal_v = min(corner, params.cruise_mps) + turning * (params.cruise_mps + wander - min(corner, params.cruise_mps))
    if abs(error) > math.pi / 4:
        goal_v = min(params.corner_mps, params.cruise_mps)
    braking = math.sqrt(corner * corner + 2 * params.acceleration_mps2 * max(ahead, 0.0))
    goal_v = min(max(min(goal_v, braking), 0.01), params.max_speed_mps)
    limit = params.acceleration_mps2 * STEP_S
    v += min(max(goal_v - v, -limit), limit)
    return ahead, v, w


def _tilt(params: TiltParams, n: int, rng: np.random.Generator) -> Array:
    """Return roll and pitch (n, 2) [rad]: a stationary second-order process, scaled to its standard deviation."""
    a, b = math.exp(-STEP_S / params.correlation_s), math.exp(-STEP_S / (0.1 * params.correlation_s))
    variance = (1 + a * b) / ((1 - a * b) * (1 - a * a) * (1 - b * b))
    lead = int(10 * params.correlation_s / STEP_S)
    noise = rng.standard_normal((n + lead, 2)) * math.radians(params.sd_deg) / math.sqrt(variance)
    out, slow, smooth = np.empty_like(noise), np.zeros(2), np.zeros(2)
    for i, e in enumerate(noise):
        slow = a * slow + e
        smooth = b * smooth + slow
        out[i] = smooth
    return out[lead:]


def _wrap(angle: float) -> float:
    return (angle + math.pi) % (2 * math.pi) - math.pi
