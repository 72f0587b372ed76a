"""Runs to be seen again: a minute in a dock, the paper's, and one that is steered by orders."""

import shutil

import pytest

from cosim.replay.folder import load_run

CLOSED = "arbiter.engine=closed"


@pytest.fixture(scope="session")
def docking(shipped_run):
    return load_run(shipped_run("docking", CLOSED).folder)


@pytest.fixture(scope="session")
def copy_of(tmp_path_factory):
    """Return a function that copies a run folder to a place of its own."""

    def copy(run, name="run"):
        folder = tmp_path_factory.mktemp("copies") / name
        shutil.copytree(run.path, folder)
        return folder

    return copy
