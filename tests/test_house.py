"""The rules of the house: layers, packages, lengths, names, stages, parameters, help and docs."""

import ast
import importlib
import inspect
import tomllib
from pathlib import Path

import pytest

from logpose.cli.main import COMMANDS, group
from logpose.formats.conversions import CONVERSIONS
from logpose.pipelines.catalog import PIPELINES, STAGES
from logpose.pipelines.engine.stage import load_stage

ROOT = Path(__file__).parent.parent
CODE = ("cli", "formats", "pipelines")
FILES = sorted(p for folder in CODE for p in (ROOT / folder).rglob("*.py"))
RULERS = {"engine", "evaluate", "report"}
"""Packages with a ``stage.py`` that are no method."""
SHARED = {"engine", "geometry", "estimation", "odometry", "images"}
LIBRARIES = {
    "cli": {"click", "yaml", "rich"},
    "formats": {"numpy", "cv2", "mcap", "rosbags", "yaml", "lz4", "zstandard", "scipy", "apsw"},
    "geometry": {"numpy"},
    "estimation": {"numpy", "scipy"},
}
STANDARD = set(__import__("sys").stdlib_module_names)


def imports(path):
    """Yield every import of a file as its parts below the repository ("formats", "events") or outside ("numpy",)."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield tuple(alias.name.split("."))
        elif isinstance(node, ast.ImportFrom):
            module = tuple((node.module or "").split(".")) if node.module else ()
            if node.level == 0:
                yield module[1:] if module[0] == "logpose" else module
                continue
            base = path.relative_to(ROOT).parts[: -node.level] if node.level else ()
            yield from [(*base, *module)] if module else [(*base, alias.name) for alias in node.names]


def place(path):
    """Return the layer of a file, and the package within ``pipelines``."""
    parts = path.relative_to(ROOT).parts
    return parts[0], parts[1] if parts[0] == "pipelines" and len(parts) > 2 else ""


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(ROOT)))
def test_layers_point_downward(path):
    layer, package = place(path)
    for target in imports(path):
        if not target or target[0] not in CODE:
            continue
        assert CODE.index(target[0]) >= CODE.index(layer) or (layer, target[0]) in {
            ("cli", "formats"),
            ("cli", "pipelines"),
            ("pipelines", "formats"),
        }, f"{layer} imports {target}"
        assert not (layer == "formats" and target[0] != "formats"), f"formats imports {target}"
        assert not (layer == "pipelines" and target[0] == "cli"), f"pipelines imports {target}"


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(ROOT)))
def test_a_system_imports_no_other_system(path):
    layer, package = place(path)
    if layer != "pipelines" or not package:
        return
    for target in imports(path):
        if target[:1] == ("pipelines",) and len(target) > 2 and target[1] != package:
            assert target[1] in SHARED, f"{package} imports {'.'.join(target)}"
            assert package != "engine", f"the engine imports {'.'.join(target)}"
            assert package != "geometry", f"geometry imports {'.'.join(target)}"
            assert package != "estimation" or target[1] == "geometry", f"estimation imports {'.'.join(target)}"
            assert package != "odometry" or target[1] in {"engine", "geometry"}, f"odometry imports {'.'.join(target)}"
            assert package != "images" or target[1] == "geometry", f"images imports {'.'.join(target)}"
            assert package != "simulate" or target[1] == "engine", f"the simulator imports {'.'.join(target)}"


def test_a_report_knows_no_kind_of_thing_seen_and_a_kind_no_other():
    home = ROOT / "pipelines" / "report"
    kinds = {p.parent.name for p in home.glob("*/__init__.py")}
    assert kinds
    for path in home.rglob("*.py"):
        used = {t[2] for t in imports(path) if t[:2] == ("pipelines", "report") and len(t) > 2} & kinds
        is_table = path.parent == home and path.name in {"kinds.py", "contents.py"}
        assert is_table or used <= {path.parent.name}, f"{path.relative_to(home)} imports {used}"


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(ROOT)))
def test_each_layer_uses_its_libraries_only(path):
    layer, package = place(path)
    allowed = LIBRARIES.get(package) or LIBRARIES.get(layer)
    if allowed is None:
        return
    used = {target[0] for target in imports(path) if target and target[0] not in CODE}
    assert used - STANDARD - allowed - {"__version__"} == set()


METHODS = sorted(p.parent.name for p in (ROOT / "pipelines").glob("*/stage.py") if p.parent.name not in RULERS)


@pytest.mark.parametrize("package", METHODS)
def test_models_know_no_events(package):
    for path in (ROOT / "pipelines" / package).glob("*.py"):
        if path.name != "stage.py":
            assert not any("events" in target for target in imports(path)), path.name


@pytest.mark.parametrize("package", ["geometry", "estimation"])
def test_shared_models_know_no_events_and_no_files(package):
    for path in (ROOT / "pipelines" / package).glob("*.py"):
        assert not any(target[:1] == ("formats",) for target in imports(path)), path.name


def test_a_simulated_sensor_knows_no_world():
    for path in (ROOT / "pipelines" / "simulate" / "sensors").glob("*.py"):
        assert not any("worlds" in target for target in imports(path)), path.name


def test_the_errors_of_odometry_know_no_messages():
    path = ROOT / "pipelines" / "odometry" / "noise.py"
    assert {target[1] for target in imports(path) if target[0] == "pipelines"} == {"engine"}


def test_only_formats_opens_files():
    words = {
        "open",
        "read_text",
        "write_text",
        "read_bytes",
        "write_bytes",
        "imread",
        "imwrite",
        "NamedTemporaryFile",
    }
    for path in FILES:
        if place(path)[0] == "formats":
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call):
                name = getattr(node.func, "attr", getattr(node.func, "id", ""))
                is_ours = isinstance(node.func, ast.Name) and name == "read_text"  # formats.text.read_text
                is_devnull = isinstance(node.func, ast.Attribute) and ast.unparse(node.func) == "os.open"
                assert name not in words or is_ours or is_devnull, f"{path.relative_to(ROOT)}:{node.lineno} {name}"


def test_the_engine_knows_no_stage_by_name():
    text = "".join(p.read_text() for p in (ROOT / "pipelines" / "engine").glob("*.py"))
    for name in (set(STAGES) | set(PIPELINES)) - {"detect-circles", "localize-pf", "write-trajectory"}:
        assert f'"{name}"' not in text
    assert '"detect-circles"' not in text
    assert '"localize-pf"' not in text


def test_the_list_of_packages_is_the_folders():
    listed = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    found = {"logpose"} | {
        "logpose." + ".".join(p.parent.relative_to(ROOT).parts) for p in FILES if p.name == "__init__.py"
    }
    assert sorted(listed) == sorted(found)


def test_every_folder_of_code_is_a_package():
    for path in FILES:
        assert (path.parent / "__init__.py").is_file(), path.parent


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(ROOT)))
def test_files_are_short_and_named_after_their_subject(path):
    assert len(path.read_text().splitlines()) <= 400
    assert path.stem not in {"utils", "util", "helpers", "helper", "common", "core", "misc"}
    assert ast.get_docstring(ast.parse(path.read_text())), "no module docstring"


@pytest.mark.parametrize("name", sorted(STAGES))
def test_stages_resolve_and_their_parameters_are_documented(name):
    spec = load_stage(name, STAGES[name])
    assert spec.doc.endswith(".")
    assert spec.params.model_config["extra"] == "forbid"
    assert spec.params.model_config["frozen"]
    for key, field in spec.params.model_fields.items():
        assert field.description, f"{name}.{key} has no description"
        for suffix, unit in {"_m": "m]", "_px": "px]", "_rad": "rad]", "_deg": "deg]", "_s": "s]"}.items():
            if key.endswith(suffix):
                assert unit in field.description, f"{name}.{key} does not say its unit [{unit}"


@pytest.mark.parametrize("name", sorted(PIPELINES))
def test_bundled_pipelines_are_installed_and_bind(name):
    from logpose.pipelines.engine.document import read_document

    document = read_document(PIPELINES[name])
    assert {entry.name for entry in document.stages} <= set(STAGES)
    data = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]
    assert "*.yaml" in data["*"]
    assert name in COMMANDS


@pytest.mark.parametrize("kind", sorted(CONVERSIONS))
def test_conversions_resolve_and_are_documented(kind):
    module, _, name = CONVERSIONS[kind].function.partition(":")
    function = getattr(importlib.import_module(f"logpose.formats.{module}"), name)
    assert "Raises:" in function.__doc__
    keywords = inspect.signature(function).parameters
    assert {k: keywords[k].default for k in list(keywords)[2:]} == {
        k: option.default for k, option in CONVERSIONS[kind].options.items()
    }, "the flags are not the keywords"
    assert f"\n| `{kind}` | " in (ROOT / "docs" / "convert.md").read_text()


def test_no_two_kinds_have_an_option_of_one_name():
    names = [name for conversion in CONVERSIONS.values() for name in conversion.options]
    assert len(names) == len(set(names))


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_commands_have_help_and_a_page(name):
    command = group.get_command(None, name)
    assert command.help == COMMANDS[name]
    assert command.epilog, "no examples"
    for parameter in command.params:
        if parameter.param_type_name == "option":
            assert parameter.help, f"{name} {parameter.name} has no help"
    page = ROOT / "docs" / f"{name}.md"
    assert page.is_file()
    text = page.read_text()
    assert text.startswith(f"# {name}")
    assert f"logpose {name}" in text


def test_every_command_stands_in_the_readme():
    text = (ROOT / "README.md").read_text()
    for name in COMMANDS:
        assert f"`{name}`" in text
