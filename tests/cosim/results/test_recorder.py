"""The record holds each row once, bit for bit, for any interruption of its writing."""

import contextlib
import itertools
import signal
import traceback
import tracemalloc
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from cosim.results import recorder as recorder_module
from cosim.results.record import PARTS, RECORD, load_record
from cosim.results.recorder import Recorder
from cosim.simulation.signals import Column

COLUMNS = [Column("time", "s", "Time"), Column("x", "m", "Place")]


def test_a_killed_recorder_leaves_its_parts(tmp_path):
    recorder = Recorder(tmp_path, COLUMNS, rows_per_part=10)
    for k in range(35):
        recorder.observe(k, np.array([k, 2.0 * k]))
    record = load_record(tmp_path)  # nobody closed it
    assert record["time"].tolist() == list(range(30))
    assert record.units == {"time": "s", "x": "m"}


def test_a_record_keeps_every_bit(tmp_path):
    rows = np.random.default_rng(0).normal(size=(27, 2)) * 1e-300
    rows[3] = [np.nan, -0.0]
    recorder = Recorder(tmp_path, COLUMNS, rows_per_part=10)
    for k, row in enumerate(rows):
        recorder.observe(k, row)
    recorder.close()
    assert load_record(tmp_path).stack(["time", "x"]).tobytes() == rows.tobytes()
    assert [p.name for p in tmp_path.iterdir()] == ["record.parquet"]


@pytest.mark.parametrize("when", ["before", "after"])
@pytest.mark.parametrize("where", ["pq.write_table", "pq.ParquetWriter.write_table", "Path.replace"])
def test_interrupt_during_any_write_call_neither_loses_nor_duplicates_rows(tmp_path, monkeypatch, where, when):
    recorder = Recorder(tmp_path, COLUMNS, rows_per_part=10)
    name, _, method = where.rpartition(".")
    owner = {"pq": pq, "pq.ParquetWriter": pq.ParquetWriter, "Path": Path}[name]
    real, calls = getattr(owner, method), []

    def interrupted(*arguments, **keywords):
        calls.append(method)
        if len(calls) == 2 and when == "before":
            raise KeyboardInterrupt
        done = real(*arguments, **keywords)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return done

    monkeypatch.setattr(owner, method, interrupted)
    with contextlib.suppress(KeyboardInterrupt):
        for k in range(100):
            recorder.observe(k, np.array([k, 2.0 * k]))
    assert 10 <= recorder.rows < 100
    recorder.close()
    assert load_record(tmp_path)["time"].tolist() == list(range(recorder.rows))
    assert [p.name for p in tmp_path.iterdir()] == ["record.parquet"]


def test_slow_run_is_written_at_time_intervals(tmp_path, monkeypatch):
    now = iter(np.arange(0.0, 1e3, 0.3))
    monkeypatch.setattr("cosim.results.recorder.time.monotonic", lambda: next(now))
    recorder = Recorder(tmp_path, COLUMNS)
    for k in range(40):
        recorder.observe(k, np.array([k, 2.0 * k]))
    assert len(load_record(tmp_path)["time"]) >= 30


@pytest.mark.parametrize("most", [199, 200])
def test_signal_cache_is_bounded_for_large_records(tmp_path, monkeypatch, most):
    monkeypatch.setattr("cosim.results.record._SMALL", most)
    columns = [Column(f"c{i}", "", "x") for i in range(100)]
    recorder = Recorder(tmp_path, columns)
    for k in range(2):
        recorder.observe(k, np.arange(100.0) + k)
    recorder.close()
    record = load_record(tmp_path)
    assert [list(record[c.name]) for c in columns] == [[i, i + 1.0] for i in range(100)]
    assert len(record._kept) == (24 if most < 200 else 100)
    with pytest.raises(KeyError):
        record["nothing"]


def test_interrupted_part_write_neither_loses_nor_duplicates_rows(tmp_path, monkeypatch):
    """Ctrl-C within the writing of a part, as Python delivers it: when the call returns."""
    recorder = Recorder(tmp_path, COLUMNS, rows_per_part=10)
    real, calls = pq.write_table, []

    def interrupted(*arguments, **named):
        real(*arguments, **named)
        calls.append(1)
        if len(calls) in (1, 3):
            raise KeyboardInterrupt

    monkeypatch.setattr("cosim.results.recorder.pq.write_table", interrupted)
    k = 0
    for _ in range(3):  # what is not written yet when it comes, is written when it goes on
        with contextlib.suppress(KeyboardInterrupt):
            while k < 35:
                recorder.observe(k, np.array([k, 2.0 * k]))
                k += 1
    recorder.close()
    assert load_record(tmp_path)["time"].tolist() == list(range(35))


