import numpy as np

from logpose.formats.events import Transform
from logpose.formats.transforms import StaticTransforms

H = np.sqrt(0.5)


def tree(*edges):
    found = StaticTransforms()
    for parent, child, translation, rotation in edges:
        found.add(
            Transform(
                stamp=0,
                frame_id=parent,
                child_frame_id=child,
                translation=np.array(translation, float),
                rotation=np.array(rotation, float),
            )
        )
    return found


def test_a_chain_of_transforms_is_multiplied_out():
    # base -> mast: 90 degrees about z; mast -> camera: one metre along the mast's x, which is base's y.
    mount = tree(("/base_link", "mast", (0, 0, 1), (0, 0, H, H)), ("mast", "/camera", (1, 0, 0), (0, 0, 0, 1))).mount(
        "camera"
    )
    np.testing.assert_allclose(mount.translation, [0, 1, 1], atol=1e-12)
    np.testing.assert_allclose(mount.rotation, [0, 0, H, H], atol=1e-12)


def test_edges_are_walked_in_both_directions():
    # The footprint is the root, base_link its child: the way to the footprint goes against the edge.
    mount = tree(("base_footprint", "base_link", (0, 0, 0.2), (0, 0, H, H))).mount("/base_footprint")
    np.testing.assert_allclose(mount.translation, [0, 0, -0.2], atol=1e-12)
    np.testing.assert_allclose(mount.rotation, [0, 0, -H, H], atol=1e-12)


def test_frames_without_a_connection_have_no_mount():
    transforms = tree(("map", "camera", (1, 2, 3), (0, 0, 0, 1)))
    assert transforms.mount("camera") is None
    assert transforms.mount("") is None


def test_the_last_word_holds():
    a, b = ("base_link", "s", (1, 0, 0), (0, 0, 0, 1)), ("base_link", "s", (2, 0, 0), (0, 0, 0, 1))
    assert tree(a, b).mount("s").translation[0] == 2.0
