"""Valid folders for all readers."""

import pytest

from tests.security.fuzzing.registry import Seeds


@pytest.fixture(scope="session")
def all_seeds(tmp_path_factory, ordered_run):
    return Seeds(tmp_path_factory, ordered_run)


@pytest.fixture
def seeds(all_seeds, monkeypatch):
    all_seeds.patch = monkeypatch
    return all_seeds
