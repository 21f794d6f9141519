"""UTIAS MRCLAM: five robots among fifteen barcode posts, as the log of one robot that cannot read barcodes.

``/odom`` holds the commanded speeds, ``/sightings`` every post and every other robot that was seen, without ids (the
robots are false landmarks), ``/ground_truth/sightings`` the same with the ids of the posts. What the recordings need:

- Clocks. A command acts about 0.20 s after its stamp (set 9: 0.05 to 0.1 s), a sighting is stamped about 0.05 s late;
  the log is on the clock of the truth. Both shifts were read off by scanning for the least residual on sets 1 and 6.
- Noise of a sighting: range sigma 0.035 m + 0.148 r, bearing sigma 0.017 rad, and 0.014 m more in x and y. Tuned on
  sets 1 and 6 with the true ids. Far larger than the scatter of the ranges, since their errors are systematic.
- Barcodes that were swapped in the file (set 1: subjects 11 and 17): found where the sightings of two posts land on
  each other, given the truth, and corrected.
- Truth: headings that were interpolated across +-pi are replaced by the circular median of five; rows that repeat a
  stamp or go back are left out or sorted, and counted.

Source: K. Y. K. Leung, Y. Halpern, T. D. Barfoot, H. H. T. Liu, "The UTIAS multi-robot cooperative localization and
mapping dataset", International Journal of Robotics Research 30(8), 2011.
"""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..errors import ConfigError
from ..events import NO_ID, Array, Odometry, Sightings
from ..products import LandmarkMap
from .imported import (
    Imported,
    Stamps,
    blind,
    identified,
    initial_pose,
    sightings,
    true_poses,
    true_trajectory,
    write_all,
)
from .mrclam_files import Measurements, read_barcodes, read_measurements, read_odometry, read_posts, read_truth

N_ROBOTS = 5
ODOMETRY_SHIFT_NS = 200_000_000
SIGHTINGS_SHIFT_NS = -50_000_000
"""What brings the stamps of commands and of sightings onto the clock of the truth."""

RANGE_SIGMA_M = 0.035
RANGE_SIGMA_SHARE = 0.148
BEARING_SIGMA_RAD = 0.017
FLOOR_SIGMA_M = 0.014
SPIKE_RAD = 0.1
"""At 25 Hz no robot turns as far from one sample to the next."""

SWAP_MIN_SIGHTINGS = 5
SWAP_RATIO = 0.25
"""Two posts were swapped if the median sighting of each lies this much nearer to the other."""


def convert_mrclam(source: str | Path, out_path: str | Path, *, robot: int = 1) -> Imported:
    """Write the log of one robot, ``<stem>.landmarks.yaml`` and ``<stem>.truth.tum`` beside it.

    The log begins with the first command that the truth covers; ``/initialpose`` is the truth there.

    Args:
        source: folder of one set as published (``Barcodes.dat``, ``Landmark_Groundtruth.dat``, ``Robot1_*.dat``).
        out_path: log to write, ``.mcap`` or ``.bag``.
        robot: 1 to 5.

    Raises:
        ConfigError: there is no such robot.
        FormatError: a file is missing, or a line is not what it should be (it is named).
    """
    folder = Path(source)
    if not 1 <= robot <= N_ROBOTS:
        raise ConfigError(f"{folder}: there is no robot {robot}. MRCLAM has 1 to {N_ROBOTS}.")
    counts: Counter[str] = Counter()
    landmarks = read_posts(folder / "Landmark_Groundtruth.dat")
    subjects = read_barcodes(folder / "Barcodes.dat")
    truth_stamps, truth = read_truth(folder / f"Robot{robot}_Groundtruth.dat", counts)
    truth[:, 2] = without_spikes(truth[:, 2], counts)
    stamps, speeds = read_odometry(folder / f"Robot{robot}_Odometry.dat", counts)
    seen = read_measurements(folder / f"Robot{robot}_Measurement.dat", subjects, counts)
    stamps = stamps + ODOMETRY_SHIFT_NS
    seen = replace(seen, stamps=seen.stamps + SIGHTINGS_SHIFT_NS)

    swaps = swapped_posts(seen, landmarks, truth_stamps, truth)
    seen = replace(seen, subjects=np.array([swaps.get(i, i) for i in seen.subjects.tolist()], dtype=np.int64))
    start = max(int(stamps[0]), int(truth_stamps[0]))
    is_driven, is_seen = stamps >= start, seen.stamps >= start
    seen = Measurements(seen.stamps[is_seen], seen.subjects[is_seen], seen.polar[is_seen])
    events = seen_posts(seen, landmarks)
    first = pose_at(truth_stamps, truth, np.array([start]))[0]
    streams = (
        [initial_pose(start, first)],
        true_poses(truth_stamps, truth),
        odometry(stamps[is_driven], speeds[is_driven]),
        blind(events),
        identified(events),
    )
    written = write_all(out_path, streams, {".landmarks.yaml": landmarks}, true_trajectory(truth_stamps, truth))
    n_true = sum(int((e.ids != NO_ID).sum()) for e in events)
    totals = {
        "odometry messages": int(is_driven.sum()),
        "sightings messages": len(events),
        "true landmarks seen": n_true,
        "false landmarks seen (other robots, unknown barcodes)": len(seen.stamps) - n_true,
        "true poses": len(truth_stamps),
        "commands before the start, left out": int((~is_driven).sum()),
        "sightings before the start, left out": int((~is_seen).sum()),
    }
    pairs = sorted({(min(a, b), max(a, b)) for a, b in swaps.items()})
    remarks = [f"barcodes of posts {a} and {b} are swapped in the file; corrected" for a, b in pairs]
    return Imported(written, totals | dict(counts), tuple(remarks))


