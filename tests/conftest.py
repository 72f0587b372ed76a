"""Fixtures shared by all tests: an FMU cache of their own, and the shipped runs, made once."""

from __future__ import annotations

import gc
import importlib.util
import os
import signal
import time
import zlib
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import settings

from tests.examples import FAST, FULL

# no test asserts a time: the first example of many compiles what it calls
settings.register_profile("full", deadline=None, derandomize=True, max_examples=FULL)
settings.register_profile("fast", settings.get_profile("full"), max_examples=FAST)

DATA = Path(__file__).parent / "data"


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--medium", action="store_true", help="also run the tests marked medium")
    parser.addoption("--slow", action="store_true", help="also run the tests marked medium or slow")
    parser.addoption("--share", metavar="K/N", help="only tests that --slow adds, of these the K-th of N shares")


def pytest_configure(config: pytest.Config) -> None:
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell lets what it starts with & ignore Ctrl-C
    full = config.getoption("--slow") or config.getoption("--share")
    settings.load_profile("full" if full else "fast")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    one_share = config.getoption("--share")
    share, shares = map(int, (one_share or "1/1").split("/"))
    slow = config.getoption("--slow") or one_share
    fast: Counter[str] = Counter()  # cases that run always, by function

    def runs(item: pytest.Item) -> bool:
        medium, function = item.get_closest_marker("medium"), item.nodeid.partition("[")[0]
        if item.get_closest_marker("slow") is None:
            if medium is None:
                return not one_share
            if fast[function] < medium.kwargs.get("fast", 0):
                fast[function] += 1
                return not one_share
            if not slow and not config.getoption("--medium"):
                return False
        elif not slow:
            return False
        return zlib.crc32(item.nodeid.encode()) % shares == share % shares

    chosen = [runs(item) for item in items]
    # to skip them costs as much as a test of no work, and they are a third
    config.hook.pytest_deselected(items=[item for item, taken in zip(items, chosen, strict=True) if not taken])
    # of two processes one begins with these, and has compiled the laws when the other one comes to them
    items[:] = sorted(
        (item for item, taken in zip(items, chosen, strict=True) if taken),
        key=lambda item: item.nodeid.startswith(("tests/controller/", "tests/cosim/")),
    )


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_logstart(nodeid: str) -> None:
    """Write which test runs, in a file for each process, where RUNNING_TESTS names a folder for them."""
    if folder := os.environ.get("RUNNING_TESTS"):
        Path(folder).mkdir(exist_ok=True)
        Path(folder, os.environ.get("PYTEST_XDIST_WORKER", "main")).write_text(f"{nodeid}\n")


def pytest_collection_finish() -> None:
    gc.collect()
    gc.freeze()  # modules and thousands of tests stay: a tenth of the session went into looking at them again and again


@pytest.fixture(autouse=True, scope="session")
def fmu_cache(tmp_path_factory):
    """Build FMUs afresh in each session, once for all its workers, independent of the user's cache."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if os.environ.get("PYTEST_XDIST_WORKER") else base) / "cache"
    folder.mkdir(exist_ok=True)
    with pytest.MonkeyPatch.context() as patch:
        if importlib.util.find_spec("platformdirs") is not None:  # else these are the arbiter's tests alone
            patch.setattr("platformdirs.user_cache_dir", lambda *_, **__: str(folder))
        yield folder


@pytest.fixture(autouse=True, scope="session")
def temporary_files(tmp_path_factory):
    """Keep what other tools and killed processes leave in the folder for temporary files among the tests' own."""
    folder = tmp_path_factory.mktemp("temporary")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TMPDIR", str(folder))
        patch.setenv("XDG_STATE_HOME", str(folder / "state"))  # of the timestamps of signatures
        patch.setattr("tempfile.tempdir", str(folder))
        yield


@pytest.fixture(scope="session")
def once(tmp_path_factory):
    """Return a function that makes a folder once for all workers of a session."""
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if os.environ.get("PYTEST_XDIST_WORKER") else base

    def made(name, make):
        folder, ready, failed = shared / name, shared / f"{name}.ready", shared / f"{name}.failed"
        try:
            folder.mkdir()
        except FileExistsError:
            while not ready.exists():  # a hang ends with the time limit of a test
                assert not failed.exists(), f"{name}: failed in another worker"
                time.sleep(0.2)
            return folder
        try:
            make(folder)
        except BaseException:
            failed.touch()
            raise
        ready.touch()
        return folder

    return made


@pytest.fixture(scope="session")
def prebuilt_of_eight(once):
    """Return the libraries of eight thrusters for all platforms, by FMI 3.0, as a wheel has them."""
    pytest.importorskip("ziglang", reason="the build extra is not installed: no binaries for other platforms")
    from plant_fmu.compiling import prebuilt

    structure = next(s for s in prebuilt.shipped_structures() if s.constants["N_THRUSTERS"] == 8)
    folder = once("prebuilt-of-eight", lambda folder: prebuilt.write_prebuilt(structure, 3, "all", folder))
    return folder / prebuilt.file_name(structure, 3)


@pytest.fixture(scope="session")
def shipped_run(tmp_path_factory):
    """Return a function that runs a shipped scenario once a session, with a report where one is asked for."""
    from cosim.run.run_scenario import run_scenario
    from cosim.scenario.scenario import load_scenario

    done = {}

    def run(name, *overrides, report=False):
        if (name, overrides, report) not in done:
            folder = tmp_path_factory.mktemp("runs") / name
            done[name, overrides, report] = run_scenario(load_scenario(name, overrides), folder, report=report)
        return done[name, overrides, report]

    return run
