"""Stripe marks in the log of a run: the map, what was seen as JSON, edges over the image, and each mark's pose.

The pose of a mark is given in the frame of the robot, which is in the tree of frames, on a topic of its own: a pose
does not say whose it is. Its X axis points along the mark to the viewer's right, Z up. What no image shows, its height
and lean, is zero.
"""

from dataclasses import replace

import numpy as np

from ....formats.encode import header, pose_fields
from ....formats.events import Array, Event, MarkSighting
from ....formats.foxglove import IMAGE_ANNOTATIONS, SCENE_UPDATE, mark_annotations, mark_scene
from ....formats.products import MarkMap
from ....formats.write_log import LogWriter
from ...geometry import se2
from ...geometry.angles import quaternion_from_yaw
from ...odometry.poses import planar_covariance
from .kept import USED


class MarkRecorder:
    """Writes the map before the first message, then what belongs to each event.

    All edges of an image are one message, so it is written when the image's last sighting has passed.
    """

    def __init__(self, log: LogWriter, marks: MarkMap | None, base_frame: str) -> None:
        self._log = log
        self._marks = marks
        self._base_frame = base_frame
        self._has_scene = marks is None
        self._group: list[MarkSighting] = []

    def take(self, event: Event) -> None:
        """Write what belongs in the log of one event."""
        if not self._has_scene and self._marks is not None:
            self._log.write_message("/marks", SCENE_UPDATE, event.stamp, mark_scene(self._marks, event.stamp))
            self._has_scene = True
        if self._group and event.stamp != self._group[0].stamp:
            self.end()
        if isinstance(event, MarkSighting):
            self._log.write(replace(event, topic=f"/{event.source}/sightings"))
            self._pose(event)
            self._group.append(event)

    def end(self) -> None:
        """Write the edges of the image that has ended; also when there are none, to clear those of the one before."""
        if self._group:
            first = self._group[0]
            topic = f"/{first.source}/annotations"
            self._log.write_message(topic, IMAGE_ANNOTATIONS, first.stamp, mark_annotations(self._group, self._marks))
        self._group = []

    def _pose(self, event: MarkSighting) -> None:
        known = () if self._marks is None else self._marks.marks
        place = next((mark.pose for mark in known if mark.id == event.mark), None)
        if place is None or event.status not in USED or not np.isfinite(event.robot).all():
            return
        base_T_mark = se2.between(event.robot, place)
        fields = {
            "header": header(event.stamp, self._base_frame),
            "pose": {
                "pose": pose_fields(np.array([*base_T_mark[:2], 0.0]), quaternion_from_yaw(float(base_T_mark[2]))),
                "covariance": mark_covariance(event, float(base_T_mark[2])),
            },
        }
        topic = f"/{event.source}/mark_{event.mark}/pose"
        self._log.write_message(topic, "geometry_msgs/msg/PoseWithCovarianceStamped", event.stamp, fields)


def mark_covariance(event: MarkSighting, yaw: float) -> Array:
    """Return the covariance of a mark's pose in the frame of the robot: (6, 6) of x, y, z, roll, pitch, yaw.

    Args:
        event: whose covariance is that of phi, D_x, D_y in the level camera frame.
        yaw: of the mark in the frame of the robot [rad]; the level camera frame is turned against it by yaw - phi.
    """
    turn = np.zeros((3, 3))
    turn[:2, 1:] = se2.rotation(yaw - float(event.pose[0]))
    turn[2, 0] = 1.0
    return planar_covariance(turn @ event.cov @ turn.T)
