"""The scenes of the benchmarks of marks: areas, projection and edges are exact."""

import numpy as np
import pytest


@pytest.fixture
def raster(root, monkeypatch):
    monkeypatch.syspath_prepend(root / "benchmarks")
    import mark_raster

    return mark_raster


@pytest.fixture
def scenes(root, monkeypatch):
    monkeypatch.syspath_prepend(root / "benchmarks")
    import mark_scenes

    return mark_scenes


def test_coverage_of_a_triangle_is_its_area_and_does_not_depend_on_its_sense(raster):
    corners = np.array([[1.3, 0.2], [7.9, 3.1], [2.2, 9.7]])
    (a, b), (c, d) = corners[1] - corners[0], corners[2] - corners[0]
    once, back = raster.coverage([corners], [1.0], (12, 12)), raster.coverage([corners[::-1]], [1.0], (12, 12))
    assert once.sum() == pytest.approx(0.5 * abs(a * d - b * c), abs=1e-12)
    assert once.min() > -1e-12
    assert once.max() == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(back, once, atol=1e-12)


def test_coverage_of_what_crosses_the_border_is_that_part_of_the_whole(raster):
    corners = np.array([[1.3, 0.2], [7.9, 3.1], [2.2, 9.7]])
    whole = raster.coverage([corners], [1.0], (12, 12))
    np.testing.assert_allclose(raster.coverage([corners - 4], [1.0], (3, 2)), whole[4:7, 4:6], atol=1e-12)


# Vectors 16 to 18 of the specification of the method: f = 16 mm, lines at 0, -60 and 60 mm, a row at height Zp.
@pytest.mark.parametrize(
    "phi, tilt, roll, D, Zp, Xp",
    [
        (25, 10, 3, (40, 700, 50), 0, (0.902100433069, -0.336218374372, 2.055429770598)),
        (-40, -8, -5, (10, 900, -120), 1.5, (0.310314659447, -0.485956873265, 1.178977918267)),
        (10, 20, 0, (0, 500, 0), -0.8, (0, -1.847635568999, 1.772206099889)),
    ],
)
def test_upright_lines_are_where_the_specification_has_them(raster, scenes, phi, tilt, roll, D, Zp, Xp):
    optics = raster.Optics(f=16.0, cx=0.0, cy=0.0, tilt=np.radians(tilt), roll=np.radians(roll))
    columns = scenes.edge_columns(
        optics, raster.Plane(np.radians(phi), *D), np.array([0.0, -60.0, 60.0]), np.array([-Zp])
    )
    np.testing.assert_allclose(columns[0], Xp, atol=1e-11)


def test_rendered_edges_are_where_they_project_to(scenes):
    assert scenes.check() < 0.003


def test_a_scene_depends_on_its_seed_only_and_the_wall_not_on_the_pattern(scenes):
    one, again, short = scenes.scene(3), scenes.scene(3), scenes.scene(3, pattern=scenes.MARKS[1])
    np.testing.assert_array_equal(one.image, again.image)
    np.testing.assert_array_equal(one.truth, short.truth)
    assert (one.image != short.image).mean() < 0.1
