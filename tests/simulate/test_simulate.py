"""A whole run: what is in it, in which order, and that the truth is the truth."""

from itertools import islice, pairwise

import cv2
import numpy as np
import pytest

from logpose.formats.events import NO_ID, CameraInfo, Image, Odometry, Pose, Sightings, Transform
from logpose.pipelines.simulate.camera import base_camera, calibration_of
from logpose.pipelines.simulate.renderer import render
from logpose.pipelines.simulate.robot import drive
from logpose.pipelines.simulate.scene import Run
from logpose.pipelines.simulate.simulate import simulate
from logpose.pipelines.simulate.world import read_world
from logpose.pipelines.simulate.worlds.ceiling import build_ceiling
from logpose.pipelines.simulate.worlds.sightings import true_sightings


def bytes_of(events):
    return [e.data.tobytes() for e in events if isinstance(e, Image)]


def clean(small, **more):
    return small(
        **{
            "sensor__psf_px": 0.0,
            "sensor__vignetting": 0.0,
            "sensor__gain_sd": 0.0,
            "sensor__read_noise_dn": 0.0,
            "sensor__shot_noise_dn": 0.0,
            "sensor__exposure_ms": 0.0,
            **more,
        }
    )


def test_events_come_in_time_order_on_their_topics(small):
    events = list(simulate(small(), 1))
    stamps = [e.stamp for e in events]
    assert stamps == sorted(stamps)
    kinds = {(type(e), e.topic, e.source, e.frame_id): None for e in events}
    assert list(kinds) == [
        (Transform, "/tf_static", "tf", "base_link"),
        (Pose, "/initialpose", "initial_pose", "map"),
        (Odometry, "/odom", "odometry", "odom"),
        (CameraInfo, "/ceiling/camera_info", "camera_info", "ceiling_camera_optical_frame"),
        (Pose, "/ground_truth/pose", "truth", "map"),
        (Sightings, "/ground_truth/sightings", "true_sightings", "base_link"),
        (Image, "/ceiling/image_raw", "image", "ceiling_camera_optical_frame"),
    ]
    assert events[0].is_static
    assert events[0].child_frame_id == "ceiling_camera_optical_frame"
    images = [e for e in events if isinstance(e, Image)]
    truths = [e for e in events if e.source == "truth"]
    assert [e.stamp for e in images] == [e.stamp for e in truths]
    assert (np.diff([e.stamp for e in images]) == 200_000_000).all()
    assert images[0].encoding == "mono8"
    assert (images[0].width, images[0].height, images[0].step, len(images[0].data)) == (160, 120, 160, 19200)
    assert not images[0].data.flags.writeable
    assert images[0].calibration == calibration_of(small().camera)
    np.testing.assert_allclose(images[0].mount.translation, [0.1, 0, 0.3])


def test_the_same_seed_gives_the_same_bytes_and_another_one_others(small):
    one, same, other = (bytes_of(simulate(small(), seed)) for seed in (1, 1, 2))
    assert one == same
    assert one[0] != other[0]


def test_a_cause_has_a_stream_of_its_own(small):
    def odometry(world):
        return [(e.stamp, e.position.tolist()) for e in simulate(world, 3) if isinstance(e, Odometry)]

    assert odometry(small()) == odometry(small(camera__rate_hz=2.0, sensor__read_noise_dn=9.0))


def test_without_noise_images_are_the_rendered_light(small):
    world = clean(small)
    built, driven = build_ceiling(world.ceiling, world.robot.route), drive(world.robot, np.random.default_rng([1, 1]))
    images = [e for e in simulate(world, 1) if isinstance(e, Image)]
    for k in (0, 7):
        view = driven.view(k * 0.2) @ base_camera(world.camera)
        light = render([built.patch], [view], calibration_of(world.camera))
        expected = np.floor(np.clip(255 * light, 0, 255) + 0.5).astype(np.uint8)
        np.testing.assert_array_equal(images[k].data.reshape(120, 160), expected)
    other_seed = [e for e in simulate(world, 2) if isinstance(e, Image)]
    assert bytes_of(images) == bytes_of(other_seed)


def test_the_true_sighting_is_where_the_lamp_is_in_the_image(small, centroid):
    world = clean(
        small,
        ceiling__landmarks__layout="listed",
        ceiling__landmarks__at_m=[[1.9, 1.8], [2.5, 1.2], [3.2, 1.9]],
        ceiling__landmarks__lamps=0.0,
        ceiling__landmarks__speakers=0.0,
        ceiling__clutter__per_m2=0.0,
        ceiling__clutter__false_lights_per_m2=0.0,
        ceiling__tiles={"bar_m": 0.0, "contrast": 0.0, "radiance": 0.1},
        robot__tilt={"sd_deg": 1.0},
    )
    events, worst, n = list(simulate(world, 1)), 0.0, 0
    for sightings, image in pairwise(events):
        if not isinstance(image, Image):
            continue
        grey = image.data.reshape(120, 160).astype(float) - 26  # 255 * 0.1, rounded
        for uv, radius in zip(sightings.uv, sightings.radius, strict=True):
            left, top = (uv - radius - 2).astype(int).clip(0)
            right, bottom = (uv + radius + 3).astype(int)
            worst = max(worst, np.abs(centroid(grey[top:bottom, left:right], left, top) - uv).max())
            n += 1
    assert n > 30
    # The lens and the tilt shift the centroid of a disc of 6 px radius by some hundredths of a pixel from its centre.
    assert worst < 0.1


