import numpy as np
import pytest

from logpose.formats.encode import Encoder
from logpose.formats.events import NO_ID, MarkSighting, Notice, Sightings
from logpose.formats.foxglove import (
    DEFINITIONS,
    IMAGE_ANNOTATIONS,
    LOG,
    SCENE_UPDATE,
    image_annotations,
    landmark_scene,
    log_line,
    mark_annotations,
    mark_scene,
)
from logpose.formats.products import LandmarkMap, MarkMap, StripeMark

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


MARK = StripeMark(
    id=4, lines=np.array([-0.1, 0.0, 0.06]), bars=np.full(3, 0.04), pose=np.array([2.0, 1.0, np.pi / 2]), height=0.25
)


def mark_sighting(mark=4, status="ok", n=6):
    return MarkSighting(
        stamp=STAMP,
        source="stripe-pose",
        mark=mark,
        status=status,
        pose=np.array([np.radians(30.0), 0.6, 0.8]),
        cov=np.eye(3),
        attitude=np.zeros(2),
        robot=np.zeros(3),
        robot_cov=np.eye(3),
        row=100.0,
        lines=np.column_stack(
            [100.0 + 10.0 * np.arange(n), np.full(n, 0.1), np.full(n, 60.0), np.full(n, 140.0), np.zeros(n)]
        ),
        members=np.arange(n),
    )


@pytest.mark.parametrize("version", ["ros1", "ros2"])
def test_every_message_can_be_encoded_and_brings_its_definition(seen, version):
    encoder = Encoder(version)
    landmarks = LandmarkMap(ids=np.array([4]), positions=np.array([[1.0, 2.0, 2.42]]))
    notice = Notice(stamp=STAMP, source="a", code="b", message="c")
    for kind, fields in (
        (IMAGE_ANNOTATIONS, image_annotations(seen)),
        (IMAGE_ANNOTATIONS, mark_annotations([mark_sighting()], MarkMap(marks=(MARK,)))),
        (SCENE_UPDATE, landmark_scene(landmarks, STAMP)),
        (SCENE_UPDATE, mark_scene(MarkMap(marks=(MARK,)), STAMP)),
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


# ---- stripe marks ---------------------------------------------------------------------------------------------


def points_of(lines):
    return [(point["x"], point["y"]) for point in lines["points"]]


def test_an_edge_counts_from_the_corner_of_the_first_pixel_too():
    edges, row = mark_annotations([mark_sighting()])["points"]
    assert edges["type"] == row["type"] == 4  # LINE_LIST of PointsAnnotation
    # 0.1 px per row, 40 rows above and below the row at which it stands at 100
    assert points_of(edges)[:2] == [(96.5, 60.5), (104.5, 140.5)]
    assert points_of(row) == [(96.5, 100.5), (154.5, 100.5)]


def test_edges_have_the_colour_of_their_polarity_where_the_marks_are_known():
    edges = mark_annotations([mark_sighting()], MarkMap(marks=(MARK,)))["points"][0]
    colours = [tuple(colour.values()) for colour in edges["outline_colors"]]
    assert len(colours) == 6
    assert len(set(colours[::2])) == len(set(colours[1::2])) == 1
    assert colours[0] != colours[1]
    unknown = mark_annotations([mark_sighting()])["points"][0]
    assert len({tuple(colour.values()) for colour in unknown["outline_colors"]}) == 1


def test_the_words_over_a_mark_say_which_how_far_and_how_turned():
    texts = mark_annotations([mark_sighting(), mark_sighting(NO_ID, "no_mark"), mark_sighting(4, "ambiguous")])["texts"]
    assert [text["text"] for text in texts] == [
        "4: 1.00 m, 30.0°", "no mark (no_mark): 1.00 m, 30.0°", "4 (ambiguous): 1.00 m, 30.0°",
    ]  # fmt: skip


def test_without_edges_there_is_nothing_to_draw():
    assert mark_annotations([mark_sighting(n=0)]) == {"points": [], "texts": []}


def test_bars_stand_where_the_map_says_and_the_arrow_points_to_the_viewer():
    (entity,) = mark_scene(MarkMap(marks=(MARK,), frame_id="hall"), STAMP)["entities"]
    assert (entity["frame_id"], entity["id"]) == ("hall", "mark_4")
    (line,) = entity["lines"]
    assert line["type"] == 2  # LINE_LIST of LinePrimitive
    points = np.array([list(point.values()) for point in line["points"]])
    assert points.shape == (3 * 8, 3)  # four lines around each of three bars
    assert points[:, 0] == pytest.approx(2.0)  # the mark lies along y
    assert sorted(set(np.round(points[:, 1], 9))) == pytest.approx([0.9, 0.94, 1.0, 1.04, 1.06, 1.1])
    assert (points[:, 2].min(), points[:, 2].max()) == (0.0, 0.25)
    turn = entity["arrows"][0]["pose"]["orientation"]
    facing = 2 * np.arctan2(turn["z"], turn["w"])
    assert (np.cos(facing), np.sin(facing)) == pytest.approx((1.0, 0.0))  # heading 90 degrees: seen from the side of +x
    assert entity["texts"][0]["text"] == "4"
