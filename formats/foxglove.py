"""Messages that Foxglove draws: circles and edges over an image, landmarks and marks in the 3-D view, log lines.

Each function returns the fields of one message of package ``foxglove_msgs``; ``DEFINITIONS`` holds what is needed of
the package, in the form that ROS distributions have released. They are ROS messages and not JSON, which Foxglove
reads as well: a log that mixes JSON and CDR is refused by ``ros2 bag play`` (rosbag2 issue 1245) and by rosbags.

Two traps: a circle has a diameter, and the origin of an image is the top left corner of the top left pixel, half a
pixel before the centre that image processing counts from.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from .events import NO_ID, Array, MarkSighting, Notice, Sightings
from .products import LandmarkMap, MarkMap, StripeMark

IMAGE_ANNOTATIONS = "foxglove_msgs/msg/ImageAnnotations"
SCENE_UPDATE = "foxglove_msgs/msg/SceneUpdate"
LOG = "foxglove_msgs/msg/Log"

HALF_PIXEL = 0.5
"""From the centre of a pixel to its corner [px]."""

_WARNING, _ERROR = 3, 4
_LINE_LIST_2D, _LINE_LIST_3D = 4, 2  # of PointsAnnotation and of LinePrimitive
_SEEN = {"r": 0.9, "g": 0.62, "b": 0.0, "a": 1.0}
_NAMED = {"r": 0.0, "g": 0.62, "b": 0.45, "a": 1.0}
_CLEAR = {"r": 0.0, "g": 0.0, "b": 0.0, "a": 0.0}
_FALLING = {"r": 0.9, "g": 0.62, "b": 0.0, "a": 1.0}
_RISING = {"r": 0.34, "g": 0.71, "b": 0.91, "a": 1.0}
_ROW = {"r": 0.84, "g": 0.37, "b": 0.0, "a": 1.0}
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


def mark_annotations(events: Sequence[MarkSighting], marks: MarkMap | None = None) -> dict[str, object]:
    """Draw all edges found in one image, each over the rows it was seen in, the row they are measured at, and words.

    Edges from dark to bright are blue, from bright to dark orange; what belongs to no mark that is known is grey.

    Args:
        events: of one image, at least one.
        marks: that they may be; without them it is not known which edge is which, and those of a mark are blue.
    """
    time = _time(events[0].stamp)
    points, texts = [], []
    for event in events:
        ends = event.ends + HALF_PIXEL
        is_drawn = np.isfinite(ends).all(axis=(1, 2))
        if not is_drawn.any():
            continue
        ends, colours = ends[is_drawn], [_edge_colour(event, int(i), marks) for i in np.flatnonzero(is_drawn)]
        left, right = float(ends[:, :, 0].min()), float(ends[:, :, 0].max())
        row = np.array([[left, event.row + HALF_PIXEL], [right, event.row + HALF_PIXEL]])
        points.append(_lines(time, ends.reshape(-1, 2), colours))
        points.append(_lines(time, row, [_ROW]))
        texts.append(
            {
                "timestamp": time,
                "position": {"x": left, "y": float(ends[:, :, 1].min()) - 4.0},
                "text": _mark_words(event),
                "font_size": 14.0,
                "text_color": _NAMED if event.status == "ok" else _SEEN,
                "background_color": _CLEAR,
            }
        )
    return {"points": points, "texts": texts}


BAR_HEIGHT_M = 0.3
"""Of bars whose height is not known."""


def mark_scene(marks: MarkMap, stamp: int) -> dict[str, object]:
    """Draw a map of stripe marks: the outline of every bar, an arrow to the viewer's side, the id over it.

    The map does not say how high above the floor they hang: they stand on it.

    Args:
        marks: where they are.
        stamp: of the message [ns].
    """
    entities = []
    for mark in marks.marks:
        top = BAR_HEIGHT_M if mark.height is None else mark.height
        heading = float(mark.pose[2])
        x, y = mark.pose[:2] + 0.5 * (mark.edges[0] + mark.edges[-1]) * np.array([np.cos(heading), np.sin(heading)])
        facing = heading - np.pi / 2
        arrow = {
            "pose": {**_pose([x, y, 0.5 * top]), "orientation": _yaw(facing)},
            "shaft_length": 0.15,
            "shaft_diameter": 0.01,
            "head_length": 0.05,
            "head_diameter": 0.03,
            "color": _NAMED,
        }
        text = {
            "pose": _pose([x, y, top + 0.1]),
            "billboard": True,
            "font_size": 11.0,
            "scale_invariant": True,
            "color": _GREY,
            "text": str(mark.id),
        }
        line = {
            "type": _LINE_LIST_3D,
            "pose": _pose([0.0, 0.0, 0.0]),
            "thickness": 2.0,
            "scale_invariant": True,
            "points": [_vector(point) for point in _bar_outlines(mark, top)],
            "color": _NAMED,
        }
        entities.append(
            {
                "timestamp": _time(stamp),
                "frame_id": marks.frame_id,
                "id": f"mark_{mark.id}",
                "frame_locked": True,
                "arrows": [arrow],
                "lines": [line],
                "texts": [text],
            }
        )
    return {"entities": entities}


def log_line(event: Notice) -> dict[str, object]:
    """Say a notice in the log panel."""
    level = _ERROR if event.is_loss else _WARNING
    return {
        "timestamp": _time(event.stamp),
        "level": level,
        "message": f"{event.code}: {event.message}",
        "name": event.source,
    }


def _lines(time: dict[str, int], points: Array, colours: Sequence[Mapping[str, float]]) -> dict[str, object]:
    """Draw separate lines over an image: (2 N, 2) points, two for each of N colours."""
    return {
        "timestamp": time,
        "type": _LINE_LIST_2D,
        "points": [{"x": float(x), "y": float(y)} for x, y in points],
        "outline_color": colours[0],
        "outline_colors": list(colours),
        "fill_color": _CLEAR,
        "thickness": 1.5,
    }


def _edge_colour(event: MarkSighting, i: int, marks: MarkMap | None) -> Mapping[str, float]:
    member = int(event.members[i])
    if event.mark == NO_ID or member < 0:
        return _GREY
    mark = next((m for m in marks.marks if m.id == event.mark), None) if marks is not None else None
    return _RISING if mark is None or mark.polarity[member] > 0 else _FALLING


def _mark_words(event: MarkSighting) -> str:
    name = "no mark" if event.mark == NO_ID else str(event.mark)
    words = name if event.status == "ok" else f"{name} ({event.status})"
    if not np.isfinite(event.pose).all():
        return words
    phi, dx, dy = event.pose
    return f"{words}: {np.hypot(dx, dy):.2f} m, {np.degrees(phi):.1f}°"


def _bar_outlines(mark: StripeMark, top: float) -> list[list[float]]:
    """Return the outlines of all bars as pairs of points, four lines each; of a bar without a width its left edge."""
    along = np.array([np.cos(mark.pose[2]), np.sin(mark.pose[2])])
    found = []
    for left, width in zip(mark.lines, np.zeros(len(mark.lines)) if mark.bars is None else mark.bars, strict=True):
        (ax, ay), (bx, by) = (mark.pose[:2] + at * along for at in (left, left + width))
        corners = [[ax, ay, 0.0], [bx, by, 0.0], [bx, by, top], [ax, ay, top]]
        found += [corner for i in range(4) for corner in (corners[i - 1], corners[i])]
    return found


def _yaw(heading: float) -> dict[str, float]:
    return {"x": 0.0, "y": 0.0, "z": float(np.sin(heading / 2)), "w": float(np.cos(heading / 2))}


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
