"""The run in one sentence: what was estimated, how wrong it is, how honest it says it is, what went wrong.

The error is the one ``evaluate`` found, if it was asked; otherwise that of the pictures.
"""

from collections.abc import Mapping

import numpy as np

from .deviation import deviation
from .findings import Findings
from .kinds import KINDS
from .track import DEAD_RECKON, Track


def verdict(findings: Findings) -> str:
    """Say it."""
    track = findings.primary
    said = [part for kind in KINDS for part in kind.says(findings)]
    if track is None or len(track) == 0:
        # Where sightings give no poses they are what was asked for; where they do, that there is none comes first.
        is_missed = not said or any(part.gives_poses for part in findings.kept)
        parts = ["No pose was estimated"] if is_missed else []
    else:
        parts = [_estimate(findings, track), _error(findings, track), *_status(track)]
    return "; ".join(part for part in (*parts, *said, _notices(findings)) if part) + "."


def duration_s(track: Track) -> float:
    """Return the time from the first to the last pose [s]."""
    return float(track.stamps[-1] - track.stamps[0]) / 1e9 if len(track) else 0.0


def status_shares(track: Track) -> list[tuple[str, int, float]]:
    """Return of each status its word, its number of poses and its share, in order of appearance."""
    counts = np.bincount(track.status[track.status >= 0], minlength=len(track.status_words))
    return [(word, int(n), float(n) / len(track)) for word, n in zip(track.status_words, counts, strict=True)]


def _estimate(findings: Findings, track: Track) -> str:
    n = len(track)
    if n == 1:
        return f"{track.source} estimated one pose"
    words = f"{track.source} estimated {n} poses over {duration_s(track):.1f} s"
    has_truth = findings.truth is not None and len(findings.truth) > 1
    if findings.is_by_images and not has_truth and DEAD_RECKON not in findings.estimates:
        return words  # poses of single images, which may lie anywhere, make no way
    way = findings.truth if findings.truth is not None and has_truth else track
    return f"{words} and {way.length:.1f} m of way"


def _error(findings: Findings, track: Track) -> str:
    found = evaluated_error(findings)
    if found is not None:
        rmse, largest, heading, matched, total = found
    else:
        if findings.truth is None:
            return "the truth is not known, so neither is the error"
        error = deviation(track, findings.truth)
        if not error.is_known:
            return "no pose could be compared with the truth"
        is_told = np.isfinite(error.distance)
        rmse, largest = float(np.sqrt(np.mean(error.distance[is_told] ** 2))), float(error.distance[is_told].max())
        heading, matched, total = float(np.sqrt(np.mean(error.turn[is_told] ** 2))), int(is_told.sum()), len(track)
    words = f"against the truth it is {length(rmse)} off (RMSE; at most {length(largest)})"
    if np.isfinite(heading):
        words += f" and {np.degrees(heading):.2f}° in heading"
    if found is not None and findings.aligned_by:
        words += f" after {findings.aligned_by} alignment"
    return words + (f", known for {matched} of {total} poses" if matched < total else "")


def evaluated_error(findings: Findings) -> tuple[float, float, float, int, int] | None:
    """Return RMSE [m], largest error [m], heading RMSE [rad] (nan if not told), matched and all poses, or None."""
    values, track = findings.evaluation, findings.primary
    ate = values.get("ate")
    if not isinstance(ate, Mapping) or track is None or values.get("source", track.source) != track.source:
        return None
    told = [ate.get("rmse_m"), ate.get("max_m"), ate.get("rmse_rad")]
    rmse, largest, heading = (float(v) if isinstance(v, int | float) else np.nan for v in told)
    if not np.isfinite(rmse):
        return None
    counts = [values.get("matched"), values.get("estimate_total")]
    matched, total = (int(v) if isinstance(v, int) else 0 for v in counts)
    return rmse, largest, heading, matched, total


def length(metres: float) -> str:
    """Write a length with the unit a person would say it in, three digits."""
    if not np.isfinite(metres):
        return "an unknown length"
    if metres < 0.00095:
        return f"{metres * 1000:.2f} mm"
    if metres < 0.0995:
        return f"{metres * 100:.2f} cm" if metres < 0.00995 else f"{metres * 100:.1f} cm"
    return f"{metres:.2f} m" if metres < 9.995 else f"{metres:.1f} m"


def _status(track: Track) -> list[str]:
    shares = status_shares(track)
    if not shares:
        return []
    return ["its status is " + ", ".join(f"{word} for {100 * share:.1f} %" for word, _, share in shares)]


def _notices(findings: Findings) -> str:
    total = len(findings.notices)
    if total == 0:
        return ""
    losses = sum(notice.is_loss for notice, _ in findings.notices)
    words = "one warning" if total == 1 else f"{total} warnings"
    return words + (f" ({losses} of lost data)" if losses else "")
