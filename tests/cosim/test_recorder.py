import signal

import numpy as np
import pyarrow.parquet as pq
import pytest

from cosim.record import RECORD, Recorder, load_record
from cosim.signals import Column


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
        _record(recorder)
    recorder.close()
    assert pq.read_table(tmp_path / RECORD)["time"].to_pylist() == list(range(recorder.rows))


def test_a_record_is_whole_after_a_disk_that_was_full_for_a_while(tmp_path, monkeypatch):
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
        _record(recorder)
    recorder.close()
    assert load_record(tmp_path)["time"].tolist() == list(range(recorder.rows))


def _record(recorder):
    for k in range(20):
        recorder.observe(k, np.array([float(k)]))
