import numpy as np
import pytest

from logpose.formats.encode import Encoder
from logpose.formats.events import Notice, Sightings
from logpose.formats.foxglove import (
    DEFINITIONS,
    IMAGE_ANNOTATIONS,
    LOG,
    SCENE_UPDATE,
    image_annotations,
    landmark_scene,
    log_line,
)
from logpose.formats.products import LandmarkMap

STAMP = 1_700_000_000_000_000_005


@pytest.fixture
def seen():
    return Sightings(
        stamp=STAMP,
        source="localize-pf",
        xy=np.zeros((3, 2)),
        cov=np.zeros((3, 2, 2)),
        uv=np.array([[10.0, 20.0], [30.0, 40.0], [np.nan, np.nan]]),
        radius=np.array([5.0, 6.0, np.nan]),
        score=np.ones(3),
        ids=np.array([-1, 7, 8]),
    )


@pytest.mark.parametrize("version", ["ros1", "ros2"])
def test_every_message_can_be_encoded_and_brings_its_definition(seen, version):
    encoder = Encoder(version)
    landmarks = LandmarkMap(ids=np.array([4]), positions=np.array([[1.0, 2.0, 2.42]]))
    notice = Notice(stamp=STAMP, source="a", code="b", message="c")
    for kind, fields in (
        (IMAGE_ANNOTATIONS, image_annotations(seen)),
        (SCENE_UPDATE, landmark_scene(landmarks, STAMP)),
        (LOG, log_line(notice)),
    ):
        assert len(encoder.encode(kind, fields)) > 20
        assert "Time" in encoder.definition(kind)[0] or "time" in encoder.definition(kind)[0]


def test_every_type_a_definition_names_is_there():
    for text in DEFINITIONS.values():
        for line in text.splitlines():
            kind = line.split()[0].removesuffix("[]")
            if kind.startswith("foxglove_msgs/"):
                assert kind.removeprefix("foxglove_msgs/") in DEFINITIONS


def test_a_circle_has_a_diameter_and_counts_from_the_corner_of_the_first_pixel(seen):
    circles = image_annotations(seen)["circles"]
    assert len(circles) == 2
    assert (circles[0]["position"], circles[0]["diameter"]) == ({"x": 10.5, "y": 20.5}, 10.0)
    assert circles[0]["timestamp"] == {"sec": 1_700_000_000, "nanosec": 5}


def test_only_known_landmarks_are_named(seen):
    assert [text["text"] for text in image_annotations(seen)["texts"]] == ["7"]


def test_a_landmark_stands_where_the_map_says():
    landmarks = LandmarkMap(ids=np.array([4]), positions=np.array([[1.0, 2.0, 2.42]]), frame_id="hall")
    entity = landmark_scene(landmarks, STAMP, diameter=0.3)["entities"][0]
    assert entity["frame_id"] == "hall"
    assert entity["spheres"][0]["pose"]["position"] == {"x": 1.0, "y": 2.0, "z": 2.42}
    assert entity["spheres"][0]["size"] == {"x": 0.3, "y": 0.3, "z": 0.3}
    assert entity["texts"][0]["text"] == "4"


def test_lost_data_is_an_error_and_the_rest_a_warning():
    assert log_line(Notice(stamp=STAMP, code="a", message="b"))["level"] == 3
    assert log_line(Notice(stamp=STAMP, code="a", message="b", is_loss=True))["level"] == 4
