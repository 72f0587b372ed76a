"""Runs that are not whole give a clear page, and what is no run a clear error."""

import json
import os

import numpy as np
import pyarrow.parquet as pq
import pytest

from cosim.command_line.cli import main
from cosim.errors import CosimError, RunError
from cosim.replay.pages import write_replay
from cosim.results.run_result import load_run
from cosim.run.run_folder import conclude
from tests.cosim.records import filled
from tests.cosim.replay.conftest import GAPS
from tests.cosim.replay.decoding import read_page

NO_ROOT = pytest.mark.skipif(hasattr(os, "geteuid") and os.geteuid() == 0, reason="root may write everywhere")


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize(
    ("kind", "status", "rows", "last"),
    [
        ("killed", "killed", 900, "The run was killed: its record ends here"),
        ("one row", "killed", 1, "The run was killed: its record ends here"),
        ("interrupted", "interrupted", 900, "The run was interrupted"),
        ("gaps", "completed", 6001, "End of the run"),
    ],
)
def test_incomplete_run_has_a_page_with_a_notice(kind, status, rows, last, docking, copy_of, spoil):
    run = load_run(spoil(copy_of(docking), kind))
    assert run.summary["status"] == status and len(run.record["time"]) == rows
    _, [(header, columns)] = read_page(write_replay(run).read_text())
    assert header["status"] == status
    assert header["events"][-1]["text"] == last
    assert columns["time"][-1] == run.record["time"][-1]
    assert header["gaps"] == (dict.fromkeys(GAPS, 120) if kind == "gaps" else {})


def test_gaps_are_kept_and_extremes_exclude_them(docking, copy_of, spoil):
    run = load_run(spoil(copy_of(docking), "gaps"))
    _, [(header, columns)] = read_page(write_replay(run).read_text())
    gap = [2.995 < t < 4.195 for t in columns["time"]]
    for name in GAPS:
        assert np.isnan(columns[name]).tolist() == gap, name
    assert np.isnan(columns["rule.R1"]).tolist() == gap
    assert header["summary"]["min_clearance"]["heading"] == np.nanmin(run.record["heading.clearance"])


def test_summary_of_a_record_with_gaps_is_valid_json(docking, copy_of, spoil):
    folder = spoil(copy_of(docking), "gaps")
    _rewritten(lambda table: filled(table, ["roof.clearance"]))(folder)
    run = load_run(folder)
    conclude(folder, run.planned, "completed", None, report=False)
    assert "NaN" not in (folder / "summary.json").read_text()
    assert json.loads((folder / "summary.json").read_text())["min_clearance"]["roof"] is None
    _, [(header, _)] = read_page(write_replay(run).read_text())
    assert header["summary"]["min_clearance"]["roof"] is None
    assert header["gaps"]["roof.clearance"] == 6001


def _rewritten(change):
    def rewrite(folder):
        file = folder / "record.parquet"
        pq.write_table(change(pq.read_table(file)), file)

    return rewrite


SPOILT = {
    "holds no record of a run": lambda folder: (folder / "record.parquet").unlink(),
    "the record of the run is empty": _rewritten(lambda table: table.slice(0, 0)),
    "record.parquet: cannot be read": lambda folder: os.truncate(folder / "record.parquet", 5000),
    "has no column 'weight.shape'": _rewritten(lambda table: table.drop_columns("weight.shape")),
    "the times of the record do not rise": _rewritten(lambda table: table.take(list(range(len(table)))[::-1])),
    "summary.json: cannot be read": lambda folder: (folder / "summary.json").write_text("{"),
    "holds no run (scenario.toml is missing)": lambda folder: (folder / "scenario.toml").unlink(),
    "scenario.toml: ": lambda folder: (folder / "scenario.toml").write_text("vehicle = 7\n"),
}


@pytest.mark.medium(fast=5)
@pytest.mark.parametrize("text", SPOILT)
def test_invalid_run_gives_one_line_error_and_keeps_the_page(text, docking, copy_of, capsys):
    folder = copy_of(docking)
    SPOILT[text](folder)
    before = sorted(folder.rglob("*"))
    with pytest.raises(CosimError):
        load_run(folder)
    assert main(["report", "--replay", str(folder)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert text in line and str(folder) in line
    assert sorted(folder.rglob("*")) == before


@pytest.mark.medium
def test_run_writes_its_page_unless_no_report(tmp_path, capsys):
    quick = ["--set", "arbiter.engine=closed", "--set", "time.duration=0.05"]
    assert main(["run", "docking", "--out", str(tmp_path / "with"), *quick]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == str(tmp_path / "with" / "replay.html")
    assert (tmp_path / "with" / "replay.html").exists()
    assert main(["run", "docking", "--out", str(tmp_path / "without"), "--no-report", *quick]) == 0
    assert not (tmp_path / "without" / "replay.html").exists()
    assert "replay" not in capsys.readouterr().out


def test_replay_writes_the_page_into_the_run_folder(docking, copy_of, capsys):
    folder = copy_of(docking)
    (folder / "replay.html").unlink(missing_ok=True)
    for _ in range(2):
        assert main(["report", "--replay", str(folder)]) == 0
        assert capsys.readouterr().out.strip() == str(folder / "replay.html")
    reader, [(header, _)] = read_page((folder / "replay.html").read_text())
    assert reader.title == docking.scenario.title and header["name"] == "docking"
    assert not list(folder.glob(".*"))


def test_several_runs_get_distinct_names(docking, copy_of, tmp_path, monkeypatch, capsys):
    here, there, other = copy_of(docking, "a/run"), copy_of(docking, "b/run"), copy_of(docking, "c")
    monkeypatch.chdir(tmp_path)
    assert main(["report", "--replay", str(here), str(there), str(other), "--title", "Three <dockings>"]) == 0
    assert capsys.readouterr().out.strip() == "replay.html"
    reader, runs = read_page((tmp_path / "replay.html").read_text())
    assert [header["name"] for header, _ in runs] == ["a/run", "b/run", f"{other.parent.name}/c"]
    assert reader.title == "Three <dockings>"


def test_foreign_file_is_not_overwritten(docking, tmp_path, capsys):
    file = tmp_path / "thesis.html"
    file.write_text("years of work")
    assert main(["report", "--replay", str(docking.folder), "--out", str(file)]) == 2
    assert capsys.readouterr().err == f"cosim: {file}: exists and is no replay; expected a new file\n"
    assert file.read_text() == "years of work"
    assert (
        main(["report", "--replay", str(docking.folder), str(docking.folder), "--out", str(tmp_path / "x.html")]) == 2
    )
    assert "is given twice" in capsys.readouterr().err
    for out in (tmp_path, tmp_path / "nowhere" / "x.html", file / "x.html"):
        assert main(["report", "--replay", str(docking.folder), "--out", str(out)]) == 2
        assert capsys.readouterr().err.count("\n") == 1
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.html"]
    if os.name == "posix":  # which has named pipes
        os.mkfifo(tmp_path / "x.html")
        assert main(["report", "--replay", str(docking.folder), "--out", str(tmp_path / "x.html")]) == 2
        assert "exists and is no replay" in capsys.readouterr().err and (tmp_path / "x.html").is_fifo()


@NO_ROOT
def test_unwritable_folder_gives_one_line_error(docking, tmp_path):
    from cosim.replay.pages import replay

    tmp_path.chmod(0o500)
    with pytest.raises(RunError, match="Permission denied"):
        replay([docking.folder], tmp_path / "x.html")
