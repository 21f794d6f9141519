"""What is said of images that cannot be used."""

import numpy as np
import pytest

from logpose.formats.calibration import Calibration
from logpose.formats.errors import ConfigError
from logpose.formats.events import Image
from logpose.formats.images import DamagedImage
from logpose.pipelines.images.checks import (
    camera_of,
    check_size,
    damaged_image,
    no_calibration,
    no_images,
    topic_of,
)

IMAGE = Image(stamp=7, topic="/top", encoding="mono8", data=np.zeros(12, np.uint8), width=4, height=3, step=4)
FILE = Image(stamp=7, topic="", encoding="mono8", data=np.zeros(12, np.uint8), width=4, height=3, step=4)


def test_an_image_without_topic_comes_from_this_log():
    assert topic_of(IMAGE) == "/top"
    assert topic_of(FILE) == "this log"


def test_the_calibration_must_be_for_this_size():
    check_size(IMAGE, np.zeros((3, 4), np.uint8), (4, 3), "me")
    with pytest.raises(
        ConfigError, match=r"^me: the images on /top are 4x3 px, their calibration is for 3x4 px\. Give"
    ):
        check_size(IMAGE, np.zeros((3, 4), np.uint8), (3, 4), "me")


def test_errors_name_the_stage_the_topic_and_the_cure():
    assert str(no_calibration(IMAGE, "me", "Do that.")).startswith(
        "me: there is no calibration for the images on /top ("
    )
    assert str(no_calibration(IMAGE, "me", "Do that.")).endswith(" Do that.")
    assert str(no_images("me")).startswith("me: there are no images in this log")


def test_a_damaged_image_is_a_loss_at_its_stamp():
    notice = damaged_image(IMAGE, DamagedImage("half a JPEG"), "me")
    assert (notice.stamp, notice.source, notice.is_loss) == (7, "me", True)
    assert notice.message == "/top holds half a JPEG; it is skipped."


def test_a_calibration_is_a_lens():
    camera = camera_of(Calibration(4, 3, 100.0, 110.0, 1.5, 1.0))
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (100.0, 110.0, 1.5, 1.0)
