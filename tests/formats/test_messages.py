from types import SimpleNamespace as N

import numpy as np
import pytest

from logpose.formats.calibration import Calibration
from logpose.formats.containers.container import Channel
from logpose.formats.decode import decoder_for
from logpose.formats.encode import Encoder, as_message
from logpose.formats.events import CameraInfo, Image, Imu, JointState, LaserScan, Odometry, Pose, Range, Transform
from logpose.formats.messages import At, UnusableError, event_of, header_stamp, transforms_of

AT = At(stamp=5_000_000_007, source="role", topic="/topic")
UNIT = np.array([0.0, 0.0, 0.0, 1.0])
TILTED = np.array([0.5, -0.5, 0.5, 0.5])
MADE = {"stamp": AT["stamp"], "topic": "/topic", "source": "role", "frame_id": "frame"}

EVENTS = [
    Image(**MADE, encoding="bgr8", data=np.arange(24, dtype=np.uint8), width=2, height=3, step=8, is_bigendian=True),
    Image(**MADE, encoding="jpeg", data=np.arange(24, dtype=np.uint8)),
    Image(**MADE, encoding="16UC1; compressedDepth png", data=np.arange(24, dtype=np.uint8)),
    CameraInfo(**MADE, calibration=Calibration(640, 480, 500.0, 501.0, 320.5, 240.5)),
    CameraInfo(**MADE, calibration=Calibration(64, 48, 50.0, 51.0, 32.5, 24.5, "equidistant", (0.1, 0.2, 0.3, 0.4))),
    CameraInfo(**MADE, calibration=Calibration(64, 48, 50.0, 51.0, 32.5, 24.5, "rational_polynomial", (0.5,) * 8)),
    Odometry(
        **MADE,
        child_frame_id="base",
        position=np.arange(3.0),
        orientation=TILTED,
        linear=np.ones(3),
        angular=np.zeros(3),
    ),
    Odometry(**MADE, child_frame_id="base", position=np.arange(3.0), orientation=TILTED),
    Imu(**MADE, angular=np.arange(3.0), acceleration=np.ones(3), orientation=TILTED),
    Imu(**MADE, angular=np.arange(3.0), acceleration=np.ones(3)),
    JointState(**MADE, names=("pan", "tilt"), positions=np.array([0.5, -0.25])),
    JointState(**MADE, names=(), positions=np.zeros(0)),
    Range(**MADE, range=float("inf"), min_range=0.25, max_range=4.0, field_of_view=0.5),
    Range(**MADE, range=float("-inf"), min_range=0.25, max_range=4.0, field_of_view=0.5),
    LaserScan(
        **MADE,
        ranges=np.array([1.0, np.inf, np.nan]),
        angle_min=-1.0,
        angle_increment=0.5,
        range_min=0.25,
        range_max=8.0,
    ),
    Pose(**MADE, position=np.arange(3.0), orientation=TILTED),
    Pose(**MADE, position=np.arange(3.0), orientation=TILTED, covariance=np.diag([1.0, 2, 3, 4, 5, 6])),
]


def fields_of(event):
    names = (name for kind in type(event).__mro__ for name in getattr(kind, "__slots__", ()))
    return {name: getattr(event, name) for name in names}


def same(a, b):
    return (
        np.array_equal(a, b, equal_nan=True) if isinstance(a, np.ndarray) and a.dtype == float else np.array_equal(a, b)
    )


@pytest.mark.parametrize("version", ["ros1", "ros2"])
@pytest.mark.parametrize("event", EVENTS, ids=lambda e: type(e).__name__)
def test_events_survive_the_way_through_ros(event, version):
    encoder = Encoder(version)
    kind, fields = as_message(event)
    encoding = "ros1" if version == "ros1" else "cdr"
    channel = Channel(1, "/topic", kind, encoding, encoder.definition(kind)[0], f"{version}msg")
    message = decoder_for(channel)(encoder.encode(kind, fields))
    assert header_stamp(message) == AT["stamp"]
    back = fields_of(event_of(message, kind, type(event), AT))
    expected = fields_of(event)
    assert {n for n in back if not same(back[n], expected[n])} == set()


@pytest.mark.parametrize("version", ["ros1", "ros2"])
def test_transforms_survive(version):
    event = Transform(**MADE, child_frame_id="/sensor", translation=np.arange(3.0), rotation=TILTED)
    encoder, (kind, fields) = Encoder(version), as_message(event)
    channel = Channel(
        1, "/tf", kind, "ros1" if version == "ros1" else "cdr", encoder.definition(kind)[0], f"{version}msg"
    )
    (back,) = transforms_of(decoder_for(channel)(encoder.encode(kind, fields)))
    assert (back.frame_id, back.child_frame_id, back.stamp) == ("frame", "sensor", AT["stamp"])
    np.testing.assert_array_equal(back.rotation, TILTED)


def test_messages_without_a_definition_are_decoded_by_the_distribution_that_fits():
    from rosbags.typesys import Stores, get_typestore

    for store, extra in ((Stores.ROS2_HUMBLE, {}), (Stores.ROS2_JAZZY, {"variance": 0.25})):
        types = get_typestore(store)
        head = types.types["std_msgs/msg/Header"](types.types["builtin_interfaces/msg/Time"](3, 4), "sonar")
        message = types.types["sensor_msgs/msg/Range"](head, 0, 0.5, 0.25, 4.0, 2.5, **extra)
        data = types.serialize_cdr(message, "sensor_msgs/msg/Range")
        read = decoder_for(Channel(1, "/r", "sensor_msgs/msg/Range", "cdr"))(data)
        assert (read.range, read.max_range, header_stamp(read)) == (2.5, 4.0, 3_000_000_004)


