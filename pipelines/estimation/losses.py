"""Robust losses: how much a measurement may cost that fits badly.

Of the squared length s of a whitened residual (chi-square if the measurement is good) least squares pays s. A robust
loss pays rho(s), which grows more slowly beyond a scale k, and weighs the measurement by w = rho'(s) in iterated least
squares; no rho here is convex in s, so each such step lowers the sum of rho. ::

    huber           rho = s, beyond k^2: 2 k sqrt(s) - k^2    w = min(1, k / sqrt(s))     pulls on for ever, one minimum
    cauchy          rho = k^2 log(1 + s / k^2)                w = 1 / (1 + s / k^2)       lets go slowly
    geman-mcclure   rho = s / (1 + s / k^2)                   w = 1 / (1 + s / k^2)^2     lets go, from a good start

Source: Z. Zhang, "Parameter estimation techniques: a tutorial with application to conic fitting", 1997, section 9.4
(weights), here for the squared length of a vector instead of a scalar.
"""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Loss:
    """A loss and its scale.

    Attributes:
        kind: which one; ``squares`` is least squares and has no scale.
        scale: k, a length in standard deviations.
    """

    kind: Literal["squares", "huber", "cauchy", "geman-mcclure"] = "squares"
    scale: float = 1.0

    def cost(self, s: Array) -> Array:
        """Return rho (K,) of squared lengths (K,)."""
        k2 = self.scale**2
        match self.kind:
            case "huber":
                return np.where(s <= k2, s, 2.0 * self.scale * np.sqrt(np.maximum(s, k2)) - k2)
            case "cauchy":
                return k2 * np.log1p(s / k2)
            case "geman-mcclure":
                return s / (1.0 + s / k2)
            case "squares":
                return s

    def weight(self, s: Array) -> Array:
        """Return w (K,) of squared lengths (K,), between 0 and 1."""
        k2 = self.scale**2
        match self.kind:
            case "huber":
                return self.scale / np.sqrt(np.maximum(s, k2))
            case "cauchy":
                return 1.0 / (1.0 + s / k2)
            case "geman-mcclure":
                return 1.0 / (1.0 + s / k2) ** 2
            case "squares":
                return np.ones_like(s)


SQUARES = Loss()
"""Least squares."""
