"""Pictures written as PNG, whole or not at all."""

from pathlib import Path

import cv2

from .events import Bytes
from .files import replacing


def write_png(path: str | Path, pixels: Bytes) -> None:
    """Write a picture.

    Args:
        path: file to write.
        pixels: (H, W) grey or (H, W, 3) blue, green, red.

    Raises:
        ValueError: pixels that make no PNG.
    """
    if pixels.dtype != "uint8" or pixels.ndim not in (2, 3) or pixels.size == 0:
        raise ValueError(f"an array of {pixels.dtype} {pixels.shape} is no 8 bit picture")
    is_done, data = cv2.imencode(".png", pixels)
    if not is_done:
        raise ValueError(f"an array of {pixels.shape} cannot be written as PNG")
    with replacing(path) as stream:
        stream.write(data.tobytes())