def odometry(stamps: Stamps, speeds: Array) -> list[Odometry]:
    """Return commands (N, 2) v [m/s], omega [rad/s] as odometry that holds speeds only."""
    return [
        Odometry(
            stamp=stamp,
            topic="/odom",
            frame_id="odom",
            linear=np.array([v, 0.0, 0.0]),
            angular=np.array([0.0, 0.0, omega]),
        )
        for stamp, (v, omega) in zip(stamps.tolist(), speeds.tolist(), strict=True)
    ]


def seen_posts(seen: Measurements, landmarks: LandmarkMap) -> list[Sightings]:
    """Return one event per stamp with all that was seen then; ids are those of posts, NO_ID for what is none."""
    ids = np.where(np.isin(seen.subjects, landmarks.ids), seen.subjects, NO_ID)
    stamps, starts = np.unique(seen.stamps, return_index=True)
    bounds = np.append(starts, len(seen.stamps))
    return sightings(stamps, bounds, xy=seen.xy, cov=covariances(seen.polar), ids=ids)


def covariances(polar: Array) -> Array:
    """Return the covariances (N, 2, 2) [m^2] of sightings (N, 2) range [m], bearing [rad] in robot coordinates."""
    r, b = polar.T
    radial = (RANGE_SIGMA_M + RANGE_SIGMA_SHARE * r) ** 2
    tangential = (BEARING_SIGMA_RAD * r) ** 2
    c, s = np.cos(b), np.sin(b)
    xy = c * s * (radial - tangential)
    floor = FLOOR_SIGMA_M**2
    xx, yy = c * c * radial + s * s * tangential + floor, s * s * radial + c * c * tangential + floor
    return np.stack([xx, xy, xy, yy], axis=-1).reshape(-1, 2, 2)


def without_spikes(headings: Array, counts: Counter[str]) -> Array:
    """Replace headings (N,) [rad] that are further than ``SPIKE_RAD`` from the circular median of the five around."""
    n = len(headings)
    around = np.clip(np.arange(n)[:, None] + np.arange(-2, 3), 0, n - 1)
    window = headings[around]
    # The circular median is the one of them whose summed distance to the others is least.
    distance = np.abs(_wrap(window[:, :, None] - window[:, None, :])).sum(axis=2)
    median = window[np.arange(n), distance.argmin(axis=1)]
    is_spike = np.abs(_wrap(headings - median)) > SPIKE_RAD
    counts["true headings repaired (interpolated across +-pi)"] += int(is_spike.sum())
    return np.where(is_spike, median, headings)


def pose_at(stamps: Stamps, poses: Array, wanted: Stamps) -> Array:
    """Interpolate poses (N, 3) x, y [m], heading [rad] at stamps (M,); the ends are held."""
    t = (wanted - stamps[0]) * 1e-9
    known = (stamps - stamps[0]) * 1e-9
    headings = np.unwrap(poses[:, 2])
    columns = [np.interp(t, known, column) for column in (poses[:, 0], poses[:, 1], headings)]
    columns[2] = _wrap(columns[2])
    return np.column_stack(columns)


def swapped_posts(seen: Measurements, landmarks: LandmarkMap, stamps: Stamps, truth: Array) -> dict[int, int]:
    """Return the ids of posts whose sightings land on each other, both ways: {a: b, b: a}."""
    x, y, heading = pose_at(stamps, truth, seen.stamps).T
    c, s = np.cos(heading), np.sin(heading)
    bx, by = seen.xy.T
    points = np.column_stack([x + c * bx - s * by, y + s * bx + c * by])
    is_covered = (seen.stamps >= stamps[0]) & (seen.stamps <= stamps[-1])
    landed: dict[int, int] = {}
    for i, identity in enumerate(landmarks.ids.tolist()):
        mine = points[is_covered & (seen.subjects == identity)]
        if len(mine) < SWAP_MIN_SIGHTINGS:
            continue
        off = np.median(np.linalg.norm(mine[:, None] - landmarks.positions[None, :, :2], axis=2), axis=0)
        nearest = int(off.argmin())
        if off[nearest] < SWAP_RATIO * off[i]:
            landed[identity] = int(landmarks.ids[nearest])
    return {a: b for a, b in landed.items() if landed.get(b) == a}


def _wrap(angles: Array) -> Array:
    return np.asarray((angles + np.pi) % (2.0 * np.pi) - np.pi)
