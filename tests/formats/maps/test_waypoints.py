import pytest

from logpose.formats.errors import FormatError
from logpose.formats.maps.waypoints import Waypoint, read_waypoints, write_waypoints


def test_waypoints_are_read_back(tmp_path):
    path = tmp_path / "w.yaml"
    waypoints = [Waypoint("W1", 30.38, 27.2), Waypoint("the door: 2", -1e-7, 0.0)]
    write_waypoints(waypoints, path)
    assert read_waypoints(path) == waypoints


HEAD = "logpose: waypoints/1\nwaypoints:\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("waypoints: []", "{p}: is no list of waypoints. It must begin with 'logpose: waypoints/1'."),
        (HEAD, "{p}: has no waypoints. Give a list 'waypoints: [{{name: W1, x_m: .., y_m: ..}}]'."),
        (HEAD + "- W1\n", "{p}: waypoints[0] is no mapping. Write {{name: W1, x_m: .., y_m: ..}}."),
        (HEAD + "- {name: W1, x_m: 1}\n", "{p}:3: key 'y_m' is missing. Write {{name: W1, x_m: .., y_m: ..}}."),
        (HEAD + "- {name: W1, x_m: 1, y_m: a}\n", "{p}:3: y_m is 'a', not a number. Correct or remove the line."),
        (
            HEAD + "- {name: W1, x_m: 1, y_m: 2}\n" * 2,
            "{p}:4: waypoint 'W1' stands twice. Give each its own name.",
        ),
    ],
)
def test_a_wrong_file_is_explained(tmp_path, text, message):
    path = tmp_path / "w.yaml"
    path.write_text(text)
    with pytest.raises(FormatError) as caught:
        read_waypoints(path)
    assert str(caught.value) == message.format(p=path)
