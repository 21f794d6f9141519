"""The real recordings: where they lie, and the pictures among them in which there is no lamp."""

import os
import sys
from pathlib import Path

import cv2
import numpy as np

NEGATIVES = {
    "boards": "opencv_calib/left*.jpg",
    "office": "rgbd_tsdf50/*.color.png",
    "street": "kitti_stereo/seq00/image_0/0000[01]?.png",
}


def folder() -> Path:
    """Return the folder that ``LOGPOSE_DATA`` names; without one the benchmark ends."""
    if not (name := os.environ.get("LOGPOSE_DATA")):
        sys.exit("LOGPOSE_DATA: is not set. Let it name the folder of recordings.")
    return Path(name)


def fitted(path: Path) -> np.ndarray:
    """Read an image as grey, scaled to fit 640 x 480."""
    grey = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    scale = min(640 / grey.shape[1], 480 / grey.shape[0])
    return cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)
