"""Static transforms of a log -> where each sensor is mounted on the robot."""

import numpy as np

from .events import Array, Mount, Transform
from .rotation import quaternion_from_rotation, rotation_from_quaternion

BASE = "base_link"


def frame_name(frame_id: str) -> str:
    """Return a frame's name without the leading slash that ROS 1 logs may have."""
    return frame_id.lstrip("/")


class StaticTransforms:
    """The tree of static transforms; the last one said of a pair of frames holds."""

    def __init__(self) -> None:
        self._edges: dict[str, dict[str, tuple[Array, Array]]] = {}
        self._mounts: dict[str, Mount | None] = {}

    def add(self, transform: Transform) -> None:
        """Add a transform and its inverse."""
        parent, child = frame_name(transform.frame_id), frame_name(transform.child_frame_id)
        rotation = rotation_from_quaternion(transform.rotation)
        translation = np.asarray(transform.translation, dtype=float)
        self._edges.setdefault(parent, {})[child] = (rotation, translation)
        self._edges.setdefault(child, {})[parent] = (rotation.T, -rotation.T @ translation)
        self._mounts.clear()

    def mount(self, frame_id: str) -> Mount | None:
        """Return where ``frame_id`` sits on ``base_link``, or None where the tree does not say."""
        name = frame_name(frame_id)
        if name not in self._mounts:
            self._mounts[name] = self._find(name)
        return self._mounts[name]

    def _find(self, target: str) -> Mount | None:
        if not target:
            return None
        poses: dict[str, tuple[Array, Array]] = {BASE: (np.eye(3), np.zeros(3))}
        queue = [BASE]
        while queue and target not in poses:
            frame = queue.pop(0)
            R, t = poses[frame]
            for other, (R_step, t_step) in self._edges.get(frame, {}).items():
                if other not in poses:
                    poses[other] = (R @ R_step, R @ t_step + t)
                    queue.append(other)
        if target not in poses:
            return None
        R, t = poses[target]
        return Mount(translation=t, rotation=quaternion_from_rotation(R))
