"""Logged images -> pixels.

``decode`` gives what was photographed: grey (H, W) or colour (H, W, 3) in the order red, green, blue, 8 bit as uint8,
16 bit as uint16, depth as it was stored. ``grey`` gives what a detector wants: uint8 (H, W).

Encodings are those of ``sensor_msgs/image_encodings.h`` and, for compressed images, the format of
``compressed_image_transport``. Sizes are checked before anything is touched: ``width * bytes per pixel <= step`` and
``step * height == len(data)``.
"""

import struct
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from .events import Bytes, Image

Pixels = npt.NDArray[Any]

_LAYOUTS: dict[str, tuple[str, int]] = {
    "mono8": ("u1", 1),
    "mono16": ("u2", 1),
    "rgb8": ("u1", 3),
    "bgr8": ("u1", 3),
    "rgba8": ("u1", 4),
    "bgra8": ("u1", 4),
    "rgb16": ("u2", 3),
    "bgr16": ("u2", 3),
    "8UC1": ("u1", 1),
    "8UC3": ("u1", 3),
    "16UC1": ("u2", 1),
    "32FC1": ("f4", 1),
    "yuv422": ("u1", 2),
    "uyvy": ("u1", 2),
    "yuv422_yuy2": ("u1", 2),
    "yuyv": ("u1", 2),
    **{
        f"bayer_{pattern}{bits}": (f"u{bits // 8}", 1)
        for pattern in ("rggb", "bggr", "gbrg", "grbg")
        for bits in (8, 16)
    },
}

# OpenCV names a pattern by the second row's second and third pixel: RGGB is its "BG".
_BAYER = {
    "rggb": cv2.COLOR_BayerBG2RGB,
    "bggr": cv2.COLOR_BayerRG2RGB,
    "gbrg": cv2.COLOR_BayerGR2RGB,
    "grbg": cv2.COLOR_BayerGB2RGB,
}

_YUV = {
    "yuv422": cv2.COLOR_YUV2RGB_UYVY,
    "uyvy": cv2.COLOR_YUV2RGB_UYVY,
    "yuv422_yuy2": cv2.COLOR_YUV2RGB_YUY2,
    "yuyv": cv2.COLOR_YUV2RGB_YUY2,
}

_DEPTH_HEADER = struct.Struct("<iff")
"""What stands before the PNG of a ``compressedDepth`` image: its format and two quantisation parameters."""


class DamagedImage(ValueError):  # noqa: N818  # it names what was met
    """Bytes that are no picture: one message is lost, the log goes on."""


def decode(image: Image) -> Pixels:
    """Return the pixels of an image.

    Returns:
        (H, W) or (H, W, 3) red, green, blue; uint8, uint16 or float32, owned by the caller.

    Raises:
        ValueError: the encoding is not known, or the data are not what the header says.
    """
    if image.width == 0 and image.height == 0 and image.step == 0:
        return _decode_compressed(image)
    pixels = _rows(image)
    encoding = image.encoding
    if encoding.startswith("bayer_"):
        return _array(cv2.cvtColor(pixels, _BAYER[encoding[6:10]]))
    if encoding in _YUV:
        return _array(cv2.cvtColor(pixels, _YUV[encoding]))
    if encoding in ("bgr8", "bgr16", "8UC3"):
        return _array(pixels[:, :, ::-1].copy())
    if encoding == "bgra8":
        return _array(pixels[:, :, 2::-1].copy())
    if encoding == "rgba8":
        return _array(pixels[:, :, :3].copy())
    return _array(pixels.copy())


def grey(image: Image) -> Bytes:
    """Return an image as uint8 (H, W).

    Colour is weighed as ITU-R BT.601 does; 16 bit images lose their low byte; depth images (16UC1, 32FC1) are not
    pictures and are refused.

    Raises:
        ValueError: as ``decode``, or a depth image.
    """
    if image.encoding.startswith(("32FC1", "16UC1")):
        raise ValueError(f"an image of encoding {image.encoding!r} holds depths, not brightness")
    pixels = decode(image)
    if pixels.dtype == np.uint16:
        pixels = (pixels >> 8).astype(np.uint8)
    if pixels.ndim == 3:
        pixels = _array(cv2.cvtColor(pixels, cv2.COLOR_RGB2GRAY))
    return pixels.astype(np.uint8, copy=False)


def _rows(image: Image) -> Pixels:
    """Return the pixels of an uncompressed image as a view, (H, W) or (H, W, channels), in the machine's byte order."""
    if image.encoding not in _LAYOUTS:
        raise ValueError(f"image encoding {image.encoding!r} is not supported")
    kind, channels = _LAYOUTS[image.encoding]
    dtype = np.dtype(kind).newbyteorder(">" if image.is_bigendian else "<")
    used = image.width * channels * dtype.itemsize
    if image.width < 1 or image.height < 1:
        raise DamagedImage(f"an image of {image.width} x {image.height} pixels")
    if used > image.step:
        raise DamagedImage(f"rows of {used} bytes do not fit a step of {image.step}")
    if image.step * image.height != len(image.data):
        raise DamagedImage(f"{image.height} rows of {image.step} bytes do not make {len(image.data)} bytes")
    rows = np.ascontiguousarray(image.data.reshape(image.height, image.step)[:, :used])
    pixels = rows.view(dtype).astype(dtype.newbyteorder("="), copy=False)
    return pixels if channels == 1 else pixels.reshape(image.height, image.width, channels)


def _decode_compressed(image: Image) -> Pixels:
    data, is_depth = image.data, "compressedDepth" in image.encoding
    if is_depth:
        if "rvl" in image.encoding.lower():
            raise ValueError(f"image encoding {image.encoding!r} is not supported")
        if len(data) <= _DEPTH_HEADER.size:
            raise DamagedImage("an image without data")
        _, quotient, offset = _DEPTH_HEADER.unpack(data[: _DEPTH_HEADER.size].tobytes())
        data = data[_DEPTH_HEADER.size :]
    if not len(data):
        raise DamagedImage("an image without data")
    flags = cv2.IMREAD_UNCHANGED if is_depth or image.encoding == "png" else cv2.IMREAD_ANYDEPTH | cv2.IMREAD_ANYCOLOR
    try:
        pixels = cv2.imdecode(np.ascontiguousarray(data), flags | cv2.IMREAD_IGNORE_ORIENTATION)
    except cv2.error as err:
        raise DamagedImage(f"a damaged {image.encoding} image ({err.err})") from err
    if pixels is None:
        raise DamagedImage(f"a damaged {image.encoding} image")
    if pixels.ndim == 3:
        pixels = pixels[:, :, 2::-1].copy()
    if is_depth and image.encoding.startswith("32FC1"):
        # Inverse depths were quantised to 16 bits; zero says that there is none.
        steps = _array(pixels).astype(np.float32)
        return np.where(steps > 0, np.float32(quotient) / np.maximum(steps - offset, 1e-9), np.nan).astype(np.float32)
    return _array(pixels)


def _array(pixels: Any) -> Pixels:
    array: Pixels = np.asarray(pixels)
    return array
