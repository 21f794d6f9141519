import struct

import cv2
import numpy as np
import pytest

from logpose.formats.events import Image
from logpose.formats.images import decode, grey

RNG = np.random.default_rng(7)
H, W = 5, 6


def logged(encoding, pixels, *, padding=0, is_bigendian=False):
    """Return an Image with the rows of ``pixels`` padded by some bytes."""
    if pixels.dtype.itemsize > 1:
        pixels = pixels.astype(pixels.dtype.newbyteorder(">" if is_bigendian else "<"))
    rows = np.ascontiguousarray(pixels).view(np.uint8).reshape(pixels.shape[0], -1)
    rows = np.pad(rows, ((0, 0), (0, padding)), constant_values=0xAB)
    return Image(
        stamp=0,
        encoding=encoding,
        data=rows.ravel(),
        width=pixels.shape[1],
        height=pixels.shape[0],
        step=rows.shape[1],
        is_bigendian=is_bigendian,
    )


def random(shape, dtype):
    return RNG.integers(0, np.iinfo(dtype).max, shape, dtype=dtype, endpoint=True)


@pytest.mark.parametrize("is_bigendian", [False, True])
@pytest.mark.parametrize("padding", [0, 3, 64])
@pytest.mark.parametrize(
    ("encoding", "dtype", "channels"),
    [
        ("mono8", np.uint8, 0),
        ("8UC1", np.uint8, 0),
        ("mono16", np.uint16, 0),
        ("16UC1", np.uint16, 0),
        ("rgb8", np.uint8, 3),
        ("rgb16", np.uint16, 3),
    ],
)
def test_pixels_come_back_whatever_the_padding_and_byte_order(encoding, dtype, channels, padding, is_bigendian):
    pixels = random((H, W, channels) if channels else (H, W), dtype)
    read = decode(logged(encoding, pixels, padding=padding, is_bigendian=is_bigendian))
    assert read.dtype == dtype
    assert read.dtype.isnative
    np.testing.assert_array_equal(read, pixels)


@pytest.mark.parametrize("is_bigendian", [False, True])
def test_depth_in_floats_comes_back(is_bigendian):
    pixels = RNG.normal(size=(H, W)).astype(np.float32)
    pixels[0, 0] = np.nan
    np.testing.assert_array_equal(decode(logged("32FC1", pixels, padding=4, is_bigendian=is_bigendian)), pixels)