def test_many_small_parts_become_few_row_groups(tmp_path, monkeypatch):
    now = itertools.count(0.0, 2.0)
    monkeypatch.setattr("cosim.results.recorder.time.monotonic", lambda: next(now))
    recorder = Recorder(tmp_path, COLUMNS, rows_per_part=1000)
    for k in range(300):
        recorder.observe(k, np.array([k, 2.0 * k]))
    assert len(list((tmp_path / PARTS).glob("*.parquet"))) == 299
    assert len(load_record(tmp_path)["time"]) == 299
    recorder.close()
    assert pq.ParquetFile(tmp_path / RECORD).num_row_groups == 1
    assert load_record(tmp_path)["x"].tolist() == [2.0 * k for k in range(300)]


def test_a_fast_run_is_written_once(tmp_path, monkeypatch):
    monkeypatch.setattr("cosim.results.recorder.time.monotonic", lambda: 0.0)
    recorder = Recorder(tmp_path, COLUMNS)
    for k in range(25_000):
        recorder.observe(k, np.array([k, 2.0 * k]))
    assert not list((tmp_path / PARTS).glob("*.parquet"))
    recorder.close()
    assert pq.ParquetFile(tmp_path / RECORD).num_row_groups == 3
    assert load_record(tmp_path)["x"].tolist() == [2.0 * k for k in range(25_000)]


def test_a_long_record_has_larger_row_groups_and_few(tmp_path, monkeypatch):
    monkeypatch.setattr("cosim.results.recorder.time.monotonic", lambda: 0.0)
    monkeypatch.setattr("cosim.results.recorder._DOUBLED", 4)
    monkeypatch.setattr("cosim.results.recorder._GROUP", 250)
    monkeypatch.setattr("cosim.results.recorder._GROUP_NUMBERS", 1250 * len(COLUMNS))
    recorder = Recorder(tmp_path, COLUMNS, rows_per_part=3000)
    for k in range(12_345):
        recorder.observe(k, np.array([k, 2.0 * k]))
    recorder.close()
    groups = pq.ParquetFile(tmp_path / RECORD).metadata
    rows = [groups.row_group(i).num_rows for i in range(groups.num_row_groups)]
    assert rows == [250] * 4 + [500] * 4 + [1000] * 4 + [1250] * 4 + [345]
    assert load_record(tmp_path)["x"].tolist() == [2.0 * k for k in range(12_345)]


@pytest.mark.medium
def test_a_part_holds_64_mib_at_the_most(tmp_path, monkeypatch):
    monkeypatch.setattr("cosim.results.recorder.time.monotonic", lambda: 0.0)
    columns = [Column(f"c{i}", "", "x") for i in range(2000)]
    recorder = Recorder(tmp_path, columns)
    for k in range(2**23 // 2000 + 300):
        recorder.observe(k, np.full(2000, float(k)))
    (part,) = (tmp_path / PARTS).glob("*.parquet")
    assert pq.ParquetFile(part).metadata.num_rows == 4000


def test_failed_finalization_leaves_all_rows_in_parts(tmp_path, monkeypatch):
    recorder = Recorder(tmp_path, COLUMNS, rows_per_part=10)
    for k in range(35):
        recorder.observe(k, np.array([k, 2.0 * k]))

    def refused(self, target):
        if target.name == RECORD:
            raise OSError(28, "No space left on device")
        return real(self, target)

    real = Path.replace
    monkeypatch.setattr(Path, "replace", refused)
    with pytest.raises(OSError, match="No space"):
        recorder.close()
    assert not (tmp_path / RECORD).exists()
    assert load_record(tmp_path)["time"].tolist() == list(range(35))


@pytest.mark.parametrize("first", [1, 2, 3])
@pytest.mark.parametrize("then", range(6))
def test_interrupted_close_keeps_all_rows_and_can_be_repeated(tmp_path, monkeypatch, first, then):
    recorder = Recorder(tmp_path, COLUMNS, rows_per_part=10)
    for k in range(35):
        recorder.observe(k, np.array([k, 2.0 * k]))
    calls = itertools.count(1)

    def interrupted(real):
        def call(*arguments, **named):
            done = real(*arguments, **named)
            if next(calls) in (first, first + then):
                raise KeyboardInterrupt
            return done

        return call

    monkeypatch.setattr("cosim.results.recorder.pq.write_table", interrupted(pq.write_table))
    for owner, method in [(pq.ParquetWriter, "write_table"), (pq.ParquetWriter, "close"), (Path, "replace")]:
        monkeypatch.setattr(owner, method, interrupted(getattr(owner, method)))
    with pytest.raises(KeyboardInterrupt):
        recorder.close()
    if not then:  # it was not interrupted in saving what there was either
        assert load_record(tmp_path)["time"].tolist() == list(range(35))
    with contextlib.suppress(KeyboardInterrupt):
        recorder.close()
    recorder.close()
    assert load_record(tmp_path)["x"].tolist() == [2.0 * k for k in range(35)]
    assert [p.name for p in tmp_path.iterdir()] == [RECORD]


def test_full_disk_keeps_the_rows_that_fit_in_parts(tmp_path, monkeypatch):
    resource = pytest.importorskip("resource")
    monkeypatch.setattr("cosim.results.recorder.time.monotonic", lambda: 0.0)
    rng = np.random.default_rng(3)
    recorder = Recorder(tmp_path, [Column(f"c{i}", "", "x") for i in range(20)])
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2_000_000, before[1]))  # a group takes 1.5 MB
    try:
        with pytest.raises(OSError, match="too large"):
            _record(recorder, rng.normal(size=(25_000, 20)))
        with pytest.raises(OSError, match="too large"):
            recorder.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert len(load_record(tmp_path)["c0"]) == recorder.rows == 20_000
    assert not list((tmp_path / PARTS).glob("*.tmp"))


