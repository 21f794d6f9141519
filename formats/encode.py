"""Events -> ROS messages: the counterpart of ``messages.py``.

``as_message`` gives the type and the fields of a message as a nested mapping in ROS 2 names; ``Encoder`` makes bytes of
it for ROS 1 or ROS 2, filling what is not given with zeros. What an event does not know is written as ROS says "not
known": a covariance that starts with -1.
"""

from collections.abc import Callable, Mapping
from functools import cached_property, partial
from typing import Any, Literal

import numpy as np

from .calibration import Calibration
from .events import (
    Array,
    CameraInfo,
    Event,
    Image,
    Imu,
    JointState,
    LaserScan,
    MarkSighting,
    Odometry,
    Pose,
    Range,
    Sightings,
    Transform,
)
from .foxglove import DEFINITIONS
from .mark_poses import mark_pose_line
from .sightings import sightings_line
from .text import NANOSECONDS
from .topics import STRING

Fields = Mapping[str, Any]

TF_MESSAGE = "tf2_msgs/msg/TFMessage"
_MAX_SECONDS = {"ros1": 2**32, "ros2": 2**31}


def as_message(event: Event) -> tuple[str, Fields]:
    """Return (ROS type, fields) of an event.

    Raises:
        ValueError: there is no ROS message for it.
    """
    for kind, encode in _ENCODERS.items():
        if isinstance(event, kind):
            return encode(event)
    raise ValueError(f"{type(event).__name__} has no ROS message")


