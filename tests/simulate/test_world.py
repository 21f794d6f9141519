"""World files: what is refused, and the words in which."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logpose.formats.errors import ConfigError, FormatError
from logpose.pipelines.engine.params import Params
from logpose.pipelines.simulate.world import WORLDS, CeilingWorld, parse_world, read_world

MINIMAL = """\
logpose: world/1
kind: ceiling
robot:
  waypoints: [{name: A, x_m: 2.0, y_m: 2.0}, {name: B, x_m: 6.0, y_m: 2.0}]
ceiling: {height_m: 2.74}
"""


def test_what_is_not_given_has_a_default():
    world = parse_world(MINIMAL, "w.yaml")
    assert world.camera.width_px == 640
    assert world.robot.waypoints[1].x_m == 6.0
    assert world.ceiling.survey_sd_m == 0.0


@pytest.mark.parametrize("name", ["papers/ceiling/world.yaml", "sample_logs/ceiling.world.yaml"])
def test_the_worlds_of_the_project_are_valid(root, name):
    assert read_world(root / name).kind == "ceiling"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("world/1", "world/2", "w.yaml:1: is no world of this version. Its first line must be 'logpose: world/1'."),
        (
            "kind: ceiling",
            "kind: sky",
            "w.yaml:2: there is no kind of world 'sky'. Known kinds: ceiling, stripe, stripe-bench.",
        ),
        (
            "height_m: 2.74",
            "height_m: tall",
            'w.yaml:5: ceiling.height_m: "tall" should be a valid number (of the ceiling above the floor [m]). Correct it.',
        ),
        (
            "height_m: 2.74",
            "height_m: -1",
            "w.yaml:5: ceiling.height_m: -1 should be greater than 0 (of the ceiling above the floor [m]). Correct it.",
        ),
        ("height_m: 2.74", "hight_m: 2.74", "w.yaml:5: unknown key 'ceiling.hight_m'. Did you mean 'height_m'?"),
        (
            "y_m: 2.0}]",
            "y: 2.0}]",
            "w.yaml:4: unknown key 'robot.waypoints.1.y'. Known keys: name, x_m, y_m.",
        ),
        (
            "x_m: 6.0, ",
            "",
            "w.yaml:4: robot.waypoints.1.x_m is missing (in the map [m]). Add it.",
        ),
        (
            "height_m: 2.74",
            "height_m: 3e0",
            'w.yaml:5: ceiling.height_m: "3e0" should be a valid number (of the ceiling above the floor [m]). '
            "YAML wants a point and a sign before an exponent: 1.0e-3, 1.0e+3.",
        ),
        (
            "2.74",
            "0.05",
            "w.yaml:1: ceiling.height_m is 0.05, the lens is at 0.0 m. The ceiling must be at least 0.1 m above the lens.",
        ),
        (
            "2.74",
            "2.74, landmarks: {radius_m: [0.2, 0.1]}",
            "w.yaml:5: ceiling.landmarks.radius_m: what is given should not begin above its end "
            "(smallest and largest radius [m]). Correct it.",
        ),
        ("2.74}", "2.74}\nkind: ceiling", "w.yaml:6: key 'kind' stands twice. Remove one."),
        (
            "2.74}",
            "2.74}\ncamera: {distortion: [0, 1]}",
            "w.yaml:6: camera.distortion.2 is missing (plumb_bob lens: k1, k2, p1, p2, k3 [1]). Add it.",
        ),
        (
            "2.74}",
            "2.74}\ncamera:\n  mount:\n    zm: 3",
            "w.yaml:8: unknown key 'camera.mount.zm'. Did you mean 'z_m'?",
        ),
        (
            "2.74}",
            "2.74}\ncamera: {rate_hz: .inf}",
            "w.yaml:6: camera.rate_hz: Infinity should be a finite number (images per second [Hz]). Correct it.",
        ),
    ],
)
def test_a_mistake_is_answered_with_its_line_its_key_and_the_cure(old, new, message):
    with pytest.raises(ConfigError) as caught:
        parse_world(MINIMAL.replace(old, new, 1), "w.yaml")
    assert str(caught.value) == message


def test_settings_replace_values_of_the_file():
    world = parse_world(MINIMAL, "w.yaml", [("camera.encoding", "jpeg"), ("robot.waypoints.1.x_m", 7)])
    assert world.camera.encoding == "jpeg"
    assert world.robot.waypoints[1].x_m == 7.0


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("camera.rate", 5, "--set camera.rate: unknown key 'camera.rate'. Did you mean 'rate_hz'?"),
        ("robot.waypoints.7.x_m", 5, "--set robot.waypoints.7.x_m: there is no such place in the world. "),
        ("camera.rate_hz", "fast", '--set camera.rate_hz: camera.rate_hz: "fast" should be a valid number'),
        ("camera.rate.x", 5, "--set camera.rate.x: unknown key 'camera.rate'."),
    ],
)
def test_a_wrong_setting_is_named(key, value, message):
    with pytest.raises(ConfigError) as caught:
        parse_world(MINIMAL, "w.yaml", [(key, value)])
    assert str(caught.value).startswith(message)


def test_a_missing_file_is_a_format_error():
    with pytest.raises(FormatError, match=r"no\.yaml: no such file"):
        read_world("no.yaml")


def test_text_that_is_no_yaml_is_refused():
    for text in ("a: [", "", "- 1\n- 2\n", "\x00"):
        with pytest.raises(ConfigError):
            parse_world(text, "w.yaml")


@settings(deadline=None)
@given(st.integers(0, len(MINIMAL) - 1), st.text(max_size=6))
def test_no_text_raises_anything_but_our_error(place, insert):
    error = None
    try:
        parse_world(MINIMAL[:place] + insert + MINIMAL[place + 1 :], "w.yaml")
    except ConfigError as err:
        error = err
    assert error is None or "\n" not in str(error)


def test_every_key_is_described():
    def check(model):
        for name, field in model.model_fields.items():
            assert field.description, f"{model.__name__}.{name}"
            for inner in (field.annotation, *getattr(field.annotation, "__args__", ())):
                if isinstance(inner, type) and issubclass(inner, Params):
                    check(inner)

    for model in WORLDS.values():
        check(model)
    assert CeilingWorld in WORLDS.values()
