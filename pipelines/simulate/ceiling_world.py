"""Worlds of the kind ``ceiling``: a hall, a robot with a camera that looks up, and what is truly in view of it."""

import math
from collections.abc import Iterator, Sequence
from typing import Literal, Self

import numpy as np
from pydantic import model_validator

from ...formats.events import NO_ID, Array, Event, Sightings
from ...formats.products import LandmarkMap
from ..engine.params import Field, Params
from .camera import base_camera, calibration_of, project, rays_through
from .ceiling import Ceiling, CeilingParams, build_ceiling
from .parts import DrivenParts
from .pose import View
from .renderer import Patch, reach
from .robot import Drive, drive
from .scene import BASE, MAP, Cause, Maps, Moment, Run, stream_of

TRUE_SIGHTINGS = "/ground_truth/sightings"


class AbstractParams(Params):
    """Sightings without images: for Monte-Carlo tests of filters only, never for a result that is called measured."""

    topic: str = Field("/sightings", description="topic of the sightings")
    pixel_sd_px: float = Field(1.0, ge=0, description="error of a centre in u and in v [px]")
    detection_probability: float = Field(0.95, ge=0, le=1, description="that a landmark wholly in view is seen [1]")
    false_per_image: float = Field(0.0, ge=0, description="mean number of false sightings, anywhere in the image [1]")


class CeilingWorld(DrivenParts):
    """A hall with landmarks on its ceiling, and a robot with a camera that looks up."""

    kind: Literal["ceiling"] = Field(description="what there is to see")
    ceiling: CeilingParams = Field(description="the building")
    images: bool = Field(True, description="render images; otherwise abstract sightings, for Monte-Carlo tests only")
    sightings: AbstractParams = Field(AbstractParams(), description="used where images is false")

    @model_validator(mode="after")
    def _lens_is_below_ceiling(self) -> Self:
        if self.ceiling.height_m - self.camera.mount.z_m < 0.1:
            raise ValueError(
                f"ceiling.height_m is {self.ceiling.height_m}, the lens is at {self.camera.mount.z_m} m. "
                "The ceiling must be at least 0.1 m above the lens."
            )
        return self


class CeilingScene:
    """A hall as built.

    Raises:
        ValueError: it cannot be built, there is no room for the landmarks.
    """

    def __init__(self, world: CeilingWorld) -> None:
        self.world = world
        route = np.array([[w.x_m, w.y_m] for w in world.robot.waypoints])
        self.building = build_ceiling(world.ceiling, np.vstack([route, route[:1]]) if world.robot.is_closed else route)

    @property
    def patches(self) -> Sequence[Patch]:
        """The ceiling; nothing where sightings are abstract."""
        return (self.building.patch,) if self.world.images else ()

    @property
    def maps(self) -> Maps:
        """The map the robot is given and the true one; landmark ids are the same in both."""
        ids = np.arange(len(self.building.landmarks), dtype=np.int64)
        return {
            ".landmarks.yaml": LandmarkMap(ids=ids, positions=self.building.surveyed, frame_id=MAP),
            ".landmarks.true.yaml": LandmarkMap(ids=ids, positions=self.building.landmarks, frame_id=MAP),
        }

    def motion(self, seed: int) -> Drive:
        """Return the drive along the route."""
        return drive(self.world.robot, stream_of(seed, Cause.DRIVE))

    def eye(self, time: float) -> View:  # noqa: ARG002
        """Return base_T_camera, which is fixed."""
        return base_camera(self.world.camera)

    def of_image(self, moment: Moment) -> Iterator[Event]:
        """Yield what is truly in view, and abstract sightings instead of an image."""
        truth = true_sightings(self.world, moment.map_t_base, moment.pose, self.building, moment.stamp)
        yield truth
        if not self.world.images:
            yield _abstract(self.world, truth, stream_of(moment.seed, Cause.ABSTRACT, moment.index))

    def sensors(self, run: Run) -> Sequence[Iterator[Event]]:  # noqa: ARG002
        """Return no further sensors."""
        return ()


def true_sightings(world: CeilingWorld, map_t_base: View, pose: Array, ceiling: Ceiling, stamp: int) -> Sightings:
    """Return what is truly in view: every landmark and false light whose whole outline lies inside the image.

    ``uv`` is the projection of the centre, not the centroid of the picture; ``xy`` is planar, without the tilt; false
    lights have the id ``NO_ID``.
    """
    calibration = calibration_of(world.camera)
    places = np.vstack([ceiling.landmarks, ceiling.false_lights])
    ids = np.concatenate([np.arange(len(ceiling.landmarks)), np.full(len(ceiling.false_lights), NO_ID)])
    camera = map_t_base @ base_camera(world.camera)
    steepest = reach(calibration)
    furthest = 2.0 + 3.0 * steepest * (world.ceiling.height_m - camera.position[2])
    near = np.flatnonzero(np.hypot(*(places[:, :2] - camera.position[:2]).T) < furthest)
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


def _abstract(world: CeilingWorld, truth: Sightings, rng: np.random.Generator) -> Sightings:
    """Return sightings without an image, for Monte-Carlo tests: noisy pixels, taken to the frame of a level robot."""
    calibration, params = calibration_of(world.camera), world.sightings
    size = np.array([calibration.width, calibration.height])
    scale = (world.ceiling.height_m - world.camera.mount.z_m) * params.pixel_sd_px / calibration.fx
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
        xy=_on_ceiling(world, uv) if n else np.zeros((0, 2)),
        cov=np.tile(scale**2 * np.eye(2), (n, 1, 1)),
        uv=uv,
        radius=np.full(n, np.nan),
        score=np.ones(n),
        ids=np.full(n, NO_ID, np.int64),
    )


def _on_ceiling(world: CeilingWorld, uv: Array) -> Array:
    """Return where the rays of pixels (N, 2) meet the ceiling, in the frame of a level robot, (N, 2) [m]."""
    view = base_camera(world.camera)
    rays = rays_through(uv, calibration_of(world.camera))
    rays = np.concatenate([rays, np.ones((len(rays), 1))], axis=1) @ view.rotation.T
    return np.asarray(view.position[:2] + rays[:, :2] * ((world.ceiling.height_m - view.position[2]) / rays[:, 2:]))
