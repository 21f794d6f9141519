"""Parameters of ``stripe-pose``."""

from typing import Literal

from ..engine.params import Field, InputPath, OutputPath, Params


class StripePoseParams(Params):
    """Which marks are looked for, through which camera, and how strictly."""

    method: Literal["best", "paper"] = Field(
        "best", description="all rows, sub-pixel, self-levelling; or the paper's: one row, whole pixels, three lines"
    )
    marks: InputPath = Field(description="map of the stripe marks, marks.yaml")
    mark: int | None = Field(None, ge=0, description="id of the only mark that is seen, where that is known")
    camera: InputPath | None = Field(None, description="calibration file; wins over CameraInfo in the log")
    fx_px: float | None = Field(
        None, gt=0, description="focal length of a camera without distortion, its axis in the middle of the image [px]"
    )

    mount_x_m: float | None = Field(None, description="lens ahead of base_link; wins over tf_static [m]")
    mount_y_m: float | None = Field(None, description="lens left of base_link, likewise [m]")
    mount_z_m: float | None = Field(None, description="lens above base_link, likewise; a leaning robot moves it [m]")
    pan_deg: float | None = Field(
        None, description="where the camera looks, counter-clockwise from ahead, likewise [deg]"
    )
    tilt_deg: float | None = Field(
        None, ge=-45, le=45, description="optical axis above the horizon, likewise and over what the log says [deg]"
    )
    roll_deg: float | None = Field(
        None, ge=-45, le=45, description="turn about the optical axis, clockwise as seen from behind, likewise [deg]"
    )
    tilt_sd_deg: float | None = Field(
        None, ge=0, description="standard deviation of the tilt; not given: 0.3 for imu and joints, 1 for options and "
        "tf_static, 4 where nothing is known [deg]",
    )  # fmt: skip
    roll_sd_deg: float | None = Field(None, ge=0, description="the same of the roll; 0.3, 1, 2 [deg]")
    levelling: Literal["best", "lines", "given"] = Field(
        "best", description="tilt and roll from what is known and the lines, from the lines alone, or as given"
    )
    tilt_model: Literal["camera", "paper"] = Field(
        "camera", description="what tilts: the camera, or the mark about its own axes as in the paper's eq. (6)"
    )
    tilt_joint: str | None = Field(None, description="joint of JointState that tilts the camera up")
    pan_joint: str | None = Field(None, description="joint of JointState that pans it counter-clockwise")
    attitude_age_s: float = Field(0.5, gt=0, description="imu and joints older than this are not used [s]")

    row_step_px: int = Field(8, ge=1, description="one of so many rows is searched for marks [px]")
    skips: int = Field(2, ge=0, le=8, description="edges within a mark that may belong to something else [1]")
    hidden: bool = Field(default=True, description="also look for marks of which a part is hidden")
    edge_px: float = Field(0.5, gt=0, description="largest error of an edge on a single row [px]")
    residual_px: float = Field(0.3, gt=0, description="largest root mean square error of a mark's lines [px]")
    residual_share: float = Field(0.04, gt=0, description="the same as part of the least gap between lines [1]")
    least_rows: int = Field(5, ge=3, description="a mark crosses at least so many rows [1]")
    least_gap_px: float = Field(2.5, gt=0, description="nearer lines are poor geometry [px]")
    blend_px: float = Field(
        7.0, ge=0, description="nearer edges are fitted as a whole; larger is slower and a fifth more exact [px]"
    )
    floor_px: float = Field(0.002, ge=0, description="part of a line's error that no image shows [px]")
    max_phi_sd_deg: float = Field(10.0, gt=0, description="a less certain angle is poor geometry [deg]")
    max_angle_deg: float = Field(80.0, gt=0, lt=90, description="largest angle between camera and mark [deg]")
    near_m: float = Field(0.05, gt=0, description="least distance of a mark [m]")
    far_m: float = Field(50.0, gt=0, description="greatest distance of a mark [m]")

    gradient: float = Field(40.0, gt=0, description="method paper: least difference of the pixels beside an edge")
    cross_ratio_share: float = Field(
        0.1, gt=0, lt=1, description="method paper: largest relative error of the cross ratio [1]"
    )
    mean_rows: int = Field(5, ge=1, description="method paper: rows whose edges are averaged [1]")


class WriteMarkOverlaysParams(Params):
    """Where the pictures go."""

    path: OutputPath = Field("overlays", description="folder to write; one PNG per image, named by its stamp")
    source: str = Field("stripe-pose", description="name of the stage whose sightings of marks are drawn")
    every: int = Field(1, ge=1, description="write every n-th image only")
