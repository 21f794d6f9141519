"""What the filter can honestly say of its pose: tracking, dead-reckoning, ambiguous or lost.

Sightings of the last seconds and the last metre are judged together (a robot that stands before something
that is not in the map learns nothing new from it). Each has a surprise, the logarithm of its density under
the cloud over that of clutter: positive if the map explains it better than chance. The robot is ``lost``
while their mean is below zero or too many have no landmark; ``dead-reckoning`` if this image gave no
landmark; ``ambiguous`` while a share of the weight stands at another place; otherwise ``tracking``.
"""

from collections import deque
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from ..estimation.gaussian import LOST, pose_covariance
from .params import LocalizePfParams

Array: TypeAlias = npt.NDArray[np.float64]

Status = Literal["tracking", "dead-reckoning", "ambiguous", "lost"]
STATUSES: tuple[Status, ...] = ("tracking", "dead-reckoning", "ambiguous", "lost")

_FOUND = 0.7
"""Who was lost is found when at most this part of the tolerated share is unmatched: half a match is no return."""

_LEAST = 1e-4
"""A cloud of one pose would say 0 m and 0 rad; a tenth of a millimetre and of a milliradian is small enough."""


class Judge:
    """Remembers how well the last sightings were explained."""

    def __init__(self, params: LocalizePfParams) -> None:
        """Take the window and the thresholds."""
        self.params = params
        self._seen: deque[tuple[int, float, float, bool]] = deque()
        self.is_lost = False

    def look(
        self, now: tuple[int, float], surprise: Array, is_matched: npt.NDArray[np.bool_], elsewhere: float
    ) -> Status:
        """Judge one image.

        Args:
            now: stamp of the image [ns], and length of the way to it [m].
            surprise: (n,) logarithm of density over clutter of each sighting.
            is_matched: (n,) whether it was given a landmark.
            elsewhere: weight of the cloud at other places.
        """
        self._seen.extend((*now, float(s), bool(m)) for s, m in zip(surprise, is_matched, strict=True))
        while len(self._seen) > self.params.lost_count and self._is_old(self._seen[1], now):
            self._seen.popleft()
        if len(self._seen) >= self.params.lost_count and self._is_old(self._seen[0], now):
            n = len(self._seen)
            mean = sum(s for _, _, s, _ in self._seen) / n
            unmatched = sum(not m for _, _, _, m in self._seen) / n
            most = self.params.lost_unmatched_share * (_FOUND if self.is_lost else 1.0)
            self.is_lost = mean < 0.0 or unmatched > most
        if self.is_lost:
            return "lost"
        if not is_matched.any():
            return "dead-reckoning"
        return "ambiguous" if elsewhere > self.params.ambiguous_share else "tracking"

    def _is_old(self, seen: tuple[int, float, float, bool], now: tuple[int, float]) -> bool:
        """Tell whether enough time and way lie behind a sighting."""
        seconds, metres = (now[0] - seen[0]) * 1e-9, now[1] - seen[1]
        return seconds >= self.params.lost_window_s and metres >= self.params.lost_window_m

    def unseen(self) -> Status:
        """Return the status of a pose without an image."""
        return "lost" if self.is_lost else "dead-reckoning"


def honest_covariance(cov: Array, status: Status) -> Array:
    """Return the covariance (3, 3) to report: widened while lost, and never singular."""
    return np.asarray(cov + (LOST if status == "lost" else pose_covariance(_LEAST, _LEAST)))
