import numpy as np
import pytest

from logpose.pipelines.evaluate.align import Alignment, align
from logpose.pipelines.evaluate.associate import Track
from logpose.pipelines.evaluate.errors import rotation_errors, translation_errors
from logpose.pipelines.geometry import so3

RNG = np.random.default_rng(3)


def random_track(n=20):
    return Track(np.arange(n), RNG.normal(size=(n, 3)) * [5, 5, 1], so3.as_matrix(so3.exp(RNG.normal(size=(n, 3)))))


def moved(track, *, rotvec, translation, scale=1.0):
    """Return the estimate that the given motion would lay back onto the track."""
    R = so3.as_matrix(so3.exp(np.array(rotvec)))
    positions = (track.positions - translation) @ R / scale
    return Track(track.stamps, positions, R.T @ track.rotations)


@pytest.mark.parametrize(
    ("method", "rotvec", "scale"),
    [
        ("none", [0, 0, 0], 1.0),
        ("origin", [0.3, -0.2, 2.0], 1.0),
        ("se2", [0, 0, 2.5], 1.0),
        ("se3", [0.3, -0.2, 3.0], 1.0),
        ("sim3", [0.3, -0.2, 3.0], 0.04),
    ],
)
def test_a_known_motion_is_found_and_undone(method, rotvec, scale):
    reference = random_track()
    translation = np.zeros(3) if method == "none" else np.array([3.0, -2.0, 0.0 if method == "se2" else 5.0])
    estimate = moved(reference, rotvec=rotvec, translation=translation, scale=scale)
    alignment = align(reference, estimate, method)
    np.testing.assert_allclose(alignment.rotation, so3.as_matrix(so3.exp(np.array(rotvec))), atol=1e-12)
    np.testing.assert_allclose(alignment.translation, translation, atol=1e-12)
    assert alignment.scale == pytest.approx(scale, rel=1e-12)
    back = alignment.apply(estimate)
    assert translation_errors(reference, back).max() < 1e-12
    assert rotation_errors(reference, back).max() < 1e-12


def test_alignment_minimises_the_squared_distances():
    reference = random_track()
    estimate = Track(reference.stamps, reference.positions + RNG.normal(size=(20, 3)), reference.rotations)
    best = align(reference, estimate, "se3")
    cost = (translation_errors(reference, best.apply(estimate)) ** 2).sum()
    for _ in range(30):
        R = so3.as_matrix(so3.exp(RNG.normal(size=3) * 1e-3)) @ best.rotation
        other = Alignment(R, best.translation + RNG.normal(size=3) * 1e-3)
        assert (translation_errors(reference, other.apply(estimate)) ** 2).sum() > cost


def test_a_mirror_image_is_not_mirrored_back():
    reference = random_track()
    mirrored = Track(reference.stamps, reference.positions * [1, 1, -1], reference.rotations)
    assert np.linalg.det(align(reference, mirrored, "sim3").rotation) == pytest.approx(1)


@pytest.mark.parametrize("method", ["se2", "se3", "sim3"])
def test_one_point_does_not_fix_an_alignment(method):
    one = random_track(1)
    with pytest.raises(ValueError, match="1 poses do not fix an alignment"):
        align(one, one, method)


def test_a_line_does_not_fix_an_alignment_in_space_but_in_the_plane():
    line = Track(np.arange(5), np.outer(np.arange(5.0), [1, 1, 0]), np.tile(np.eye(3), (5, 1, 1)))
    with pytest.raises(ValueError, match="5 poses do not fix an alignment"):
        align(line, line, "se3")
    np.testing.assert_allclose(align(line, line, "se2").rotation, np.eye(3), atol=1e-12)
