"""``open_log``: the only door into a log, whatever its container; time-ordered events come out.

A log is one or several paths (split recordings, several robots' files, a folder of images). Each role of a pipeline is
played by one topic (``topics.py``). Iterating reads every message of those topics once: containers give bytes by
log time (``container.py``), ``decode.py`` makes messages, ``messages.py`` events, ``reorder.py`` sorts them by header
stamp; inputs are merged by time, then in the order they were named, then by place in the file. Images get the
calibration that CameraInfo last said before them and, like ranges, scans and inertial sensors, their place on the robot
by the static transforms of the whole log.

Nothing is lost in silence: ``counts`` says of every topic how many messages the files announce, how many were read, how
many were dropped and why.
"""

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from heapq import merge
from pathlib import Path
from typing import Literal

from .calibration import Calibration
from .containers.container import Channel, Loss, Record, explain
from .containers.image_folder import DEFAULT_RATE_HZ
from .containers.inputs import InputFile, Opened, channels_of, open_inputs
from .counts import LATE, NO_STAMP, TopicCount
from .decode import Decoder, decoder_for, why_not_decodable
from .errors import ConfigError, FormatError
from .events import CameraInfo, Event, Image, Imu, LaserScan, Range
from .messages import At, UnusableError, event_of, header_stamp, transforms_of, unwrapped
from .reorder import Message, in_stamp_order
from .topics import AUTO, ROLES, TopicInfo, choose, is_static_transform, topics_of
from .transforms import StaticTransforms
from .window import Window


def open_log(
    paths: str | Path | Sequence[str | Path],
    topics: Mapping[str, str],
    *,
    stamp: Literal["header", "log"] = "header",
    window: Window | None = None,
    rate_hz: float = DEFAULT_RATE_HZ,
) -> "Log":
    """Open a log.

    Args:
        paths: bags, MCAP files, ROS 2 bag folders, folders of images, images.
        topics: role -> topic name or ``auto``; the roles are the keys of ``ROLES``.
        stamp: what ``Event.stamp`` is: the header stamp, or the time the message was logged.
        window: what to read of it.
        rate_hz: of image files that have no stamps.

    Raises:
        ConfigError: a role or topic that does not exist, or several topics between which only the user can choose.
        FormatError: a path that is not there, or not a log.
    """
    opened = open_inputs(paths, rate_hz)
    infos = topics_of((opened.containers[i].format, channel) for i, channel in channels_of(opened))
    try:
        chosen = choose(opened.where, infos, topics)
    except ConfigError as err:
        if any(container.is_cut for container in opened.containers):
            raise ConfigError(f"{err} Note that {opened.problems[0]}.") from err
        raise
    calibration_topic = chosen.get("camera_info") or _calibration_topic(opened.where, infos, chosen)
    return Log(opened, infos, chosen, calibration_topic=calibration_topic, stamp=stamp, window=window)


