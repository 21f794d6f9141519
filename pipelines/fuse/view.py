"""What one image shows, as numbers: sightings of marks by how sure they are of themselves."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """One sighting.

    Attributes:
        mark: index of the mark in the map.
        pose: (3,) of the robot that it says [m, m, rad].
        cov: (3, 3) of it in the map.
        span: first and last image column it covers [px].
    """

    mark: int
    pose: Array
    cov: Array
    span: tuple[float, float] = (-np.inf, np.inf)


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """One image.

    Attributes:
        stamp: of the image [ns].
        sure: sightings whose mark was told apart from all others.
        ambiguous: candidates; those that lie over one another in the image are candidates for the same thing.
        unverified: sightings whose mark is an assumption.
    """

    stamp: int
    sure: Sequence[Seen] = ()
    ambiguous: Sequence[Seen] = ()
    unverified: Sequence[Seen] = ()

    @property
    def n_seen(self) -> int:
        """Number of things seen; candidates for one count once."""
        return len(self.sure) + len(self.unverified) + len(groups(self.ambiguous))


def groups(seen: Sequence[Seen]) -> list[list[Seen]]:
    """Put together the candidates that lie over one another in the image."""
    found: list[list[Seen]] = []
    end = -np.inf
    for one in sorted(seen, key=lambda one: one.span):
        if found and one.span[0] <= end:
            found[-1].append(one)
        else:
            found.append([one])
            end = -np.inf
        end = max(end, one.span[1])
    return found


def by_precision(seen: Sequence[Seen]) -> list[Seen]:
    """Return sightings, the one with the least uncertain place first."""
    return sorted(seen, key=lambda one: float(one.cov[0, 0] + one.cov[1, 1]))
