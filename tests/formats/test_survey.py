from dataclasses import replace

import numpy as np

from logpose.formats.events import Odometry
from logpose.formats.survey import survey
from logpose.formats.write_log import create_log

S = 1_000_000_000
START = 1_700_000_000 * S


def test_a_survey_says_what_is_in_the_log(any_log):
    found = survey([any_log])
    by_name = {topic.name: topic for topic in found.topics}
    image, odometry = by_name["/camera/image_raw"], by_name["/odom"]
    assert (image.count, image.announced, image.type) == (20, 20, "sensor_msgs/msg/Image")
    assert (image.image_size, image.image_encoding) == ((8, 6), "mono8")
    assert image.roles == ("image",)
    assert image.frame_ids == ("camera",)
    assert abs(image.rate_hz - 10.0) < 1e-9
    assert abs(image.largest_gap_s - 0.1) < 1e-9
    assert image.median_lag_s == 0.0
    assert (odometry.first_header_ns, odometry.last_header_ns) == (START, START + 1_950_000_000)
    assert (found.first_ns, found.last_ns) == (START, START + 1_950_000_000)
    assert [p for p in found.problems if "metadata.yaml" not in p and "protobuf" not in p] == []


def test_problems_are_one_line_each(tmp_path):
    base = Odometry(stamp=0, topic="/odom", frame_id="odom", linear=np.zeros(3), angular=np.zeros(3))
    stamps = [START + k * S // 10 for k in range(20)]
    stamps[10:] = [s + 5 * S for s in stamps[10:]]
    path = tmp_path / "a.mcap"
    with create_log(path) as writer:
        from logpose.formats.encode import as_message

        for k, stamp in enumerate(stamps):
            header_stamp = 0 if k == 3 else stamp - 60 * S - (S if k == 5 else 0)
            kind, fields = as_message(replace(base, stamp=header_stamp))
            writer.write_message("/odom", kind, stamp, fields)
    assert list(survey(path).problems) == [
        "/odom: 1 header stamps are zero",
        "/odom: the header stamp goes back 1 times",
        "/odom: a gap of 5.100 s, 0.900 s after its first message",
        "/odom: header stamps are 60.000 s behind the log's clock; --stamp log may be needed",
    ]


def test_undecodable_topics_are_named(mcap_file, recording, tmp_path):
    found = survey(mcap_file(tmp_path / "x.mcap", recording, with_json=True))
    assert list(found.problems) == ["/blob: encoding 'protobuf' is not supported"]


def test_sightings_in_a_bag_are_recognised_by_their_name(tmp_path, some_sightings):
    path = tmp_path / "a.bag"
    with create_log(path) as writer:
        writer.write(some_sightings)
        writer.write_message("/chatter", "std_msgs/msg/String", START, {"data": "hello"})
    assert {t.name: t.roles for t in survey(path).topics} == {"/chatter": (), "/sightings": ("sightings",)}
