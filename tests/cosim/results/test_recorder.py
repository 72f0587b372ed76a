"""The record holds each row once, bit for bit, for any interruption of its writing."""

import contextlib
import io
import itertools
import signal
import subprocess
import sys
import traceback
import tracemalloc
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from cosim.errors import RunError
from cosim.results import recorder as recorder_module
from cosim.results.record import RECORD, STREAM, load_record
from cosim.results.recorder import Recorder
from cosim.simulation.signals import Column

COLUMNS = [Column("time", "s", "Time"), Column("x", "m", "Position")]


def record(recorder, n, first=0):
    for k in range(first, n):
        recorder.observe(k, np.array([k, 2.0 * k]))


def numbered(folder):
    """Return the number of rows of a record in which each row has its number."""
    signals = load_record(folder)
    assert signals["time"].tolist() == list(range(len(signals)))
    assert signals["x"].tolist() == [2.0 * k for k in range(len(signals))]
    return len(signals)


@pytest.fixture
def endless(monkeypatch):
    """Stop the clock of the recorder, so that only full batches are written."""
    monkeypatch.setattr("cosim.results.recorder.time.monotonic", lambda: 0.0)


def test_a_killed_run_leaves_the_rows_that_were_flushed(tmp_path):
    program = (
        "import os, pathlib, sys, tests.cosim.results.test_recorder as t\n"
        "t.record(t.Recorder(pathlib.Path(sys.argv[1]), t.COLUMNS, batch_rows=10), 35)\n"
        "os.kill(os.getpid(), 9)"
    )
    assert subprocess.run([sys.executable, "-c", program, tmp_path], check=False).returncode != 0
    assert [file.name for file in tmp_path.iterdir()] == [STREAM] and numbered(tmp_path) == 30
    assert load_record(tmp_path).units == {"time": "s", "x": "m"}
    with pa.memory_map(str(tmp_path / STREAM)) as file:  # as other tools read it
        assert pa.ipc.open_stream(file).read_all()["x"].to_pylist() == [2.0 * k for k in range(30)]


@pytest.mark.medium
def test_a_stream_that_is_cut_anywhere_is_read_up_to_its_last_complete_batch(tmp_path):
    record(Recorder(tmp_path, COLUMNS, batch_rows=10), 35)
    whole, counts = (tmp_path / STREAM).read_bytes(), []
    for size in range(len(whole), 0, -1):
        (tmp_path / STREAM).write_bytes(whole[:size])
        with contextlib.suppress(RunError):
            counts.append(numbered(tmp_path))
    assert counts == sorted(counts, reverse=True) and set(counts) == {30, 20, 10}


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize("seed", range(5))
def test_a_damaged_stream_is_read_or_refused(tmp_path, seed):
    record(Recorder(tmp_path, COLUMNS, batch_rows=10), 35)
    rng, whole = np.random.default_rng(seed), (tmp_path / STREAM).read_bytes()
    for _ in range(200):
        damaged = bytearray(whole)
        for index in rng.integers(len(whole), size=rng.integers(1, 6)):
            damaged[index] = rng.integers(256)
        (tmp_path / STREAM).write_bytes(damaged)
        with contextlib.suppress(RunError):
            signals = load_record(tmp_path)
            assert all(len(signals[name]) == len(signals) for name in signals.units)


def test_a_record_keeps_every_bit(tmp_path):
    rows = np.random.default_rng(0).normal(size=(27, 2)) * 1e-300
    rows[3] = [np.nan, -0.0]
    recorder = Recorder(tmp_path, COLUMNS, batch_rows=10)
    for k, row in enumerate(rows):
        recorder.observe(k, row)
    recorder.close()
    assert load_record(tmp_path).stack(["time", "x"]).tobytes() == rows.tobytes()
    assert [file.name for file in tmp_path.iterdir()] == [RECORD]


def test_a_slow_run_is_flushed_every_second(tmp_path, monkeypatch):
    now = iter(np.arange(0.0, 1e3, 0.3))
    monkeypatch.setattr("cosim.results.recorder.time.monotonic", lambda: next(now))
    record(Recorder(tmp_path, COLUMNS), 40)
    assert numbered(tmp_path) >= 30


