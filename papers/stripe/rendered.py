"""The bench from rendered images: logs by ``logpose simulate``, poses by ``logpose run``, errors per cell.

Logs stay in the folder they are made in, and are used again: delete it after changing the world or the renderer. Truth
is what the simulator wrote beside the log. No method is told which mark it sees, or where.
"""

import io
import re
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import redirect_stderr
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TypeAlias

import numpy as np
import yaml
from bench import COLUMNS, FX_PX, TO_TABLE, Array

from logpose.cli.main import call
from logpose.formats.errors import ExitStatus
from logpose.formats.events import MarkSighting
from logpose.formats.maps.marks import read_marks, write_marks
from logpose.formats.mark_poses import read_mark_poses
from logpose.formats.products import MarkMap
from logpose.formats.trajectories.tum import read_tum
from logpose.pipelines.stripe_pose.pose import level_pose

HERE = Path(__file__).parent
WORLD, PIPELINE = HERE / "bench.world.yaml", HERE / "poses.yaml"

Cell: TypeAlias = tuple[float, float, float]
"""Dy, Dx [mm], phi [deg]."""
Way: TypeAlias = Mapping[str, str | float]
"""Parameters of stage ``stripe-pose``."""

METHODS: Mapping[str, Way] = {"paper": {"method": "paper"}, "best": {"method": "best", "max_angle_deg": 85.0}}
"""The bench goes to 80 degrees, which the default would just not try."""
AT_ROW = "lines of best at the row, as if level"


@dataclass(frozen=True)
class Chunk:
    """What is rendered into one log.

    Attributes:
        name: of its files.
        dy_mm, dx_mm, phi_deg: the lists of the bench.
        repeats: images per cell.
        leans: what the log does not tell of: ``tilt_deg``, ``roll_deg``, ``height_m``.
        ways: by name, what is run over it.
        has_heights: the methods are told how high the bars are.
        row: for ``AT_ROW``, which is made from the lines of way ``best``: above the principal point [px]; none if None.
    """

    name: str
    dy_mm: Sequence[float]
    dx_mm: Sequence[float]
    phi_deg: Sequence[float]
    repeats: int
    leans: Mapping[str, float] = field(default_factory=dict)
    ways: Mapping[str, Way] = field(default_factory=lambda: METHODS)
    has_heights: bool = True
    row: float | None = None

    @property
    def cells(self) -> list[Cell]:
        """One per image, in the order of the log."""
        return [
            (dy, dx, phi) for dy in self.dy_mm for dx in self.dx_mm for phi in self.phi_deg for _ in range(self.repeats)
        ]


@dataclass(frozen=True)
class Seen:
    """What a method made of the images of one cell.

    Attributes:
        n: images.
        errors: (k, 3) of the poses it gave, of phi, Dx, Dy [deg, mm, mm].
        sds: (k, 3) as predicted [deg, mm, mm].
    """

    n: int
    errors: Array
    sds: Array

    @property
    def rms(self) -> Array:
        """(3,) root mean square; nan without poses."""
        return np.sqrt(np.mean(self.errors**2, axis=0)) if len(self.errors) else np.full(3, np.nan)


Results: TypeAlias = dict[str, dict[Cell, Seen]]
"""Way -> cell -> what was seen."""


def run_all(chunks: Mapping[str, Chunk], work: Path, *, jobs: int = 2) -> dict[str, Results]:
    """Render and locate all chunks; the results by the same names."""
    work.mkdir(parents=True, exist_ok=True)
    run = partial(run_chunk, work=work)
    if jobs == 1:
        return {name: run(chunk) for name, chunk in chunks.items()}
    with ProcessPoolExecutor(jobs) as pool:
        return dict(zip(chunks, pool.map(run, chunks.values()), strict=True))


def joined(parts: Iterable[Results]) -> Results:
    """Return the cells of several results, by way; a cell in several is all its images."""
    found: Results = {}
    for part in parts:
        for way, cells in part.items():
            found.setdefault(way, {}).update(cells)
    return found


