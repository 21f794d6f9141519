"""Checkerboards as stripe marks: real images, a real lens, and the truth from all corners of each board.

    LOGPOSE_DATA=.../data python benchmarks/checkerboards.py

A column of inner corners is the edge of a bar whose colours change with every square: 6 or 9 edges 25 mm apart. Their
identity is given (equal spacing has none), and so is where they run, roughly; the edges themselves are found, followed
and fitted as those of any mark. Truth is the pose of the board from all 54 corners (sub-pixel, ``cv2.solvePnP``) with
the same calibration. What is vertical is the direction of the board's own columns, so each image has another tilt and
roll, up to 41 degrees.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from recordings import folder

from logpose.formats.calibration import read_calibration
from logpose.pipelines.geometry.camera import Camera
from logpose.pipelines.geometry.mount import OPTICAL
from logpose.pipelines.stripe_pose.edges import filter_taps, follow
from logpose.pipelines.stripe_pose.levelling import levelling_matrix
from logpose.pipelines.stripe_pose.lines import N_COLUMNS, SLOPE, VAR_SLOPE, VAR_X, X, Z, fit_lines
from logpose.pipelines.stripe_pose.pose import level_pose
from logpose.pipelines.stripe_pose.scene import ray_table
from logpose.pipelines.stripe_pose.solve import Attitude, Lines, solve

Array = npt.NDArray[np.float64]

SQUARE_M = 0.025
INNER = (9, 6)
CORNER_ROWS = 4
"""Rows beside a corner that are left out: there the edge ends, and its colours change."""
LEAST_RESPONSE = 5.0
FLOOR_PX = 0.1
"""What the calibration leaves: the root mean square of its residuals is 0.2 px per corner."""
TO_TABLE = np.array([180.0 / np.pi, 1e3, 1e3])


@dataclass(frozen=True)
class Board:
    """One image.

    Attributes:
        name: of the file.
        pixels: (H, W) uint8.
        corners: (rows, columns, 2) inner corners, top to bottom and left to right as a viewer sees them [px].
        pose: (3,) phi, Dx, Dy in the level frame, from all corners [rad, m, m].
        tilt, roll: of the camera against the board's columns, from all corners [rad].
    """

    name: str
    pixels: npt.NDArray[np.uint8]
    corners: Array
    pose: Array
    tilt: float
    roll: float

    @property
    def lines(self) -> Array:
        """(n,) abscissae of the columns of corners [m]."""
        return across(self.corners.shape[1])


def across(n: int) -> Array:
    """Return n places one square apart, about 0 [m]."""
    return np.asarray((np.arange(n) - (n - 1) / 2) * SQUARE_M)


def read_camera(data: Path) -> Camera:
    """Read the calibration that belongs to the images."""
    found = read_calibration(data / "opencv_calib" / "left_intrinsics.yml")
    return Camera(found.fx, found.fy, found.cx, found.cy, found.model, found.distortion)


def read_boards(data: Path, camera: Camera) -> Iterator[Board]:
    """Read left01 .. left14, and find corners and pose of each board."""
    for path in sorted((data / "opencv_calib").glob("left[0-9][0-9].jpg")):
        pixels = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        is_found, corners = cv2.findChessboardCorners(pixels, INNER)
        if not is_found:
            raise ValueError(f"{path}: no board of {INNER[0]} x {INNER[1]} corners")
        cv2.cornerSubPix(pixels, corners, (5, 5), (-1, -1), (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-4))
        grid = upright(corners.reshape(INNER[1], INNER[0], 2).astype(np.float64))
        yield Board(path.stem, pixels, grid, *pose_from_corners(grid, camera))


def upright(grid: Array) -> Array:
    """Turn a grid (a, b, 2) of corners so that its first axis runs down the image and its second to the right."""
    down = (grid[-1] - grid[0]).mean(axis=0)
    if abs(down[1]) < abs(down[0]):
        grid = grid.transpose(1, 0, 2)
    if (grid[-1] - grid[0]).mean(axis=0)[1] < 0:
        grid = grid[::-1]
    if (grid[:, -1] - grid[:, 0]).mean(axis=0)[0] < 0:
        grid = grid[:, ::-1]
    return np.ascontiguousarray(grid)


def pose_from_corners(grid: Array, camera: Camera) -> tuple[Array, float, float]:
    """Return the level pose, tilt and roll of a board from all its corners.

    The board's own vertical, in the camera frame, is (-cos t sin r, sin t, cos t cos r).
    """
    n_rows, n_columns = grid.shape[:2]
    x, y = np.meshgrid(across(n_columns), across(n_rows))  # right, down
    points = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    matrix = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]])
    _, turn, shift = cv2.solvePnP(points, grid.reshape(-1, 2), matrix, np.array(camera.distortion))
    camera_R_mark = OPTICAL @ cv2.Rodrigues(turn)[0] @ OPTICAL.T
    up = camera_R_mark[:, 2]
    tilt, roll = float(np.arcsin(up[1])), float(np.arctan2(-up[0], up[2]))
    Q = levelling_matrix(tilt, roll)
    level_R_mark, level_D = Q.T @ camera_R_mark, Q.T @ OPTICAL @ shift.ravel()
    return np.array([np.arctan2(level_R_mark[1, 0], level_R_mark[0, 0]), *level_D[:2]]), tilt, roll


def read_lines(board: Board, camera: Camera) -> Lines:
    """Find the edge of each column of corners on all rows of all squares, and fit a line to it, through the lens."""
    height, width = board.pixels.shape
    rays, taps, n = ray_table(camera, width, height), filter_taps(), len(board.lines)
    found, size = np.full((n, height), np.nan), np.zeros((n, height))
    one, one_size = np.empty((1, height)), np.empty((1, height))
    for j in range(n):
        for upper, lower in zip(board.corners[:-1, j], board.corners[1:, j], strict=True):
            first, last = int(np.ceil(upper[1])) + CORNER_ROWS, int(np.floor(lower[1])) - CORNER_ROWS
            middle = (first + last) // 2
            column = np.interp(middle, [upper[1], lower[1]], [upper[0], lower[0]])
            follow(
                board.pixels,
                middle,
                len(board.pixels),
                np.array([column]),
                np.array([0]),
                taps,
                LEAST_RESPONSE,
                one,
                one_size,
            )
            found[j, first : last + 1], size[j, first : last + 1] = (
                one[0, first : last + 1],
                one_size[0, first : last + 1],
            )
    table = np.empty((n, N_COLUMNS))
    fit_lines(found, size, rays, 20, FLOOR_PX / camera.fx, table)
    # What bends a board or a line of the picture moves its slope as well: the floor over the height of the line.
    tall = np.array([np.ptp(rays[np.flatnonzero(np.isfinite(row)), 0, 1]) for row in found])
    slope_var = table[:, VAR_SLOPE] + 12.0 * (FLOOR_PX / camera.fx / tall) ** 2
    x, slope, z = (np.ascontiguousarray(table[:, i]) for i in (X, SLOPE, Z))
    return Lines(board.lines, x, slope, z, np.diag(table[:, VAR_X]), slope_var)


@dataclass(frozen=True)
class Answer:
    """What the lines of one board give.

    Attributes:
        errors: by variant, (3,) of phi, Dx, Dy against all corners [deg, mm, mm].
        sd: (3,) predicted for the self-levelled one [deg, mm, mm].
        attitude: (2,) errors of tilt and roll of the self-levelled one [deg].
        steepest: largest slope of a line, which a level camera would see as 0 [1].
    """

    errors: dict[str, Array]
    sd: Array
    attitude: Array
    steepest: float


VARIANTS = ("not levelled", "tilt and roll given", "self-levelled")


def answer(board: Board, camera: Camera) -> Answer:
    """Measure a board in three ways."""
    lines = read_lines(board, camera)
    at_axis = lines.x - lines.slope * lines.z
    given = solve(lines, Attitude(board.tilt, board.roll))
    free = solve(lines, Attitude(tilt_sd=np.inf, roll_sd=np.inf))
    poses = (level_pose(lines.X, at_axis), given.values[:3], free.values[:3])
    errors = {name: (pose - board.pose) * TO_TABLE for name, pose in zip(VARIANTS, poses, strict=True)}
    off = np.degrees(free.values[3:5] - (board.tilt, board.roll))
    return Answer(errors, np.sqrt(np.diag(free.cov)[:3]) * TO_TABLE, off, float(np.max(np.abs(lines.slope))))


def main() -> None:
    """Measure all boards and print Markdown."""
    data = folder()
    camera = read_camera(data)
    boards = list(read_boards(data, camera))
    answers = [answer(board, camera) for board in boards]
    print("| board | edges | tilt, roll deg | phi deg | Dx, Dy mm | " + " | ".join(VARIANTS) + " | tilt, roll off |")
    print("|---|---|---|---|---|" + "---|" * (len(VARIANTS) + 1))
    for board, found in zip(boards, answers, strict=True):
        phi, dx, dy = board.pose * TO_TABLE
        cells = ["/".join(f"{e:+.2f}" for e in found.errors[name]) for name in VARIANTS]
        print(
            f"| {board.name} | {len(board.lines)} | {np.degrees(board.tilt):.1f}, {np.degrees(board.roll):.1f} "
            f"| {phi:.1f} | {dx:.1f}, {dy:.1f} | {' | '.join(cells)} "
            f"| {found.attitude[0]:+.2f}, {found.attitude[1]:+.2f} |"
        )
    print("\n| of 13 boards: absolute error of phi deg, Dx mm, Dy mm | median | largest |")
    print("|---|---|---|")
    for name in VARIANTS:
        errors = np.abs([found.errors[name] for found in answers])
        middle, largest = np.median(errors, axis=0), errors.max(axis=0)
        print(f"| {name} | {' / '.join(f'{e:.3f}' for e in middle)} | {' / '.join(f'{e:.2f}' for e in largest)} |")


if __name__ == "__main__":
    main()
