"""What is in a log, for ``logpose inspect``: topics, rates, gaps, clocks, frames, image sizes, and what is wrong."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from heapq import merge
from pathlib import Path
from typing import Any

import numpy as np

from .containers.container import Channel, Container, Loss, Record, explain
from .containers.inputs import InputFile, Opened, channels_of, open_inputs
from .decode import decoder_for, why_not_decodable
from .messages import frame_of, header_stamp, transforms_of
from .topics import ROLES, TopicInfo, can_play, roles_of_type, topics_of

_GAP_PERIODS = 5.0
"""A gap is worth a line when it is longer than this many median periods ..."""
_GAP_S = 0.5
"""... and longer than this."""
_LAG_S = 10.0
"""A clock that differs by more from the clock of the log is another clock."""


@dataclass(frozen=True, slots=True)
class TopicSurvey:
    """What is known of a topic after reading all of it.

    Attributes:
        name, type, format: of the topic, its messages and its container.
        announced: messages by the files' indexes, None when they do not say.
        count: messages found.
        undecodable: of them, how many could not be decoded.
        first_log_ns, last_log_ns: log times, None when there is no message.
        first_header_ns, last_header_ns: header stamps, None when there are none.
        rate_hz: by log time, None for less than two messages.
        largest_gap_s: between neighbours by log time.
        median_lag_s: log time minus header stamp.
        frame_ids: of the headers.
        image_size: (width, height) [px], (0, 0) for compressed images.
        image_encoding: of the first image.
        roles: that the topic can play.
    """

    name: str
    type: str
    format: str
    announced: int | None
    count: int
    undecodable: int = 0
    first_log_ns: int | None = None
    last_log_ns: int | None = None
    first_header_ns: int | None = None
    last_header_ns: int | None = None
    rate_hz: float | None = None
    largest_gap_s: float | None = None
    median_lag_s: float | None = None
    frame_ids: tuple[str, ...] = ()
    image_size: tuple[int, int] | None = None
    image_encoding: str = ""
    roles: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Survey:
    """What is in a log.

    Attributes:
        inputs: the files.
        topics: by name.
        first_ns, last_ns: first and last log time, None for a log without messages.
        problems: one line each.
        has_loss: a file is cut off or damaged, so that messages are missing.
    """

    inputs: tuple[InputFile, ...]
    topics: tuple[TopicSurvey, ...]
    first_ns: int | None
    last_ns: int | None
    problems: tuple[str, ...] = ()
    has_loss: bool = False


@dataclass(slots=True)
class _Notes:
    """What is collected of a topic while reading."""

    channels: list[Channel] = field(default_factory=list)
    log_times: list[int] = field(default_factory=list)
    stamps: list[int] = field(default_factory=list)
    lags: list[int] = field(default_factory=list)
    frames: dict[str, None] = field(default_factory=dict)
    undecodable: int = 0
    why: str = ""
    without_stamp: int = 0
    image: Any = None
    lost: dict[str, int] = field(default_factory=lambda: defaultdict(int))


def survey(paths: Sequence[str | Path]) -> Survey:
    """Read a whole log and say what is in it.

    Raises:
        FormatError: a path that is not there, or not a log.
    """
    opened = open_inputs(paths)
    notes: dict[str, _Notes] = defaultdict(_Notes)
    for _, channel in channels_of(opened):
        notes[channel.topic].channels.append(channel)
    losses: list[tuple[Container, Loss]] = []
    for record in _all_records(opened, losses):
        note = notes[record.channel.topic]
        note.log_times.append(record.log_time)
        if not why_not_decodable(record.channel):
            _look_into(note, record)
    problems = list(opened.problems)
    for container, loss in losses:
        if loss.channel_id is None or loss.messages is None:
            problems.append(f"{container.name}: {loss.why}")
        else:
            notes[container.channels[loss.channel_id].topic].lost[loss.why] += loss.messages
    infos = topics_of((opened.containers[i].format, channel) for i, channel in channels_of(opened))
    topics = tuple(_summed_up(info, notes[info.name], opened.expected) for info in infos)
    problems += [text for topic in topics for text in _problems_of(topic, notes[topic.name])]
    times = [t for note in notes.values() for t in (note.log_times[:1] + note.log_times[-1:])]
    has_loss = any(c.is_cut for c in opened.containers) or any(note.lost for note in notes.values())
    return Survey(opened.files, topics, min(times, default=None), max(times, default=None), tuple(problems), has_loss)


def _all_records(opened: Opened, losses: list[tuple[Container, Loss]]) -> Iterator[Record]:
    """Yield all messages by log time; append to ``losses`` what could not be read, like a container."""

    def of(container: Container) -> Iterator[Record]:
        lost: list[Loss] = []
        yield from container.records(frozenset(container.channels), lost)
        losses.extend((container, loss) for loss in lost)

    yield from merge(*map(of, opened.containers), key=lambda record: record.log_time)


def _look_into(note: _Notes, record: Record) -> None:
    """Take note of what one message says."""
    try:
        message = decoder_for(record.channel)(record.data)
        stamp = header_stamp(message)
        if stamp is None and hasattr(message, "transforms") and message.transforms:
            stamp = transforms_of(message)[0].stamp or None
        facts = _image_facts(message) if note.image is None and "image" in roles_of_type(record.channel.type) else None
        frame = frame_of(message)
    except Exception as err:  # noqa: BLE001  # whatever the deserialisers throw
        note.undecodable += 1
        note.why = note.why or explain(err)
        return
    if stamp is not None:
        note.stamps.append(stamp)
        note.lags.append(record.log_time - stamp)
    elif hasattr(message, "header"):
        note.without_stamp += record.log_time != 0
    if frame:
        note.frames[frame] = None
    note.image = note.image or facts


def _image_facts(message: Any) -> tuple[tuple[int, int], str]:
    if hasattr(message, "encoding"):
        return (int(message.width), int(message.height)), str(message.encoding)
    return (0, 0), str(getattr(message, "format", "file"))


def _summed_up(info: TopicInfo, note: _Notes, expected: Mapping[str, int]) -> TopicSurvey:
    announced = info.count
    if info.name in expected:
        announced = max(announced or 0, expected[info.name])
    times = np.array(note.log_times, dtype=np.int64)
    steps = np.diff(times)
    gap = float(steps.max()) / 1e9 if len(steps) else None
    span = float(times[-1] - times[0]) / 1e9 if len(steps) else 0.0
    lag = float(np.median(np.array(note.lags, dtype=np.float64))) / 1e9 if note.lags else None
    found = replace(info, is_readable=True)  # what a role could take, if it could be decoded
    return TopicSurvey(
        name=info.name,
        type=info.type,
        format=info.format,
        announced=announced,
        count=len(times),
        undecodable=note.undecodable,
        first_log_ns=int(times[0]) if len(times) else None,
        last_log_ns=int(times[-1]) if len(times) else None,
        first_header_ns=min(note.stamps, default=None),
        last_header_ns=max(note.stamps, default=None),
        rate_hz=len(steps) / span if span > 0 else None,
        largest_gap_s=gap,
        median_lag_s=lag,
        frame_ids=tuple(note.frames),
        image_size=note.image[0] if note.image else None,
        image_encoding=note.image[1] if note.image else "",
        roles=tuple(role for role in ROLES if can_play(found, role, is_named=False)),
    )


def _problems_of(topic: TopicSurvey, note: _Notes) -> list[str]:
    """Return what is wrong with a topic, one line each."""
    problems = []
    has_role = any(roles_of_type(channel.type) for channel in note.channels)
    for why, count in note.lost.items():
        problems.append(f"{count} messages are lost: {why}")
    missing = (topic.announced or 0) - len(note.log_times) - sum(note.lost.values())
    if missing > 0:
        problems.append(f"{missing} of {topic.announced} announced messages are not in the file")
    if note.undecodable:
        problems.append(f"{note.undecodable} messages cannot be decoded ({note.why})")
    if reasons := {why_not_decodable(channel) for channel in note.channels} - {""}:
        problems.append(", ".join(sorted(reasons)))
    if note.without_stamp:
        problems.append(f"{note.without_stamp} header stamps are zero")
    if backwards := int((np.diff(np.array(note.stamps, dtype=np.int64)) < 0).sum()):
        problems.append(f"the header stamp goes back {backwards} times")
    if has_role and len(note.log_times) > 2:
        steps = np.diff(np.array(note.log_times, dtype=np.int64)) / 1e9
        if steps.max() > max(_GAP_S, _GAP_PERIODS * float(np.median(steps))):
            at = int(np.argmax(steps))
            begin = (note.log_times[at] - note.log_times[0]) / 1e9
            problems.append(f"a gap of {steps.max():.3f} s, {begin:.3f} s after its first message")
    lag = topic.median_lag_s
    if has_role and lag is not None and abs(lag) > _LAG_S:
        problems.append(f"header stamps are {lag:.3f} s behind the log's clock; --stamp log may be needed")
    return [f"{topic.name}: {text}" for text in problems]
