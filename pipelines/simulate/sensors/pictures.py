"""What a camera writes into the log: its calibration and its images, at the middles of their exposures."""

from collections.abc import Callable, Iterator, Sequence

import cv2
import numpy as np

from ....formats.events import Bytes, CameraInfo, Image
from ..camera import CameraParams, base_camera, calibration_of
from ..pose import View, place
from ..renderer import Patch, finer, render
from ..scene import Cause, Run
from .imager import ImagerParams, gains, photograph


def camera_infos(run: Run, camera: CameraParams) -> Iterator[CameraInfo]:
    """Yield the calibration with each image."""
    calibration = calibration_of(camera)
    for time_ns in run.ticks(camera.rate_hz):
        yield CameraInfo(
            stamp=run.start_ns + time_ns,
            topic=camera.info_topic,
            source="camera_info",
            frame_id=camera.frame,
            calibration=calibration,
        )


def pictures(
    run: Run, patches: Sequence[Patch], camera: CameraParams, sensor: ImagerParams, eye: Callable[[float], View]
) -> Iterator[Image]:
    """Yield the images of a run.

    Args:
        run: through the scene.
        patches: what there is to see.
        camera: lens, place on the robot, and topic.
        sensor: the imager behind the lens.
        eye: base_T_camera at a time [s].

    Raises:
        ValueError: the lens folds over inside the image.
    """
    calibration, ticks = calibration_of(camera), run.ticks(camera.rate_hz)
    shape = (calibration.height, calibration.width)
    gain = gains(len(ticks), 1 / camera.rate_hz, sensor, run.stream(Cause.GAIN))
    samples = sensor.blur_samples if sensor.exposure_ms > 0 else 1
    open_s = ((np.arange(samples) + 0.5) / samples - 0.5) * sensor.exposure_ms * 1e-3
    for k, time_ns in enumerate(ticks):
        views = [run.motion.view(time) @ eye(time) for time in time_ns * 1e-9 + open_s]
        light = render(patches, views, finer(calibration, sensor.oversampling))
        noise = run.stream(Cause.NOISE, k).standard_normal(shape, np.float32)
        yield _image(run.start_ns + time_ns, photograph(light, gain[k], calibration, sensor, noise), camera)


def _image(stamp: int, grey: Bytes, camera: CameraParams) -> Image:
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
        calibration=calibration_of(camera),
        mount=place(base_camera(camera)),
        **size,
    )
