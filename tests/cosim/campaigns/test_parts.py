"""Rows on disk during a campaign: none lost, none duplicated, few files."""

import tempfile
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cosim.campaigns.store import parts
from cosim.campaigns.store.parts import Parts, in_order, write_tables

SCHEMA = pa.schema([pa.field("row", pa.int64(), nullable=False), pa.field("x", pa.float64())])


def table(rows):
    rows = np.array(sorted(rows), dtype=np.int64)
    return pa.table({"row": rows, "x": rows * 0.5}, schema=SCHEMA)


def opened(folder):
    found = Parts(folder / "parts", SCHEMA)
    return found, found.keys().tolist()


def joined(found, folder):
    found.join(folder / "all.parquet")
    return pq.read_table(folder / "all.parquet")


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize("batches", [1, 2, 3, 8, 9, 26, 27, 28, 100])
def test_parts_are_merged_and_keep_every_row(tmp_path, monkeypatch, batches):
    monkeypatch.setattr(parts, "MERGED", 3)
    found, _ = opened(tmp_path)
    rows = np.random.default_rng(batches).permutation(batches * 5).reshape(batches, 5)
    most = 0
    for batch in rows:
        found.add(table(batch))
        most = max(most, len(list((tmp_path / "parts").iterdir())))
    assert most <= 2 * 5 + 1  # two of each size below 3 ** 5
    again, keys = opened(tmp_path)
    assert sorted(keys) == list(range(batches * 5))
    assert joined(again, tmp_path).equals(table(range(batches * 5)))


def test_kill_during_merge_duplicates_no_row(tmp_path, monkeypatch):
    monkeypatch.setattr(parts, "MERGED", 3)
    found, _ = opened(tmp_path)
    for i in range(8):
        found.add(table(range(4 * i, 4 * i + 4)))
    before = {p.name: p.read_bytes() for p in (tmp_path / "parts").iterdir()}
    assert sorted(before) == [
        "00000000-00000002.parquet", "00000003-00000005.parquet", "00000006-00000006.parquet",
        "00000007-00000007.parquet",
    ]  # fmt: skip
    found.add(table(range(32, 36)))
    assert [p.name for p in (tmp_path / "parts").iterdir()] == ["00000000-00000008.parquet"]
    for name, content in before.items():  # as if none of them had been removed yet
        (tmp_path / "parts" / name).write_bytes(content)
    again, keys = opened(tmp_path)
    assert sorted(keys) == list(range(36)) and len(list((tmp_path / "parts").iterdir())) == 1
    again.add(table([40]))
    assert joined(again, tmp_path)["row"].to_pylist() == [*range(36), 40]


def test_copied_part_duplicates_no_row(tmp_path):
    found, _ = opened(tmp_path)
    for rows in ([0, 1], [2, 3], [4, 5]):
        found.add(table(rows))
    part = next((tmp_path / "parts").glob("00000001-*"))
    (tmp_path / "parts" / "00000007-00000007.parquet").write_bytes(part.read_bytes())
    found, keys = opened(tmp_path)
    assert sorted(keys) == list(range(6))
    assert joined(found, tmp_path)["row"].to_pylist() == list(range(6))


def test_foreign_files_are_ignored(tmp_path):
    found, _ = opened(tmp_path)
    found.add(table([0, 1]))
    foreign_files = [
        tmp_path / "parts" / name for name in ("notes.parquet", "1-2-3.parquet", "copy of 00000000.parquet")
    ]
    for file in foreign_files:
        file.write_text("no part")
    found, keys = opened(tmp_path)
    assert keys == [0, 1] and joined(found, tmp_path)["row"].to_pylist() == [0, 1]
    assert all(file.exists() for file in foreign_files)


def test_failed_merge_on_full_disk_loses_no_row(tmp_path, monkeypatch):
    monkeypatch.setattr(parts, "MERGED", 3)
    found, _ = opened(tmp_path)
    for i in range(2):
        found.add(table([i]))

    def full(*_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(parts, "in_order", full)
        with pytest.raises(OSError, match="No space left"):
            found.add(table([2]))
    again, keys = opened(tmp_path)
    assert keys == [0, 1, 2]
    again.add(table([3]))
    assert joined(again, tmp_path)["row"].to_pylist() == [0, 1, 2, 3]


@pytest.mark.medium
@given(st.lists(st.sets(st.integers(0, 10**6), min_size=1, max_size=30), min_size=1, max_size=8), st.integers(1, 7))
def test_parts_with_any_rows_are_joined_in_order(rows, chunk):
    taken, disjoint = set(), []
    for batch in rows:
        if batch - taken:
            disjoint.append(batch - taken)
            taken |= batch
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setattr(parts, "_CHUNK", chunk)
        files = []
        for i, batch in enumerate(disjoint):
            files.append(Path(folder) / f"{i}.parquet")
            write_tables(files[-1], [table(batch)], SCHEMA)
        found = list(in_order(files, SCHEMA))
    assert pa.concat_tables(found).equals(table(taken))
    assert all(len(t) for t in found)


def test_only_overlapping_parts_are_read_together(tmp_path, monkeypatch):
    at_once = []
    reader = parts._Reader

    class Counted(reader):
        def __init__(self, *arguments):
            at_once.append(self)
            super().__init__(*arguments)

        def _load(self):
            super()._load()
            if not self.more:
                at_once.remove(self)
            assert len(at_once) <= 2

    monkeypatch.setattr(parts, "_Reader", Counted)
    files = []
    for i in range(10):
        files.append(tmp_path / f"{i}.parquet")
        write_tables(files[-1], [table(range(10 * i, 10 * i + 10))], SCHEMA)
    assert pa.concat_tables(in_order(files, SCHEMA)).equals(table(range(100)))
    assert not at_once
