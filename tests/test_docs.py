"""Every command shown in README and docs is run here, in the order of its page.

Blocks marked ``sh`` are run line by line in a folder where the sample logs and paper folders stand as in the repository.
A block with ``$LOGPOSE_DATA`` needs the recordings; a block marked ``sh slow`` waits for ``-m slow``; ``make`` and ``git``
are what the reader of a fresh clone types, and run there (``.ci/run``).
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), ROOT / "sample_logs" / "README.md"]
BLOCK = re.compile(r"^```sh( slow)?\n(.*?)^```", re.DOTALL | re.MULTILINE)
QUOTED = re.compile(r"^````.*?^````", re.DOTALL | re.MULTILINE)
"""A page within a page, whose commands are of something that is yet to be made (``test_architecture.py``)."""


def commands(page, *, slow):
    lines = []
    for mark, block in BLOCK.findall(QUOTED.sub("", page.read_text())):
        needs_data = "$LOGPOSE_DATA" in block and "LOGPOSE_DATA" not in os.environ
        if bool(mark) == slow and not needs_data:
            lines += [line.split("  #")[0].strip() for line in block.replace("\\\n", " ").splitlines()]
    return [line for line in lines if line and not line.startswith(("#", "make", "git", "cd", "pip"))]


@pytest.fixture
def place(tmp_path):
    """A folder that looks like the repository to a command."""
    shutil.copytree(ROOT / "sample_logs", tmp_path / "sample_logs")  # commands may write there
    for name in ("papers", "benchmarks"):
        (tmp_path / name).symlink_to(ROOT / name)
    return tmp_path


def run(lines, place):
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    for line in lines:
        done = subprocess.run(
            ["bash", "-o", "pipefail", "-c", line],
            cwd=place,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        expected = 4 if "--fail-if" in line and "exits with 4" in line else 0
        assert done.returncode == expected, f"{line}\n{done.stdout[-500:]}{done.stderr[-1500:]}"


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.stem if p.parent != ROOT / "sample_logs" else "sample_logs")
def test_commands_of_a_page_run(page, place):
    assert page.read_text().startswith("# ")
    run(commands(page, slow=False), place)


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.stem if p.parent != ROOT / "sample_logs" else "sample_logs")
def test_slow_commands_of_a_page_run(page, place):
    run(commands(page, slow=True), place)


def test_every_page_is_linked_from_the_readme():
    text = (ROOT / "README.md").read_text()
    for page in (ROOT / "docs").glob("*.md"):
        assert f"docs/{page.name}" in text, page.name


def test_the_reference_of_stages_is_that_of_the_code():
    from logpose.pipelines.catalog import STAGES
    from logpose.pipelines.engine.reference import reference

    assert (ROOT / "docs" / "stages.md").read_text() == reference(STAGES), "run make reference"
