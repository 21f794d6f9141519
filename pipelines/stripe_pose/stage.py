"""The stages ``stripe-pose`` and ``write-mark-overlays``: events to arrays and back."""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import TypeVar

import numpy as np

from ...formats.calibration import Calibration, read_calibration
from ...formats.errors import ConfigError, FormatError
from ...formats.events import NO_ID, Array, Event, Image, Imu, JointState, MarkSighting, Notice, Summary
from ...formats.images import DamagedImage, grey
from ...formats.maps.marks import read_marks
from ..geometry.camera import Camera
from ..geometry.mount import robot_tilt
from ..images.checks import camera_of, check_size, damaged_image, no_calibration, no_images, topic_of
from ..images.overlays import overlays
from .attitude import Looking, Stated, Turned, expected, looking_of
from .method import find_marks
from .overlay import Seen, draw_overlay
from .paper import PaperSearch, find_marks_paper
from .params import StripePoseParams, WriteMarkOverlaysParams
from .scene import Bytes, Eye, Search, saturated_share
from .verdict import Found
from .world import robot_covariance, robot_pose, without_height

T = TypeVar("T", Imu, JointState)

NAME = "stripe-pose"
LEAN = 0.02
"""Lines that slope by more against what the camera's attitude lets expect: it is not what it is taken for."""
SATURATED = 0.4
"""Share of black and white pixels from which a row is badly exposed."""


def stripe_pose(events: Iterator[Event], params: StripePoseParams) -> Iterator[Event]:
    """Find stripe marks in images, and where the camera and the robot are: one record per mark, or one that says none.

    Tilt and roll of the camera come from options, joints, an inertial unit or the mount, in this order, and from the
    lines themselves. A damaged image is a loss and has no record.

    Raises:
        ConfigError: no marks, no calibration, one of another image size, or a camera that looks at the floor.
        ValueError: an image of depths, or of an encoding that is not supported.
    """
    finder = _Finder(params)
    for event in events:
        yield event
        if isinstance(event, Image):
            yield from finder.look(event)
        elif isinstance(event, Imu):
            finder.imu = event
        elif isinstance(event, JointState):
            finder.joints = event
        finder.last = max(finder.last, event.stamp)
    yield from finder.end()


