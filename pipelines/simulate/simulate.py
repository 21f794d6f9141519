"""Drive a robot through a world and yield the messages of its log, with the truth beside them.

Topics: ``/tf_static`` and the calibration first, the start pose, then in time order odometry, the true pose and the
true sightings at each image, and the image itself. Everything random comes from the run's seed, a stream of its own
for each cause, so that another camera leaves the odometry as it was; the building comes from the world's own seed.

The truth is planar (x, y, heading of the robot on the floor plan). The tilt of the floor is not in it: it is what an
estimator that believes in a flat floor has to live with.
"""

import heapq
import math
from collections.abc import Iterator

import cv2
import numpy as np

from ...formats.events import (
    NO_ID,
    Array,
    CameraInfo,
    Event,
    Image,
    Odometry,
    Pose,
    Sightings,
    Transform,
)
from ...formats.products import LandmarkMap
from .camera import View, base_camera, calibration_of, mount_of, project, quaternion, ray_table, rays_through, rpy
from .ceiling import Ceiling, build_ceiling
from .odometry import readings
from .renderer import render
from .robot import Drive, drive
from .sensor import gains, photograph
from .world import World

MAP, ODOM, BASE = "map", "odom", "base_link"
TRUE_POSE, TRUE_SIGHTINGS = "/ground_truth/pose", "/ground_truth/sightings"
_DRIVE, _ODOMETRY, _GAIN, _NOISE, _START, _ABSTRACT = range(1, 7)


def simulate(world: World, seed: int) -> Iterator[Event]:
    """Yield the messages of one run in time order; the same world and seed give the same messages.

    Raises:
        ValueError: the world cannot be built or driven (no room for the landmarks, a lens that folds over).
    """
    ceiling = build_world(world)
    driven = drive(world.robot, np.random.default_rng([seed, _DRIVE]))
    yield from _beginning(world, driven, seed)
    moving = _odometry(world, driven, seed)
    looking = _images(world, driven, ceiling, seed) if world.images else _abstract(world, driven, ceiling, seed)
    yield from heapq.merge(moving, looking, key=lambda event: event.stamp)


def build_world(world: World) -> Ceiling:
    """Build what there is to see in a world."""
    route = np.array([[w.x_m, w.y_m] for w in world.robot.waypoints])
    return build_ceiling(world.ceiling, np.vstack([route, route[:1]]) if world.robot.is_closed else route)


def _beginning(world: World, driven: Drive, seed: int) -> Iterator[Event]:
    camera, stamp = world.camera, world.start_stamp_ns
    mount = mount_of(camera)
    yield Transform(
        stamp=stamp,
        topic="/tf_static",
        source="tf",
        frame_id=BASE,
        child_frame_id=camera.frame,
        translation=mount.translation,
        rotation=mount.rotation,
        is_static=True,
    )
    start = world.initial_pose
    sd = np.array([start.position_sd_m, start.position_sd_m, math.radians(start.heading_sd_deg)])
    x, y, heading = driven.pose[0] + sd * np.random.default_rng([seed, _START]).standard_normal(3)
    covariance = np.zeros((6, 6))
    covariance[[0, 1, 5], [0, 1, 5]] = sd**2
    yield Pose(
        stamp=stamp,
        topic=start.topic,
        source="initial_pose",
        frame_id=MAP,
        position=np.array([x, y, 0.0]),
        orientation=_heading(heading),
        covariance=covariance,
    )


def _odometry(world: World, driven: Drive, seed: int) -> Iterator[Event]:
    for reading in readings(driven, world.odometry, np.random.default_rng([seed, _ODOMETRY])):
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


def _times(world: World, driven: Drive) -> list[int]:
    """Return the middles of the exposures, in ns after the start."""
    period = round(1e9 / world.camera.rate_hz)
    return list(range(0, int(driven.duration * 1e9) + 1, period))


def _images(world: World, driven: Drive, ceiling: Ceiling, seed: int) -> Iterator[Event]:
    camera, sensor = world.camera, world.sensor
    calibration, mount, base_t_camera = calibration_of(camera), mount_of(camera), base_camera(camera)
    times = _times(world, driven)
    gain = gains(len(times), 1 / camera.rate_hz, sensor, np.random.default_rng([seed, _GAIN]))
    samples = sensor.blur_samples if sensor.exposure_ms > 0 else 1
    open_s = ((np.arange(samples) + 0.5) / samples - 0.5) * sensor.exposure_ms * 1e-3
    for k, time_ns in enumerate(times):
        stamp = world.start_stamp_ns + time_ns
        yield CameraInfo(
            stamp=stamp,
            topic=camera.info_topic,
            source="camera_info",
            frame_id=camera.frame,
            calibration=calibration,
        )
        yield from _truth(world, driven, ceiling, time_ns)
        views = [driven.view(time_ns * 1e-9 + dt) @ base_t_camera for dt in open_s]
        light = render([ceiling.patch], views, calibration)
        noise = np.random.default_rng([seed, _NOISE, k]).standard_normal(light.shape, np.float32)
        grey = photograph(light, gain[k], calibration, sensor, noise)
        data, size = grey.reshape(-1), {"width": grey.shape[1], "height": grey.shape[0], "step": grey.shape[1]}
        if camera.encoding == "jpeg":
            data = cv2.imencode(".jpg", grey, [cv2.IMWRITE_JPEG_QUALITY, camera.jpeg_quality])[1].reshape(-1)
            size = {}
        data.setflags(write=False)
        yield Image(
            stamp=stamp,
            topic=camera.topic,
            source="image",
            frame_id=camera.frame,
            encoding=camera.encoding,
            data=data,
            calibration=calibration,
            mount=mount,
            **size,
        )