class Log:
    """An opened log: iterate over its events, as often as you like.

    Attributes:
        topics: every topic of the inputs.
        chosen: role -> topic name.
        inputs: the files.
        problems: one line each, what is wrong with the files as a whole.
        counts: topic -> what became of its messages; filled while iterating.
    """

    def __init__(
        self,
        opened: Opened,
        topics: tuple[TopicInfo, ...],
        chosen: Mapping[str, str],
        *,
        calibration_topic: str,
        stamp: Literal["header", "log"],
        window: Window | None,
    ) -> None:
        self.topics = topics
        self.chosen = dict(chosen)
        self.inputs: tuple[InputFile, ...] = opened.files
        self.problems: list[str] = list(opened.problems)
        self.counts: dict[str, TopicCount] = {}
        self._opened = opened
        self._calibration_topic = calibration_topic
        self._uses_header = stamp == "header"
        self._window = window
        self._has_uncounted_loss = False
        self._decoders: dict[tuple[int, int], Decoder] = {}
        used = {*self.chosen.values(), calibration_topic}
        for index, channel in channels_of(opened):
            if channel.topic in used and not why_not_decodable(channel):
                self._decoders[index, channel.id] = self._decoder(channel)

    @property
    def has_loss(self) -> bool:
        """Whether messages were lost, as far as it has been read: exit status 3."""
        is_cut = any(container.is_cut for container in self._opened.containers)
        return is_cut or self._has_uncounted_loss or any(count.dropped for count in self.counts.values())

    def __iter__(self) -> Iterator[Event]:
        """Yield the events by time; equal times as they stand in the files."""
        self.counts = {name: TopicCount(self._announced(name)) for name in sorted(self._used())}
        self.problems[len(self._opened.problems) :] = []
        self._has_uncounted_loss = False
        mounts, calibration = self._static_transforms(), self._first_calibration()
        first: int | None = None
        last, start, end, is_empty = 0, None, None, True
        for message in self._in_order():
            last, count = message.stamp, self.counts[message.topic]
            if first is None and self._window and any(event.source for event in message.events):
                first = message.stamp
                start, end = self._window.resolve(first)
            if end is not None and message.stamp >= end:
                break
            is_inside = start is None or message.stamp >= start
            count.read += is_inside
            count.outside += not is_inside
            for event in message.events:
                if isinstance(event, CameraInfo):
                    calibration = event.calibration
                if is_inside and event.source:
                    is_empty = False
                    yield _placed(event, mounts, calibration)
        else:
            end = None
        for count in self.counts.values():
            count.reconcile(is_complete=end is None)
        if self._window and is_empty:
            runs = "no message of these topics at all" if first is None else f"stamps {first} ns to {last} ns"
            raise ConfigError(
                f"{self._opened.where}: no message in the window {self._window}. The log has {runs}. Change the window."
            )

    # ---- reading ----------------------------------------------------------------------------------------------

    def _in_order(self) -> Iterator[Message]:
        """Yield the decoded messages of all inputs by stamp; equal ones by input, then by place in the file.

        Recordings are sorted each for itself: two that were logged years apart may have header stamps of one time.
        """
        if not self._uses_header:
            return self._messages(range(len(self._opened.containers)))

        def late(message: Message) -> None:
            self.counts[message.topic].drop(LATE)

        streams = [in_stamp_order(self._messages(indices), late) for indices in self._opened.recordings]
        return merge(*streams, key=lambda message: message.stamp)

    def _messages(self, indices: range) -> Iterator[Message]:
        """Yield the decoded messages of some containers by log time."""
        roles: dict[str, list[tuple[str, type[Event]]]] = defaultdict(list)
        for role, topic in self.chosen.items():
            roles[topic].append((role, ROLES[role].event))
        if self._calibration_topic and self._calibration_topic not in roles:
            roles[self._calibration_topic] = [("", CameraInfo)]  # no role: nobody asked for it, only images need it
        order = 0
        for index, record in self._records(lambda channel: channel.topic in roles, indices):
            topic = record.channel.topic
            count = self.counts[topic]
            try:
                raw = self._decoders[index, record.channel.id](record.data)
                message = unwrapped(raw, record.channel.type)
                has_header = self._uses_header and record.channel.encoding != "file"
                stamp = header_stamp(message) if has_header else record.log_time
                when = record.log_time if stamp is None else stamp
                events = tuple(
                    event_of(message, record.channel.type, event_type, At(stamp=when, source=role, topic=topic))
                    for role, event_type in roles[topic]
                )
            except Exception as err:  # noqa: BLE001  # whatever the deserialisers throw
                count.drop(_why(err))
                continue
            if stamp is None and record.log_time:
                count.why[NO_STAMP] += 1
            order += 1
            yield Message(when, order, record.log_time, len(record.data), topic, events)

    def _records(
        self, is_wanted: Callable[[Channel], bool], indices: range | None = None, *, is_counted: bool = True
    ) -> Iterator[tuple[int, Record]]:
        """Yield (container index, record) of all inputs by log time, then input, then place; count what is lost."""
        indices = range(len(self._opened.containers)) if indices is None else indices
        losses: dict[int, list[Loss]] = {index: [] for index in indices}

        def numbered(index: int) -> Iterator[tuple[int, Record]]:
            container = self._opened.containers[index]
            wanted = frozenset(n for n, c in container.channels.items() if is_wanted(c) and not why_not_decodable(c))
            if not wanted:
                return
            for record in container.records(wanted, losses[index]):
                yield index, record
                self._count_losses(index, losses[index], is_counted=is_counted)
            self._count_losses(index, losses[index], is_counted=is_counted)

        yield from merge(*(numbered(i) for i in indices), key=lambda pair: pair[1].log_time)

    def _count_losses(self, index: int, losses: list[Loss], *, is_counted: bool) -> None:
        container = self._opened.containers[index]
        while losses:
            loss = losses.pop(0)
            if not is_counted:
                continue
            if loss.channel_id is None or loss.messages is None:
                self.problems.append(f"{container.name}: {loss.why}")
                self._has_uncounted_loss = True
            else:
                self.counts[container.channels[loss.channel_id].topic].drop(loss.why, loss.messages)

    def _static_transforms(self) -> StaticTransforms:
        """Read all static transforms of the whole log, whatever the window."""
        found = StaticTransforms()
        for _, record in self._records(is_static_transform):
            count = self.counts[record.channel.topic]
            try:
                for transform in transforms_of(decoder_for(record.channel)(record.data)):
                    found.add(transform)
            except Exception as err:  # noqa: BLE001  # whatever the deserialisers throw
                count.drop(_why(err))
            else:
                count.read += 1
        return found

    def _first_calibration(self) -> Calibration | None:
        """Return what the first CameraInfo says: it holds for images that come before it."""
        topic = self._calibration_topic
        if not topic:
            return None
        for index, record in self._records(lambda channel: channel.topic == topic, is_counted=False):
            try:
                message = self._decoders[index, record.channel.id](record.data)
                event = event_of(message, record.channel.type, CameraInfo, At(stamp=0, source="", topic=topic))
            except Exception:  # noqa: BLE001, S112  # counted when the messages are read
                continue
            return event.calibration if isinstance(event, CameraInfo) else None
        return None

    def _decoder(self, channel: Channel) -> Decoder:
        try:
            return decoder_for(channel)
        except ValueError as err:
            raise FormatError(
                f"{self._opened.where}: topic {channel.topic!r} cannot be decoded ({err}). Choose another topic."
            ) from err

    # ---- counting ---------------------------------------------------------------------------------------------

    def _used(self) -> set[str]:
        transforms = {c.topic for _, c in channels_of(self._opened) if is_static_transform(c)}
        return {*self.chosen.values(), self._calibration_topic, *transforms} - {""}

    def _announced(self, topic: str) -> int | None:
        count = next(info.count for info in self.topics if info.name == topic)
        return None if count is None else max(count, self._opened.expected.get(topic, 0))


def _placed(event: Event, mounts: StaticTransforms, calibration: Calibration | None) -> Event:
    """Return the event with the sensor's calibration and place on the robot."""
    if isinstance(event, Image):
        return replace(event, calibration=calibration, mount=mounts.mount(event.frame_id))
    if isinstance(event, Imu | Range | LaserScan):
        return replace(event, mount=mounts.mount(event.frame_id))
    return event


def _why(err: Exception) -> str:
    """Return why a message is lost: what it does not say, or that it cannot be decoded."""
    return explain(err) if isinstance(err, UnusableError) else f"cannot be decoded ({explain(err)})"


def _calibration_topic(where: str, infos: Sequence[TopicInfo], chosen: Mapping[str, str]) -> str:
    if "image" not in chosen:
        return ""
    return choose(where, infos, {"image": chosen["image"], "camera_info": AUTO}).get("camera_info", "")
