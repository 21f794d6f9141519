"""Where the camera looks: pan, tilt and roll from a mount, an inertial unit, joints, or options."""

from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeAlias

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

    pan: float
    tilt: float
    roll: float
    tilt_known: Known
    roll_known: Known

    @property
    def is_known(self) -> bool:
        """Whether both are known."""
        return "not" not in {self.tilt_known, self.roll_known}


class Turned(NamedTuple):
    """How far joints turn the camera from its mount [rad]: None without such a joint, nan while it is silent."""

    tilt: float | None = None
    pan: float | None = None


class Stated(NamedTuple):
    """What options say [rad], None where they say nothing."""

    pan: float | None = None
    tilt: float | None = None
    roll: float | None = None


def looking_of(mount: Array | None, tilted: Array | None, turned: Turned, stated: Stated) -> Looking:
    """Return where a camera looks: options win over joints, joints over an inertial unit, that over the mount.

    Where a joint would have to speak and is silent the pan is nan: nobody knows where the head is turned to.

    Args:
        mount: (4,) quaternion of the optical frame on the robot; it looks ahead where the log does not say (None). With
            joints it is the head's at rest.
        tilted: (3, 3) rotation of the robot against a level one of the same heading, None where it is not measured.
        turned: by joints.
        stated: by options.
    """
    base_R_optical = AHEAD if mount is None else as_matrix(mount)
    tilt_known: Known = "measured" if tilted is not None else "not" if mount is None else "stated"
    roll_known = tilt_known
    pan, tilt, roll = pan_tilt_roll(base_R_optical if tilted is None else tilted @ base_R_optical)
    if turned.pan is not None:
        pan += turned.pan
    if turned.tilt is not None:
        is_silent = np.isnan(turned.tilt)
        tilt, tilt_known = (tilt, "not") if is_silent else (tilt + turned.tilt, "measured")
    if stated.pan is not None:
        pan = stated.pan
    if stated.tilt is not None:
        tilt, tilt_known = stated.tilt, "stated"
    if stated.roll is not None:
        roll, roll_known = stated.roll, "stated"
    return Looking(pan, tilt, roll, tilt_known, roll_known)


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
