"""The frame tree map -> odom -> base_link of REP-105: what a localiser publishes is where odometry's frame stands.

``map_T_odom = map_T_base inverse(odom_T_base)``, both at the stamp of the estimate. Odometry is interpolated to it
(position linearly, orientation along the great circle), so an estimate waits for the odometry message after it. Over
gaps in the odometry nothing is said. Where odometry tells no pose, or there is none, or the estimates come when the log
has ended, as a smoother's do, ``map -> base_link`` is all there is.

Poses are pairs of position (3,) [m] and quaternion (4,) x, y, z, w.
"""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal, NamedTuple, TypeAlias

from ...formats.events import Array
from ..geometry import se3, so3

LONGEST_GAP_NS = 1_000_000_000
"""Odometry is not interpolated over longer gaps, and estimates do not wait longer for it [ns]."""

Rigid: TypeAlias = tuple[Array, Array]


class Placed(NamedTuple):
    """The tree at one estimate; ``map_T_odom`` is None where the tree has no odometry in it."""

    stamp: int
    map_T_odom: Rigid | None  # noqa: N815  # maps odom coordinates to the map
    odom_T_base: Rigid  # noqa: N815


@dataclass(slots=True)
class FrameTree:
    """Follows one estimator and the odometry; feed both in time order, take what ``placed`` yields.

    Attributes:
        mode: ``odom`` as soon as odometry tells a pose, ``base`` once it is clear that it will not; never changes back.
    """

    mode: Literal["odom", "base"] | None = None
    _last: tuple[int, Rigid] | None = None
    _waiting: deque[tuple[int, Rigid]] = field(default_factory=deque)
    _has_placed: bool = False

    def odometry(self, stamp: int, odom_T_base: Rigid | None) -> Iterator[Placed]:
        """Take an odometry message (None if it tells no pose); yield the estimates that waited for it."""
        self.mode = self.mode or ("base" if odom_T_base is None else "odom")
        if self.mode == "base":
            yield from self._without_odometry()
        elif odom_T_base is not None:
            yield from self._between(stamp, odom_T_base)
            self._last = (stamp, odom_T_base)

    def estimate(self, stamp: int, map_T_base: Rigid) -> Iterator[Placed]:
        """Take an estimate; yield what needs not wait any longer."""
        is_late = self._last is not None and stamp < self._last[0]
        if is_late and not self._has_placed:  # a smoother, which speaks when the log has ended
            self.mode = "base"
        self._waiting.append((stamp, map_T_base))
        if self.mode == "odom":
            while self._waiting and stamp - self._waiting[0][0] > LONGEST_GAP_NS:
                self._waiting.popleft()
        elif self.mode == "base" or stamp - self._waiting[0][0] > LONGEST_GAP_NS:
            self.mode = "base"
            yield from self._without_odometry()

    def end(self) -> Iterator[Placed]:
        """Yield what still waits when the log ends."""
        if self.mode == "odom" and self._last is not None:
            stamp, odom_T_base = self._last
            while self._waiting and self._waiting[0][0] == stamp:
                yield _place(*self._waiting.popleft(), odom_T_base)
        elif self.mode is None:
            yield from self._without_odometry()

    def _without_odometry(self) -> Iterator[Placed]:
        while self._waiting:
            stamp, map_T_base = self._waiting.popleft()
            yield Placed(stamp, None, map_T_base)

    def _between(self, stamp: int, odom_T_base: Rigid) -> Iterator[Placed]:
        while self._waiting and self._waiting[0][0] <= stamp:
            at, map_T_base = self._waiting.popleft()
            self._has_placed = True
            if at == stamp:
                yield _place(at, map_T_base, odom_T_base)
            elif self._last is not None and self._last[0] <= at and stamp - self._last[0] <= LONGEST_GAP_NS:
                before, start = self._last
                yield _place(at, map_T_base, interpolate(start, odom_T_base, (at - before) / (stamp - before)))


def interpolate(a: Rigid, b: Rigid, share: float) -> Rigid:
    """Return the pose that lies ``share`` (0..1) of the way from a to b."""
    q, r = so3.normalize(a[1]), so3.normalize(b[1])
    turn = so3.exp(share * so3.log(so3.compose(so3.inverse(q), r)))
    return a[0] + share * (b[0] - a[0]), so3.compose(q, turn)


def divide(map_T_base: Rigid, odom_T_base: Rigid) -> Rigid:
    """Return ``map_T_base inverse(odom_T_base)``, the place of the odometry frame in the map."""
    place, odom = ((t, so3.normalize(q)) for t, q in (map_T_base, odom_T_base))
    return se3.compose(place, se3.inverse(odom))


def _place(stamp: int, map_T_base: Rigid, odom_T_base: Rigid) -> Placed:
    return Placed(stamp, divide(map_T_base, odom_T_base), odom_T_base)
