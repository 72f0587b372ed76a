"""Fixtures of the tests of runs."""

import pytest


@pytest.fixture(autouse=True)
def compilation_notice(monkeypatch):
    """Silence the notice of a compilation, which depends on the cache of earlier runs."""
    monkeypatch.setattr("cosim.run.progress._Notice.emit", lambda *_: None)
