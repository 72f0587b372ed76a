"""Fixtures shared by all tests: an FMU cache of their own, and the shipped runs, made once."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import settings

# no test asserts a time: the first example of many compiles what it calls
settings.register_profile("subreach", deadline=None, derandomize=True)
settings.load_profile("subreach")

DATA = Path(__file__).parent / "data"


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--slow", action="store_true", help="also run the tests marked slow")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if not config.getoption("--slow"):
        for item in items:
            if "slow" in item.keywords:
                item.add_marker(pytest.mark.skip(reason="slow; run with --slow"))


@pytest.fixture(autouse=True, scope="session")
def fmu_cache(tmp_path_factory):
    """Build FMUs afresh in each session, whatever the user's cache holds."""
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("cache")
        patch.setattr("platformdirs.user_cache_dir", lambda *_, **__: str(folder))
        yield folder


@pytest.fixture(scope="session")
def shipped_run(tmp_path_factory):
    """Return a function that runs a shipped scenario once a session; those that are changed get no report."""
    from cosim.run import run_scenario
    from cosim.scenario import load_scenario

    done = {}

    def run(name, *overrides):
        if (name, overrides) not in done:
            folder = tmp_path_factory.mktemp("runs") / name
            report = overrides == ("arbiter.engine=closed",)
            done[name, overrides] = run_scenario(load_scenario(name, overrides), folder, report=report)
        return done[name, overrides]

    return run
