"""Fixtures of the tests of runs."""

import pytest

from tests.cosim.components import build_components


@pytest.fixture(autouse=True)
def compilation_notice(monkeypatch):
    """Silence the notice of a compilation, which depends on the cache of earlier runs."""
    monkeypatch.setattr("cosim.run.progress._Notice.emit", lambda *_: None)


@pytest.fixture(scope="module")
def fmus(once):
    """Return the folder with the FMUs of `build_components`."""
    return once("components", build_components)
