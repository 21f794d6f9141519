"""What a run of ``fuse-poses`` amounts to: JSON-ready numbers."""

from collections.abc import Mapping, Sequence
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from .motion import N_POSE, N_STATE
from .smoother import Way
from .tracker import STATUSES, Tracker

Array: TypeAlias = npt.NDArray[np.float64]

_OUTCOMES = (
    "accepted",
    "rejected",
    "ambiguous_accepted",
    "ambiguous_left",
    "unverified_accepted",
    "unverified_left",
)


def summary(tracker: Tracker, ids: Sequence[int]) -> dict[str, object]:
    """Return what the filter says of the log; ``ids`` are those of the marks of the map."""
    tally, robot = tracker.tally, tracker.filter
    n = max(sum(tally.status.values()), 1)
    ratio = tally.innovations.ratio
    values: dict[str, object] = {
        "n_images": tally.images,
        "n_before_start": tally.before_start,
        "status_share": {status: tally.status[status] / n for status in STATUSES},
        "sightings": {outcome: tally.sightings[outcome] for outcome in _OUTCOMES},
        "begun_anew": tally.begun_anew,
        "nis_per_dof": None if np.isnan(ratio) else ratio,
        "way_m": tally.way_m,
        "odometry": None,
        "marks": [],
    }
    if robot is not None and tracker.has_odometry:
        sigmas = np.sqrt(np.diag(robot.P)[N_POSE:])
        values["odometry"] = _calibration(robot.calibration, sigmas[:3])
        errors = zip(robot.marks, robot.errors, sigmas[3:].reshape(-1, 3), strict=True)
        values["marks"] = [_survey(ids[mark], error, sigma) for mark, error, sigma in errors]
    return values


def summary_of_way(way: Way, ids: Sequence[int], *, has_odometry: bool) -> dict[str, object]:
    """Return what the smoother says of the log, in place of what the filter said at its end."""
    result = way.result
    sigma = np.sqrt(np.diag(result.border_covariance)).reshape(-1, 3)
    rows = zip(way.marks, result.border.reshape(-1, 3), sigma, strict=True)
    last = np.sqrt(np.diag(result.covariances[-1])[N_POSE:N_STATE])
    return {
        "smoother": {
            "n_states": len(result.states),
            "n_sightings": len(way.is_kept),
            "n_rejected": int(np.sum(~way.is_kept)),
            "n_increments_rejected": len(way.broken),
            "is_converged": result.is_converged,
        },
        "odometry": _calibration(result.states[-1, N_POSE:], last) if has_odometry else None,
        "marks": [_survey(ids[mark], error, s) for mark, error, s in rows],
    }


def _calibration(values: Array, sigmas: Array) -> Mapping[str, float]:
    names = ("speed_scale", "turn_scale", "turn_bias_rad_s")
    told = {name: float(value) for name, value in zip(names, values, strict=True)}
    return told | {f"{name}_sigma": float(sigma) for name, sigma in zip(names, sigmas, strict=True)}


def _survey(identity: int, error: Array, sigma: Array) -> Mapping[str, float | int]:
    names = ("dx_m", "dy_m", "dheading_rad")
    told: dict[str, float | int] = {"mark": identity}
    told |= {name: float(value) for name, value in zip(names, error, strict=True)}
    return told | {f"{name}_sigma": float(value) for name, value in zip(names, sigma, strict=True)}