@pytest.mark.medium
def test_memory_of_a_slow_run_does_not_grow(tmp_path, monkeypatch):
    now = itertools.count(0.0, 0.3)
    monkeypatch.setattr("cosim.results.recorder.time.monotonic", lambda: next(now))
    recorder = Recorder(tmp_path, [Column(f"c{i}", "", "x") for i in range(100)])  # room for a group takes 8 MB
    row, held = np.ones(100), []
    tracemalloc.start()
    try:
        for k in range(300):
            recorder.observe(k, row)
            held.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    assert len(list((tmp_path / PARTS).glob("*.parquet"))) > 20
    assert held[-1] - held[100] < 2e6


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="there are no timers")
def test_signal_storm_neither_loses_nor_duplicates_rows(tmp_path):
    recorder, storm = Recorder(tmp_path, COLUMNS, rows_per_part=300), np.random.default_rng(7)
    caught = 0

    def again(_, frame):
        signal.setitimer(signal.ITIMER_REAL, storm.uniform(1e-5, 2e-3))
        within = [f.f_code for f, _ in traceback.walk_stack(frame)]
        if {"__del__", "gc_callback"} & {code.co_name for code in within}:  # which swallow it; one is Hypothesis's
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
    finally:
        signal.signal(
            signal.SIGALRM, lambda *_: None
        )  # one under way neither sets the timer again nor reaches `before`
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    recorder.close()
    assert load_record(tmp_path)["time"].tolist() == list(range(recorder.rows))
    assert load_record(tmp_path)["x"].tolist() == [2.0 * k for k in range(recorder.rows)]


@pytest.mark.parametrize("at", range(1, 9))
@pytest.mark.parametrize("when", ["before", "after"])
def test_a_record_holds_each_row_once_however_its_writing_is_interrupted(tmp_path, monkeypatch, at, when):
    recorder = Recorder(tmp_path, [Column("time", "s", "")], rows_per_part=3)
    write, writes = pq.ParquetWriter.write_table, 0

    def interrupted(self, *arguments, **options):
        nonlocal writes
        writes += 1
        if writes == at and when == "before":
            signal.raise_signal(signal.SIGINT)
        write(self, *arguments, **options)
        if writes == at and when == "after":
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(pq.ParquetWriter, "write_table", interrupted)
    with pytest.raises(KeyboardInterrupt):
        _record(recorder, np.arange(20.0)[:, np.newaxis])
    recorder.close()
    assert pq.read_table(tmp_path / RECORD)["time"].to_pylist() == list(range(recorder.rows))


def test_record_is_complete_after_a_temporarily_full_disk(tmp_path, monkeypatch):
    recorder = Recorder(tmp_path, [Column("time", "s", "")], rows_per_part=3)
    write, writes = pq.ParquetWriter.write_table, 0

    def full(self, *arguments, **options):
        nonlocal writes
        writes += 1
        write(self, *arguments, **options)
        if writes == 4:
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(pq.ParquetWriter, "write_table", full)
    with pytest.raises(OSError, match="No space"):
        _record(recorder, np.arange(20.0)[:, np.newaxis])
    recorder.close()
    assert load_record(tmp_path)["time"].tolist() == list(range(recorder.rows))


def _record(recorder, rows):
    for k, row in enumerate(rows):
        recorder.observe(k, row)
