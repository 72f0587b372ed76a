"""Export of a run: selection of signals and steps, files, and rejected requests."""

import builtins
import importlib
import os
from pathlib import Path

import numpy as np
import pytest
from pymavlink import mavutil

from cosim.command_line.cli import main
from cosim.errors import ExportError, RunError
from cosim.export import export_run
from cosim.export.excerpt import excerpt_of
from cosim.export.formats import FORMATS
from cosim.results.record import load_record

needs_pipes = pytest.mark.skipif(os.name != "posix", reason="pipes have names on POSIX alone")


def test_export_defaults_to_all_steps_and_signals(run):
    excerpt, record = excerpt_of(run), load_record(run)
    assert excerpt.columns == record.columns
    assert excerpt.count == len(record) == len(record["time"])
    taken = np.concatenate([block.to_array() for block in excerpt.blocks()])
    assert np.array_equal(taken, record.stack([*record.units]), equal_nan=True)


@pytest.mark.parametrize("every", [1, 7, 101, 1000])
def test_every_nth_step_is_exported(run, every):
    record = load_record(run)
    blocks = [*excerpt_of(run, every=every).blocks()]
    for name in ("time", "velocity.u"):
        assert np.array_equal(np.concatenate([block[name] for block in blocks]), record[name][::every])


@pytest.mark.parametrize(("rate", "rows"), [(10.0, 11), (30.0, 31), (100.0, 101), (1e6, 101)])
def test_export_rate_is_capped_by_the_recorded_rate(run, rate, rows):
    time = np.concatenate([block["time"] for block in excerpt_of(run, rate=rate).blocks()])
    assert len(time) == rows
    assert time[0] == 0.0
    assert np.abs(np.diff(time) - 1.0 / min(rate, 100.0)).max() < 0.0101


def test_patterns_select_signals_and_time_is_always_included(run):
    names = [column.name for column in excerpt_of(run, ["*.clearance", "thrust[[]1]", "thrust[2]"]).columns]
    assert names[0] == "time"
    assert {"goal.clearance", "thrust[1]", "thrust[2]"} < set(names)
    assert all(name == "time" or name.endswith(".clearance") or name.startswith("thrust[") for name in names)


def test_default_file_name_is_the_run_name(run, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["export", str(run), "--to", "csv", "--every", "10", "--signals", "position.*"]) == 0
    assert capsys.readouterr().out.split() == ["docking.csv", "docking.units.csv"]
    assert (tmp_path / "docking.csv").read_text().splitlines()[0] == "time,position.x,position.y,position.z"
    assert len((tmp_path / "docking.csv").read_text().splitlines()) == 12


@pytest.mark.parametrize("there", ["out.csv", "out.units.csv"])
def test_a_file_is_replaced_only_by_force(run, tmp_path, there, capsys):
    (tmp_path / there).write_text("mine")
    out = str(tmp_path / "out.csv")
    assert main(["export", str(run), "--to", "csv", "--out", out]) == 2
    assert f"{there}: exists; expected a new file, or --force to replace it" in capsys.readouterr().err
    assert (tmp_path / there).read_text() == "mine"
    assert [path.name for path in tmp_path.iterdir()] == [there]
    assert main(["export", str(run), "--to", "csv", "--out", out, "--force"]) == 0
    assert (tmp_path / there).read_text() != "mine"


@pytest.mark.parametrize("make", ["mkdir", pytest.param("mkfifo", marks=needs_pipes)])
def test_a_folder_or_pipe_is_never_replaced(run, tmp_path, make):
    out = tmp_path / "out.csv"
    getattr(os, make)(out)
    with pytest.raises(ExportError, match="exists"):
        export_run(run, "csv", out, force=True)
    assert out.is_fifo() or out.is_dir()


