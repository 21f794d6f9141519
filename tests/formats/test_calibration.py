import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logpose.formats.calibration import N_COEFFICIENTS, Calibration, read_calibration, write_calibration
from logpose.formats.errors import FormatError

NUMBER = st.floats(-1e4, 1e4)
FOCAL = st.floats(1e-3, 1e4)


@st.composite
def calibrations(draw):
    model = draw(st.sampled_from(sorted(N_COEFFICIENTS)))
    n = draw(st.sampled_from([0, N_COEFFICIENTS[model]]))
    return Calibration(
        draw(st.integers(1, 9999)), draw(st.integers(1, 9999)), draw(FOCAL), draw(FOCAL), draw(NUMBER), draw(NUMBER),
        model, tuple(draw(st.lists(NUMBER, min_size=n, max_size=n))),
    )  # fmt: skip


@settings(max_examples=40, deadline=None)
@given(calibrations())
def test_what_is_written_is_read_back_bit_by_bit(tmp_path_factory, calibration):
    path = tmp_path_factory.mktemp("camera") / "camera.yaml"
    write_calibration(calibration, path)
    assert read_calibration(path) == calibration


ROS = """\
image_width: 640
image_height: 480
camera_name: ceiling
camera_matrix:
  rows: 3
  cols: 3
  data: [500.5, 0.0, 320.25, 0.0, 501.5, 240.75, 0.0, 0.0, 1.0]
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [-0.3, 0.1, 1e-3, -2e-3, 0]}
"""
EXPECTED = Calibration(640, 480, 500.5, 501.5, 320.25, 240.75, "plumb_bob", (-0.3, 0.1, 1e-3, -2e-3, 0.0))

KALIBR = """\
cam0:
  camera_model: pinhole
  intrinsics: [500.5, 501.5, 320.25, 240.75]
  distortion_model: radtan
  distortion_coeffs: [-0.3, 0.1, 1e-3, -2e-3]
  resolution: [640, 480]
  rostopic: /cam0/image_raw
cam1:
  camera_model: pinhole
  intrinsics: [400, 400, 320, 240]
  distortion_model: equidistant
  distortion_coeffs: [0.1, 0.2, 0.3, 0.4]
  resolution: [640, 480]
"""

OPENCV = """\
%YAML:1.0
---
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 5.005e+02, 0., 320.25, 0.,
       501.5, 240.75, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -0.3, 0.1, 1.0e-03, -2.0e-03, 0. ]
"""

XML = """\
<?xml version="1.0"?>
<opencv_storage>
<image_width>640</image_width>
<image_height>480</image_height>
<camera_matrix type_id="opencv-matrix"><rows>3</rows><cols>3</cols><dt>d</dt>
<data>500.5 0. 320.25 0. 501.5 240.75 0. 0. 1.</data></camera_matrix>
<distortion_coefficients type_id="opencv-matrix"><rows>5</rows><cols>1</cols><dt>d</dt>
<data>-0.3 0.1 1e-3 -2e-3 0.</data></distortion_coefficients>
</opencv_storage>
"""


@pytest.mark.parametrize("text", [ROS, KALIBR, OPENCV, XML], ids=["ros", "kalibr", "opencv-yaml", "opencv-xml"])
def test_every_tool_s_file_gives_the_same_camera(tmp_path, text):
    path = tmp_path / "camera"
    path.write_text(text)
    assert read_calibration(path) == EXPECTED


def test_another_camera_of_a_chain_can_be_named(tmp_path):
    path = tmp_path / "chain.yaml"
    path.write_text(KALIBR)
    calibration = read_calibration(path, "cam1")
    assert (calibration.model, calibration.distortion) == ("equidistant", (0.1, 0.2, 0.3, 0.4))
    with pytest.raises(FormatError, match=r"has no camera 'cam7'. It has cam0, cam1.$"):
        read_calibration(path, "cam7")


def test_eight_opencv_coefficients_are_the_rational_model(tmp_path):
    path = tmp_path / "camera.yml"
    path.write_text(OPENCV.replace("-0.3, 0.1, 1.0e-03, -2.0e-03, 0.", "1, 2, 3, 4, 5, 6, 7, 8, 0, 0, 0, 0"))
    assert read_calibration(path).model == "rational_polynomial"
    assert read_calibration(path).distortion == (1, 2, 3, 4, 5, 6, 7, 8)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("image_width: 640\n", "", "{p}: has no image size. Add 'image_width: ..' and 'image_height: ..' [px]."),
        (
            "camera_matrix:",
            "matrix:",
            "{p}: has no camera matrix. Name a file of camera_calibration, Kalibr or OpenCV.",
        ),
        (
            "plumb_bob",
            "omni",
            "{p}: lens model 'omni' is not known. Known: plumb_bob, rational_polynomial, equidistant.",
        ),
        ("-2e-3, 0]", "-2e-3, 0, 1]", "{p}: plumb_bob has 5 coefficients, not 6. Calibrate again."),
        (
            "[500.5, 0.0,",
            "[500.5, 0.1,",
            "{p}: camera_matrix is no [fx 0 cx; 0 fy cy; 0 0 1]. A skewed camera is not known.",
        ),
        ("[500.5,", "[-500.5,", "{p}: focal length -500.5, 501.5 px. Both must be positive."),
        (
            "[500.5,",
            "[.nan,",
            "{p}: camera_matrix is 'nan'. Every value must be finite; remove the line.",
        ),
        ("0.0, 0.0, 1.0]", "0.0, 1.0]", "{p}: camera_matrix has 8 numbers. Calibrate again."),
        ("640", "640.5", "{p}: image size 640.5 x 480.0. Both must be positive integers [px]."),
        (ROS, "- 1\n", "{p}: is no calibration. Name a file of camera_calibration, Kalibr or OpenCV."),
        (ROS, "<a/>", "{p}: is <a>, not <opencv_storage>. Name a file that OpenCV wrote."),
        (
            ROS,
            '<!DOCTYPE a [<!ENTITY b "b">]><a/>',
            "{p}: defines XML entities. Name a plain OpenCV storage file.",
        ),
    ],
)
def test_a_wrong_file_is_explained(tmp_path, old, new, message):
    path = tmp_path / "camera.yaml"
    assert old in ROS
    path.write_text(ROS.replace(old, new))
    with pytest.raises(FormatError) as caught:
        read_calibration(path)
    assert str(caught.value) == message.format(p=path)


def test_opencv_s_own_calibration_is_read(recordings):
    calibration = read_calibration(recordings / "opencv_calib" / "left_intrinsics.yml")
    assert (calibration.width, calibration.height) == (640, 480)
    assert calibration.fx == 5.3591573396163199e02
    assert calibration.cx == 3.4228315473308373e02
    assert calibration.distortion[0] == -2.6637260909660682e-01
    assert calibration.distortion[4] == 2.3839153080878486e-01
