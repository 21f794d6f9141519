import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logpose.formats.errors import FormatError
from logpose.formats.maps.landmarks import read_landmarks, write_landmarks
from logpose.formats.products import LandmarkMap


@st.composite
def maps(draw):
    """Landmarks on a 1 m raster, moved by less than half of it less 0.05 m."""
    cells = draw(st.lists(st.tuples(st.integers(-99, 99), st.integers(-99, 99)), min_size=1, max_size=8, unique=True))
    shift = st.floats(-0.4, 0.4)
    positions = np.array([[x + draw(shift), y + draw(shift), draw(st.floats(-10, 10))] for x, y in cells])
    ids = np.array(draw(st.lists(st.integers(0, 2**40), min_size=len(cells), max_size=len(cells), unique=True)))
    covariances = None
    if draw(st.booleans()):
        roots = np.array(draw(st.lists(st.floats(-0.1, 0.1), min_size=9 * len(cells), max_size=9 * len(cells))))
        roots = roots.reshape(-1, 3, 3)
        covariances = roots @ np.swapaxes(roots, 1, 2)
    frame = draw(st.sampled_from(["map", "odom", "my map: 1", "null", "1.5"]))
    return LandmarkMap(ids=ids, positions=positions, covariances=covariances, frame_id=frame)


@settings(max_examples=25, deadline=None)
@given(maps())
def test_yaml_gives_the_map_back_bit_by_bit(tmp_path_factory, landmarks):
    path = tmp_path_factory.mktemp("maps") / "m.yaml"
    write_landmarks(landmarks, path)
    back = read_landmarks(path)
    np.testing.assert_array_equal(back.ids, landmarks.ids)
    np.testing.assert_array_equal(back.positions, landmarks.positions)
    assert back.frame_id == landmarks.frame_id
    if landmarks.covariances is None:
        assert back.covariances is None
    else:
        upper = np.triu_indices(3)
        np.testing.assert_array_equal(back.covariances[:, *upper], landmarks.covariances[:, *upper])
        np.testing.assert_array_equal(back.covariances, np.swapaxes(back.covariances, 1, 2))


@settings(max_examples=25, deadline=None)
@given(maps())
def test_csv_gives_ids_positions_and_frame_back_bit_by_bit(tmp_path_factory, landmarks):
    path = tmp_path_factory.mktemp("maps") / "m.csv"
    write_landmarks(landmarks, path)
    back = read_landmarks(path)
    np.testing.assert_array_equal(back.ids, landmarks.ids)
    np.testing.assert_array_equal(back.positions, landmarks.positions)
    assert back.frame_id == landmarks.frame_id


def test_the_yaml_is_laid_out_as_documented(tmp_path):
    path = tmp_path / "m.yaml"
    write_landmarks(LandmarkMap(ids=np.array([3]), positions=np.array([[1.0, -2.5, 2.42]])), path)
    assert path.read_text() == (
        "logpose: landmarks/1\nframe: map\nlandmarks:\n  - {id: 3, x_m: 1.0, y_m: -2.5, z_m: 2.42}\n"
    )


def test_content_and_not_the_suffix_tells_csv_from_yaml(tmp_path):
    path = tmp_path / "m.yaml"
    path.write_text("id,x_m,y_m,z_m\n0,1,2,3\n")
    np.testing.assert_array_equal(read_landmarks(path).positions, [[1, 2, 3]])


def test_height_may_be_missing_and_columns_may_stand_in_another_order(tmp_path):
    path = tmp_path / "m.csv"
    path.write_text("# surveyed by hand\n\nid, y_m, x_m\n4, 2, 1\n")
    np.testing.assert_array_equal(read_landmarks(path).positions, [[1, 2, 0]])


def test_a_planar_covariance_is_taken(tmp_path):
    path = tmp_path / "m.yaml"
    path.write_text("logpose: landmarks/1\nlandmarks:\n- {id: 0, x_m: 1, y_m: 2, cov_m2: [0.1, 0.02, 1e-1]}\n")
    expected = [[0.1, 0.02, 0], [0.02, 0.1, 0], [0, 0, 0]]
    np.testing.assert_array_equal(read_landmarks(path).covariances[0], expected)


