"""The stage ``localize-pf``: events to arrays and back; the method is ``filter.py`` (or ``paper.py``)."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ...formats.errors import ConfigError
from ...formats.events import INITIAL_POSE, NO_ID, TRUE_SIGHTINGS, Event, Notice, Odometry, Pose, Sightings, Summary
from ...formats.maps.landmarks import read_landmarks
from ..odometry.poses import MISSING_START_POSE, parse_start_pose, planar_pose, start_pose_of
from ..odometry.reader import MISSING_ODOMETRY, OdometryReader, odometry_notices, skipped_notice
from .association import CLUTTER, Indices
from .localizer import Estimate, Localizer
from .params import LocalizePfParams

SOURCE = "localize-pf"

_PATIENCE_NS = 5_000_000_000
"""A log whose images have run for so long without odometry or start pose is not going to have them."""

_FAR = 10.0
"""A map that never comes nearer than this many times the farthest sighting cannot be in metres."""


MISSING_SIGHTINGS = (
    "no images and no sightings in the log. Name their topic with --topic image=/NAME or --topic sightings=/NAME, or "
    "pass --sightings FILE."
)
MISSING_TRUE = "no sightings with true ids in the log. Name their topic with --topic true_sightings=/NAME."
TWICE = (
    "both images and sightings in the log. Choose with --topic image=none or --topic sightings=none which of them "
    "to use."
)


def localize_pf(events: Iterator[Event], params: LocalizePfParams) -> Iterator[Event]:
    """Follow the robot on a known map of landmarks that look alike, from sightings and odometry.

    Reads Odometry, Sightings (of ``detect-circles`` or the log; with ``association: given`` the true ones)
    and the start pose; never the truth. Per Sightings: a Pose in ``map`` with covariance (height, roll and
    pitch held at 1 mm and 1 mrad: a plane) and info, and the sightings with their ids. Where the log has no
    sightings for ``silence_s``, poses follow the odometry. At the end a Summary.

    Covariances of landmarks in the map are averaged, over the whole map and both axes, into one variance of
    the survey; without them it is ``map_sigma_m`` squared.

    Raises:
        ConfigError: no start pose, no odometry, no sightings, or a map that cannot be in metres.
        ValueError: odometry or sightings are not finite, or go back in time.
        FormatError: the map cannot be read.
    """
    run = _Run(params)
    for event in events:
        yield from run.bridge(event.stamp)
        yield event
        run.last = max(run.last, event.stamp)
        if isinstance(event, Odometry):
            yield from run.odometry(event)
        elif isinstance(event, Sightings) and event.source in run.roles:
            yield from run.image(event)
        elif isinstance(event, Pose) and event.source == INITIAL_POSE:
            yield from run.start(event)
    yield from run.end()


class _Run:
    """One log."""

    def __init__(self, params: LocalizePfParams) -> None:
        self.params = params
        landmarks = read_landmarks(params.map)
        self.ids = landmarks.ids
        self.index = {int(identity): i for i, identity in enumerate(landmarks.ids)}
        variance = params.map_sigma_m**2
        if landmarks.covariances is not None:
            variance = float(np.mean(landmarks.covariances[:, [0, 1], [0, 1]]))
        self.localizer = Localizer(landmarks.positions[:, :2], variance, params)
        self.reader = OdometryReader(
            params.odometry_from, params.gap_s, jump=(params.jump_speed_m_s, params.jump_turn_rad_s)
        )
        given = params.association == "given"
        self.roles = {TRUE_SIGHTINGS} if given else {"detect-circles", "sightings"}
        self.last = -(2**63)
        self.first_image: int | None = None
        self.last_image: int | None = None
        self.last_pose: int | None = None
        self.bridging: Pose | None = None
        self.source = ""  # of the sightings
        self.n_before_start = 0
        if params.initial_pose is not None:
            self.localizer.start(parse_start_pose(params.initial_pose), None)

    def start(self, event: Pose) -> Iterator[Event]:
        """Take a logged start pose; a second one begins anew, as setting the pose in RViz does."""
        if self.params.initial_pose is not None:
            return
        if self.localizer.is_started:
            message = "the log sets the start pose again; localisation begins anew there."
            yield Notice(stamp=event.stamp, source=SOURCE, code="start-pose-again", message=message)
        self.reader.until(event.stamp)
        self.localizer.start(*start_pose_of(event))

    def odometry(self, event: Odometry) -> Iterator[Event]:
        """Follow one message."""
        self.localizer.move(self.reader.read(event))
        after = "poses after it are wrong until the map corrects them"
        yield from odometry_notices(self.reader, SOURCE, after)
        if self.last_pose is None or not self.localizer.is_started:
            return
        if event.stamp - self.last_pose >= round(self.params.silence_s * 1e9):
            self.bridging = self._pose(event.stamp, self.localizer.guess(), 0)

    def bridge(self, stamp: int) -> Iterator[Event]:
        """Give the pose that follows odometry alone, once time has gone on and no image came with it."""
        if self.bridging is not None and stamp > self.bridging.stamp:
            yield self.bridging
            self.bridging = None

    def image(self, event: Sightings) -> Iterator[Event]:
        """Explain one image's sightings."""
        self._check(event)
        if not self.localizer.is_started:
            self.n_before_start += 1
            return
        self.bridging = None  # an image at the same time knows better
        self.localizer.move(self.reader.until(event.stamp))
        given = None
        if self.params.association == "given":
            given = np.array([self.index.get(int(i), CLUTTER) for i in event.ids], dtype=np.intp)
        estimate = self.localizer.look(event.stamp, event.xy, event.cov, given)
        yield self._pose(event.stamp, estimate, len(event.xy))
        yield replace(event, source=SOURCE, topic="", ids=self._names(estimate.matches))

    def end(self) -> Iterator[Event]:
        """Say what is missing, or sum up."""
        if self.first_image is None:
            raise ConfigError(f"{SOURCE}: {MISSING_TRUE if 'true_sightings' in self.roles else MISSING_SIGHTINGS}")
        self._complain()
        if self.bridging is not None:
            yield self.bridging
        yield from skipped_notice(self.reader, self.last, SOURCE)
        tally = self.localizer.tally
        yield from self._nothing_matched()
        values = {"method": self.params.method, **tally.values(), "n_before_start": self.n_before_start}
        yield Summary(stamp=self.last, source=SOURCE, values=values)

    def _check(self, event: Sightings) -> None:
        """Refuse sightings that cannot be used, and a log in which something is missing for too long."""
        if event.source != (self.source or event.source):
            raise ConfigError(f"{SOURCE}: {TWICE}")
        self.source = event.source
        if not (np.all(np.isfinite(event.xy)) and np.all(np.isfinite(event.cov))):
            raise ValueError("sightings are not finite. Correct x_m, y_m and cov_m2 there, or leave them out.")
        if self.last_image is not None and event.stamp < self.last_image:
            back = (self.last_image - event.stamp) * 1e-9
            raise ValueError(f"sightings go back in time by {back:.9f} s. Sort them by stamp.")
        if self.first_image is None:
            self.first_image = event.stamp
        self.last_image = event.stamp
        if event.stamp - self.first_image > _PATIENCE_NS:
            self._complain()

    def _complain(self) -> None:
        if not self.localizer.is_started:
            raise ConfigError(f"{SOURCE}: {MISSING_START_POSE}")
        if self.reader.count == 0:
            raise ConfigError(f"{SOURCE}: {MISSING_ODOMETRY}")

    def _nothing_matched(self) -> Iterator[Event]:
        """Tell a map in other units from a robot that saw nothing."""
        tally = self.localizer.tally
        if tally.any_matched or tally.farthest_sighting_m == 0.0:
            return
        if tally.nearest_landmark_m > _FAR * tally.farthest_sighting_m:
            raise ConfigError(
                f"{self.params.map}: the nearest landmark is {tally.nearest_landmark_m:.1f} m away, no sighting is "
                f"farther than {tally.farthest_sighting_m:.1f} m and odometry travels {tally.way_m:.1f} m. "
                "Give the map in metres, in the frame of the start pose."
            )
        message = "no sighting was found in the map; every pose is dead reckoning."
        yield Notice(stamp=self.last, source=SOURCE, code="nothing-matched", message=message)

    def _names(self, matches: Indices) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
        return np.array([NO_ID if m == CLUTTER else self.ids[m] for m in matches], dtype=np.int64)

    def _pose(self, stamp: int, estimate: Estimate, n_seen: int) -> Pose:
        self.last_pose = stamp
        info = {
            "status": estimate.status,
            "n_seen": n_seen,
            "n_matched": int(np.sum(estimate.matches != CLUTTER)),
            "ess": None if math.isnan(estimate.ess) else estimate.ess,
            "elsewhere": estimate.elsewhere,
        }
        return planar_pose(stamp, source=SOURCE, frame_id="map", pose=estimate.pose, cov=estimate.cov, info=info)