@pytest.mark.parametrize("most", [199, 200])
def test_signal_cache_is_bounded_for_large_records(tmp_path, monkeypatch, most):
    monkeypatch.setattr("cosim.results.record._SMALL", most)
    columns = [Column(f"c{i}", "", "x") for i in range(100)]
    recorder = Recorder(tmp_path, columns)
    for k in range(2):
        recorder.observe(k, np.arange(100.0) + k)
    recorder.close()
    signals = load_record(tmp_path)
    assert [list(signals[c.name]) for c in columns] == [[i, i + 1.0] for i in range(100)]
    assert 0 < len(signals._kept) <= (24 if most < 200 else 100)
    names = ["c99", *(f"c{i}" for i in range(23))]  # the first is kept, the others are read again
    np.testing.assert_array_equal(signals.stack(names)[0], [99, *range(23)])
    assert all(signal.base is None for signal in signals._kept.values())  # one keeps no other in memory
    with pytest.raises(KeyError):
        signals["nothing"]


def test_many_small_batches_become_few_row_groups(tmp_path, monkeypatch):
    now = itertools.count(0.0, 2.0)
    monkeypatch.setattr("cosim.results.recorder.time.monotonic", lambda: next(now))
    recorder = Recorder(tmp_path, COLUMNS)
    record(recorder, 300)
    assert numbered(tmp_path) == 299
    recorder.close()
    assert pq.ParquetFile(tmp_path / RECORD).num_row_groups == 1 and numbered(tmp_path) == 300


def test_a_long_record_has_larger_row_groups_and_few(tmp_path, endless, monkeypatch):
    monkeypatch.setattr("cosim.results.recorder._BATCH", 10)
    recorder = Recorder(tmp_path, COLUMNS)
    record(recorder, 12_345)
    recorder.close()
    assert pq.ParquetFile(tmp_path / RECORD).num_row_groups <= 101 and numbered(tmp_path) == 12_345


@pytest.mark.medium
def test_memory_and_batches_of_a_wide_run_are_bounded(tmp_path, endless):
    recorder, row, held = Recorder(tmp_path, [Column(f"c{i}", "", "x") for i in range(2000)]), np.ones(2000), []
    tracemalloc.start()
    try:
        for k in range(3500):
            recorder.observe(k, row)
            held.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    assert len(load_record(tmp_path)) == 3 * 1048  # in batches of 2**21 values
    assert max(held) - held[1500] < 2e6


def test_a_torn_end_is_named_once(tmp_path, endless, caplog):
    recorder = Recorder(tmp_path, COLUMNS, 10)
    record(recorder, 45)
    stream = tmp_path / STREAM
    stream.write_bytes(stream.read_bytes()[:-9])
    with caplog.at_level("WARNING"):
        rows = load_record(tmp_path)
        assert len(rows[COLUMNS[0].name]) == len(rows) == 30 and len([*rows.blocks()]) == 1
    assert [r.getMessage().count("its end cannot be read") for r in caplog.records] == [1]


