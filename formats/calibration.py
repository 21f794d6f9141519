"""A camera's calibration as numbers: what CameraInfo and ``camera.yaml`` hold.

Read here from the files of ROS ``camera_calibration``, Kalibr and OpenCV; what the numbers mean (distortion
and its inverse) is ``pipelines/geometry/camera.py``.
"""

from collections.abc import Container, Mapping
from dataclasses import dataclass
from pathlib import Path

from .errors import FormatError
from .files import replacing_text
from .opencv_xml import parse_opencv_xml
from .text import parse_number, read_text
from .yaml_file import parse_yaml, yaml_float

N_COEFFICIENTS = {"plumb_bob": 5, "rational_polynomial": 8, "equidistant": 4}
"""Number of coefficients of each lens model."""


@dataclass(frozen=True, slots=True)
class Calibration:
    """Intrinsic parameters of one camera; hashable, so that tables made from it can be cached.

    Attributes:
        width, height: of the images it holds for [px].
        fx, fy, cx, cy: focal lengths and principal point [px]; pixel centres are integers.
        model: ``plumb_bob`` (k1 k2 p1 p2 k3), ``rational_polynomial`` (8) or ``equidistant`` (4).
        distortion: the model's coefficients; empty for none.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    model: str = "plumb_bob"
    distortion: tuple[float, ...] = ()


def read_calibration(path: str | Path, camera: str = "") -> Calibration:
    """Read a calibration of ROS ``camera_calibration``, Kalibr (camchain) or OpenCV (YAML or XML).

    Args:
        path: the file; told apart by content.
        camera: which one, where the file has several (``cam1``, or ``2`` for M2/D2); empty is the first.

    Raises:
        FormatError: no such file, no camera in it, no image size, another lens model, or numbers that are
        none.
    """
    text = read_text(path)
    name = str(path)
    if text.lstrip().startswith("<"):
        document: object = parse_opencv_xml(text, name)
    elif text.startswith("%YAML:"):
        document = parse_yaml(text.partition("\n")[2], name)
    else:
        document = parse_yaml(text, name)
    if not isinstance(document, Mapping):
        raise FormatError(f"{name}: is no calibration. Name a file of camera_calibration, Kalibr or OpenCV.")
    cameras = [key for key in document if isinstance(key, str) and key.startswith("cam") and key[3:].isdigit()]
    if cameras:
        key = camera or cameras[0]
        if key not in cameras:
            raise FormatError(f"{name}: has no camera {camera!r}. It has {', '.join(cameras)}.")
        return _from_kalibr(document[key], f"{name}: {key}")
    return _from_matrices(document, name, camera)


def write_calibration(calibration: Calibration, path: str | Path) -> None:
    """Write a calibration as ROS ``camera_calibration`` does; floats are read back bit by bit."""
    c = calibration
    k = [c.fx, 0.0, c.cx, 0.0, c.fy, c.cy, 0.0, 0.0, 1.0]
    r = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    p = [c.fx, 0.0, c.cx, 0.0, 0.0, c.fy, c.cy, 0.0, 0.0, 0.0, 1.0, 0.0]
    matrices = (
        ("camera_matrix", 3, 3, k),
        ("distortion_coefficients", 1, len(c.distortion), list(c.distortion)),
        ("rectification_matrix", 3, 3, r),
        ("projection_matrix", 3, 4, p),
    )
    with replacing_text(path) as stream:
        stream.write(f"image_width: {c.width}\nimage_height: {c.height}\ncamera_name: camera\n")
        stream.write(f"distortion_model: {c.model}\n")
        for key, rows, cols, data in matrices:
            numbers = ", ".join(yaml_float(value) for value in data)
            stream.write(f"{key}:\n  rows: {rows}\n  cols: {cols}\n  data: [{numbers}]\n")


def _from_kalibr(entry: object, where: str) -> Calibration:
    if not isinstance(entry, Mapping):
        raise FormatError(f"{where}: is no camera. Name a camchain file of Kalibr.")
    if entry.get("camera_model", "pinhole") != "pinhole":
        raise FormatError(f"{where}: camera model {entry['camera_model']!r} is not known. Calibrate as 'pinhole'.")
    intrinsics = _numbers(entry.get("intrinsics"), where, "intrinsics", {4})
    width, height = _numbers(entry.get("resolution"), where, "resolution", {2})
    model = str(entry.get("distortion_model", "none"))
    coefficients = [] if model == "none" else _numbers(entry.get("distortion_coeffs", []), where, "distortion_coeffs")
    return _checked((width, height), intrinsics, model, coefficients, where)


def _from_matrices(document: Mapping[object, object], name: str, camera: str) -> Calibration:
    """ROS and OpenCV files: a matrix, its coefficients and an image size, under one of several names."""
    n = camera or "1"
    matrix_keys = (
        "camera_matrix",
        "Camera_Matrix",
        "cameraMatrix",
        f"cameraMatrix{n}",
        f"M{n}",
        f"K{n}",
        "K",
    )
    lens_keys = (
        *("distortion_coefficients", "Distortion_Coefficients", "distCoeffs", f"distCoeffs{n}", f"D{n}", "D"),
        *("dist_coeffs", "dist_coeff"),
    )
    matrix_key = next((key for key in matrix_keys if key in document), None)
    if matrix_key is None:
        raise FormatError(f"{name}: has no camera matrix. Name a file of camera_calibration, Kalibr or OpenCV.")
    k = _numbers(document[matrix_key], name, matrix_key, {9})
    if k[1] != 0 or k[3:4] != [0] or k[6:] != [0, 0, 1]:
        raise FormatError(f"{name}: {matrix_key} is no [fx 0 cx; 0 fy cy; 0 0 1]. A skewed camera is not known.")
    lens_key = next((key for key in lens_keys if key in document), None)
    coefficients = [] if lens_key is None else _numbers(document[lens_key], name, lens_key)
    fallback = {8: "rational_polynomial", 12: "rational_polynomial", 14: "rational_polynomial"}
    model = str(document.get("distortion_model") or fallback.get(len(coefficients), "plumb_bob"))
    if document.get("fisheye_model") in {1, "1"}:
        model = "equidistant"
    size = [
        next((document[key] for key in keys if key in document), None)
        for keys in (("image_width", "image_Width", "width"), ("image_height", "image_Height", "height"))
    ]
    if None in size:
        raise FormatError(f"{name}: has no image size. Add 'image_width: ..' and 'image_height: ..' [px].")
    width, height = _numbers(size, name, "the image size", {2})
    return _checked((width, height), [k[0], k[4], k[2], k[5]], model, coefficients, name)


def _checked(
    size: tuple[float, float], intrinsics: list[float], model: str, coefficients: list[float], where: str
) -> Calibration:
    known = {name: name for name in N_COEFFICIENTS}
    known |= {"radtan": "plumb_bob", "none": "plumb_bob", "": "plumb_bob"}
    known |= {"equi": "equidistant", "fisheye": "equidistant"}
    if model not in known:
        raise FormatError(f"{where}: lens model {model!r} is not known. Known: {', '.join(N_COEFFICIENTS)}.")
    model = known[model]
    n = N_COEFFICIENTS[model]
    if model == "plumb_bob" and len(coefficients) in {2, 4}:
        coefficients = coefficients + [0.0] * (n - len(coefficients))
    if model == "rational_polynomial" and not any(coefficients[n:]):
        coefficients = coefficients[:n]  # thin prism and tilt terms, all zero
    if len(coefficients) not in {0, n}:
        raise FormatError(f"{where}: {model} has {n} coefficients, not {len(coefficients)}. Calibrate again.")
    fx, fy, cx, cy = intrinsics
    width, height = size
    if fx <= 0 or fy <= 0:
        raise FormatError(f"{where}: focal length {fx!r}, {fy!r} px. Both must be positive.")
    if width < 1 or height < 1 or width % 1 or height % 1:
        raise FormatError(f"{where}: image size {width!r} x {height!r}. Both must be positive integers [px].")
    return Calibration(int(width), int(height), fx, fy, cx, cy, model, tuple(coefficients))


def _numbers(value: object, where: str, key: str, counts: Container[int] | None = None) -> list[float]:
    """Return the numbers of a list, a list of lists, or a ``{rows, cols, data}`` matrix."""
    if isinstance(value, Mapping):
        value = value.get("data")
    if not isinstance(value, list):
        raise FormatError(f"{where}: {key} is missing or no list of numbers. Calibrate again.")
    flat: list[float] = []
    for item in value:
        if isinstance(item, list):
            flat += _numbers(item, where, key)
        elif isinstance(item, bool) or not isinstance(item, int | float | str):
            raise FormatError(f"{where}: {key} holds {item!r}, not a number. Calibrate again.")
        else:
            flat.append(parse_number(str(item), where, key))
    if counts is not None and len(flat) not in counts:
        raise FormatError(f"{where}: {key} has {len(flat)} numbers. Calibrate again.")
    return flat
