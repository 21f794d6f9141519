"""A small recording and every container it can be written to: by our writer, by rosbags' and by mcap's."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from logpose.formats.calibration import Calibration
from logpose.formats.encode import Encoder, as_message
from logpose.formats.events import (
    CameraInfo,
    Event,
    Image,
    Odometry,
    Pose,
    Sightings,
    Transform,
)
from logpose.formats.write_log import create_log

S = 1_000_000_000
START = 1_700_000_000 * S
CALIBRATION = Calibration(8, 6, 10.0, 11.0, 3.5, 2.5, "plumb_bob", (0.1, 0.0, 0.0, 0.0, 0.0))
UNIT = np.array([0.0, 0.0, 0.0, 1.0])


def make_recording(n_images: int = 20) -> list[Event]:
    """Return events in time order: an image, two odometry messages and a true pose every tenth of a second."""
    events: list[Event] = [
        Transform(
            stamp=START,
            topic="/tf_static",
            frame_id="base_link",
            child_frame_id="camera",
            translation=np.array([0.1, 0.2, 0.3]),
            rotation=UNIT,
            is_static=True,
        ),
        CameraInfo(stamp=START, topic="/camera/camera_info", frame_id="camera", calibration=CALIBRATION),
    ]
    for i in range(n_images):
        stamp = START + i * S // 10
        pixels = (np.arange(48) + i).astype(np.uint8)
        events += [
            Image(
                stamp=stamp,
                topic="/camera/image_raw",
                frame_id="camera",
                encoding="mono8",
                data=pixels,
                width=8,
                height=6,
                step=8,
            ),
            _odometry(stamp, i),
            Pose(
                stamp=stamp,
                topic="/ground_truth/pose",
                frame_id="map",
                position=np.array([i, 0.5, 0.0]),
                orientation=UNIT,
            ),
            _odometry(stamp + S // 20, i + 0.5),
        ]
    return events


def _odometry(stamp: int, x: float) -> Odometry:
    return Odometry(
        stamp=stamp,
        topic="/odom",
        frame_id="odom",
        child_frame_id="base_link",
        position=np.array([x, 0.0, 0.0]),
        orientation=UNIT,
        linear=np.array([1.0, 0.0, 0.0]),
        angular=np.array([0.0, 0.0, 0.25]),
    )


def write_bag(path: Path, events: list[Event], compression: str = "") -> Path:
    """Write a ROS 1 bag with rosbags."""
    from rosbags.rosbag1 import Writer

    encoder = Encoder("ros1")
    writer = Writer(path)
    writer.chunk_threshold = 2000
    if compression:
        writer.set_compression(Writer.CompressionFormat[compression.upper()])
    with writer:
        connections: dict[str, object] = {}
        for event in events:
            kind, fields = as_message(event)
            if event.topic not in connections:
                definition, digest = encoder.definition(kind)
                connections[event.topic] = writer.add_connection(event.topic, kind, msgdef=definition, md5sum=digest)
            writer.write(connections[event.topic], event.stamp, encoder.encode(kind, fields))
    return path


def write_folder(path: Path, events: list[Event], storage: str, mode: str = "", version: int = 9) -> Path:
    """Write a ROS 2 bag folder with rosbags."""
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    encoder, store = Encoder("ros2"), get_typestore(Stores.ROS2_HUMBLE)
    writer = Writer(path, version=version, storage_plugin=StoragePlugin[storage.upper()])
    if mode:
        writer.set_compression(CompressionMode[mode.upper()], CompressionFormat.ZSTD)
    with writer:
        connections: dict[str, object] = {}
        for event in events:
            kind, fields = as_message(event)
            if event.topic not in connections:
                connections[event.topic] = writer.add_connection(event.topic, kind, typestore=store)
            writer.write(connections[event.topic], event.stamp, encoder.encode(kind, fields))
    return path


def write_mcap(
    path: Path, events: list[Event], *, profile: str = "ros2", with_json: bool = False, **options: object
) -> Path:
    """Write an MCAP file with the mcap library and its options."""
    from mcap.writer import CompressionType, Writer

    version = "ros1" if profile == "ros1" else "ros2"
    encoder = Encoder(version)
    settings: dict = {"compression": CompressionType.NONE, "chunk_size": 2000, **options}
    with path.open("wb") as stream:
        writer = Writer(stream, **settings)
        writer.start(profile)
        channels: dict[str, int] = {}
        for number, event in enumerate(events):
            kind, fields = as_message(event)
            if event.topic not in channels:
                name = kind.replace("/msg/", "/") if version == "ros1" else kind
                form, encoding = ("ros1msg", "ros1") if version == "ros1" else ("ros2msg", "cdr")
                schema = writer.register_schema(name, form, encoder.definition(kind)[0].encode())
                channels[event.topic] = writer.register_channel(event.topic, encoding, schema)
            writer.add_message(channels[event.topic], event.stamp, bytes(encoder.encode(kind, fields)), event.stamp)
            if with_json and number == 3:
                schema = writer.register_schema("my.Config", "jsonschema", b"{}")
                channel = writer.register_channel("/config", "json", schema)
                writer.add_message(channel, event.stamp, json.dumps({"a": 1}).encode(), event.stamp)
                channel = writer.register_channel("/blob", "protobuf", 0)
                writer.add_message(channel, event.stamp, b"\x01\x02", event.stamp)
        writer.finish()
    return path


def _ours(path: Path, events: list[Event], compression: str) -> Path:
    with create_log(path, compression=compression) as writer:
        for event in events:
            writer.write(event)
    return path


def _split(path: Path, events: list[Event]) -> Path:
    """Write a folder of two MCAP files without metadata.yaml."""
    path.mkdir()
    write_mcap(path / "part_9.mcap", events[: len(events) // 2])
    write_mcap(path / "part_10.mcap", events[len(events) // 2 :])
    return path


def _single(folder: Path, suffix: str) -> Path:
    return next(folder.glob(f"*{suffix}"))


def _index(name: str) -> object:
    from mcap.writer import IndexType

    return {"none": IndexType.NONE, "chunk": IndexType.CHUNK}[name]


def _packed(name: str) -> object:
    from mcap.writer import CompressionType

    return CompressionType[name]


CONTAINERS: dict[str, Callable[[Path, list[Event]], Path]] = {
    "bag-none": lambda d, e: write_bag(d / "x.bag", e),
    "bag-lz4": lambda d, e: write_bag(d / "x.bag", e, "lz4"),
    "bag-bz2": lambda d, e: write_bag(d / "x.bag", e, "bz2"),
    "bag-ours": lambda d, e: _ours(d / "x.bag", e, "zstd"),
    "bag-ours-none": lambda d, e: _ours(d / "x.bag", e, "none"),
    "bag-odd-suffix": lambda d, e: write_bag(d / "x.BAG.active", e),
    "ros2-sqlite": lambda d, e: write_folder(d / "x", e, "sqlite3"),
    "ros2-sqlite-v8": lambda d, e: write_folder(d / "x", e, "sqlite3", version=8),
    "ros2-sqlite-message": lambda d, e: write_folder(d / "x", e, "sqlite3", "message"),
    "ros2-sqlite-file": lambda d, e: write_folder(d / "x", e, "sqlite3", "file"),
    "ros2-db3": lambda d, e: _single(write_folder(d / "x", e, "sqlite3"), ".db3"),
    "ros2-db3-zstd": lambda d, e: _single(write_folder(d / "x", e, "sqlite3", "file"), ".zstd"),
    "ros2-mcap": lambda d, e: write_folder(d / "x", e, "mcap"),
    "ros2-mcap-message": lambda d, e: write_folder(d / "x", e, "mcap", "message"),
    "ros2-mcap-file": lambda d, e: write_folder(d / "x", e, "mcap", "file"),
    "ros2-mcap-storage": lambda d, e: write_folder(d / "x", e, "mcap", "storage"),
    "ros2-no-metadata": lambda d, e: _split(d / "x", e),
    "mcap-none": lambda d, e: write_mcap(d / "x.mcap", e),
    "mcap-lz4": lambda d, e: write_mcap(d / "x.mcap", e, compression=_packed("LZ4")),
    "mcap-zstd": lambda d, e: write_mcap(d / "x.mcap", e, compression=_packed("ZSTD")),
    "mcap-unchunked": lambda d, e: write_mcap(d / "x.mcap", e, use_chunking=False),
    "mcap-no-index": lambda d, e: write_mcap(d / "x.mcap", e, index_types=_index("none")),
    "mcap-no-message-index": lambda d, e: write_mcap(d / "x.mcap", e, index_types=_index("chunk")),
    "mcap-no-repeated-channels": lambda d, e: write_mcap(d / "x.mcap", e, repeat_channels=False),
    "mcap-no-repeated-schemas": lambda d, e: write_mcap(d / "x.mcap", e, repeat_schemas=False),
    "mcap-no-statistics": lambda d, e: write_mcap(d / "x.mcap", e, use_statistics=False, index_types=_index("none")),
    "mcap-no-crc": lambda d, e: write_mcap(d / "x.mcap", e, enable_crcs=False),
    "mcap-ros1": lambda d, e: write_mcap(d / "x.mcap", e, profile="ros1"),
    "mcap-no-profile": lambda d, e: write_mcap(d / "x.mcap", e, profile=""),
    "mcap-json-beside": lambda d, e: write_mcap(d / "x.mcap", e, with_json=True),
    "mcap-ours": lambda d, e: _ours(d / "x.mcap", e, "zstd"),
    "mcap-ours-none": lambda d, e: _ours(d / "x.mcap", e, "none"),
}


@pytest.fixture(scope="session")
def recording() -> list[Event]:
    """82 events over two seconds."""
    return make_recording()


@pytest.fixture(scope="session", params=sorted(CONTAINERS))
def any_log(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, recording: list[Event]) -> Path:
    """The recording in one container after the other."""
    return CONTAINERS[request.param](tmp_path_factory.mktemp(request.param), recording)


@pytest.fixture(scope="session")
def log_of() -> Callable[..., Path]:
    """Write events into a container of the given kind: ``log_of(kind, folder, events)``."""
    return lambda kind, folder, events: CONTAINERS[kind](folder, events)


@pytest.fixture(scope="session")
def make_events() -> Callable[..., list[Event]]:
    """The recording with any number of images."""
    return make_recording


@pytest.fixture(scope="session")
def some_sightings() -> Sightings:
    """Two sightings, one without an image."""
    return Sightings(
        stamp=START,
        topic="/sightings",
        frame_id="base_link",
        xy=np.array([[1.0, 2.0], [0.1, -0.3]]),
        cov=np.array([[[0.01, 0.002], [0.002, 0.03]], [[0.01, 0.0], [0.0, 0.01]]]),
        uv=np.array([[10.5, 20.25], [np.nan, np.nan]]),
        radius=np.array([5.5, np.nan]),
        score=np.array([0.9, 1.0]),
        ids=np.array([7, -1], dtype=np.int64),
    )


@pytest.fixture(scope="session")
def mcap_file() -> Callable[..., Path]:
    """``mcap_file(path, events, **options)`` writes with the mcap library."""
    return write_mcap


@pytest.fixture(scope="session")
def bag_file() -> Callable[..., Path]:
    """``bag_file(path, events, compression)`` writes with rosbags."""
    return write_bag


@pytest.fixture(scope="session")
def bag_folder() -> Callable[..., Path]:
    """``bag_folder(path, events, storage, mode)`` writes with rosbags."""
    return write_folder