class _Finder:
    """One log: what was last heard of the camera's attitude, and what was seen."""

    def __init__(self, params: StripePoseParams) -> None:
        self.params = params
        map_ = read_marks(params.marks)
        self.frame_id = map_.frame_id
        self.marks = {mark.id: mark for mark in map_.marks}
        if params.mark is not None and params.mark not in self.marks:
            known = ", ".join(map(str, sorted(self.marks)))
            raise ConfigError(
                f"{params.marks}: has no mark {params.mark}. It has {known}; name one of them with --mark."
            )
        if params.method == "paper" and all(len(mark.lines) < 4 for mark in map_.marks):
            raise ConfigError(
                f"{params.marks}: no mark has four lines, by whose cross ratio the paper tells marks. "
                "Use --method best, or marks of four lines."
            )
        if params.levelling == "lines" and (params.method == "paper" or params.tilt_model == "paper"):
            raise ConfigError(
                f"{NAME}: levelling: lines finds tilt and roll, which the paper takes as given. "
                "Leave it out, or use method: best with tilt_model: camera."
            )
        if params.camera is not None and params.fx_px is not None:
            raise ConfigError(f"{NAME}: camera and fx_px both say what the camera is. Leave one of them out.")
        self.given = None if params.camera is None else read_calibration(params.camera)
        self.search = _search_of(params)
        said = (params.pan_deg, params.tilt_deg, params.roll_deg)
        self.stated = Stated(*(None if deg is None else float(np.radians(deg)) for deg in said))
        self.imu: Imu | None = None
        self.joints: JointState | None = None
        self.last = 0
        self.images = 0
        self.damaged = 0
        self.statuses: Counter[str] = Counter()
        self.by_mark: Counter[int] = Counter()
        self.said: set[str] = set()
        self.camera: tuple[Calibration, Camera] | None = None

    def look(self, event: Image) -> Iterator[Event]:
        """Find the marks of one image."""
        try:
            pixels = grey(event)
        except DamagedImage as err:
            yield damaged_image(event, err, NAME)
            self.damaged += 1
            return
        self.images += 1
        eye, mount = self._eye(event, pixels)
        yield from self._silence(event)
        yield from self._exposure(event, pixels, eye)
        if self.params.method == "paper":
            p = self.params
            search = PaperSearch(p.gradient, p.cross_ratio_share, p.mean_rows, p.mark)
            found = find_marks_paper(pixels, eye, list(self.marks.values()), search, p.tilt_model)
        else:
            found = find_marks(pixels, eye, list(self.marks.values()), self.search)
        yield from self._warn(event, found, eye)
        for item in found:
            self.statuses[item.status] += 1
            self.by_mark[item.mark] += item.status == "ok"
            yield self._sighting(event, item, eye, mount)
        if not found:
            self.statuses["no_mark"] += 1
            yield self._nothing(event.stamp, eye)

    def end(self) -> Iterator[Event]:
        """Sum up."""
        if self.images == 0 and self.damaged:
            raise FormatError(f"{NAME}: all images of this log are damaged ({self.damaged}). Record them again.")
        if self.images == 0:
            raise no_images(NAME)
        joint = self.params.pan_joint or self.params.tilt_joint
        if joint is not None and self.joints is None:
            raise ConfigError(
                f"{NAME}: there are no joint states in this log that tell of {joint!r}. "
                "Name their topic with --topic joints=/NAME, or leave the joint out."
            )
        n = f"{self.images} images" if self.images > 1 else "the image"
        if set(self.statuses) == {"no_mark"}:
            raise ConfigError(
                f"{self.params.marks}: no_mark: none of its marks was recognised in {n}. "
                "Name the marks that hang there; --check-marks tells what they need to be read."
            )
        if not any(self.by_mark.values()):
            seen = ", ".join(f"{count} {status}" for status, count in sorted(self.statuses.items()))
            message = f"no mark of {self.params.marks} is sure in {n}: {seen}."
            if self.statuses["mirrored_or_back"]:
                message += " Those are seen in a mirror, or the image is flipped or upside down."
            yield Notice(stamp=self.last, source=NAME, code="no-mark", message=message)
        values = {
            "images": self.images,
            "sightings": dict(sorted(self.statuses.items())),
            "marks": {str(mark): self.by_mark[mark] for mark in sorted(self.marks)},
        }
        yield Summary(stamp=self.last, source=NAME, values=values)

    # ---- the camera -------------------------------------------------------------------------------------------

    def _eye(self, event: Image, pixels: Bytes) -> tuple[Eye, Array]:
        """Return the camera with what is known of its attitude, and its mount.

        The mount is x, y, height, pan, tilt, roll of the camera on the robot [m, rad].
        """
        camera = self._lens(event, pixels)
        looking = self._looking(event, level=False)
        if max(abs(looking.tilt), abs(looking.roll)) > np.pi / 4:
            raise ConfigError(
                f"{NAME}: the camera is tilted by {np.degrees(looking.tilt):.1f} and rolled by "
                f"{np.degrees(looking.roll):.1f} deg; beyond 45 deg it sees no upright marks. "
                "Correct the mount, or give --tilt DEG and --roll DEG."
            )
        p = self.params
        tilt_sd, roll_sd = (None if sd is None else float(np.radians(sd)) for sd in (p.tilt_sd_deg, p.roll_sd_deg))
        levelling = "given" if p.method == "paper" or p.tilt_model == "paper" else p.levelling
        attitude = expected(looking, levelling, tilt_sd, roll_sd)
        logged = np.zeros(3) if event.mount is None else event.mount.translation
        given = (p.mount_x_m, p.mount_y_m, p.mount_z_m)
        place = [float(logged[i]) if value is None else value for i, value in enumerate(given)]
        on_robot = self._looking(event, level=True)
        mount = np.array([*place, on_robot.pan, on_robot.tilt, on_robot.roll])
        height, width = pixels.shape
        return Eye(camera, width, height, attitude), mount

    def _lens(self, event: Image, pixels: Bytes) -> Camera:
        """Return the lens that an option, a calibration file or the log tells, in this order."""
        height, width = pixels.shape
        fx = self.params.fx_px
        c = self.given or event.calibration
        if fx is not None:
            c = Calibration(width, height, fx, fx, 0.5 * (width - 1), 0.5 * (height - 1))
        if c is None:
            raise no_calibration(event, NAME, "Pass one with --camera FILE, or --fx PX.")
        check_size(event, pixels, (c.width, c.height), NAME)
        if self.camera is None or self.camera[0] != c:
            try:
                self.camera = (c, camera_of(c))
            except ValueError as err:
                raise ConfigError(f"{NAME}: {err}. Calibrate the camera, or pass --camera FILE.") from err
        return self.camera[1]

    def _looking(self, event: Image, *, level: bool) -> Looking:
        """Return pan, tilt and roll; on a ``level`` robot the inertial unit has nothing to say."""
        imu, joints = self._fresh(self.imu, event), self._fresh(self.joints, event)
        tilted = None
        if imu is not None and imu.orientation is not None and not level:
            tilted = robot_tilt(imu.orientation, None if imu.mount is None else imu.mount.rotation)
        turned = Turned(*(_position(joints, name) for name in (self.params.tilt_joint, self.params.pan_joint)))
        return looking_of(None if event.mount is None else event.mount.rotation, tilted, turned, self.stated)

    def _fresh(self, heard: T | None, event: Image) -> T | None:
        """Return what was heard last if it is not too old."""
        age = round(self.params.attitude_age_s * 1e9)
        return heard if heard is not None and event.stamp - heard.stamp <= age else None

    # ---- what a person should know ----------------------------------------------------------------------------

    def _silence(self, event: Image) -> Iterator[Notice]:
        p = self.params
        is_silent = (p.pan_joint or p.tilt_joint) is not None and self._fresh(self.joints, event) is None
        if is_silent and "joints" not in self.said:
            self.said.add("joints")
            what = (
                "its tilt is found by the lines alone"
                if p.pan_joint is None
                else "it tells where the camera is, and not where the robot is"
            )
            message = (
                f"no joint states came within {p.attitude_age_s:g} s before an image on {topic_of(event)}, and maybe "
                f"others; {what}."
            )
            yield Notice(stamp=event.stamp, source=NAME, code="joints-silent", message=message)

    def _exposure(self, event: Image, pixels: Bytes, eye: Eye) -> Iterator[Notice]:
        share = saturated_share(pixels, eye.row)
        if share > SATURATED and "saturated" not in self.said:
            self.said.add("saturated")
            message = (
                f"{100 * share:.0f} % of the middle row of an image on {topic_of(event)} are black or white; edges "
                "may be off by a common shift. Expose for the marks."
            )
            yield Notice(stamp=event.stamp, source=NAME, code="saturated", message=message)

    def _warn(self, event: Image, found: list[Found], eye: Eye) -> Iterator[Notice]:
        lean = max((item.lean for item in found if item.status == "ok"), default=0.0)
        is_trusted = not (eye.attitude.tilt_sd > 0 and eye.attitude.roll_sd > 0)
        if lean > LEAN and (is_trusted or not self._looking(event, level=False).is_known):
            what = "taken as given" if is_trusted else "not known, and found from the lines alone"
            message = (
                f"the lines of a mark lean by up to {100 * lean:.1f} % against those of a level camera, whose tilt and "
                f"roll are {what}. Pass --tilt DEG and --roll DEG, or log them (imu, joints, tf_static)."
            )
            yield Notice(stamp=event.stamp, source=NAME, code="not-level", message=message)

    # ---- events -----------------------------------------------------------------------------------------------

    def _sighting(self, event: Image, item: Found, eye: Eye, mount: Array) -> MarkSighting:
        place = self.marks[item.mark].pose
        p = self.params
        if p.tilt_model == "paper" or p.levelling == "lines" or not self._looking(event, level=True).is_known:
            # How the camera stands on the robot is not known, so the lines do not say how the robot leans. Without
            # height its lens does not move.
            mount = without_height(mount)
        leaning = item.attitude - mount[4:]
        return MarkSighting(
            stamp=event.stamp,
            source=NAME,
            frame_id=self.frame_id,
            mark=item.mark,
            status=item.status,
            pose=item.pose,
            cov=item.cov[:3, :3],
            attitude=item.attitude,
            robot=robot_pose(place, item.pose, mount, leaning),
            robot_cov=robot_covariance(place, item.pose, mount, leaning, item.cov),
            row=eye.row,
            lines=item.lines,
            members=item.members,
        )

    def _nothing(self, stamp: int, eye: Eye) -> MarkSighting:
        nowhere, unknown = np.full(3, np.nan), np.full((3, 3), np.nan)
        return MarkSighting(
            stamp=stamp,
            source=NAME,
            frame_id=self.frame_id,
            mark=NO_ID,
            status="no_mark",
            pose=nowhere,
            cov=unknown,
            attitude=np.array([eye.attitude.tilt, eye.attitude.roll]),
            robot=nowhere,
            robot_cov=unknown,
            row=eye.row,
            lines=np.empty((0, 5)),
            members=np.empty(0, dtype=np.int64),
        )