def stamp_fields(stamp: int) -> Fields:
    """Return a time as the fields of ``builtin_interfaces/Time``."""
    return {"sec": stamp // NANOSECONDS, "nanosec": stamp % NANOSECONDS}


def header(stamp: int, frame_id: str = "") -> Fields:
    """Return the fields of ``std_msgs/Header``."""
    return {"stamp": stamp_fields(stamp), "frame_id": frame_id}


def pose_fields(position: Array, orientation: Array) -> Fields:
    """Return the fields of ``geometry_msgs/Pose``."""
    return {"position": _xyz(position), "orientation": _xyzw(orientation)}


class Encoder:
    """Makes bytes of fields for one ROS version, with the definitions of one distribution."""

    def __init__(self, version: Literal["ros1", "ros2"]) -> None:
        self._version = version
        self._plans: dict[str, _Plan] = {}

    def encode(self, ros_type: str, message: Any) -> bytes | memoryview:
        """Return a message as bytes.

        Args:
            ros_type: ``package/msg/Name``.
            message: its fields as a mapping, or a ready message object.

        Raises:
            ValueError: an unknown type or field, or a value that does not fit.
        """
        if isinstance(message, Mapping):
            message = self._build(ros_type, message)
        try:
            if self._version == "ros1":
                return self._store.serialize_ros1(message, ros_type)  # type: ignore[no-any-return]
            return self._store.serialize_cdr(message, ros_type, little_endian=True)  # type: ignore[no-any-return]
        except Exception as err:
            raise ValueError(f"{ros_type} cannot be written ({type(err).__name__}: {err})") from err

    def definition(self, ros_type: str) -> tuple[str, str]:
        """Return (text of the message definition, its MD5 sum as ROS 1 has it)."""
        if ros_type not in self._store.types:
            raise ValueError(f"type {ros_type!r} is not known")
        text, digest = self._store.generate_msgdef(ros_type, ros_version=1 if self._version == "ros1" else 2)
        return str(text), str(digest)

    @cached_property
    def _store(self) -> Any:
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore

        if self._version == "ros1":
            store = get_typestore(Stores.ROS1_NOETIC)
            store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms\n", TF_MESSAGE))
        else:
            # humble: the oldest living distribution, whose Range has no variance yet; definitions go into the file.
            store = get_typestore(Stores.ROS2_HUMBLE)
        for name, definition in DEFINITIONS.items():
            store.register(get_types_from_msg(definition, f"foxglove_msgs/msg/{name}"))
        return store

    def _build(self, ros_type: str, fields: Fields) -> Any:
        """Return a message object; names are compared without case, because ROS 1 says ``K`` where ROS 2 says ``k``."""
        make, fillers = self._plans.get(ros_type) or self._plan(ros_type)
        given = {name.lower(): value for name, value in fields.items()}
        values = [fill(given.pop(name, None)) for name, fill in fillers]
        if given:
            raise ValueError(f"{ros_type} has no field {min(given)!r}")
        return make(*values)

    def _plan(self, ros_type: str) -> "_Plan":
        """Find out once per type how its fields are filled; nested types follow when they are first met."""
        if ros_type not in self._store.types:
            raise ValueError(f"type {ros_type!r} is not known")
        forms = self._store.fielddefs[ros_type][1]
        fillers = [(name.lower(), self._filler(form)) for name, form in forms]
        self._plans[ros_type] = (self._store.types[ros_type], fillers)
        return self._plans[ros_type]

    def _filler(self, form: Any) -> Callable[[Any], Any]:
        """Return what makes a field's value of what was given for it, or of None."""
        from rosbags.interfaces import Nodetype

        node, detail = form
        if node == Nodetype.BASE:
            return _SCALARS.get(detail[0], _integer)
        if node == Nodetype.NAME:
            return partial(self._nested, detail)
        inner, length = detail
        if inner[0] == Nodetype.BASE and inner[1][0] not in ("string", "wstring"):
            dtype = {"bool": np.bool_, "char": np.uint8, "byte": np.uint8}.get(inner[1][0], inner[1][0])
            return partial(_numbers, dtype, length if node == Nodetype.ARRAY else 0)
        fill = self._filler(inner)
        return lambda value: [fill(item) for item in (value or ())]

    def _nested(self, ros_type: str, value: Any) -> Any:
        if value is not None and not isinstance(value, Mapping):
            return value
        if ros_type == "builtin_interfaces/msg/Time" and value:
            seconds, nanoseconds = int(value["sec"]), int(value["nanosec"])
            if not 0 <= seconds < _MAX_SECONDS[self._version]:
                raise ValueError(f"stamp {seconds}.{nanoseconds:09d} s cannot be written by {self._version}")
        return self._build(ros_type, value or {})


def _text(value: Any) -> str:
    return "" if value is None else str(value)


def _float(value: Any) -> float:
    return 0.0 if value is None else float(value)


def _integer(value: Any) -> int:
    return int(value or 0)


def _numbers(dtype: Any, length: int, value: Any) -> Any:
    return np.zeros(length, dtype) if value is None else np.ascontiguousarray(value, dtype).ravel()


_SCALARS: Mapping[str, Callable[[Any], Any]] = {
    "string": _text, "wstring": _text, "float32": _float, "float64": _float, "bool": bool,
}  # fmt: skip
_Plan = tuple[Any, list[tuple[str, Callable[[Any], Any]]]]


# ---- events ---------------------------------------------------------------------------------------------------


def _image(event: Image) -> tuple[str, Fields]:
    head = header(event.stamp, event.frame_id)
    if not (event.width or event.height or event.step):
        return "sensor_msgs/msg/CompressedImage", {"header": head, "format": event.encoding, "data": event.data}
    return "sensor_msgs/msg/Image", {
        "header": head,
        "height": event.height,
        "width": event.width,
        "encoding": event.encoding,
        "is_bigendian": int(event.is_bigendian),
        "step": event.step,
        "data": event.data,
    }


def _camera_info(event: CameraInfo) -> tuple[str, Fields]:
    c: Calibration = event.calibration
    return "sensor_msgs/msg/CameraInfo", {
        "header": header(event.stamp, event.frame_id),
        "height": c.height,
        "width": c.width,
        "distortion_model": c.model,
        "d": c.distortion or ((0.0,) * 5 if c.model == "plumb_bob" else ()),
        "k": (c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1),
        "r": np.eye(3),
        "p": (c.fx, 0, c.cx, 0, 0, c.fy, c.cy, 0, 0, 0, 1, 0),
    }


def _odometry(event: Odometry) -> tuple[str, Fields]:
    if event.position is None and event.linear is not None:
        return "geometry_msgs/msg/TwistStamped", {
            "header": header(event.stamp, event.child_frame_id),
            "twist": {"linear": _xyz(event.linear), "angular": _xyz(event.angular)},
        }
    pose: dict[str, Any] = {"covariance": _not_known(36)}
    if event.position is not None and event.orientation is not None:
        pose = {"pose": pose_fields(event.position, event.orientation)}
    twist: dict[str, Any] = {"covariance": _not_known(36)}
    if event.linear is not None:
        twist = {"twist": {"linear": _xyz(event.linear), "angular": _xyz(event.angular)}}
    return "nav_msgs/msg/Odometry", {
        "header": header(event.stamp, event.frame_id),
        "child_frame_id": event.child_frame_id,
        "pose": pose,
        "twist": twist,
    }


def _imu(event: Imu) -> tuple[str, Fields]:
    fields = {
        "header": header(event.stamp, event.frame_id),
        "angular_velocity": _xyz(event.angular),
        "linear_acceleration": _xyz(event.acceleration),
    }
    if event.orientation is None:
        return "sensor_msgs/msg/Imu", fields | {"orientation_covariance": _not_known(9)}
    return "sensor_msgs/msg/Imu", fields | {"orientation": _xyzw(event.orientation)}


def _joint_state(event: JointState) -> tuple[str, Fields]:
    return "sensor_msgs/msg/JointState", {
        "header": header(event.stamp, event.frame_id),
        "name": event.names,
        "position": event.positions,
    }


def _range(event: Range) -> tuple[str, Fields]:
    names = ("range", "min_range", "max_range", "field_of_view")
    values = {name: getattr(event, name) for name in names}
    return "sensor_msgs/msg/Range", {"header": header(event.stamp, event.frame_id), **values}


def _scan(event: LaserScan) -> tuple[str, Fields]:
    n = len(event.ranges)
    names = ("ranges", "angle_min", "angle_increment", "range_min", "range_max", "time_increment")
    values = {name: getattr(event, name) for name in names}
    values["angle_max"] = event.angle_min + (n - 1) * event.angle_increment if n else event.angle_min
    return "sensor_msgs/msg/LaserScan", {"header": header(event.stamp, event.frame_id), **values}


def _transform(event: Transform) -> tuple[str, Fields]:
    transform = {"translation": _xyz(event.translation), "rotation": _xyzw(event.rotation)}
    item = {
        "header": header(event.stamp, event.frame_id),
        "child_frame_id": event.child_frame_id,
        "transform": transform,
    }
    return TF_MESSAGE, {"transforms": [item]}


def _pose(event: Pose) -> tuple[str, Fields]:
    head, pose = header(event.stamp, event.frame_id), pose_fields(event.position, event.orientation)
    if event.covariance is None:
        return "geometry_msgs/msg/PoseStamped", {"header": head, "pose": pose}
    return "geometry_msgs/msg/PoseWithCovarianceStamped", {
        "header": head,
        "pose": {"pose": pose, "covariance": event.covariance},
    }


def _xyz(vector: Array | None) -> Fields:
    return {} if vector is None else {"x": vector[0], "y": vector[1], "z": vector[2]}


def _xyzw(quaternion: Array) -> Fields:
    return {"x": quaternion[0], "y": quaternion[1], "z": quaternion[2], "w": quaternion[3]}


def _not_known(size: int) -> Array:
    covariance = np.zeros(size)
    covariance[0] = -1
    return covariance


def _sightings(event: Sightings) -> tuple[str, Fields]:
    return STRING, {"data": sightings_line(event).rstrip("\n")}


def _mark_sighting(event: MarkSighting) -> tuple[str, Fields]:
    return STRING, {"data": mark_pose_line(event).rstrip("\n")}


_ENCODERS: dict[type[Event], Callable[[Any], tuple[str, Fields]]] = {
    Image: _image,
    CameraInfo: _camera_info,
    Odometry: _odometry,
    Imu: _imu,
    JointState: _joint_state,
    Range: _range,
    LaserScan: _scan,
    Transform: _transform,
    Pose: _pose,
    Sightings: _sightings,
    MarkSighting: _mark_sighting,
}
