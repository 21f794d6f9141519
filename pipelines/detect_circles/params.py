"""Parameters of ``detect-circles`` and ``write-overlays``."""

from typing import Literal

from ..engine.params import Field, InputPath, OutputPath, Params


class DetectCirclesParams(Params):
    """What to look for on the ceiling, and through which camera."""

    method: Literal["best", "paper"] = Field(
        "best", description="sub-pixel detector, or the paper's blur, threshold and Hough transform"
    )
    polarity: Literal["bright", "dark", "both"] = Field("bright", description="bright or dark circles")
    ceiling_m: float | None = Field(None, gt=0, description="height of the features above base_link [m]")
    map: InputPath | None = Field(None, description="landmark map whose height is the ceiling's if that is not given")
    lamp_diameter_m: float | None = Field(None, gt=0, description="diameter of the lamps; sets the radius range [m]")
    min_radius_px: float | None = Field(None, ge=1.5, description="least radius in the image [px]")
    max_radius_px: float | None = Field(None, ge=2, description="greatest radius in the image [px]")
    camera: InputPath | None = Field(None, description="calibration file; wins over CameraInfo in the log")
    mount_x_m: float = Field(0.0, description="lens ahead of base_link, if the log has no tf_static [m]")
    mount_y_m: float = Field(0.0, description="lens left of base_link, likewise [m]")
    mount_z_m: float = Field(0.0, description="lens above base_link, likewise [m]")
    mount_yaw_deg: float = Field(0.0, description="turn of an upward camera; 0: image top is forward [deg]")
    flip_x: bool = Field(default=False, description="the images are mirrored left to right")
    sigma_px: float = Field(0.05, gt=0, description="part of a centre's error that no single image shows [px]")
    tilt_deg: float = Field(0.0, ge=0, description="standard deviation of the robot's unknown tilt [deg]")
    blur_px: int = Field(7, ge=1, le=63, description="method paper: side of the Gaussian kernel, odd [px]")
    threshold: float | None = Field(140.0, ge=0, le=255, description="method paper: brightness; null takes Otsu's")
    hough_canny: float = Field(100.0, gt=0, description="method paper: upper threshold of the edge detector")
    hough_votes: float = Field(14.0, gt=0, description="method paper: least votes for a centre")
    hough_sigma_px: float = Field(1.5, gt=0, description="method paper: standard deviation of a centre [px]")


class WriteOverlaysParams(Params):
    """Where the pictures go."""

    path: OutputPath = Field("overlays", description="folder to write; one PNG per image, named by its stamp")
    every: int = Field(1, ge=1, description="write every n-th image only")