def _truth(world: World, driven: Drive, ceiling: Ceiling, time_ns: int) -> Iterator[Event]:
    stamp = world.start_stamp_ns + time_ns
    pose, _, _ = driven.at(time_ns * 1e-9)
    yield Pose(
        stamp=stamp,
        topic=TRUE_POSE,
        source="truth",
        frame_id=MAP,
        position=np.array([pose[0], pose[1], 0.0]),
        orientation=_heading(pose[2]),
    )
    yield true_sightings(world, driven.view(time_ns * 1e-9), pose, ceiling, stamp)


def true_sightings(world: World, map_t_base: View, pose: Array, ceiling: Ceiling, stamp: int) -> Sightings:
    """Return what is truly in view: every landmark and false light whose whole outline lies inside the image.

    ``uv`` is the projection of the centre, not the centroid of the picture; ``xy`` is planar, without the tilt; false
    lights have the id ``NO_ID``.
    """
    calibration = calibration_of(world.camera)
    places = np.vstack([ceiling.landmarks, ceiling.false_lights])
    ids = np.concatenate([np.arange(len(ceiling.landmarks)), np.full(len(ceiling.false_lights), NO_ID)])
    camera = map_t_base @ base_camera(world.camera)
    steepest = 1.1 * float(np.abs(ray_table(calibration)).max())
    reach = 2.0 + 3.0 * steepest * (world.ceiling.height_m - camera.position[2])
    near = np.flatnonzero(np.hypot(*(places[:, :2] - camera.position[:2]).T) < reach)
    around = np.linspace(0, 2 * np.pi, 32, endpoint=False)
    outline = np.zeros((len(near), 33, 3))
    outline[:, 1:, 0], outline[:, 1:, 1] = np.cos(around), np.sin(around)
    outline = places[near, None] + ceiling.radii[near, None, None] * outline
    points = (outline - camera.position) @ camera.rotation
    # The lens model is only good inside the image; far outside it may fold back in.
    is_ahead = (points[..., 2] > 0.05) & (np.abs(points[..., :2]).max(axis=-1) < steepest * points[..., 2])
    uv = project(np.where(is_ahead[..., None], points, np.nan), calibration)
    size = np.array([calibration.width, calibration.height])
    seen = ((uv >= -0.5) & (uv <= size - 0.5)).all(axis=(1, 2))
    uv, near = uv[seen], near[seen]
    c, s = math.cos(pose[2]), math.sin(pose[2])
    n = len(near)
    return Sightings(
        stamp=stamp,
        topic=TRUE_SIGHTINGS,
        source="true_sightings",
        frame_id=BASE,
        xy=(places[near, :2] - pose[:2]) @ np.array([[c, -s], [s, c]]),
        cov=np.zeros((n, 2, 2)),
        uv=uv[:, 0],
        radius=np.linalg.norm(uv[:, 1:] - uv[:, :1], axis=2).mean(axis=1),
        score=np.ones(n),
        ids=ids[near].astype(np.int64),
    )


def _abstract(world: World, driven: Drive, ceiling: Ceiling, seed: int) -> Iterator[Event]:
    """Yield sightings without images, for Monte-Carlo tests: noisy pixels, taken to the frame of a level robot."""
    calibration, params = calibration_of(world.camera), world.sightings
    size = np.array([calibration.width, calibration.height])
    rise = world.ceiling.height_m - world.camera.mount.z_m
    scale = rise * params.pixel_sd_px / calibration.fx
    for k, time_ns in enumerate(_times(world, driven)):
        rng = np.random.default_rng([seed, _ABSTRACT, k])
        for event in _truth(world, driven, ceiling, time_ns):
            yield event
            if not isinstance(event, Sightings):
                continue
            detected = rng.random(len(event.uv)) < params.detection_probability
            uv = event.uv[detected] + params.pixel_sd_px * rng.standard_normal((int(detected.sum()), 2))
            false = rng.uniform(-0.5, size - 0.5, (int(rng.poisson(params.false_per_image)), 2))
            uv = rng.permutation(np.vstack([uv, false]))
            n = len(uv)
            yield Sightings(
                stamp=event.stamp,
                topic=params.topic,
                source="sightings",
                frame_id=BASE,
                xy=_on_ceiling(world, uv) if n else np.zeros((0, 2)),
                cov=np.tile(scale**2 * np.eye(2), (n, 1, 1)),
                uv=uv,
                radius=np.full(n, np.nan),
                score=np.ones(n),
                ids=np.full(n, NO_ID, np.int64),
            )


def _on_ceiling(world: World, uv: Array) -> Array:
    """Return where the rays of pixels (N, 2) meet the ceiling, in the frame of a level robot, (N, 2) [m]."""
    view = base_camera(world.camera)
    rays = rays_through(uv, calibration_of(world.camera))
    rays = np.concatenate([rays, np.ones((len(rays), 1))], axis=1) @ view.rotation.T
    return np.asarray(view.position[:2] + rays[:, :2] * ((world.ceiling.height_m - view.position[2]) / rays[:, 2:]))


def _heading(angle: float) -> Array:
    return quaternion(rpy(0.0, 0.0, angle))


def maps_of(world: World) -> tuple[LandmarkMap, LandmarkMap]:
    """Return the map the robot is given and the true one; landmark ids are the same in both."""
    ceiling = build_world(world)
    ids = np.arange(len(ceiling.landmarks), dtype=np.int64)
    surveyed = LandmarkMap(ids=ids, positions=ceiling.surveyed, frame_id=MAP)
    return surveyed, LandmarkMap(ids=ids, positions=ceiling.landmarks, frame_id=MAP)
