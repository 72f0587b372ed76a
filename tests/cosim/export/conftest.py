"""Inexpensive runs: real ones of a second, and a killed one with gaps."""

import shutil

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from tests.cosim.records import filled

GAP = slice(40, 60)  # rows without a pose


def assert_same_bits(got, expected, name):
    """Hold two signals equal to the last bit, but for which NaN it is."""
    known = ~np.isnan(expected)
    assert np.array_equal(np.isnan(got), ~known), name
    assert np.array_equal(got[known].view(np.uint64), expected[known].view(np.uint64)), name


@pytest.fixture(scope="session")
def run(shipped_run):
    """The folder of a run of a vehicle with walls, a heading to keep and noise."""
    return shipped_run("docking", "time.duration=1", "arbiter.engine=closed").folder


@pytest.fixture(scope="session")
def moving_run(shipped_run):
    """The folder of a run whose regions move."""
    return shipped_run("moving-obstacle", "time.duration=1", "arbiter.engine=closed").folder


@pytest.fixture(scope="session")
def killed(run, tmp_path_factory):
    """The folder of a run that was killed; some of its rows have no pose, one number is below zero by no amount."""
    folder = tmp_path_factory.mktemp("killed") / "killed"
    folder.mkdir()
    shutil.copy(run / "scenario.toml", folder)
    table = pq.read_table(run / "record.parquet")
    table = filled(table, [name for name in table.schema.names if name.startswith(("position", "quaternion"))], GAP)
    table = filled(table, ["bottom_contact"], value=-0.0)
    with pa.ipc.new_stream(folder / "record.arrows", table.schema) as stream:
        stream.write_table(table, max_chunksize=70)
    return folder
