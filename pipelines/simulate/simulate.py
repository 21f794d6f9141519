"""Let a robot move through a world and yield the messages of its log, with the truth beside them.

Topics: ``/tf_static`` and the start pose first, then in time order what the sensors say and, at each image, the
calibration, the true pose, what else the kind of world knows of the image, and the image itself. Everything random
comes from the run's seed, a stream of its own for each cause, so that another camera leaves the odometry as it was; the
building comes from the world's own seed.

The truth is planar (x, y, heading of the robot on the floor plan). The tilt of the floor is not in it: it is what an
estimator that believes in a flat floor has to live with.
"""

import heapq
from collections.abc import Iterator

import cv2
import numpy as np

from ...formats.calibration import Calibration
from ...formats.events import Bytes, CameraInfo, Event, Image, Pose
from .bench import BenchScene, BenchWorld
from .camera import base_camera, calibration_of
from .ceiling_world import CeilingScene, CeilingWorld
from .imu import attitude
from .odometry import odometry
from .parts import DrivenParts
from .pose import place, quaternion, rpy
from .renderer import finer, render
from .scene import MAP, Cause, Moment, Motion, Run, Scene
from .sensor import gains, photograph
from .start import frames, start_pose
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
    run = Run(scene.motion(seed), world.start_stamp_ns, seed)
    mounts = [(world.camera.frame, place(base_camera(world.camera)))]
    streams: list[Iterator[Event]] = []
    if isinstance(world, DrivenParts):
        streams += [start_pose(run, world.initial_pose), odometry(run, world.odometry)]
        if world.imu is not None:
            mounts.append((world.imu.frame, place(world.imu.mount.view)))
            streams.append(attitude(run, world.imu))
    streams = [frames(run, mounts), *streams, *scene.sensors(run), _camera(world, scene, run)]
    yield from heapq.merge(*streams, key=lambda event: event.stamp)


def _camera(world: World, scene: Scene, run: Run) -> Iterator[Event]:
    """Yield what the log has of each image; the times are the middles of the exposures."""
    camera, calibration = world.camera, calibration_of(world.camera)
    motion, times = run.motion, run.ticks(camera.rate_hz)
    gain = gains(len(times), 1 / camera.rate_hz, world.sensor, run.stream(Cause.GAIN))
    is_rendered = bool(scene.patches)
    for k, time_ns in enumerate(times):
        time, stamp = time_ns * 1e-9, run.start_ns + time_ns
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
            orientation=quaternion(rpy(0.0, 0.0, pose[2])),
        )
        yield from scene.of_image(Moment(k, stamp, pose, motion.view(time), run.seed))
        if is_rendered:
            noise = run.stream(Cause.NOISE, k)
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
