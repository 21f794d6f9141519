"""docs/architecture.md is true: its tree is the folders, its files exist, and its recipes work as they stand there.

In a recipe a line ``**`FILE`**`` stands before the content of a new file, and ``**`FILE`**, after `LINE` `` before what goes
behind the first line that contains LINE. The test follows them, in their order, in a copy of the code.
"""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "docs" / "architecture.md").read_text()
CODE = ("cli", "formats", "pipelines")
EDIT = re.compile(r"^\*\*`([^`]+)`\*\*(?:, after `([^\n]+)`)?\n(`{3,})\w+\n(.*?)^\3$", re.DOTALL | re.MULTILINE)


def section(title):
    """Return what stands under a heading of the page."""
    return re.search(rf"^## {re.escape(title)}\n(.*?)(?=^## |\Z)", PAGE, re.DOTALL | re.MULTILINE).group(1)


def follow(title, root):
    """Do what a recipe says in a copy of the code."""
    edits = EDIT.findall(section(title))
    assert edits, f"{title}: nothing to do"
    for name, after, _, text in edits:
        path = root / name
        if not after:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
            continue
        lines = path.read_text().splitlines(keepends=True)
        at = next(i for i, line in enumerate(lines) if after in line)
        path.write_text("".join([*lines[: at + 1], text, *lines[at + 1 :]]))


@pytest.fixture
def copy(tmp_path):
    """The code, its rules and its docs, without anything that was made."""
    root = tmp_path / "logpose"
    made = shutil.ignore_patterns("__pycache__", "*.nbi", "*.nbc")
    for name in (*CODE, "docs", "sample_logs"):
        shutil.copytree(ROOT / name, root / name, ignore=made)
    tests = ("tests/conftest.py", "tests/cli/conftest.py", "tests/test_house.py")
    for name in ("__init__.py", "__main__.py", "pyproject.toml", "README.md", *tests):
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, root / name)
    return root


def run(root, *words):
    """Run Python with the copy as the package."""
    environment = {**os.environ, "PYTHONPATH": str(root.parent)}
    done = subprocess.run(
        [sys.executable, *words], cwd=root, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, f"{words}\n{done.stdout[-2000:]}{done.stderr[-2000:]}"
    return done.stdout


def keeps_the_rules(root, *tests):
    run(root, "-m", "pytest", "-q", "-p", "no:cacheprovider", "tests/test_house.py", *tests)


def write_reference(root):
    """Do what ``make reference`` does, and return the page with its tree."""
    makefile = (ROOT / "Makefile").read_text()
    lines = r"^reference:.*\n\t\$\(BIN\)/python -c '(.+)' > docs/stages.md\n\t\$\(BIN\)/python docs/tree.py$"
    words = re.search(lines, makefile, re.MULTILINE)
    (root / "docs" / "stages.md").write_text(run(root, "-c", words.group(1)))
    run(root, "docs/tree.py")
    return (root / "docs" / "architecture.md").read_text()


def test_a_stage_and_a_subcommand_added_as_the_page_says_work(copy, tmp_path):
    follow("Add a stage", copy)
    pipeline = tmp_path / "p.yaml"
    pipeline.write_text(
        "logpose: 1\ntopics: {odometry: auto, initial_pose: auto}\nstages: [dead-reckon, path-length]\n"
    )
    log = "sample_logs/ceiling.mcap"
    run(copy, "-m", "logpose", "run", str(pipeline), log, "--duration", "5", "-o", "out")
    assert '"length_m": ' in (copy / "out" / "report.json").read_text()
    assert re.search(r"^    stage.py +The stage path-length: how far", write_reference(copy), re.MULTILINE)
    assert "## path-length" in (copy / "docs" / "stages.md").read_text()
    keeps_the_rules(copy, "tests/path_length")

    follow("Add a subcommand", copy)
    assert re.search(r"^  path_length.py +logpose path-length$", write_reference(copy), re.MULTILINE)
    assert "path-length" in run(copy, "-m", "logpose", "--help")
    assert "suits path-length: yes" in run(copy, "-m", "logpose", "inspect", log)
    run(copy, "-m", "logpose", "path-length", log, "--duration", "5", "-o", "again")
    assert (copy / "again" / "trajectory.tum").is_file()
    keeps_the_rules(copy, "tests/path_length", "tests/cli/test_path_length.py")


def test_an_importer_added_as_the_page_says_works(copy, tmp_path):
    follow("Add an importer", copy)
    assert re.search(r"^    poses_txt.py +Lines of t_s x_m y_m", write_reference(copy), re.MULTILINE)
    poses = tmp_path / "poses.txt"
    poses.write_text("".join(f"{0.1 * i:.1f} {0.05 * i:.2f} 0 0\n" for i in range(20)))
    run(copy, "-m", "logpose", "convert", "poses-txt", str(poses), "-o", "drive.mcap")
    assert "/ground_truth/pose" in run(copy, "-m", "logpose", "inspect", "drive.mcap")
    keeps_the_rules(copy)


def test_a_reader_added_as_the_page_says_works(copy, tmp_path):
    follow("Add a reader", copy)
    assert re.search(r"^    sightings_file.py +Reads sightings.jsonl as a log", write_reference(copy), re.MULTILINE)
    sightings = tmp_path / "s.jsonl"
    log, landmarks = "sample_logs/ceiling.mcap", "sample_logs/ceiling.landmarks.yaml"
    words = ["detect-circles", log, "--map", landmarks, "--lamp-diameter", "0.135", "--duration", "3", "-o", "-"]
    sightings.write_text(run(copy, "-m", "logpose", *words))
    assert "/sightings" in run(copy, "-m", "logpose", "inspect", str(sightings))
    merged = ["localize-pf", log, str(sightings), "--map", landmarks, "--topic", "image=none", "--duration", "3"]
    assert len(run(copy, "-m", "logpose", *merged, "-o", "-").splitlines()) > 20
    keeps_the_rules(copy, "tests/formats/containers/test_sightings_file.py")


@pytest.mark.parametrize("title", re.findall(r"^## (Add .+)$", PAGE, re.MULTILINE))
def test_recipes_have_at_most_ten_steps(title):
    steps = re.findall(r"^(\d+)\. ", section(title), re.MULTILINE)
    assert steps == [str(i + 1) for i in range(len(steps))]
    assert 0 < len(steps) <= 10


def test_the_tree_is_that_of_the_code():
    spec = importlib.util.spec_from_file_location("tree", ROOT / "docs" / "tree.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.BLOCK.search(PAGE).group() == module.tree(), "run make reference"


def test_every_file_named_on_the_page_exists():
    recipes = "".join(section(title) for title in re.findall(r"^## (Add .+)$", PAGE, re.MULTILINE))
    made = {name for name, after, _, _ in EDIT.findall(recipes) if not after}
    text = re.sub(r"^(`{3,}).*?^\1$", "", PAGE, flags=re.DOTALL | re.MULTILINE)
    for name in re.findall(r"`((?:cli|formats|pipelines|tests)/[\w/.]+\.\w+)`", text):
        assert name in made or (ROOT / name).is_file(), name
