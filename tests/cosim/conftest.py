"""Fixtures of the tests of runs."""

import pytest


@pytest.fixture(autouse=True)
def untold_compiling(monkeypatch):
    """Leave out what the command says where laws are compiled: whether they are depends on what earlier runs kept."""
    monkeypatch.setattr("cosim.run.progress._Notice.emit", lambda *_: None)
