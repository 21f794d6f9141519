"""What every stage that looks at images asks of them, and says of those it cannot use."""

import numpy as np
import numpy.typing as npt

from ...formats.calibration import Calibration
from ...formats.errors import ConfigError
from ...formats.events import Image, Notice
from ...formats.images import DamagedImage
from ..geometry.camera import Camera


def topic_of(event: Image) -> str:
    """Return where an image comes from, as messages name it."""
    return event.topic or "this log"


def camera_of(calibration: Calibration) -> Camera:
    """Return the lens of a calibration.

    Raises:
        ValueError: it is none.
    """
    c = calibration
    return Camera(c.fx, c.fy, c.cx, c.cy, c.model, c.distortion)


def check_size(event: Image, pixels: npt.NDArray[np.uint8], calibrated: tuple[int, int], source: str) -> None:
    """Refuse an image whose calibration is that of images of another width and height.

    Raises:
        ConfigError: it is.
    """
    height, width = pixels.shape
    if (width, height) != calibrated:
        raise ConfigError(
            f"{source}: the images on {topic_of(event)} are {width}x{height} px, their calibration is for "
            f"{calibrated[0]}x{calibrated[1]} px. Give the calibration of this camera and image size with "
            "--camera FILE."
        )


def no_calibration(event: Image, source: str, cure: str) -> ConfigError:
    """Return the error of an image without calibration, and how to give one."""
    return ConfigError(
        f"{source}: there is no calibration for the images on {topic_of(event)} (no CameraInfo in the log, or one with "
        f"focal length 0: the camera is not calibrated). {cure}"
    )


def no_images(source: str) -> ConfigError:
    """Return the error of a log without images."""
    return ConfigError(
        f"{source}: there are no images in this log, or in this part of it. Name their topic with --topic image=/NAME."
    )


def damaged_image(event: Image, err: DamagedImage, source: str) -> Notice:
    """Return the loss of an image that cannot be decoded."""
    message = f"{topic_of(event)} holds {err}; it is skipped."
    return Notice(stamp=event.stamp, source=source, code="damaged-image", message=message, is_loss=True)
