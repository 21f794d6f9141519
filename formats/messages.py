"""ROS messages -> events: here, and only here, the differences of ROS 1 and ROS 2 and of message types end.

``event_of(message, ros_type, wanted, at)`` makes one event; what a message cannot say is None (ROS says "not known"
with a covariance of -1 or a quaternion of length zero), and what it must say but does not is an ``UnusableError``,
which the caller counts.
"""

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, TypedDict

import numpy as np

from .calibration import Calibration
from .containers.sniff import image_encoding
from .events import (
    Array,
    CameraInfo,
    Event,
    Image,
    Imu,
    JointState,
    LaserScan,
    Odometry,
    Pose,
    Range,
    Sightings,
    Transform,
)
from .sightings import sightings_from_json
from .topics import STRING
from .transforms import frame_name


class UnusableError(ValueError):
    """A message that was decoded, but does not say what the event needs; the text is the whole reason."""


class At(TypedDict):
    """What an event says beside its message: when it was measured, which role it plays, and where it was read."""

    stamp: int
    source: str
    topic: str


def header_stamp(message: Any) -> int | None:
    """Return the stamp of a message's header [ns], None where it has none or it is zero."""
    header = getattr(message, "header", None)
    stamp = getattr(header, "stamp", None)
    if stamp is None:
        return int(message["stamp_ns"]) if isinstance(message, Mapping) and "stamp_ns" in message else None
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec) or None


def frame_of(message: Any) -> str:
    """Return the frame of a message without the leading slash of ROS 1."""
    if isinstance(message, Mapping):
        return frame_name(str(message.get("frame_id", "")))
    header = getattr(message, "header", None)
    return frame_name(str(getattr(header, "frame_id", "")))


def event_of(message: Any, ros_type: str, wanted: type[Event], at: At) -> Event:
    """Return ``message`` as an event of type ``wanted``.

    Raises:
        UnusableError: the message does not say what the event needs.
        ValueError: its content cannot be decoded.
    """
    if wanted is Sightings:
        return _sightings(message, at)
    if wanted is Pose:
        return _POSES[ros_type](message, at)
    return _EVENTS[ros_type](message, at)


def unwrapped(message: Any, ros_type: str) -> Any:
    """Return the content of a String that holds JSON, other messages unchanged."""
    return json.loads(message.data) if ros_type == STRING else message


def transforms_of(message: Any) -> list[Transform]:
    """Return the transforms of a TFMessage."""
    found: list[Transform] = []
    for item in message.transforms:
        translation, rotation = _vector(item.transform.translation), _quaternion(item.transform.rotation)
        found.append(
            Transform(
                stamp=header_stamp(item) or 0,
                frame_id=frame_of(item),
                child_frame_id=frame_name(item.child_frame_id),
                translation=translation,
                rotation=rotation,
                is_static=True,
            )
        )
    return found


# ---- images ---------------------------------------------------------------------------------------------------


def _image(message: Any, at: At) -> Image:
    return Image(
        **at,
        frame_id=frame_of(message),
        encoding=str(message.encoding),
        data=_copied(message.data),
        width=int(message.width),
        height=int(message.height),
        step=int(message.step),
        is_bigendian=bool(message.is_bigendian),
    )


def _compressed_image(message: Any, at: At) -> Image:
    text = str(message.format)
    encoding = text
    if "compressedDepth" not in text:
        encoding = "png" if "png" in text.lower() else "jpeg"
    return Image(**at, frame_id=frame_of(message), encoding=encoding, data=_copied(message.data))


def _image_file(message: Any, at: At) -> Image:
    data = _copied(np.frombuffer(message, np.uint8))
    return Image(**at, encoding=image_encoding(bytes(message[:32])), data=data)


def _copied(view: Any) -> Any:
    """Copy pixels out of the message: a view would keep a whole chunk of the file in memory."""
    data = np.array(view, dtype=np.uint8)
    data.flags.writeable = False
    return data


_MODELS = {"": "plumb_bob", "radtan": "plumb_bob", "fisheye": "equidistant"}
_LENGTHS = {"plumb_bob": (0, 4, 5), "rational_polynomial": (0, 8), "equidistant": (0, 4)}


def _camera_info(message: Any, at: At) -> CameraInfo:
    """Read CameraInfo; binning and region of interest are applied, so that it fits the images as they are."""
    K = [float(v) for v in _either(message, "k", "K")]
    fx, fy, cx, cy = K[0], K[4], K[2], K[5]
    if not (fx > 0 and fy > 0):
        raise UnusableError("the camera is not calibrated (focal length 0)")
    model = _MODELS.get(str(message.distortion_model), str(message.distortion_model))
    D = tuple(float(v) for v in _either(message, "d", "D"))
    if model not in _LENGTHS:
        raise UnusableError(f"distortion model {model!r} is not known")
    if len(D) not in _LENGTHS[model] and any(D):
        raise UnusableError(f"distortion model {model!r} with {len(D)} coefficients")
    if not any(D):
        D = ()
    elif model == "plumb_bob":
        D = (*D, 0.0)[:5]
    width, height = int(message.width), int(message.height)
    roi = message.roi
    if roi.width and roi.height:
        width, height = int(roi.width), int(roi.height)
        cx, cy = cx - roi.x_offset, cy - roi.y_offset
    bx, by = max(int(message.binning_x), 1), max(int(message.binning_y), 1)
    # Pixel centres are integers, so pixel edges, which binning keeps, are at half-integers.
    fx, cx, width = fx / bx, (cx + 0.5) / bx - 0.5, width // bx
    fy, cy, height = fy / by, (cy + 0.5) / by - 0.5, height // by
    calibration = Calibration(width, height, fx, fy, cx, cy, model, D)
    return CameraInfo(**at, frame_id=frame_of(message), calibration=calibration)