def write_mark_overlays(events: Iterator[Event], params: WriteMarkOverlaysParams) -> Iterator[Event]:
    """Write a picture per image with the marks that ``stripe-pose`` found in it."""

    def drawn(pixels: Bytes, seen: Sequence[MarkSighting]) -> Bytes:
        names = ["" if s.mark == NO_ID else str(s.mark) for s in seen]
        rows = zip(names, seen, strict=True)
        return draw_overlay(pixels, [Seen(name, s.status, s.pose, s.lines, s.row) for name, s in rows])

    yield from overlays(events, MarkSighting, params.source, drawn, folder=params.path, every=params.every)


def _search_of(p: StripePoseParams) -> Search:
    return Search(
        row_step=p.row_step_px,
        skips=p.skips,
        tolerance_px=p.edge_px,
        residual_px=p.residual_px,
        residual_share=p.residual_share,
        least_rows=p.least_rows,
        least_gap_px=p.least_gap_px,
        blend_px=p.blend_px,
        floor_px=p.floor_px,
        max_angle=float(np.radians(p.max_angle_deg)),
        near=p.near_m,
        far=p.far_m,
        max_phi_sd=float(np.radians(p.max_phi_sd_deg)),
        hidden=p.hidden,
        given=p.mark,
        is_leaning=p.tilt_model == "paper",
    )


def _position(joints: JointState | None, name: str | None) -> float | None:
    """Return the position of a joint [rad]: nan if joints are silent, None if none was named."""
    if name is None or joints is None:
        return None if name is None else np.nan
    if name not in joints.names:
        raise ConfigError(
            f"{NAME}: {joints.topic or 'the log'} has no joint {name!r}. It has {', '.join(joints.names) or 'none'}."
        )
    value = float(joints.positions[joints.names.index(name)])
    if not np.isfinite(value):
        raise ValueError(f"the position of joint {name!r} is not finite. Repair or cut the log there.")
    return value
