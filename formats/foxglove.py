"""Messages that Foxglove draws: circles over an image, landmarks in the 3-D view, lines in the log panel.

Each function returns the fields of one message of package ``foxglove_msgs``; ``DEFINITIONS`` holds what is needed of
the package, in the form that ROS distributions have released. They are ROS messages and not JSON, which Foxglove
reads as well: a log that mixes JSON and CDR is refused by ``ros2 bag play`` (rosbag2 issue 1245) and by rosbags.

Two traps: a circle has a diameter, and the origin of an image is the top left corner of the top left pixel, half a
pixel before the centre that image processing counts from.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from .events import NO_ID, Notice, Sightings
from .products import LandmarkMap

IMAGE_ANNOTATIONS = "foxglove_msgs/msg/ImageAnnotations"
SCENE_UPDATE = "foxglove_msgs/msg/SceneUpdate"
LOG = "foxglove_msgs/msg/Log"

HALF_PIXEL = 0.5
"""From the centre of a pixel to its corner [px]."""

_WARNING, _ERROR = 3, 4
_SEEN = {"r": 0.9, "g": 0.62, "b": 0.0, "a": 1.0}
_NAMED = {"r": 0.0, "g": 0.62, "b": 0.45, "a": 1.0}
_CLEAR = {"r": 0.0, "g": 0.0, "b": 0.0, "a": 0.0}
_GREY = {"r": 0.55, "g": 0.6, "b": 0.65, "a": 1.0}


def image_annotations(event: Sightings) -> dict[str, object]:
    """Draw a circle for each sighting that has a place in the image; green with its id where the landmark is known."""
    circles, texts = [], []
    time = _time(event.stamp)
    is_drawn = np.isfinite(event.uv).all(axis=1) & np.isfinite(event.radius)
    for i in np.flatnonzero(is_drawn):
        u, v = (float(x) + HALF_PIXEL for x in event.uv[i])
        radius, identity = float(event.radius[i]), int(event.ids[i])
        colour = _SEEN if identity == NO_ID else _NAMED
        circles.append(
            {
                "timestamp": time,
                "position": {"x": u, "y": v},
                "diameter": 2.0 * radius,
                "thickness": 2.0,
                "fill_color": _CLEAR,
                "outline_color": colour,
            }
        )
        if identity != NO_ID:
            texts.append(
                {
                    "timestamp": time,
                    "position": {"x": u + radius, "y": v - radius},
                    "text": str(identity),
                    "font_size": 14.0,
                    "text_color": colour,
                    "background_color": _CLEAR,
                }
            )
    return {"circles": circles, "texts": texts}


def landmark_scene(landmarks: LandmarkMap, stamp: int, diameter: float = 0.2) -> dict[str, object]:
    """Draw a map of landmarks as spheres [m] with their ids; it stays until replaced."""
    spheres, texts = [], []
    for identity, position in zip(landmarks.ids.tolist(), landmarks.positions.tolist(), strict=True):
        spheres.append({"pose": _pose(position), "size": _vector([diameter] * 3), "color": _GREY})
        x, y, z = position
        texts.append(
            {
                "pose": _pose([x, y, z + diameter]),
                "billboard": True,
                "font_size": 11.0,
                "scale_invariant": True,
                "color": _GREY,
                "text": str(identity),
            }
        )
    entity = {
        "timestamp": _time(stamp),
        "frame_id": landmarks.frame_id,
        "id": "landmarks",
        "frame_locked": True,
        "spheres": spheres,
        "texts": texts,
    }
    return {"entities": [entity]}


def log_line(event: Notice) -> dict[str, object]:
    """Say a notice in the log panel."""
    level = _ERROR if event.is_loss else _WARNING
    return {
        "timestamp": _time(event.stamp),
        "level": level,
        "message": f"{event.code}: {event.message}",
        "name": event.source,
    }


def _time(stamp: int) -> dict[str, int]:
    return {"sec": stamp // 1_000_000_000, "nanosec": stamp % 1_000_000_000}


def _vector(values: Sequence[float]) -> dict[str, float]:
    return dict(zip("xyz", (float(value) for value in values), strict=True))


def _pose(position: Sequence[float]) -> dict[str, object]:
    return {"position": _vector(position), "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}


DEFINITIONS: Mapping[str, str] = {
    "Color": "float64 r\nfloat64 g\nfloat64 b\nfloat64 a\n",
    "Point2": "float64 x\nfloat64 y\n",
    "KeyValuePair": "string key\nstring value\n",
    "CircleAnnotation": (
        "builtin_interfaces/Time timestamp\nfoxglove_msgs/Point2 position\nfloat64 diameter\nfloat64 thickness\n"
        "foxglove_msgs/Color fill_color\nfoxglove_msgs/Color outline_color\n"
    ),
    "PointsAnnotation": (
        "builtin_interfaces/Time timestamp\nuint8 UNKNOWN=0\nuint8 POINTS=1\nuint8 LINE_LOOP=2\nuint8 LINE_STRIP=3\n"
        "uint8 LINE_LIST=4\nuint8 type\nfoxglove_msgs/Point2[] points\nfoxglove_msgs/Color outline_color\n"
        "foxglove_msgs/Color[] outline_colors\nfoxglove_msgs/Color fill_color\nfloat64 thickness\n"
    ),
    "TextAnnotation": (
        "builtin_interfaces/Time timestamp\nfoxglove_msgs/Point2 position\nstring text\nfloat64 font_size\n"
        "foxglove_msgs/Color text_color\nfoxglove_msgs/Color background_color\n"
    ),
    "ImageAnnotations": (
        "foxglove_msgs/CircleAnnotation[] circles\nfoxglove_msgs/PointsAnnotation[] points\n"
        "foxglove_msgs/TextAnnotation[] texts\n"
    ),
    "SceneEntityDeletion": (
        "builtin_interfaces/Time timestamp\nuint8 MATCHING_ID=0\nuint8 ALL=1\nuint8 type\nstring id\n"
    ),
    "ArrowPrimitive": (
        "geometry_msgs/Pose pose\nfloat64 shaft_length\nfloat64 shaft_diameter\nfloat64 head_length\n"
        "float64 head_diameter\nfoxglove_msgs/Color color\n"
    ),
    "CubePrimitive": "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 size\nfoxglove_msgs/Color color\n",
    "SpherePrimitive": "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 size\nfoxglove_msgs/Color color\n",
    "CylinderPrimitive": (
        "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 size\nfloat64 bottom_scale\nfloat64 top_scale\n"
        "foxglove_msgs/Color color\n"
    ),
    "LinePrimitive": (
        "uint8 LINE_STRIP=0\nuint8 LINE_LOOP=1\nuint8 LINE_LIST=2\nuint8 type\ngeometry_msgs/Pose pose\n"
        "float64 thickness\nbool scale_invariant\ngeometry_msgs/Point[] points\nfoxglove_msgs/Color color\n"
        "foxglove_msgs/Color[] colors\nuint32[] indices\n"
    ),
    "TriangleListPrimitive": (
        "geometry_msgs/Pose pose\ngeometry_msgs/Point[] points\nfoxglove_msgs/Color color\n"
        "foxglove_msgs/Color[] colors\nuint32[] indices\n"
    ),
    "TextPrimitive": (
        "geometry_msgs/Pose pose\nbool billboard\nfloat64 font_size\nbool scale_invariant\n"
        "foxglove_msgs/Color color\nstring text\n"
    ),
    "ModelPrimitive": (
        "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 scale\nfoxglove_msgs/Color color\nbool override_color\n"
        "string url\nstring media_type\nuint8[] data\n"
    ),
    "SceneEntity": (
        "builtin_interfaces/Time timestamp\nstring frame_id\nstring id\nbuiltin_interfaces/Duration lifetime\n"
        "bool frame_locked\nfoxglove_msgs/KeyValuePair[] metadata\nfoxglove_msgs/ArrowPrimitive[] arrows\n"
        "foxglove_msgs/CubePrimitive[] cubes\nfoxglove_msgs/SpherePrimitive[] spheres\n"
        "foxglove_msgs/CylinderPrimitive[] cylinders\nfoxglove_msgs/LinePrimitive[] lines\n"
        "foxglove_msgs/TriangleListPrimitive[] triangles\nfoxglove_msgs/TextPrimitive[] texts\n"
        "foxglove_msgs/ModelPrimitive[] models\n"
    ),
    "SceneUpdate": "foxglove_msgs/SceneEntityDeletion[] deletions\nfoxglove_msgs/SceneEntity[] entities\n",
    "Log": (
        "builtin_interfaces/Time timestamp\nuint8 UNKNOWN=0\nuint8 DEBUG=1\nuint8 INFO=2\nuint8 WARNING=3\n"
        "uint8 ERROR=4\nuint8 FATAL=5\nuint8 level\nstring message\nstring name\nstring file\nuint32 line\n"
    ),
}
"""Message definitions of package ``foxglove_msgs``, by name."""