# ---- motion ---------------------------------------------------------------------------------------------------


def _odometry(message: Any, at: At) -> Odometry:
    pose, twist = message.pose, message.twist
    orientation = None if pose.covariance[0] == -1 else _quaternion_or_none(pose.pose.orientation)
    has_twist = twist.covariance[0] != -1
    return Odometry(
        **at,
        frame_id=frame_of(message),
        child_frame_id=frame_name(str(message.child_frame_id)) or "base_link",
        position=None if orientation is None else _vector(pose.pose.position),
        orientation=orientation,
        linear=_vector(twist.twist.linear) if has_twist else None,
        angular=_vector(twist.twist.angular) if has_twist else None,
    )


def _twist(message: Any, at: At) -> Odometry:
    twist = getattr(message, "twist", message)
    twist = getattr(twist, "twist", twist)
    return Odometry(
        **at,
        child_frame_id=frame_of(message) or "base_link",
        linear=_vector(twist.linear),
        angular=_vector(twist.angular),
    )


def _imu(message: Any, at: At) -> Imu:
    has_orientation = message.orientation_covariance[0] != -1
    return Imu(
        **at,
        frame_id=frame_of(message),
        angular=_vector(message.angular_velocity),
        acceleration=_vector(message.linear_acceleration),
        orientation=_quaternion_or_none(message.orientation) if has_orientation else None,
    )


def _joint_state(message: Any, at: At) -> JointState:
    """Read positions by name; a driver that gives no positions (only efforts, say) leaves the list empty."""
    names = tuple(str(name) for name in message.name)
    positions = np.array(message.position, dtype=np.float64)
    if len(positions) not in {0, len(names)}:
        raise UnusableError(f"{len(names)} joints with {len(positions)} positions")
    return JointState(
        **at,
        frame_id=frame_of(message),
        names=names,
        positions=positions if len(positions) else np.full(len(names), np.nan),
    )


# ---- ranges ---------------------------------------------------------------------------------------------------


def _range(message: Any, at: At) -> Range:
    return Range(
        **at,
        frame_id=frame_of(message),
        range=float(message.range),
        min_range=float(message.min_range),
        max_range=float(message.max_range),
        field_of_view=float(message.field_of_view),
    )


def _scan(message: Any, at: At) -> LaserScan:
    return LaserScan(
        **at,
        frame_id=frame_of(message),
        ranges=np.asarray(message.ranges, dtype=np.float64),
        angle_min=float(message.angle_min),
        angle_increment=float(message.angle_increment),
        range_min=float(message.range_min),
        range_max=float(message.range_max),
        time_increment=float(message.time_increment),
    )


# ---- poses ----------------------------------------------------------------------------------------------------


def _pose(message: Any, at: At) -> Pose:
    pose = message.pose
    covariance: Array | None = None
    if hasattr(pose, "covariance"):
        values = np.asarray(pose.covariance, dtype=np.float64).reshape(6, 6)
        covariance = values if values.any() and values[0, 0] != -1 else None
        pose = pose.pose
    return Pose(
        **at,
        frame_id=frame_of(message),
        position=_vector(pose.position),
        orientation=_quaternion(pose.orientation),
        covariance=covariance,
    )


def _transform_pose(message: Any, at: At) -> Pose:
    return Pose(
        **at,
        frame_id=frame_of(message),
        position=_vector(message.transform.translation),
        orientation=_quaternion(message.transform.rotation),
    )


def _sightings(message: Any, at: At) -> Sightings:
    return replace(sightings_from_json(message), **at)


def _either(message: Any, ros2: str, ros1: str) -> Any:
    return getattr(message, ros2) if hasattr(message, ros2) else getattr(message, ros1)


_NOT_FINITE = "a value is not a finite number"


def _vector(value: Any) -> Array:
    x, y, z = value.x, value.y, value.z
    if not math.isfinite(x + y + z):
        raise UnusableError(_NOT_FINITE)
    return np.array((x, y, z), dtype=np.float64)


def _quaternion_or_none(value: Any) -> Array | None:
    """Return a quaternion, None if it is all zeros: not given."""
    x, y, z, w = value.x, value.y, value.z, value.w
    square = x * x + y * y + z * z + w * w
    if not math.isfinite(square):
        raise UnusableError(_NOT_FINITE)
    return np.array((x, y, z, w), dtype=np.float64) if square > 1e-12 else None


def _quaternion(value: Any) -> Array:
    q = _quaternion_or_none(value)
    if q is None:
        raise UnusableError("a quaternion is all zeros, no rotation")
    return q


_EVENTS: dict[str, Callable[[Any, At], Event]] = {
    "sensor_msgs/msg/Image": _image,
    "sensor_msgs/msg/CompressedImage": _compressed_image,
    "image file": _image_file,
    "sensor_msgs/msg/CameraInfo": _camera_info,
    "nav_msgs/msg/Odometry": _odometry,
    "geometry_msgs/msg/TwistWithCovarianceStamped": _twist,
    "geometry_msgs/msg/TwistStamped": _twist,
    "geometry_msgs/msg/Twist": _twist,
    "sensor_msgs/msg/Imu": _imu,
    "sensor_msgs/msg/JointState": _joint_state,
    "sensor_msgs/msg/Range": _range,
    "sensor_msgs/msg/LaserScan": _scan,
}
_POSES: dict[str, Callable[[Any, At], Event]] = {
    "geometry_msgs/msg/PoseStamped": _pose,
    "geometry_msgs/msg/PoseWithCovarianceStamped": _pose,
    "nav_msgs/msg/Odometry": _pose,
    "geometry_msgs/msg/TransformStamped": _transform_pose,
}
