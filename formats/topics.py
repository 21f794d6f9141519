"""Roles: what a pipeline wants of a log, and which topic plays it.

A pipeline names roles (``image``, ``odometry``, ``truth``, ...); ``choose`` finds the topic of each, by the name that
was given or, with ``auto``, by its default name or because it is the only one of the right type.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from .containers.container import Channel
from .decode import why_not_decodable
from .errors import ConfigError
from .events import (
    INITIAL_POSE,
    LOGGED_POSE,
    TRUE_SIGHTINGS,
    TRUTH,
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
)

AUTO = "auto"


@dataclass(frozen=True)
class Role:
    """What plays a role.

    Attributes:
        event: the type of event it yields.
        default: the name of its topic where there is one by convention.
        needs_name: ``auto`` takes the default topic and never another one of the right type: what is called truth or
            start pose must have been meant as such.
    """

    event: type[Event]
    default: str | None = None
    needs_name: bool = False


ROLES: dict[str, Role] = {
    "image": Role(Image),
    "camera_info": Role(CameraInfo),
    "odometry": Role(Odometry, "/odom"),
    "imu": Role(Imu, "/imu/data"),
    "joints": Role(JointState, "/joint_states"),
    "range": Role(Range),
    "scan": Role(LaserScan, "/scan"),
    "sightings": Role(Sightings, "/sightings"),
    TRUE_SIGHTINGS: Role(Sightings, "/ground_truth/sightings", needs_name=True),
    TRUTH: Role(Pose, "/ground_truth/pose", needs_name=True),
    INITIAL_POSE: Role(Pose, "/initialpose", needs_name=True),
    LOGGED_POSE: Role(Pose),
}

SIGHTINGS_SCHEMA = "logpose.Sightings"
STRING = "std_msgs/msg/String"
TF_TYPES = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")

# The first type of an event that a log has is the one ``auto`` looks at: /odom before /cmd_vel.
TYPES: dict[type[Event], tuple[str, ...]] = {
    Image: ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage", "image file"),
    CameraInfo: ("sensor_msgs/msg/CameraInfo",),
    Odometry: (
        "nav_msgs/msg/Odometry",
        "geometry_msgs/msg/TwistWithCovarianceStamped",
        "geometry_msgs/msg/TwistStamped",
        "geometry_msgs/msg/Twist",
    ),
    Imu: ("sensor_msgs/msg/Imu",),
    JointState: ("sensor_msgs/msg/JointState",),
    Range: ("sensor_msgs/msg/Range",),
    LaserScan: ("sensor_msgs/msg/LaserScan",),
    Sightings: (SIGHTINGS_SCHEMA,),
    Pose: (
        "geometry_msgs/msg/PoseWithCovarianceStamped",
        "geometry_msgs/msg/PoseStamped",
        "nav_msgs/msg/Odometry",
        "geometry_msgs/msg/TransformStamped",
    ),
}


@dataclass(frozen=True, slots=True)
class TopicInfo:
    """A topic of the inputs.

    Attributes:
        name, type: of the topic; several types are joined with commas.
        count: messages announced, None where the files do not say.
        format: of the container.
        is_readable: whether a role can take it.
        why_not: the reason when it is not readable.
    """

    name: str
    type: str
    count: int | None
    format: str
    is_readable: bool = True
    why_not: str = ""


def roles_of_type(ros_type: str) -> tuple[str, ...]:
    """Return the roles that a topic of this type can play."""
    return tuple(r for r, role in ROLES.items() if ros_type in TYPES[role.event])


def is_static_transform(channel: Channel) -> bool:
    """Tell whether a channel carries latched transforms."""
    return channel.topic.rstrip("/").endswith("tf_static") and channel.type in TF_TYPES


def topics_of(channels: Iterable[tuple[str, Channel]]) -> tuple[TopicInfo, ...]:
    """Put (container format, channel) of all inputs together by topic, sorted by name."""
    grouped: dict[str, list[tuple[str, Channel]]] = {}
    for form, channel in channels:
        grouped.setdefault(channel.topic, []).append((form, channel))
    infos: list[TopicInfo] = []
    for name in sorted(grouped):
        members = [channel for _, channel in grouped[name]]
        counts = [channel.announced for channel in members]
        reasons = [_why_not(channel) for channel in members]
        infos.append(
            TopicInfo(
                name=name,
                type=", ".join(dict.fromkeys(channel.type for channel in members)),
                count=None if None in counts else sum(count or 0 for count in counts),
                format=", ".join(dict.fromkeys(form for form, _ in grouped[name])),
                is_readable=not all(reasons),
                why_not=reasons[0] if all(reasons) else "",
            )
        )
    return tuple(infos)


def _why_not(channel: Channel) -> str:
    if reason := why_not_decodable(channel):
        return reason
    if roles_of_type(channel.type) or is_static_transform(channel):
        return ""
    if channel.type == STRING:
        return "read as sightings only when it is named"
    return f"no role reads {channel.type or 'a channel without a type'}"


def choose(where: str, topics: Sequence[TopicInfo], wanted: Mapping[str, str]) -> dict[str, str]:
    """Return role -> topic name for the wanted roles that the log can fill.

    Raises:
        ConfigError: a role or topic that does not exist, or several topics between which only the user can choose.
    """
    chosen: dict[str, str] = {}
    # camera_info after image: among several it is the image's sibling.
    for role in sorted(wanted, key=lambda name: name == "camera_info"):
        if role not in ROLES:
            raise ConfigError(f"topics: no role {role!r}. Roles: {', '.join(ROLES)}.")
        name = wanted[role]
        if name == AUTO:
            found = _automatic(where, topics, role, chosen.get("image", ""))
        else:
            found = _named(where, topics, role, name)
        if found:
            chosen[role] = found
    return {role: chosen[role] for role in wanted if role in chosen}


def sibling_of(image_topic: str, candidates: Sequence[str]) -> str:
    """Return the camera_info topic in the nearest namespace of an image topic, or ''."""
    parts = image_topic.split("/")
    for n in range(len(parts) - 1, 0, -1):
        name = "/".join([*parts[:n], "camera_info"])
        if name in candidates:
            return name
    return ""


def can_play(topic: TopicInfo, role: str, *, is_named: bool) -> bool:
    """Tell whether a topic can play a role; a String holds sightings only where its name says so."""
    ros_types = topic.type.split(", ")
    if any(ros_type in TYPES[ROLES[role].event] for ros_type in ros_types):
        return topic.is_readable
    is_default = topic.name == ROLES[role].default
    return ROLES[role].event is Sightings and STRING in ros_types and (is_named or is_default)


def _named(where: str, topics: Sequence[TopicInfo], role: str, name: str) -> str:
    for topic in topics:
        if topic.name.lstrip("/") == name.lstrip("/") and can_play(topic, role, is_named=True):
            return topic.name
    names = ", ".join(t.name for t in topics if can_play(t, role, is_named=False)) or "none"
    raise ConfigError(f"{where}: no topic {name!r} of type {ROLES[role].event.__name__}. Topics of this type: {names}.")


def _automatic(where: str, topics: Sequence[TopicInfo], role: str, image: str) -> str:
    spec = ROLES[role]
    candidates = [t for t in topics if can_play(t, role, is_named=False) and t.count != 0]
    for topic in candidates:
        if spec.default and topic.name.lstrip("/") == spec.default.lstrip("/"):
            return topic.name
    if spec.needs_name:
        return ""
    taken = {r.default for n, r in ROLES.items() if n != role and r.default and r.needs_name}
    candidates = [t for t in candidates if t.name not in taken]
    for ros_type in TYPES[spec.event]:
        names = [t.name for t in candidates if ros_type in t.type.split(", ")]
        if role == "camera_info" and len(names) > 1:
            return sibling_of(image, names)
        if len(names) > 1:
            raise ConfigError(
                f"{where}: several topics of type {spec.event.__name__}: {', '.join(names)}. "
                f"Choose one with --topic {role}={names[0]}."
            )
        if names:
            return names[0]
    return ""