def run_chunk(chunk: Chunk, work: Path) -> Results:
    """Render one log if it is missing, go every way over it, and read what came out."""
    log = work / f"{chunk.name}.mcap"
    if not log.is_file():
        bench = {
            "distances_m": [dy / 1e3 for dy in chunk.dy_mm],
            "offsets_m": [dx / 1e3 for dx in chunk.dx_mm],
            "angles_deg": list(chunk.phi_deg),
            "repeats": chunk.repeats,
            **chunk.leans,
        }
        logpose("simulate", WORLD, "-o", log, "--seed", 1, "-q", *settings("bench", bench))
    marks = log.with_suffix(".marks.yaml")
    if not chunk.has_heights:
        known = read_marks(marks)
        marks = log.with_suffix(".lines.yaml")
        write_marks(MarkMap(marks=tuple(replace(mark, height=None) for mark in known.marks)), marks)
    truth = true_poses(log)
    found: Results = {}
    for way, params in chunk.ways.items():
        out = work / f"{chunk.name}-{re.sub('[^a-z0-9]+', '_', way)}"
        words = settings("stripe-pose", {"marks": str(marks), **params})
        is_seen = logpose("run", PIPELINE, log, *words, "-q", "-o", out)
        found[way] = gather(chunk.cells, truth, read_mark_poses(out / "poses.jsonl") if is_seen else [])
    if chunk.row is not None:
        best = read_mark_poses(work / f"{chunk.name}-best" / "poses.jsonl")
        found[AT_ROW] = gather(chunk.cells, truth, at_row(best, marks, chunk.row))
    return found


def at_row(sightings: Iterable[MarkSighting], marks: Path, row: float) -> Iterator[MarkSighting]:
    """Replace each pose by what the closed form makes of the lines where they cross a row, as if nothing leaned."""
    edges = {mark.id: mark.edges for mark in read_marks(marks).marks}
    for sighting in sightings:
        if sighting.status == "ok":
            u = (sighting.lines[:, 0] - row * sighting.lines[:, 1] - (COLUMNS - 1) / 2) / FX_PX
            pose = level_pose(edges[sighting.mark][sighting.members], u)
            yield replace(sighting, pose=pose, cov=np.full((3, 3), np.nan))


def settings(group: str, values: Mapping[str, object]) -> list[str]:
    """Return the options ``--set group.key=value``."""
    return [word for key, value in values.items() for word in ("--set", f"{group}.{key}={value}")]


def logpose(*words: object) -> bool:
    """Run one command in this process; return False if it recognised no mark, which is a result as well.

    Raises:
        RuntimeError: its status is otherwise not 0 (or 3, data lost); what it was stands on stderr.
    """
    with redirect_stderr(io.StringIO()) as talk:
        status = call(list(map(str, words)))
    if status == ExitStatus.USAGE and " no_mark: " in talk.getvalue():
        return False
    print(talk.getvalue(), end="", file=sys.stderr)
    if status not in {0, 3}:
        raise RuntimeError(f"logpose {' '.join(map(str, words))}: ended with status {status}")
    return True


def true_poses(log: Path) -> dict[int, Array]:
    """Return phi, Dx, Dy [rad, m, m] of each image by its stamp.

    The mark hangs at the origin along x, and the lens stands over the origin of the robot and looks ahead: phi is the
    quarter turn that the robot faces at phi = 0 less its heading, and the mark is D = -R(phi) lens away.

    Raises:
        ValueError: the world mounts the camera elsewhere.
    """
    mount = yaml.safe_load(WORLD.read_text(encoding="utf-8"))["camera"].get("mount", {})
    if any(mount.get(key, 0.0) for key in ("x_m", "y_m", "yaw_deg")):
        raise ValueError(f"{WORLD}: the camera is mounted beside the origin. Leave x_m, y_m and yaw_deg out.")
    found = {}
    truth = read_tum(log.with_suffix(".truth.tum"))
    for stamp, place, q in zip(truth.stamps.tolist(), truth.positions, truth.orientations, strict=True):
        phi = np.pi / 2 - 2.0 * np.arctan2(q[2], q[3])
        c, s = np.cos(phi), np.sin(phi)
        found[stamp] = np.array([phi, -c * place[0] + s * place[1], -s * place[0] - c * place[1]])
    return found


def gather(cells: Sequence[Cell], truth: Mapping[int, Array], poses: Iterable[MarkSighting]) -> dict[Cell, Seen]:
    """Sort the poses of a run into cells; images without one that is ``ok`` count in ``n`` only.

    Raises:
        ValueError: the log has other images than the cells need.
    """
    stamps = sorted(truth)
    if len(stamps) != len(cells):
        raise ValueError(f"{len(stamps)} images in the log, {len(cells)} were to be rendered. Delete the log.")
    cell_of = dict(zip(stamps, cells, strict=True))
    errors: dict[Cell, list[Array]] = {cell: [] for cell in cells}
    sds: dict[Cell, list[Array]] = {cell: [] for cell in cells}
    for sighting in poses:
        if sighting.status == "ok":
            cell = cell_of[sighting.stamp]
            errors[cell].append((sighting.pose - truth[sighting.stamp]) * TO_TABLE)
            sds[cell].append(np.sqrt(np.diag(sighting.cov)) * TO_TABLE)
    return {
        cell: Seen(cells.count(cell), np.reshape(errors[cell], (-1, 3)), np.reshape(sds[cell], (-1, 3)))
        for cell in errors
    }
