"""What is truly in view of a camera that looks up, and sightings made from that without an image."""

import math
from collections.abc import Iterator

import numpy as np

from ....formats.events import NO_ID, TRUE_SIGHTINGS, Array, Sightings
from ...engine.params import Field, Params
from ..camera import CameraParams, base_camera, calibration_of, project, rays_through
from ..renderer import reach
from ..scene import BASE, Cause, Run
from .ceiling import Ceiling

TOPIC = "/ground_truth/sightings"


class AbstractParams(Params):
    """Sightings without images: for Monte-Carlo tests of filters only, never for a result that is called measured."""

    topic: str = Field("/sightings", description="topic of the sightings")
    pixel_sd_px: float = Field(1.0, ge=0, description="error of a centre in u and in v [px]")
    detection_probability: float = Field(0.95, ge=0, le=1, description="that a landmark wholly in view is seen [1]")
    false_per_image: float = Field(0.0, ge=0, description="mean number of false sightings, anywhere in the image [1]")


def sightings(run: Run, camera: CameraParams, ceiling: Ceiling, abstract: AbstractParams | None) -> Iterator[Sightings]:
    """Yield what is truly in view at each image and, where they are asked for, abstract sightings instead of it."""
    for k, time_ns in enumerate(run.ticks(camera.rate_hz)):
        truth = true_sightings(run, time_ns, camera, ceiling)
        yield truth
        if abstract is not None:
            yield _abstract(truth, camera, ceiling.height, abstract, run.stream(Cause.ABSTRACT, k))


def true_sightings(run: Run, time_ns: int, camera: CameraParams, ceiling: Ceiling) -> Sightings:
    """Return what is truly in view: every landmark and false light whose whole outline lies inside the image.

    ``uv`` is the projection of the centre, not the centroid of the picture; ``xy`` is planar, without the tilt; false
    lights have the id ``NO_ID``.
    """
    calibration, time = calibration_of(camera), time_ns * 1e-9
    pose, lens = run.motion.at(time)[0], run.motion.view(time) @ base_camera(camera)
    places = np.vstack([ceiling.landmarks, ceiling.false_lights])
    ids = np.concatenate([np.arange(len(ceiling.landmarks)), np.full(len(ceiling.false_lights), NO_ID)])
    steepest = reach(calibration)
    furthest = 2.0 + 3.0 * steepest * (ceiling.height - lens.position[2])
    near = np.flatnonzero(np.hypot(*(places[:, :2] - lens.position[:2]).T) < furthest)
    around = np.linspace(0, 2 * np.pi, 32, endpoint=False)
    outline = np.zeros((len(near), 33, 3))
    outline[:, 1:, 0], outline[:, 1:, 1] = np.cos(around), np.sin(around)
    outline = places[near, None] + ceiling.radii[near, None, None] * outline
    points = (outline - lens.position) @ lens.rotation
    # The lens model is only good inside the image; far outside it may fold back in.
    is_ahead = (points[..., 2] > 0.05) & (np.abs(points[..., :2]).max(axis=-1) < steepest * points[..., 2])
    uv = project(np.where(is_ahead[..., None], points, np.nan), calibration)
    size = np.array([calibration.width, calibration.height])
    seen = ((uv >= -0.5) & (uv <= size - 0.5)).all(axis=(1, 2))
    uv, near = uv[seen], near[seen]
    c, s = math.cos(pose[2]), math.sin(pose[2])
    n = len(near)
    return Sightings(
        stamp=run.start_ns + time_ns,
        topic=TOPIC,
        source=TRUE_SIGHTINGS,
        frame_id=BASE,
        xy=(places[near, :2] - pose[:2]) @ np.array([[c, -s], [s, c]]),
        cov=np.zeros((n, 2, 2)),
        uv=uv[:, 0],
        radius=np.linalg.norm(uv[:, 1:] - uv[:, :1], axis=2).mean(axis=1),
        score=np.ones(n),
        ids=ids[near].astype(np.int64),
    )


def _abstract(
    truth: Sightings, camera: CameraParams, height: float, params: AbstractParams, rng: np.random.Generator
) -> Sightings:
    """Return sightings without an image, for Monte-Carlo tests: noisy pixels, taken to the frame of a level robot."""
    calibration = calibration_of(camera)
    size = np.array([calibration.width, calibration.height])
    scale = (height - camera.mount.z_m) * params.pixel_sd_px / calibration.fx
    detected = rng.random(len(truth.uv)) < params.detection_probability
    uv = truth.uv[detected] + params.pixel_sd_px * rng.standard_normal((int(detected.sum()), 2))
    false = rng.uniform(-0.5, size - 0.5, (int(rng.poisson(params.false_per_image)), 2))
    uv = rng.permutation(np.vstack([uv, false]))
    n = len(uv)
    return Sightings(
        stamp=truth.stamp,
        topic=params.topic,
        source="sightings",
        frame_id=BASE,
        xy=_on_ceiling(uv, camera, height) if n else np.zeros((0, 2)),
        cov=np.tile(scale**2 * np.eye(2), (n, 1, 1)),
        uv=uv,
        radius=np.full(n, np.nan),
        score=np.ones(n),
        ids=np.full(n, NO_ID, np.int64),
    )


def _on_ceiling(uv: Array, camera: CameraParams, height: float) -> Array:
    """Return where the rays of pixels (N, 2) meet the ceiling, in the frame of a level robot, (N, 2) [m]."""
    view = base_camera(camera)
    rays = rays_through(uv, calibration_of(camera))
    rays = np.concatenate([rays, np.ones((len(rays), 1))], axis=1) @ view.rotation.T
    return np.asarray(view.position[:2] + rays[:, :2] * ((height - view.position[2]) / rays[:, 2:]))
