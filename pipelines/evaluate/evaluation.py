"""Compares a trajectory with its reference: pairs by time, alignment, errors, consistency, waypoints.

What comes out is the ``logpose.evaluation/1`` of ``logpose evaluate --json`` and of ``result.evaluation`` in a report::

    {"matched": n, "reference_total": n, "estimate_total": n, "ate": {"rmse_m": .., "rmse_rad": .., ..},
     "rpe": {..}, "lost": {..}, "alignment": {..}, "consistency": {..}, "waypoints": [..], "waypoint_summary": {..}}

The figures equal those of evo 1.38 where it has them and every pose has one partner.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import field_validator

from ...formats.errors import FormatError
from ...formats.maps.waypoints import Waypoint
from ...formats.products import Trajectory
from ...formats.trajectories.poses import check_trajectory
from ..engine.params import Field, InputPath, Params
from ..geometry import so3
from ..geometry.angles import Array
from .align import Alignment, align
from .associate import Track, associate, interpolate
from .consistency import consistency
from .errors import Delta, longest_loss, relative_errors, rotation_errors, statistics, translation_errors
from .waypoints import passes, summary

SCHEMA = "logpose.evaluation/1"


class EvaluateParams(Params):
    """How a trajectory is compared with its reference."""

    source: str = Field(
        "", description="name of the estimator whose poses are scored; empty is the first one that gives any"
    )
    align: Literal["none", "origin", "se2", "se3", "sim3"] = Field(
        "none", description="motion that lays the estimate onto the reference first"
    )
    max_diff_s: float = Field(0.01, ge=0, description="largest difference of the stamps of a pair [s]")
    interpolate: bool = Field(
        default=False, description="interpolate the reference at the stamps of the estimate instead of pairing"
    )
    max_gap_s: float = Field(0.2, gt=0, description="largest gap of the reference that is interpolated across [s]")
    delta: str = Field("1f", description="step of the relative error: frames, like 1f, or metres of path, like 10m")
    lost_m: float = Field(1.0, gt=0, description="an estimate further off than this is lost [m]")
    lost_s: float = Field(10.0, ge=0, description="if it stays so for longer than this, the run is lost [s]")
    waypoints: InputPath | None = Field(None, description="waypoints.yaml, at whose passes the error is tabulated")
    waypoint_radius_m: float = Field(
        1.0, gt=0, description="a waypoint that the reference stays further away from was not passed [m]"
    )

    @field_validator("delta")
    @classmethod
    def _is_step(cls, text: str) -> str:
        Delta.parse(text)
        return text


@dataclass(frozen=True, slots=True)
class Evaluation:
    """The figures, and the errors they were made of.

    Attributes:
        result: JSON-ready.
        reference: the paired poses of the reference.
        estimate: the paired poses of the estimate, aligned.
        errors: (N,) distances [m] of the pairs.
    """

    result: Mapping[str, object]
    reference: Track
    estimate: Track
    errors: Array

    def to_json(self) -> dict[str, object]:
        """Return the whole object with its schema."""
        return {"schema": SCHEMA, "result": dict(self.result)}


def evaluate(
    reference: Trajectory, estimate: Trajectory, params: EvaluateParams, waypoints: Sequence[Waypoint] | None = None
) -> Evaluation:
    """Compare a trajectory with its reference.

    Args:
        reference: the truth, stamps not decreasing.
        estimate: what is scored, stamps not decreasing.
        params: how.
        waypoints: what stands in the file ``params.waypoints``; None: no passes are sought.

    Raises:
        FormatError: one of them is empty, unsorted or holds what is no number (the pose is named); no poses match
            (both time ranges are given); or the poses do not fix the alignment.
    """
    delta = Delta.parse(params.delta)
    try:
        truth, guess = _track(reference, "the reference"), _track(estimate, "the estimate")
        paired_truth, paired = _pairs(truth, guess, params)
        alignment = align(paired_truth, paired, params.align)
    except ValueError as err:
        raise FormatError(f"evaluate: {err}. Check both trajectories.") from err
    aligned = alignment.apply(paired)
    errors = translation_errors(paired_truth, aligned)
    steps_m, steps_rad = relative_errors(paired_truth, aligned, delta)
    result: dict[str, object] = {
        "matched": len(paired.stamps),
        "reference_total": len(reference),
        "estimate_total": len(estimate),
        "reference_repeats": int(np.count_nonzero(np.diff(reference.stamps) == 0)),
        "estimate_repeats": int(np.count_nonzero(np.diff(estimate.stamps) == 0)),
        "duration_s": int(paired.stamps[-1] - paired.stamps[0]) / 1e9,
        "length_m": float(np.linalg.norm(np.diff(paired_truth.positions, axis=0), axis=1).sum()),
        "max_gap_s": int(np.diff(paired.stamps).max(initial=0)) / 1e9,
        "alignment": _alignment(alignment, params.align),
        "ate": statistics(errors, "m") | statistics(rotation_errors(paired_truth, aligned), "rad"),
        "rpe": {"delta": params.delta, "pairs": len(steps_m)} | statistics(steps_m, "m") | statistics(steps_rad, "rad"),
        "lost": _lost(paired, errors, params),
    }
    if paired.covariances is not None and params.align == "none":
        result["consistency"] = consistency(paired_truth, paired)
    if waypoints is not None:
        places = [(w.name, w.x, w.y) for w in waypoints]
        found = passes(truth, alignment.apply(guess), places, params.waypoint_radius_m)
        result["waypoints"] = [p.to_json() for p in found]
        result["waypoint_summary"] = summary(found)
    return Evaluation(result, paired_truth, aligned, errors)


def _track(trajectory: Trajectory, name: str) -> Track:
    if len(trajectory) == 0:
        raise ValueError(f"{name} has no poses")
    try:
        check_trajectory(trajectory, allow_repeats=True)
    except ValueError as err:
        raise ValueError(f"{name}: {err}") from err
    rotations = trajectory.matrices if trajectory.matrices is not None else so3.as_matrix(trajectory.orientations)
    return Track(trajectory.stamps, trajectory.positions, rotations, trajectory.covariances)


def _pairs(truth: Track, guess: Track, params: EvaluateParams) -> tuple[Track, Track]:
    if params.interpolate:
        paired = interpolate(truth, guess, round(params.max_gap_s * 1e9))
        rule = f"inside the reference with gaps up to {params.max_gap_s:g} s"
    else:
        paired = associate(truth, guess, round(params.max_diff_s * 1e9))
        rule = f"within {params.max_diff_s:g} s"
    if len(paired[0].stamps) == 0:
        ranges = [f"{t.stamps[0] * 1e-9:.3f} to {t.stamps[-1] * 1e-9:.3f} s" for t in (truth, guess)]
        raise ValueError(f"no poses match {rule}: the reference goes from {ranges[0]}, the estimate from {ranges[1]}")
    return paired


def _alignment(alignment: Alignment, method: str) -> dict[str, object]:
    return {
        "method": method,
        "rotation_xyzw": so3.from_matrix(alignment.rotation).tolist(),
        "translation_m": alignment.translation.tolist(),
        "scale": alignment.scale,
    }


def _lost(paired: Track, errors: Array, params: EvaluateParams) -> dict[str, object]:
    longest = longest_loss(paired.stamps, errors, params.lost_m)
    return {
        "threshold_m": params.lost_m,
        "after_s": params.lost_s,
        "longest_s": longest,
        "is_lost": longest > params.lost_s,
    }
