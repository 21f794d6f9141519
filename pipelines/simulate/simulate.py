"""Let a robot move through a world and yield the messages of its log, with the truth beside them.

Topics: ``/tf_static`` and the start pose first, then in time order what the sensors say and, at each image, the
calibration, the true pose, what else the kind of world knows of the image, and the image itself. Everything random
comes from the run's seed, a stream of its own for each cause, so that another camera leaves the odometry as it was; the
building comes from the world's own seed.

The truth is planar (x, y, heading of the robot on the floor plan). The tilt of the floor is not in it: it is what an
estimator that believes in a flat floor has to live with.
"""

import heapq
import math
from collections.abc import Iterator

import cv2
import numpy as np

from ...formats.calibration import Calibration
from ...formats.events import Array, Bytes, CameraInfo, Event, Image, Mount, Odometry, Pose, Transform
from .bench import BenchScene, BenchWorld
from .camera import base_camera, calibration_of
from .ceiling_world import CeilingScene, CeilingWorld
from .imu import imu_events
from .odometry import readings
from .parts import DrivenParts
from .pose import place, quaternion, rpy
from .renderer import finer, render
from .scene import BASE, MAP, ODOM, Cause, Moment, Motion, Scene, stream_of
from .sensor import gains, photograph
from .stripe_world import StripeScene, StripeWorld
from .world import World

TRUE_POSE = "/ground_truth/pose"


def simulate(world: World, seed: int) -> Iterator[Event]:
    """Yield the messages of one run in time order; the same world and seed give the same messages.

    Raises:
        ValueError: the world cannot be built or driven (no room for the landmarks, a lens that folds over).
    """
    yield from events_of(world, build_scene(world), seed)


def build_scene(world: World) -> Scene:
    """Build what there is to see in a world.

    Raises:
        ValueError: it cannot be built.
    """
    match world:
        case CeilingWorld():
            return CeilingScene(world)
        case StripeWorld():
            return StripeScene(world)
        case BenchWorld():
            return BenchScene(world)


def events_of(world: World, scene: Scene, seed: int) -> Iterator[Event]:
    """Yield the messages of one run in a scene that is built."""
    motion = scene.motion(seed)
    yield _transform(world, world.camera.frame, place(base_camera(world.camera)))
    streams: list[Iterator[Event]] = []
    if isinstance(world, DrivenParts):
        if world.imu is not None:
            yield _transform(world, world.imu.frame, place(world.imu.mount.view))
            streams.append(imu_events(motion, world.imu, world.start_stamp_ns, stream_of(seed, Cause.IMU)))
        yield _start(world, motion, seed)
        streams.insert(0, _odometry(world, motion, seed))
    streams += [*scene.sensors(motion, seed), _camera(world, scene, motion, seed)]
    yield from heapq.merge(*streams, key=lambda event: event.stamp)


def _transform(world: World, frame: str, mount: Mount) -> Transform:
    return Transform(
        stamp=world.start_stamp_ns,
        topic="/tf_static",
        source="tf",
        frame_id=BASE,
        child_frame_id=frame,
        translation=mount.translation,
        rotation=mount.rotation,
        is_static=True,
    )


def _start(world: DrivenParts, motion: Motion, seed: int) -> Pose:
    start = world.initial_pose
    sd = np.array([start.position_sd_m, start.position_sd_m, math.radians(start.heading_sd_deg)])
    x, y, heading = motion.at(0.0)[0] + sd * stream_of(seed, Cause.START).standard_normal(3)
    covariance = np.zeros((6, 6))
    covariance[[0, 1, 5], [0, 1, 5]] = sd**2
    return Pose(
        stamp=world.start_stamp_ns,
        topic=start.topic,
        source="initial_pose",
        frame_id=MAP,
        position=np.array([x, y, 0.0]),
        orientation=_heading(heading),
        covariance=covariance,
    )


def _odometry(world: DrivenParts, motion: Motion, seed: int) -> Iterator[Event]:
    for reading in readings(motion, world.odometry, stream_of(seed, Cause.ODOMETRY)):
        x, y, heading = reading.pose
        yield Odometry(
            stamp=world.start_stamp_ns + reading.time_ns,
            topic=world.odometry.topic,
            source="odometry",
            frame_id=ODOM,
            child_frame_id=BASE,
            position=np.array([x, y, 0.0]),
            orientation=_heading(heading),
            linear=np.array([reading.speed, 0.0, 0.0]),
            angular=np.array([0.0, 0.0, reading.turn_rate]),
        )


def _camera(world: World, scene: Scene, motion: Motion, seed: int) -> Iterator[Event]:
    """Yield what the log has of each image; the times are the middles of the exposures."""
    camera, calibration = world.camera, calibration_of(world.camera)
    times = list(range(0, int(motion.duration * 1e9) + 1, round(1e9 / camera.rate_hz)))
    gain = gains(len(times), 1 / camera.rate_hz, world.sensor, stream_of(seed, Cause.GAIN))
    is_rendered = bool(scene.patches)
    for k, time_ns in enumerate(times):
        time, stamp = time_ns * 1e-9, world.start_stamp_ns + time_ns
        if is_rendered:
            yield CameraInfo(
                stamp=stamp,
                topic=camera.info_topic,
                source="camera_info",
                frame_id=camera.frame,
                calibration=calibration,
            )
        pose = motion.at(time)[0]
        yield Pose(
            stamp=stamp,
            topic=TRUE_POSE,
            source="truth",
            frame_id=MAP,
            position=np.array([pose[0], pose[1], 0.0]),
            orientation=_heading(pose[2]),
        )
        yield from scene.of_image(Moment(k, stamp, pose, motion.view(time), seed))
        if is_rendered:
            noise = stream_of(seed, Cause.NOISE, k)
            yield _image(world, calibration, stamp, expose(world, scene, motion, time, (gain[k], noise)))


def expose(world: World, scene: Scene, motion: Motion, time: float, chance: tuple[float, np.random.Generator]) -> Bytes:
    """Return one picture (H, W); ``chance`` is the gain and what draws the noise."""
    calibration, sensor = calibration_of(world.camera), world.sensor
    samples = sensor.blur_samples if sensor.exposure_ms > 0 else 1
    open_s = ((np.arange(samples) + 0.5) / samples - 0.5) * sensor.exposure_ms * 1e-3
    views = [motion.view(time + dt) @ scene.eye(time + dt) for dt in open_s]
    light = render(scene.patches, views, finer(calibration, sensor.oversampling))
    gain, rng = chance
    shape = (calibration.height, calibration.width)
    return photograph(light, gain, calibration, sensor, rng.standard_normal(shape, np.float32))


def _image(world: World, calibration: Calibration, stamp: int, grey: Bytes) -> Image:
    camera = world.camera
    data, size = grey.reshape(-1), {"width": grey.shape[1], "height": grey.shape[0], "step": grey.shape[1]}
    if camera.encoding == "jpeg":
        data = cv2.imencode(".jpg", grey, [cv2.IMWRITE_JPEG_QUALITY, camera.jpeg_quality])[1].reshape(-1)
        size = {}
    data.setflags(write=False)
    return Image(
        stamp=stamp,
        topic=camera.topic,
        source="image",
        frame_id=camera.frame,
        encoding=camera.encoding,
        data=data,
        calibration=calibration,
        mount=place(base_camera(camera)),
        **size,
    )


def _heading(angle: float) -> Array:
    return quaternion(rpy(0.0, 0.0, angle))
