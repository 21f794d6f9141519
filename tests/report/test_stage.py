import pytest

from logpose.formats.errors import ConfigError, FormatError
from logpose.formats.maps.landmarks import write_landmarks
from logpose.pipelines.report.landmarks.kept import LandmarkFindings
from logpose.pipelines.report.stage import WritePictureParams, WriteReportParams, write_picture, write_report


def test_write_report_forwards_everything_and_leaves_a_page(tmp_path, make, landmarks):
    write_landmarks(landmarks, tmp_path / "landmarks.yaml")
    path = tmp_path / "report.html"
    params = WriteReportParams(path=str(path), map=str(tmp_path / "landmarks.yaml"), title="a drive")
    events = list(make.drive(60))
    assert list(write_report(iter(events), params)) == events
    page = path.read_text()
    assert "<h1>a drive</h1>" in page
    assert "of 297)" in page


def test_a_run_that_fails_leaves_no_page(tmp_path, make):
    def failing():
        yield make.pose(1, 0.0, 0.0, 0.0)
        raise RuntimeError

    with pytest.raises(RuntimeError):
        list(write_report(failing(), WriteReportParams(path=str(tmp_path / "report.html"))))
    assert list(tmp_path.iterdir()) == []


def test_a_map_that_is_missing_is_told_before_the_log_is_read(tmp_path):
    def never():
        pytest.fail("the log was read")
        yield

    with pytest.raises(FormatError):
        next(write_report(never(), WriteReportParams(path=str(tmp_path / "r.html"), map=str(tmp_path / "no.yaml"))))


def test_start_pose_and_true_sightings_are_no_estimates(collect, make):
    events = [make.pose(1, 0.0, 0.0, 0.0, "initial_pose"), make.sightings(1, [[0, 0]], source="true_sightings")]
    found = collect(events)
    assert (found.primary, found.of(LandmarkFindings)) == (None, None)


def test_what_the_detector_saw_and_the_estimator_matched_are_kept_apart(collect, make):
    events = []
    for i in range(3):
        events += [make.sightings(i, [[0, 0], [1, 1]]), make.pose(i, 0.0, 0.0, 0.0)]
        events += [make.sightings(i, [[0, 0], [1, 1]], [7, -1], source="localize-pf")]
    found = collect(events)
    kept = found.of(LandmarkFindings)
    matched = kept.matched_by(found.primary)
    assert (kept.seen.source, kept.seen.n.tolist()) == ("detect-circles", [2, 2, 2])
    assert (matched.source, matched.n.tolist()) == ("localize-pf", [1, 1, 1])
    assert kept.matched_ids == {7}


def test_write_picture_writes_what_its_suffix_says(tmp_path, make):
    events = list(make.drive(60))
    for name, start in (("map.svg", b"<?xml"), ("map.PNG", b"\x89PNG")):
        params = WritePictureParams(path=str(tmp_path / name))
        assert list(write_picture(iter(events), params)) == events
        assert (tmp_path / name).read_bytes().startswith(start)


def test_write_picture_refuses_other_suffixes():
    with pytest.raises(ConfigError, match=r"a\.jpg: no picture can be written so\. Name it \.png or \.svg\."):
        list(write_picture(iter([]), WritePictureParams(path="a.jpg")))