def test_true_sightings_are_the_landmarks_seen_from_the_robot(small):
    world = small(ceiling__clutter__false_lights_per_m2=0.5, robot__tilt={"sd_deg": 0.0})
    built = build_ceiling(world.ceiling, world.robot.route)
    events = list(simulate(world, 1))
    seen = 0
    for pose, sightings in pairwise(events):
        if not isinstance(sightings, Sightings):
            continue
        heading = 2 * np.arctan2(pose.orientation[2], pose.orientation[3])
        turn = np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]])
        there = pose.position[:2] + sightings.xy @ turn.T
        is_known = sightings.ids != NO_ID
        np.testing.assert_allclose(there[is_known], built.landmarks[sightings.ids[is_known], :2], atol=1e-9)
        for place in there[~is_known]:
            assert np.hypot(*(built.false_lights[:, :2] - place).T).min() < 1e-9
        # Wholly in view: the centre is at least a radius away from the border.
        edge = np.minimum(sightings.uv, np.array([159, 119]) - sightings.uv).min(axis=1)
        assert (edge > 0.9 * sightings.radius - 0.6).all()
        seen += len(sightings.ids)
    assert seen > 20


def test_a_jpeg_log_holds_the_same_pictures(small):
    raw = [e for e in simulate(small(), 1) if isinstance(e, Image)]
    packed = [e for e in simulate(small(camera__encoding="jpeg", camera__jpeg_quality=95), 1) if isinstance(e, Image)]
    assert packed[3].encoding == "jpeg"
    decoded = cv2.imdecode(packed[3].data, cv2.IMREAD_GRAYSCALE).astype(int)
    assert np.abs(decoded - raw[3].data.reshape(120, 160)).mean() < 2


def test_the_start_pose_errs_as_it_says(small):
    starts = [list(islice(simulate(small(images=False), seed), 2))[1] for seed in range(30)]
    errors = np.array([s.position[:2] - [1.5, 1.5] for s in starts]).reshape(-1)
    assert errors.std() == pytest.approx(0.05, rel=3 / np.sqrt(2 * 60))
    np.testing.assert_allclose(starts[0].covariance.diagonal(), [0.05**2, 0.05**2, 0, 0, 0, np.radians(2) ** 2])


def test_abstract_sightings_have_the_errors_that_were_asked_for(small):
    world = small(
        images=False,
        camera__rate_hz=50.0,
        sightings={"pixel_sd_px": 0.5, "detection_probability": 0.8, "false_per_image": 0.3},
    )
    events = list(simulate(world, 4))
    assert not any(isinstance(e, Image) for e in events)
    true = [e for e in events if e.source == "true_sightings"]
    seen = [e for e in events if e.source == "sightings"]
    assert [e.stamp for e in true] == [e.stamp for e in seen]
    errors, n_true, n_false = [], 0, 0
    for a, b in zip(true, seen, strict=True):
        n_true += len(a.uv)
        for uv, xy in zip(b.uv, b.xy, strict=True):
            apart = np.linalg.norm(a.uv - uv, axis=1) if len(a.uv) else np.array([99.0])
            if apart.min() < 3:
                errors.append(np.concatenate([uv - a.uv[apart.argmin()], xy - a.xy[apart.argmin()]]))
            else:
                n_false += 1
        assert (b.ids == NO_ID).all()
    table = np.array(errors)
    assert len(table) / n_true == pytest.approx(0.8, abs=3 * np.sqrt(0.16 / n_true) + 0.01)
    assert n_false / len(true) == pytest.approx(0.3, abs=3 * np.sqrt(0.3 / len(true)) + 0.02)
    assert table[:, :2].std() == pytest.approx(0.5, rel=3 / np.sqrt(4 * len(table)) + 0.02)
    # 0.5 px of 2.4 m / 161 px each
    assert table[:, 2:].std() == pytest.approx(np.sqrt(seen[0].cov[0, 0, 0]), rel=0.1)


def test_the_paper_s_robot_sees_what_the_paper_counts(root):
    world = read_world(root / "papers" / "ceiling" / "world.yaml")
    built, driven = build_ceiling(world.ceiling, world.robot.route), drive(world.robot, np.random.default_rng([0, 1]))
    period = round(1e9 / world.camera.rate_hz)
    run, counts, ids = Run(driven, 1, 0), [], set()
    for k in range(0, int(driven.duration * 1e9) // period, 3):
        found = true_sightings(run, k * period, world.camera, built)
        counts.append(len(found.ids))
        ids |= set(found.ids.tolist())
    share = np.bincount(counts) / len(counts)
    assert len(built.landmarks) == 297
    assert abs(len(ids) - 146) <= 2
    # Printed: 370 of 4400 images without, 1200 with one landmark: 0.084 and 0.273.
    assert 0.075 < share[0] < 0.115
    assert 0.25 < share[1] < 0.29
    assert 1.7 < np.mean(counts) < 2.2
    longest = max(len(run) for run in "".join("0" if n == 0 else " " for n in counts).split())
    assert longest * 3 / world.camera.rate_hz > 4  # the gap: seconds without a landmark


def test_the_first_image_comes_before_the_drive_is_rendered(small):
    # A generator: nothing is rendered that is not asked for, so memory does not grow with the length of the log.
    assert any(isinstance(e, Image) for e in islice(simulate(small(), 1), 10))
