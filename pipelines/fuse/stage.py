"""The stage ``fuse-poses``: events to numbers and back; the method is ``filter.py``, and ``smoother.py`` after it."""

import math
from collections.abc import Iterator

import numpy as np

from ...formats.errors import ConfigError
from ...formats.events import INITIAL_POSE, Array, Event, MarkSighting, Notice, Odometry, Pose, Summary
from ...formats.maps.marks import read_marks
from ..geometry.motion import Increment
from ..odometry.poses import parse_start_pose, planar_pose, start_pose_of
from ..odometry.reader import OdometryReader, odometry_notices, skipped_notice
from .params import FuseParams
from .smoother import poses_along, smooth_way
from .summary import summary, summary_of_way
from .tracker import Estimate, Tracker
from .view import Seen, View

SOURCE = "stripe-pose"
"""Of the sightings, and of the poses made from them."""

STAGE = "fuse-poses"

_JUMP_S = 0.1
"""A jump of the odometry hides what the robot did for this time at least."""

MISSING_SIGHTINGS = "no sightings of stripe marks come here. Put stripe-pose before it, and images into the log."


def fuse_poses(events: Iterator[Event], params: FuseParams) -> Iterator[Event]:
    """Follow the robot by stripe marks and odometry.

    Reads MarkSighting, Odometry and the start pose; never the truth. Per image: a Pose in the frame of the marks with
    covariance (height, roll and pitch held at 1 mm and 1 mrad: a plane) and info, also where odometry alone leads to
    it; and along the odometry where there are no images for ``silence_s``. Without a start pose it begins at the first
    mark that is sure. In a log without odometry each image with a mark that is sure has a Pose of its own, others none.
    At the end a Summary.

    With ``smooth`` no Pose is made along the log: they all follow its last event, in their own order, from the smoother
    over the whole log. Kept for it are some hundred bytes per image.

    Raises:
        ConfigError: no sightings.
        ValueError: odometry or sightings are not finite, or go back in time.
        FormatError: the map cannot be read.
    """
    run = _Run(params)
    for event in events:
        yield from run.until(event.stamp)
        yield event
        run.last = max(run.last, event.stamp)
        if isinstance(event, MarkSighting) and event.source == SOURCE:
            run.sighting(event)
        elif isinstance(event, Odometry):
            yield from run.odometry(event)
        elif isinstance(event, Pose) and event.source == INITIAL_POSE:
            yield from run.start(event)
    yield from run.end()