@pytest.mark.parametrize("padding", [0, 5])
@pytest.mark.parametrize(
    ("encoding", "order"),
    [("rgb8", [0, 1, 2]), ("bgr8", [2, 1, 0]), ("rgba8", [0, 1, 2]), ("bgra8", [2, 1, 0]), ("8UC3", [2, 1, 0])],
)
def test_colour_comes_back_as_red_green_blue(encoding, order, padding):
    stored = random((H, W, 4 if "a8" in encoding else 3), np.uint8)
    np.testing.assert_array_equal(decode(logged(encoding, stored, padding=padding)), stored[:, :, order])


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("pattern", ["rggb", "bggr", "gbrg", "grbg"])
def test_a_red_scene_through_a_bayer_pattern_is_red(pattern, bits):
    mosaic = np.zeros((8, 8), np.uint8 if bits == 8 else np.uint16)
    at = pattern.index("r")
    mosaic[at // 2 :: 2, at % 2 :: 2] = 200
    inner = decode(logged(f"bayer_{pattern}{bits}", mosaic, padding=2))[2:-2, 2:-2].astype(int)
    assert inner[..., 0].min() == 200
    assert inner[..., 1:].max() == 0


@pytest.mark.parametrize("encoding", ["yuv422", "yuv422_yuy2"])
def test_yuv_of_a_grey_scene_is_grey(encoding):
    luma, chroma = 126, 128
    pair = [chroma, luma] if encoding == "yuv422" else [luma, chroma]
    stored = np.tile(np.array(pair, np.uint8), (4, 6, 1))
    pixels = decode(logged(encoding, stored)).astype(int)
    # BT.601 studio range: (126 - 16) * 255 / 219 = 128.08
    assert np.abs(pixels - 128).max() <= 1


def test_grey_weighs_colours_and_drops_low_bytes():
    red = np.zeros((H, W, 3), np.uint8)
    red[..., 0] = 200
    assert np.abs(grey(logged("rgb8", red)).astype(int) - round(0.299 * 200)).max() <= 1
    wide = np.full((H, W), 0x8123, np.uint16)
    assert (grey(logged("mono16", wide, is_bigendian=True)) == 0x81).all()
    assert grey(logged("mono8", red[..., 0])).dtype == np.uint8


@pytest.mark.parametrize("encoding", ["16UC1", "32FC1"])
def test_depth_is_not_brightness(encoding):
    pixels = np.ones((H, W), np.uint16 if encoding == "16UC1" else np.float32)
    with pytest.raises(ValueError, match="holds depths, not brightness"):
        grey(logged(encoding, pixels))


@pytest.mark.parametrize(("suffix", "encoding"), [(".png", "png"), (".jpg", "jpeg")])
def test_compressed_images_come_back(suffix, encoding):
    pixels = cv2.GaussianBlur(random((40, 50, 3), np.uint8), (0, 0), 5)
    data = cv2.imencode(suffix, pixels[:, :, ::-1])[1].ravel()
    image = Image(stamp=0, encoding=encoding, data=data)
    # JPEG at quality 95 of a smooth image: a few grey levels
    assert np.abs(decode(image).astype(int) - pixels).max() <= (0 if encoding == "png" else 12)
    assert grey(image).shape == (40, 50)


def test_a_grey_jpeg_stays_grey_and_a_16_bit_png_stays_16_bit():
    data = cv2.imencode(".jpg", np.full((8, 9), 77, np.uint8))[1].ravel()
    assert decode(Image(stamp=0, encoding="jpeg", data=data)).shape == (8, 9)
    depth = random((8, 9), np.uint16)
    png = cv2.imencode(".png", depth)[1].ravel()
    np.testing.assert_array_equal(decode(Image(stamp=0, encoding="png", data=png)), depth)


def test_compressed_depth_comes_back():
    depth = random((8, 9), np.uint16)
    data = np.concatenate(
        [np.frombuffer(struct.pack("<iff", 0, 0, 0), np.uint8), cv2.imencode(".png", depth)[1].ravel()]
    )
    image = Image(stamp=0, encoding="16UC1; compressedDepth png", data=data)
    np.testing.assert_array_equal(decode(image), depth)


def test_compressed_float_depth_is_unquantised():
    inverse = np.array([[0, 1, 2, 100]], np.uint16)
    head = np.frombuffer(struct.pack("<iff", 0, 6.0, -1.0), np.uint8)
    data = np.concatenate([head, cv2.imencode(".png", inverse)[1].ravel()])
    depth = decode(Image(stamp=0, encoding="32FC1; compressedDepth", data=data))
    np.testing.assert_allclose(depth, [[np.nan, 3.0, 2.0, 6.0 / 101.0]], rtol=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"step": 4}, "rows of 6 bytes do not fit a step of 4"),
        ({"height": 2**31}, "2147483648 rows of 6 bytes do not make 30 bytes"),
        ({"data": np.zeros(10, np.uint8)}, "5 rows of 6 bytes do not make 10 bytes"),
        ({"width": 0}, "an image of 0 x 5 pixels"),
        ({"encoding": "nv21"}, "image encoding 'nv21' is not supported"),
    ],
)
def test_a_header_that_lies_is_refused(change, message):
    fields = {"encoding": "mono8", "data": np.zeros(30, np.uint8), "width": 6, "height": 5, "step": 6}
    with pytest.raises(ValueError) as error:
        decode(Image(stamp=0, **(fields | change)))
    assert str(error.value) == message


@pytest.mark.parametrize("encoding", ["jpeg", "png"])
def test_a_damaged_compressed_image_is_refused(encoding):
    for data in (b"", b"nothing", b"\xff\xd8\xff\xe0" + b"\x00" * 40):
        image = Image(stamp=0, encoding=encoding, data=np.frombuffer(data, np.uint8))
        with pytest.raises(ValueError):
            decode(image)


def test_pixels_belong_to_the_caller():
    image = logged("mono8", np.zeros((H, W), np.uint8))
    decode(image)[:] = 9
    assert not image.data.any()