def test_two_definitions_under_one_name_are_kept_apart():
    first = Channel(1, "/a", "my/msg/T", "ros1", "float64 x\nfloat64 y\n", "ros1msg")
    second = Channel(1, "/a", "my/msg/T", "ros1", "float64 y\nfloat64 x\n", "ros1msg")
    data = np.array([1.0, 2.0]).tobytes()
    assert (decoder_for(first)(data).x, decoder_for(second)(data).x) == (1.0, 2.0)


def camera(**changes):
    fields = {
        "header": N(stamp=N(sec=0, nanosec=0), frame_id="/cam"),
        "K": np.array([100.0, 0, 50, 0, 110, 40, 0, 0, 1]),
        "D": np.zeros(5),
        "distortion_model": "plumb_bob",
        "width": 101,
        "height": 81,
        "binning_x": 0,
        "binning_y": 0,
        "roi": N(width=0, height=0, x_offset=0, y_offset=0),
    }
    return N(**(fields | changes))


def calibration(**changes):
    return event_of(camera(**changes), "sensor_msgs/msg/CameraInfo", CameraInfo, AT).calibration


def test_binning_and_region_of_interest_are_applied():
    assert calibration() == Calibration(101, 81, 100, 110, 50, 40)
    roi = calibration(roi=N(width=60, height=40, x_offset=10, y_offset=20))
    assert roi == Calibration(60, 40, 100, 110, 40, 20)
    # The centre of a 2 x 2 block of pixels 0 and 1 is at 0.5 and becomes pixel 0.
    assert calibration(binning_x=2, binning_y=2) == Calibration(50, 40, 50, 55, 24.75, 19.75)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"K": np.zeros(9)}, "the camera is not calibrated (focal length 0)"),
        ({"distortion_model": "magic"}, "distortion model 'magic' is not known"),
        ({"D": np.ones(3)}, "distortion model 'plumb_bob' with 3 coefficients"),
    ],
)
def test_a_calibration_that_means_nothing_is_refused(changes, message):
    with pytest.raises(ValueError) as error:
        calibration(**changes)
    assert str(error.value) == message


def test_four_coefficients_of_plumb_bob_become_five():
    assert calibration(D=np.array([1.0, 2, 3, 4])).distortion == (1.0, 2.0, 3.0, 4.0, 0.0)


@pytest.mark.parametrize(
    ("text", "encoding"),
    [("jpeg", "jpeg"), ("bgr8; jpeg compressed bgr8", "jpeg"), ("rgb8; png compressed ", "png"), ("png", "png")],
)
def test_the_format_of_compressed_images_is_understood(text, encoding):
    message = N(header=N(stamp=N(sec=1, nanosec=0), frame_id=""), format=text, data=np.zeros(3, np.uint8))
    assert event_of(message, "sensor_msgs/msg/CompressedImage", Image, AT).encoding == encoding


def test_joints_without_positions_have_none_and_half_of_them_are_refused():
    head = N(stamp=N(sec=1, nanosec=0), frame_id="")
    silent = N(header=head, name=["a", "b"], position=np.zeros(0))
    np.testing.assert_array_equal(
        event_of(silent, "sensor_msgs/msg/JointState", JointState, AT).positions, [np.nan, np.nan]
    )
    half = N(header=head, name=["a", "b"], position=np.zeros(1))
    with pytest.raises(UnusableError, match=r"^2 joints with 1 positions$"):
        event_of(half, "sensor_msgs/msg/JointState", JointState, AT)


def odometry(orientation, *, known=True):
    covariance = np.zeros(36) if known else np.full(36, -1.0)
    zero = N(x=0.0, y=0.0, z=0.0)
    return N(
        header=N(stamp=N(sec=1, nanosec=0), frame_id="odom"),
        child_frame_id="base_link",
        pose=N(
            pose=N(position=zero, orientation=N(**dict(zip("xyzw", orientation, strict=True)))), covariance=covariance
        ),
        twist=N(twist=N(linear=zero, angular=zero), covariance=np.zeros(36)),
    )


def test_a_quaternion_of_zeros_is_not_given_one_of_nan_is_refused():
    kind = "nav_msgs/msg/Odometry"
    zero = event_of(odometry((0.0, 0.0, 0.0, 0.0)), kind, Odometry, AT)
    assert (zero.position, zero.orientation) == (None, None)
    with pytest.raises(UnusableError, match=r"^a value is not a finite number$"):
        event_of(odometry((0.0, 0.0, np.nan, 1.0)), kind, Odometry, AT)
    assert event_of(odometry((np.nan,) * 4, known=False), kind, Odometry, AT).orientation is None
    with pytest.raises(UnusableError, match=r"^a quaternion is all zeros, no rotation$"):
        event_of(odometry((0.0, 0.0, 0.0, 0.0)), kind, Pose, AT)


def test_values_that_are_no_numbers_are_refused():
    message = N(
        header=N(stamp=N(sec=1, nanosec=0), frame_id="map"),
        pose=N(position=N(x=np.nan, y=0, z=0), orientation=N(x=0, y=0, z=0, w=1)),
    )
    with pytest.raises(ValueError, match="a value is not a finite number"):
        event_of(message, "geometry_msgs/msg/PoseStamped", Pose, AT)