class Faults:
    """Fail chosen calls among the writes, moves and removals of a recorder, before or after they have worked."""

    def __init__(self, monkeypatch, error, when, numbers):
        self.calls, self._error, self._when, self._numbers = 0, error, when, numbers
        monkeypatch.setattr(recorder_module, "io", SimpleNamespace(FileIO=self._failing_file()))
        for owner, method in [(pq.ParquetWriter, "write_table"), (pq.ParquetWriter, "close"), (Path, "replace")]:
            monkeypatch.setattr(owner, method, self._failing(getattr(owner, method)))

    def _failing(self, method):
        def call(*arguments, **keywords):
            self.calls += 1
            fails = self.calls in self._numbers
            if fails and self._when == "before":
                raise self._error
            result = method(*arguments, **keywords)
            if fails and self._when == "after":
                raise self._error
            return result

        return call

    def _failing_file(self):
        class File(io.FileIO):
            def write(self, data):
                if faults.calls + 1 in faults._numbers and faults._when == "within":
                    faults.calls += 1
                    super().write(data[: len(data) // 2])
                    raise faults._error
                return write(self, data)

        faults, write = self, self._failing(io.FileIO.write)
        return File


@pytest.mark.parametrize(
    "error", [KeyboardInterrupt(), OSError(28, "No space left on device")], ids=["^C", "full disk"]
)
@pytest.mark.parametrize("when", ["before", "within", "after"])
@pytest.mark.parametrize(
    "numbers", [*([k] for k in range(2, 10)), *([k, k + d] for k in (3, 5, 6, 7) for d in (1, 2, 3))]
)
def test_each_row_is_recorded_once_however_its_writing_fails(tmp_path, monkeypatch, error, when, numbers):
    Faults(monkeypatch, error, when, numbers)
    recorder = Recorder(tmp_path, COLUMNS, batch_rows=10)
    for _ in range(4):
        with contextlib.suppress(type(error)):
            while recorder.rows < 35:
                record(recorder, recorder.rows + 1, recorder.rows)
            recorder.close()
    assert numbered(tmp_path) == 35
    assert [file.name for file in tmp_path.iterdir()] == [RECORD]


def test_an_error_at_the_end_leaves_all_rows_in_the_stream(tmp_path, monkeypatch):
    recorder = Recorder(tmp_path, COLUMNS, batch_rows=10)
    record(recorder, 35)
    Faults(monkeypatch, OSError(28, "No space left on device"), "before", range(2, 100))
    with pytest.raises(OSError, match="No space"):
        recorder.close()
    assert [file.name for file in tmp_path.iterdir()] == [STREAM] and numbered(tmp_path) == 35


def test_a_full_disk_keeps_the_rows_that_fit(tmp_path, endless):
    resource = pytest.importorskip("resource")
    recorder = Recorder(tmp_path, COLUMNS)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, before[1]))  # a batch takes 160 kB
    try:
        with pytest.raises(OSError, match="too large"):
            record(recorder, 100_000)
        with pytest.raises(OSError, match="too large"):
            recorder.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert numbered(tmp_path) == 20_000


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="there are no timers")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # a file opened just before a signal
def test_signal_storm_neither_loses_nor_duplicates_rows(tmp_path):
    recorder, storm = Recorder(tmp_path, COLUMNS, batch_rows=300), np.random.default_rng(7)
    caught = 0

    def again(_, frame):
        signal.setitimer(signal.ITIMER_REAL, storm.uniform(1e-5, 2e-3))
        within = [f.f_code for f, _ in traceback.walk_stack(frame)]
        if {"__del__", "gc_callback", "unraisable_hook"} & {code.co_name for code in within}:
            return
        if recorder_module.__file__ in {code.co_filename for code in within}:
            raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, again)
    signal.setitimer(signal.ITIMER_REAL, 1e-3)
    try:
        while caught < 50:
            try:
                while caught < 50:
                    recorder.observe(0, np.array([recorder.rows, 2.0 * recorder.rows]))
            except KeyboardInterrupt:
                caught += 1
    finally:  # a signal under way neither sets the timer again nor reaches `before`
        signal.signal(signal.SIGALRM, lambda *_: None)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    recorder.close()
    assert numbered(tmp_path) == recorder.rows


@pytest.mark.parametrize("batch", [1, 7, 1000])
def test_blocks_and_single_rows_make_one_record(tmp_path, batch):
    rows = np.random.default_rng(batch).normal(size=(600, 2))
    recorder = Recorder(tmp_path, COLUMNS[:2], batch_rows=batch)
    done = 0
    for size in (1, 0, 256, 3, 100, 240):
        if size == 3:
            for row in rows[done : done + size]:
                recorder.observe(done, row)
        else:
            recorder.observe_block(done, rows[done : done + size])
        done += size
    recorder.close()
    record = load_record(tmp_path)
    np.testing.assert_array_equal(record.stack(list(record.units)), rows)
    assert recorder.rows == 600 == done