class _Run:
    """One log."""

    def __init__(self, params: FuseParams) -> None:
        self.params = params
        marks = read_marks(params.map)
        self.frame_id = marks.frame_id
        self.ids = [mark.id for mark in marks.marks]
        self.index = {identity: i for i, identity in enumerate(self.ids)}
        self.places = np.array([mark.pose[:2] for mark in marks.marks])
        self.tracker = Tracker(self.places, params)
        jump = (params.jump_speed_m_s, params.jump_turn_rad_s)
        self.reader = OdometryReader(params.odometry_from, params.gap_s, jump)
        self.last = -(2**63)
        self.image: list[MarkSighting] = []  # the sightings of the image at hand
        self.last_image: int | None = None
        self.last_pose: int | None = None
        self.bridging: Pose | None = None
        self.is_started = params.initial_pose is not None
        if params.initial_pose is not None:
            self.tracker.start(parse_start_pose(params.initial_pose), None)

    def start(self, event: Pose) -> Iterator[Event]:
        """Take a logged start pose; a second one begins anew, as setting the pose in RViz does."""
        if self.params.initial_pose is not None:
            return
        if self.tracker.filter is not None:
            message = "the log sets the start pose again; the trajectory begins anew there."
            yield self._notice(event.stamp, "start-pose-again", message)
        self.is_started = True
        self.tracker.move(self.reader.until(event.stamp))
        self.tracker.start(*start_pose_of(event))

    def odometry(self, event: Odometry) -> Iterator[Event]:
        """Follow one message."""
        step = self.reader.read(event)
        if self.reader.count and not self.tracker.has_odometry:
            self.tracker.has_odometry = True
            step = Increment(dt=step.dt, gap=step.dt)  # what the robot did before it, nobody knows
        if self.reader.jumps:
            step = Increment(dt=step.dt, gap=max(step.dt, _JUMP_S))  # no robot drives so
        self.tracker.move(step)
        after = "the pose does not follow it and is uncertain there"
        yield from odometry_notices(self.reader, STAGE, after)
        if self.last_pose is not None and event.stamp - self.last_pose >= round(self.params.silence_s * 1e9):
            self.bridging = self._pose(event.stamp, self.tracker.guess(event.stamp))

    def sighting(self, event: MarkSighting) -> None:
        """Keep a sighting until all of its image are there."""
        if self.last_image is not None and event.stamp < self.last_image:
            back = (self.last_image - event.stamp) * 1e-9
            raise ValueError(f"sightings go back in time by {back:.9f} s. Sort them by stamp.")
        self.last_image = event.stamp
        self.image.append(event)

    def until(self, stamp: int) -> Iterator[Event]:
        """Give the poses of what is over when time has come to ``stamp`` [ns]."""
        if self.image and stamp > self.image[0].stamp:
            yield from self._look()
        if self.bridging is not None and stamp > self.bridging.stamp:
            yield from self._along(self.bridging)
            self.bridging = None

    def end(self) -> Iterator[Event]:
        """Give what is left, say what is missing, and sum up."""
        if self.last_image is None:
            raise ConfigError(f"{STAGE}: {MISSING_SIGHTINGS}")
        yield from self.until(2**63)
        if self.last_pose is None:
            yield self._notice(self.last, "no-pose", "no mark was told apart from the others; there is no pose.")
        yield from skipped_notice(self.reader, self.last, STAGE)
        yield from self._alone()
        values = summary(self.tracker, self.ids)
        history = self.tracker.history
        if history is not None and len(history):
            way = smooth_way(history, self.places, self.params)
            for stamp, estimate in poses_along(history, way):
                yield self._pose(stamp, estimate)
            values |= summary_of_way(way, self.ids, has_odometry=self.tracker.has_odometry)
        yield Summary(stamp=self.last, source=STAGE, values=values)

    def _alone(self) -> Iterator[Notice]:
        """Say what has no effect where there is no odometry."""
        vain = [
            *(["the start pose is not used"] if self.is_started else []),
            *(["there is nothing to smooth"] if self.params.smooth else []),
        ]
        if vain and not self.tracker.has_odometry:
            message = f"there is no odometry, so each image stands alone: {', and '.join(vain)}."
            yield self._notice(self.last, "no-odometry", message)

    def _look(self) -> Iterator[Event]:
        """Explain the sightings of one image."""
        stamp = self.image[0].stamp
        view = View(stamp, *(self._seen(status) for status in ("ok", "ambiguous", "unverified")))
        self.image.clear()
        self.tracker.move(self.reader.until(stamp))
        if self.bridging is not None and self.bridging.stamp == stamp:
            self.bridging = None  # an image at the same time knows better
        estimate = self.tracker.look(view)
        if estimate is not None:
            yield from self._along(self._pose(stamp, estimate))

    def _seen(self, status: str) -> list[Seen]:
        """Return the image's sightings of one status as numbers."""
        # A sighting may say where the camera is and not where the robot is: the turn of its head was not logged.
        chosen = [event for event in self.image if event.status == status and not np.all(np.isnan(event.robot))]
        for event in chosen:
            if not (np.all(np.isfinite(event.robot)) and np.all(np.isfinite(event.robot_cov))):
                raise ValueError(f"the sighting of mark {event.mark} is not finite. Leave it out, or correct it.")
            if event.mark not in self.index:
                raise ConfigError(
                    f"{self.params.map}: has no mark {event.mark}, which was seen. Name the map it was found by."
                )
        return [
            Seen(self.index[event.mark], event.robot, event.robot_cov, _span(event.lines[:, 0])) for event in chosen
        ]

    def _along(self, pose: Pose) -> Iterator[Event]:
        """Give a pose of the filter, unless the smoother will give a better one."""
        if not self.params.smooth:
            yield pose

    def _pose(self, stamp: int, estimate: Estimate) -> Pose:
        self.last_pose = stamp
        info = {"status": estimate.status, "n_seen": estimate.n_seen, "n_matched": estimate.n_matched}
        return planar_pose(
            stamp, source=SOURCE, frame_id=self.frame_id, pose=estimate.pose, cov=estimate.cov, info=info
        )

    @staticmethod
    def _notice(stamp: int, code: str, message: str) -> Notice:
        return Notice(stamp=stamp, source=STAGE, code=code, message=message)


def _span(columns: Array) -> tuple[float, float]:
    """Return the first and last column of a sighting; everything if it does not say."""
    return (float(np.min(columns)), float(np.max(columns))) if len(columns) else (-math.inf, math.inf)
