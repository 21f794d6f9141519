"""What all tests share: slow ones wait for ``-m slow``, real recordings for ``LOGPOSE_DATA``."""

import os
from pathlib import Path

import pytest


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    wants_slow = "slow" in (config.getoption("-m") or "")
    has_data = bool(os.environ.get("LOGPOSE_DATA"))
    for item in items:
        if "slow" in item.keywords and not wants_slow:
            item.add_marker(pytest.mark.skip(reason="slow; run with -m slow"))
        if "realdata" in item.keywords and not has_data:
            item.add_marker(pytest.mark.skip(reason="LOGPOSE_DATA names no folder of recordings"))


@pytest.fixture(scope="session")
def root() -> Path:
    """The repository."""
    return Path(__file__).parent.parent


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder of real recordings."""
    return Path(os.environ["LOGPOSE_DATA"])
