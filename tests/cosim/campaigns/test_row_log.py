"""Rows on disk during a campaign: none lost, none duplicated, whenever the process is killed."""

import sys
import tempfile
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cosim.campaigns.store import row_log
from cosim.campaigns.store.row_log import RowLog
from cosim.errors import RunError

SCHEMA = pa.schema([pa.field("row", pa.int64(), nullable=False), pa.field("x", pa.string(), metadata={"unit": "m"})])


def table(rows):
    rows = sorted(rows)
    return pa.table({"row": rows, "x": [None if row % 3 == 0 else f"row {row}" for row in rows]}, schema=SCHEMA)


def append(folder, *batches):
    folder.mkdir(exist_ok=True)
    log = RowLog(folder / "parts", SCHEMA)
    for batch in batches:
        log.add(table(batch))
    log.close()
    return log


def joined(folder):
    RowLog(folder / "parts", SCHEMA).join(folder / "all.parquet")
    return pq.read_table(folder / "all.parquet")


@pytest.mark.medium
@given(st.lists(st.lists(st.sets(st.integers(0, 60), max_size=20), max_size=4), min_size=1, max_size=4), st.data())
def test_tables_of_any_sessions_are_joined_in_order_up_to_a_kill(sessions, data):
    taken = set()
    with tempfile.TemporaryDirectory() as name, pytest.MonkeyPatch.context() as patch:
        folder = Path(name)
        patch.setattr(row_log, "_GROUP", data.draw(st.integers(1, 9)))
        for session in sessions:
            earlier = set(taken)
            for batch in session:
                batch -= taken
                taken |= batch
            append(folder, *session)
        if sessions[-1] and data.draw(st.booleans()):  # killed while it wrote one of the tables of the last session
            file = max((folder / "parts").iterdir())
            file.write_bytes(file.read_bytes()[: data.draw(st.integers(0, file.stat().st_size))])
            keys = set(RowLog(folder / "parts", SCHEMA).keys().tolist())
            assert earlier <= keys <= taken
            taken = keys
        log = append(folder, {100})  # the next session goes on
        assert log.keys().tolist() == [*sorted(taken), 100]
        assert log.table().equals(table(taken | {100})) and joined(folder).equals(table(taken | {100}))


@pytest.mark.skipif(sys.platform == "win32", reason="limits the size of files")
def test_full_disk_is_an_error_at_any_byte(tmp_path):
    import resource

    append(tmp_path / "whole", {0}, range(1, 9))
    size = (tmp_path / "whole" / "parts" / "000000.arrows").stat().st_size
    unlimited = resource.getrlimit(resource.RLIMIT_FSIZE)
    for lacking in range(1, 20):
        log = RowLog(tmp_path / str(lacking), SCHEMA)
        log.add(table({0}))
        resource.setrlimit(resource.RLIMIT_FSIZE, (size - lacking, unlimited[1]))
        try:
            with pytest.raises(OSError, match="too large"):
                log.add(table(range(1, 9)))
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, unlimited)
            log.close()


def test_copied_file_is_refused_and_foreign_files_are_ignored(tmp_path):
    append(tmp_path, {0, 1})
    parts = tmp_path / "parts"
    for name in ("notes.arrows", "7.txt"):
        (parts / name).write_text("no part")
    pq.write_table(table({3}), parts / "00000001-00000001.parquet")
    assert joined(tmp_path)["row"].to_pylist() == [0, 1]
    (parts / "9.arrows").write_bytes((parts / "000000.arrows").read_bytes())
    with pytest.raises(RunError, match="holds row 0 twice, expected each row once"):
        joined(tmp_path)


def test_rows_with_other_columns_are_not_taken(tmp_path):
    log = RowLog(tmp_path / "parts", pa.schema([("row", pa.int64())]))
    log.add(pa.table({"row": np.arange(3)}))
    log.close()
    assert append(tmp_path, {1}).keys().tolist() == [1]