def test_of_two_files_none_is_left_without_the_other(run, tmp_path, monkeypatch):
    def one_of_two(excerpt, path):
        path.touch()
        return [path, path.with_name("absent")]

    monkeypatch.setattr("cosim.export.csv_writer.write", one_of_two)
    with pytest.raises(RunError, match="No such file"):
        export_run(run, "csv", tmp_path / "out.csv")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("to", "lacking", "brings"),
    [("mcap", "mcap", "mcap"), ("rrd", "rerun", "rerun-sdk"), ("rosbag2", "rosbags", "rosbags")],
)
def test_missing_library_is_named(run, tmp_path, monkeypatch, to, lacking, brings):
    plain = builtins.__import__

    def without(name, *rest, **keywords):
        if name.partition(".")[0] == lacking:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        return plain(name, *rest, **keywords)

    monkeypatch.delitem(importlib.sys.modules, f"cosim.export.{to}_writer", raising=False)
    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(ExportError, match=rf'--to {to} needs {lacking}\S*; .+ -m pip install .*"{brings}>='):
        export_run(run, to, tmp_path / "out")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("{run} --to xlsx", f"--to xlsx: expected one of {', '.join(FORMATS)}\n"),
        ("{run} --to mat", "; MATLAB reads RUN/record.parquet by parquetread\n"),
        ("nowhere --to csv", "holds no run"),
        ("{run} --to csv --signals postion.x", "--signals postion.x: matches no signal of the run; expected such as"),
        ("{run} --to tlog --signals time", "expected without --signals, --every, --rate, since"),
        ("{run} --to tlog --every 2", "expected without --signals, --every, --rate, since"),
        ("{run} --to tlog --rate 5", "expected without --signals, --every, --rate, since"),
    ],
)
def test_requests_that_cannot_be_met_are_one_line(run, tmp_path, monkeypatch, capsys, words, said):
    monkeypatch.chdir(tmp_path)
    assert main(["export", *words.format(run=run).split()]) == 2
    error = capsys.readouterr().err
    assert said in error and error.startswith("cosim: ") and error.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("flags", [["--every", "0"], ["--rate", "nan"], ["--every", "2", "--rate", "5"]])
def test_invalid_numbers_are_rejected(run, flags, capsys):
    with pytest.raises(SystemExit):
        main(["export", str(run), "--to", "csv", *flags])
    assert "argument --" in capsys.readouterr().err


def test_tlog_export_is_readable_by_pymavlink(run, tmp_path):
    (path,) = export_run(run, "tlog", tmp_path / "out.tlog")
    record, log = load_record(run), mavutil.mavlink_connection(str(path))
    depths = {}
    while (message := log.recv_match(type="LOCAL_POSITION_NED")) is not None:
        depths[message.time_boot_ms] = message.z
    log.close()
    assert len(depths) > 5
    for milliseconds, depth in depths.items():
        row = int(np.argmin(np.abs(record["time"] - milliseconds / 1e3)))
        assert depth == pytest.approx(record["position.z"][row], abs=1e-5)


def test_blocks_of_a_long_record_stay_small(run, monkeypatch):
    """A record is read in its blocks: no more rows are in memory than one of them has."""
    monkeypatch.setattr("cosim.results.record._BLOCK", 13)
    sizes = [len(block) for block in excerpt_of(run, every=2).blocks()]
    assert sum(sizes) == 51
    assert max(sizes) <= 7


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no full disk to try")
@pytest.mark.parametrize(("to", "there"), [("csv", False), ("csv", True), ("mcap", False), ("rrd", False)])
def test_full_disk_is_reported_and_leaves_what_was_there(run, tmp_path, monkeypatch, to, there):
    out = tmp_path / f"out.{to}"
    if there:
        out.write_text("mine")
    if to == "rrd":
        pytest.importorskip("rerun")
    writer = importlib.import_module(FORMATS[to].writer)
    write = writer.write

    def on_full_disk(excerpt, path):
        path.symlink_to("/dev/full")
        return write(excerpt, path)

    monkeypatch.setattr(writer, "write", on_full_disk)
    with pytest.raises((ExportError, RunError), match=r"space|cannot be written"):
        export_run(run, to, out, force=there)
    assert [path.read_text() for path in tmp_path.iterdir()] == ["mine"] * there


def test_incomplete_tlog_is_discarded(run, tmp_path, monkeypatch):
    monkeypatch.setattr("cosim.mavlink.channels.tlog_file.Tlog.send", lambda channel, _: channel.trouble.update(lost=1))
    with pytest.raises(ExportError, match="not all was written"):
        export_run(run, "tlog", tmp_path / "out.tlog")
    assert not list(tmp_path.iterdir())


def test_export_never_overwrites_the_run(run, tmp_path):
    before = (run / "record.parquet").read_bytes()
    (tmp_path / "link").symlink_to(run)
    for folder in (run, tmp_path / "link"):
        with pytest.raises(ExportError, match="belongs to the run"):
            export_run(folder, "csv", run / "record.parquet", force=True)
    assert (run / "record.parquet").read_bytes() == before
