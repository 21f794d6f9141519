"""What all tests share: slow ones wait for ``-m slow``, those that take ``recordings`` for ``LOGPOSE_DATA``."""

import importlib
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

import pytest


@pytest.hookimpl(tryfirst=True)  # before -m selects
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    wants_slow = "slow" in (config.getoption("-m") or "")
    has_data = bool(os.environ.get("LOGPOSE_DATA"))
    for item in items:
        if "slow" in item.keywords and not wants_slow:
            item.add_marker(pytest.mark.skip(reason="slow; run with -m slow"))
        if "recordings" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.realdata)
            if not has_data:
                item.add_marker(pytest.mark.skip(reason="LOGPOSE_DATA names no folder of recordings"))


@pytest.fixture(scope="session")
def root() -> Path:
    """The repository."""
    return Path(__file__).parent.parent


@pytest.fixture(scope="session")
def recordings() -> Path:
    """The folder of real recordings; a test that takes it, or what is made of it, is marked ``realdata``."""
    return Path(os.environ["LOGPOSE_DATA"])


@pytest.fixture(scope="session")
def benchmark(root: Path) -> Iterator[Callable[[str], ModuleType]]:
    """Import a file of ``benchmarks`` by its name."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(root / "benchmarks")
        yield importlib.import_module