HEAD = "logpose: landmarks/1\nlandmarks:\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "{p}: is empty. Name a landmark map, 'logpose: landmarks/1' or CSV."),
        ("# only a comment\n", "{p}: is empty. Name a landmark map, 'logpose: landmarks/1' or CSV."),
        (HEAD, "{p}: the map has no landmarks. Give at least one."),
        (HEAD.strip() + " []\n", "{p}: the map has no landmarks. Give at least one."),
        ("id,x_m,y_m,z_m\n", "{p}: the map has no landmarks. Give at least one."),
        ("just words\n", "{p}: is no landmark map. It must begin with 'logpose: landmarks/1'."),
        ("landmarks: []\n", "{p}:1: key 'logpose' is missing. Write 'logpose: landmarks/1' into the first line."),
        (
            "frame: map\nlogpose: landmarks/2\n",
            "{p}:2: the file is 'landmarks/2', not 'landmarks/1'. Name a landmark map of this version.",
        ),
        ("logpose: landmarks/1\n", "{p}: key 'landmarks' is missing. Give a list of landmarks."),
        (
            HEAD + "- {id: 0, x_m: 1, y_m: 2}\n- {id: 1, x_m: 1}\n",
            "{p}:4: key 'y_m' is missing. Write {{id: 0, x_m: .., y_m: .., z_m: ..}}.",
        ),
        (
            HEAD + "- {id: 0, x_m: 1, y_m: 2}\n- {id: 0, x_m: 5, y_m: 2}\n",
            "{p}:4: id 0 stands twice (first in line 3). Give each landmark its own.",
        ),
        (
            HEAD + "- {id: 0, x_m: 1, y_m: 2}\n- {id: 7, x_m: 1.04, y_m: 2}\n",
            "{p}:4: landmarks 0 and 7 are 0.040 m apart. Remove one; landmarks must be at least 0.05 m apart.",
        ),
        (
            HEAD + "- {id: 0, x_m: .nan, y_m: 2}\n",
            "{p}:3: x_m is 'nan'. Every value must be finite; remove the line.",
        ),
        (HEAD + "- {id: 0, x_m: one, y_m: 2}\n", "{p}:3: x_m is 'one', not a number. Correct or remove the line."),
        (HEAD + "- {id: a, x_m: 1, y_m: 2}\n", "{p}:3: id is 'a'. It must be an integer from 0."),
        (
            HEAD + "- {id: 0, x_m: 2.0e+12, y_m: 2}\n",
            "{p}:3: x_m is 2000000000000.0 m. No map is that large; the unit is metres.",
        ),
        (
            HEAD + "- {id: 0, x_m: 1, y_m: 2, x: 1}\n",
            "{p}:3: a landmark has no key 'x'. Known keys: cov_m2, id, x_m, y_m, z_m.",
        ),
        (
            HEAD + "- {id: 0, x_m: 1, y_m: 2, cov_m2: [1, 2]}\n",
            "{p}:3: cov_m2 is [1, 2]. It must be [xx, xy, xz, yy, yz, zz] or [xx, xy, yy].",
        ),
        (
            HEAD + "- {id: 0, x_m: 1, y_m: 2, cov_m2: [1, 2, 1]}\n",
            "{p}:3: cov_m2 [1, 2, 1] is no covariance. No eigenvalue may be negative.",
        ),
        (
            HEAD + "- {id: 0, x_m: 1, y_m: 2, cov_m2: [1, 0, 1]}\n- {id: 1, x_m: 3, y_m: 2}\n",
            "{p}:4: id 1 has no cov_m2, others do. Give it for all or none.",
        ),
        (HEAD + "- {id: 0, id: 1}\n", "{p}:3: key 'id' stands twice. Remove one."),
        (HEAD + "- {id: 0\n", "{p}:3: is no YAML (expected ',' or '}}', but got '<stream end>'). Correct the line."),
        ("id,x_m\n0,1\n", "{p}:1: column 'y_m' is missing. The header is id,x_m,y_m,z_m."),
        ("id,x_m,y_m\n0,1\n", "{p}:2: has 2 columns, the header 3. Correct the line."),
        ("id,x_m,y_m\n0,1,nan\n", "{p}:2: y_m is 'nan'. Every value must be finite; remove the line."),
        ("id,x_m,y_m\n0.5,1,1\n", "{p}:2: id is '0.5'. It must be an integer from 0."),
        (
            "id,x_m,y_m\n0,1,1\n1,1,1\n",
            "{p}:3: landmarks 0 and 1 are 0.000 m apart. Remove one; landmarks must be at least 0.05 m apart.",
        ),
    ],
)
def test_a_wrong_map_is_explained(tmp_path, text, message):
    path = tmp_path / "map"
    path.write_text(text)
    with pytest.raises(FormatError) as caught:
        read_landmarks(path)
    assert str(caught.value) == message.format(p=path)


def test_a_missing_file_is_an_error():
    with pytest.raises(FormatError, match=r"^nowhere.yaml: no such file. Check the path.$"):
        read_landmarks("nowhere.yaml")


def test_a_folder_is_an_error(tmp_path):
    with pytest.raises(FormatError, match=r"is a folder. Name a file in it.$"):
        read_landmarks(tmp_path)


def test_landmarks_just_far_enough_apart_are_kept(tmp_path):
    path = tmp_path / "m.csv"
    path.write_text("id,x_m,y_m\n0,0.049999,0\n1,0.1,0\n2,-0.001,0\n")
    assert len(read_landmarks(path)) == 3


def test_near_landmarks_are_found_across_cell_borders(tmp_path):
    rng = np.random.default_rng(0)
    path = tmp_path / "m.csv"
    for _ in range(50):
        x, y = rng.uniform(-5, 5, 2)
        a = rng.uniform(0, 2 * math.pi)
        path.write_text(f"id,x_m,y_m\n0,{x},{y}\n1,{x + 0.049 * math.cos(a)},{y + 0.049 * math.sin(a)}\n")
        with pytest.raises(FormatError, match=r"0\.049 m apart"):
            read_landmarks(path)


def test_an_alias_bomb_is_not_expanded(tmp_path):
    path = tmp_path / "m.yaml"
    bomb = "a: &a [x, x, x, x, x, x, x, x, x]\n"
    for old, new in zip("abcdefgh", "bcdefghi", strict=True):
        bomb += f"{new}: &{new} [{', '.join(['*' + old] * 9)}]\n"
    path.write_text("logpose: landmarks/1\n" + bomb + "landmarks: *i\n")
    with pytest.raises(FormatError, match="aliases expand to more than 1,000,000 values"):
        read_landmarks(path)


@settings(max_examples=60, deadline=None)
@given(st.text(max_size=200))
def test_any_text_is_a_map_or_a_format_error(tmp_path_factory, text):
    path = tmp_path_factory.mktemp("fuzz") / "m"
    path.write_text(text, encoding="utf-8", errors="replace")
    try:
        read_landmarks(path)
    except FormatError as err:
        assert "\n" not in str(err)  # noqa: PT017
