"""Where the camera looks: pan, tilt and roll from a mount, an inertial unit, joints, or options."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from ..geometry.mount import AHEAD, pan_tilt_roll
from ..geometry.so3 import as_matrix
from .pose import Array
from .solve import Attitude

MEASURED_SD, STATED_SD, TILT_SD, ROLL_SD = np.radians([0.3, 1.0, 4.0, 2.0])
"""Standard deviations of what was measured, of what options or a mount say (the floor is not flat), and of nothing
known."""


Known: TypeAlias = Literal["measured", "stated", "not"]


@dataclass(frozen=True, slots=True)
class Looking:
    """Pan, tilt, roll [rad], and how tilt and roll are known."""

    pan: float = 0.0
    tilt: float = 0.0
    roll: float = 0.0
    tilt_known: Known = "not"
    roll_known: Known = "not"

    @property
    def is_known(self) -> bool:
        """Whether both are known."""
        return "not" not in {self.tilt_known, self.roll_known}


def looking_of(rotation: Array | None, tilted: Array | None) -> Looking:
    """Return where a camera looks.

    Args:
        rotation: (4,) quaternion of the optical frame on the robot; it looks ahead where the log does not say (None).
        tilted: (3, 3) rotation of the robot against a level one of the same heading, None where it is not measured.
    """
    base_R_optical = AHEAD if rotation is None else as_matrix(rotation)
    if tilted is not None:
        return Looking(*pan_tilt_roll(tilted @ base_R_optical), "measured", "measured")
    known: Known = "not" if rotation is None else "stated"
    return Looking(*pan_tilt_roll(base_R_optical), known, known)


def expected(
    looking: Looking, levelling: Literal["best", "lines", "given"], tilt_sd: float | None, roll_sd: float | None
) -> Attitude:
    """Return what is known of tilt and roll: ``given`` is exact, ``lines`` takes nothing for known."""
    if levelling == "given":
        return Attitude(looking.tilt, looking.roll, 0.0, 0.0)
    if levelling == "lines":
        return Attitude(looking.tilt, looking.roll, np.inf, np.inf)
    usual = {"measured": (MEASURED_SD,) * 2, "stated": (STATED_SD,) * 2, "not": (TILT_SD, ROLL_SD)}
    return Attitude(
        looking.tilt,
        looking.roll,
        usual[looking.tilt_known][0] if tilt_sd is None else tilt_sd,
        usual[looking.roll_known][1] if roll_sd is None else roll_sd,
    )
