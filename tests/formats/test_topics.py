import pytest

from logpose.formats.errors import ConfigError
from logpose.formats.events import Pose, Sightings
from logpose.formats.messages import _EVENTS, _POSES
from logpose.formats.topics import ROLES, TYPES, TopicInfo, choose, roles_of_type, sibling_of

IMAGE, INFO = "sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo"
ODOMETRY, TWIST = "nav_msgs/msg/Odometry", "geometry_msgs/msg/TwistStamped"


def log(*pairs):
    return [TopicInfo(name, kind, 3, "MCAP") for name, kind in pairs]


def test_the_default_topic_wins_over_others_of_its_type():
    assert choose("x", log(("/a", ODOMETRY), ("/odom", ODOMETRY)), {"odometry": "auto"}) == {"odometry": "/odom"}


def test_the_only_topic_of_the_type_is_taken():
    assert choose("x", log(("/a", IMAGE), ("/b", ODOMETRY)), {"image": "auto"}) == {"image": "/a"}


def test_odometry_goes_before_velocities():
    assert choose("x", log(("/cmd_vel", TWIST), ("/wheels", ODOMETRY)), {"odometry": "auto"})["odometry"] == "/wheels"
    assert choose("x", log(("/cmd_vel", TWIST)), {"odometry": "auto"})["odometry"] == "/cmd_vel"


def test_of_several_camera_infos_the_sibling_of_the_image_is_taken():
    topics = log(("/l/image_raw", IMAGE), ("/l/camera_info", INFO), ("/r/camera_info", INFO))
    assert choose("x", topics, {"camera_info": "auto", "image": "auto"})["camera_info"] == "/l/camera_info"


@pytest.mark.parametrize("image", ["/cam/image_raw", "/cam/image/compressed", "/cam/camera_info"])
def test_siblings_share_a_namespace(image):
    assert sibling_of(image, ["/other/camera_info", "/cam/camera_info"]) == "/cam/camera_info"


def test_truth_and_start_pose_must_have_been_meant_as_such():
    topics = log(("/odom", ODOMETRY), ("/amcl_pose", "geometry_msgs/msg/PoseWithCovarianceStamped"))
    assert choose("x", topics, {"truth": "auto", "initial_pose": "auto"}) == {}
    assert choose("x", topics, {"truth": "/amcl_pose"}) == {"truth": "/amcl_pose"}


def test_names_are_compared_without_the_leading_slash():
    pose = "geometry_msgs/msg/PoseStamped"
    assert choose("x", log(("groundtruth", pose)), {"truth": "/groundtruth"}) == {"truth": "groundtruth"}


def test_a_topic_without_messages_is_not_taken_by_itself():
    topics = [TopicInfo("/a", IMAGE, 0, "MCAP"), TopicInfo("/b", IMAGE, 1, "MCAP")]
    assert choose("x", topics, {"image": "auto"}) == {"image": "/b"}


def test_a_string_holds_sightings_only_where_its_name_says_so():
    topics = log(("/chatter", "std_msgs/msg/String"))
    assert choose("x", topics, {"sightings": "auto"}) == {}
    assert choose("x", topics, {"sightings": "/chatter"}) == {"sightings": "/chatter"}
    assert choose("x", log(("/sightings", "std_msgs/msg/String")), {"sightings": "auto"}) == {"sightings": "/sightings"}


def test_an_unknown_role_lists_the_roles():
    with pytest.raises(ConfigError) as error:
        choose("x", [], {"imagee": "auto"})
    assert str(error.value) == f"topics: no role 'imagee'. Roles: {', '.join(ROLES)}."


def test_types_say_their_roles():
    assert roles_of_type("sensor_msgs/msg/CompressedImage") == ("image",)
    assert roles_of_type("nav_msgs/msg/Odometry") == ("odometry", "truth", "initial_pose", "pose")
    assert roles_of_type("std_msgs/msg/Empty") == ()


def test_whatever_a_role_takes_can_be_made_an_event():
    assert set(TYPES[Pose]) == set(_POSES)
    assert {t for event, types in TYPES.items() if event not in {Pose, Sightings} for t in types} == set(_EVENTS)
