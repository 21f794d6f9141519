"""Fiducial tags as patterns for ``mark_scenes``, and their detectors, each as a function from an image to a pose.

What makes the comparison fair: pupil-apriltags counts pixels from their corners, so its principal point is half a pixel
further right and down; its frame of a 36h11 tag is turned by 180 degrees in the plane against OpenCV's picture of it;
poses are brought into the level camera frame by the tag's own attitude, as nothing else tells a tag what is level.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import cv2
import numpy as np
import numpy.typing as npt
from mark_raster import Array, Canvas, Optics, Plane, Rectangle

try:
    from pupil_apriltags import Detector
except ImportError:
    Detector = None

NOT_INSTALLED = "pupil-apriltags is not installed, its rows are missing: pip install 'logpose[bench]'"
Locate = Callable[[npt.NDArray[np.uint8], Optics], Array | None]

DICTIONARIES = {"36h11": (cv2.aruco.DICT_APRILTAG_36h11, 8), "4x4": (cv2.aruco.DICT_4X4_50, 6)}
TAG_ID = 7


@dataclass(frozen=True)
class Tag:
    """A tag: its cells, True where bright, and the side of its black square [m]; around it one bright cell."""

    cells: tuple[tuple[bool, ...], ...]
    side: float

    def outline(self) -> Rectangle:
        """Return the bright ground."""
        half = self.side * (0.5 + 1.0 / len(self.cells))
        return -half, -half, half, half

    def paint(self, canvas: Canvas, plane: Plane, dark: float, bright: float) -> None:
        """Paint the ground, and the black cells in runs."""
        n = len(self.cells)
        cell = self.side / n
        black = []
        for i, row in enumerate(self.cells):
            top = 0.5 * self.side - i * cell
            edges = [0, *(k for k in range(1, n) if row[k] != row[k - 1]), n]
            for a, b in pairwise(edges):
                if not row[a]:
                    black.append(((a * cell - 0.5 * self.side, top - cell, b * cell - 0.5 * self.side, top), dark))
        canvas.paint(plane, self.outline(), bright, black)


def tag(family: str, side: float) -> Tag:
    """Return a tag of family "36h11" or "4x4"."""
    name, n = DICTIONARIES[family]
    bits = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(name), TAG_ID, n)
    return Tag(tuple(tuple(bool(v) for v in row) for row in bits), side)


def level_pose(rotation: Array, origin: Array) -> Array:
    """Return yaw, lateral offset and depth in the level frame.

    Args:
        rotation: (3, 3) the tag's axes (right, up, towards the viewer) as columns, in the optical frame (x right,
            y down, z along the view).
        origin: (3,) its centre there [m].
    """
    to_camera = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    axes, centre = to_camera @ rotation, to_camera @ origin
    up = axes[:, 1]
    tilt = np.arctan2(up[1], np.hypot(up[0], up[2]))
    roll = np.arctan2(-up[0], up[2])
    back = Optics(tilt=tilt, roll=roll).attitude().T
    along, at = back @ axes[:, 0], back @ centre
    return np.array([np.arctan2(along[1], along[0]), at[0], at[1]])


def locate_cv2(family: str, side: float, refine: int = cv2.aruco.CORNER_REFINE_SUBPIX) -> Locate:
    """OpenCV's detector, its corners refined, and its planar solver for squares."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = refine
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(DICTIONARIES[family][0]), parameters)
    half = 0.5 * side
    corners_3d = np.array([[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]])

    def locate(image: npt.NDArray[np.uint8], optics: Optics) -> Array | None:
        corners, ids, _ = detector.detectMarkers(image)
        for corner, found in zip(corners, np.ravel([] if ids is None else ids), strict=True):
            if found == TAG_ID:
                matrix = np.array([[optics.f, 0, optics.cx], [0, optics.f, optics.cy], [0, 0, 1]])
                lens = np.array([optics.k1, optics.k2, 0.0, 0.0])
                ok, r, t = cv2.solvePnP(
                    corners_3d, corner.reshape(4, 2).astype(float), matrix, lens, flags=cv2.SOLVEPNP_IPPE_SQUARE
                )
                if ok:
                    return level_pose(cv2.Rodrigues(r)[0], t.ravel())
        return None

    return locate


@cache
def _detector(decimate: float) -> "Detector":
    class Kept(Detector):
        def __del__(self) -> None:
            """Free nothing: the package's own frees the family before the detector that uses it, and may crash."""

    return Kept(families="tag36h11", nthreads=1, quad_decimate=decimate)


def locate_pupil(side: float, decimate: float) -> Locate:
    """pupil-apriltags on an image without distortion."""

    def locate(image: npt.NDArray[np.uint8], optics: Optics) -> Array | None:
        camera = (optics.f, optics.f, optics.cx + 0.5, optics.cy + 0.5)
        for found in _detector(decimate).detect(image, estimate_tag_pose=True, camera_params=camera, tag_size=side):
            if found.tag_id == TAG_ID:
                # Its axes are right, down, away from the viewer, of the tag turned by 180 degrees.
                return level_pose(found.pose_R @ np.diag([-1.0, 1.0, -1.0]), found.pose_t.ravel())
        return None

    return locate
