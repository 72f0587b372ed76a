"""Reports as pages and as pictures, and reports of incomplete runs."""

import shutil
import struct

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from cosim.command_line.cli import main
from cosim.report.figures.layout import WIDTH
from cosim.results.record import RECORD
from cosim.run import run_folder

pytestmark = pytest.mark.slow

SHORT = ("arbiter.engine=closed", "time.duration=0.3")


@pytest.fixture(scope="module")
def folder(shipped_run, tmp_path_factory):
    """A run of the paper's scenario, reported as pictures."""
    made = tmp_path_factory.mktemp("reported") / "run"
    shutil.copytree(shipped_run("paper", *SHORT).folder, made)
    assert main(["report", str(made), "--format", "png"]) == 0
    return made


def test_png_and_svg_figures_coincide(folder):
    svgs, pngs = ({p.stem for p in (folder / "figures").glob(f"*.{kind}")} for kind in ("svg", "png"))
    assert svgs == pngs and len(svgs) == 10
    for name in pngs:
        assert size_of(folder / "figures" / f"{name}.png")[0] == WIDTH * 160
    assert not (folder / "report.html").exists()


def size_of(png):
    data = png.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n" and data[-8:-4] == b"IEND"
    return struct.unpack(">II", data[16:24])


@pytest.mark.parametrize("formats", ["html", "png,html"])
def test_every_written_path_is_printed(shipped_run, tmp_path, capsys, formats):
    folder = tmp_path / "run"
    shutil.copytree(shipped_run("paper", *SHORT).folder, folder)
    (folder / "summary.json").unlink()
    before = set(folder.rglob("*"))
    assert main(["report", str(folder), "--format", formats, "-q"]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert sorted(printed) == sorted(str(file) for file in set(folder.rglob("*")) - before if file.is_file())
    assert printed[:2] == [str(folder / "report.html"), str(folder / "replay.html")]


def test_invalid_folder_does_not_prevent_other_reports(shipped_run, tmp_path, capsys):
    good, bad = tmp_path / "good", tmp_path / "bad"
    shutil.copytree(shipped_run("paper", *SHORT).folder, good)
    bad.mkdir()
    assert main(["report", str(bad), str(good)]) == 2
    said = capsys.readouterr()
    assert said.err == f"cosim: {bad}: holds no run (scenario.toml is missing)\n"
    assert str(good / "report.html") in said.out
    assert (good / "report.html").exists() and not list(bad.iterdir())


def test_unknown_format_gives_one_line_error(tmp_path, capsys):
    with pytest.raises(SystemExit):
        main(["report", str(tmp_path), "--format", "html,docx"])
    assert "'docx': expected html, png" in capsys.readouterr().err


@pytest.mark.parametrize("formats", [["html"], ["png"]])
def test_full_disk_leaves_old_files_unchanged(shipped_run, tmp_path, monkeypatch, formats):
    folder = tmp_path / "run"
    shutil.copytree(shipped_run("paper", *SHORT, report=True).folder, folder)
    before = {p: p.read_bytes() for p in folder.rglob("*") if p.is_file() and p.name != "summary.json"}

    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", full)
    with pytest.raises(run_folder.RunError, match="No space left"):
        run_folder.report_again(folder, formats)
    assert {p: p.read_bytes() for p in folder.rglob("*") if p.is_file() and p.name != "summary.json"} == before


def changed(folder, shipped, change):
    """Copy a run with another record and without a summary, as after a kill."""
    shutil.copytree(shipped, folder)
    table = pq.read_table(folder / RECORD)
    pq.write_table(change(table), folder / RECORD)
    (folder / "summary.json").unlink()
    return folder


def without_numbers(first):
    """Make all signals NaN from a row on."""

    def change(table):
        arrays = [table[name].to_numpy().copy() for name in table.column_names]
        for array in arrays[1:]:
            array[first:] = np.nan
        return pa.Table.from_arrays([pa.array(array) for array in arrays], schema=table.schema)

    return change


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (without_numbers(100), "201 of 301 rows of the record"),
        (without_numbers(0), "how near it came is not recorded"),
        (lambda table: table.slice(0, 1), "its record ends at 0.000 s"),
    ],
    ids=["NaN from a row on", "NaN throughout", "one row"],
)
def test_incomplete_record_gives_a_page_with_a_notice(shipped_run, tmp_path, change, said):
    folder = changed(tmp_path / "run", shipped_run("paper", *SHORT).folder, change)
    assert main(["report", str(folder)]) == 0
    assert said in (folder / "report.html").read_text()
    assert not list(folder.glob(".*"))


def test_empty_record_gives_one_line_error(shipped_run, tmp_path, capsys):
    folder = changed(tmp_path / "run", shipped_run("paper", *SHORT).folder, lambda table: table.slice(0, 0))
    assert main(["report", str(folder), "--format", "png"]) == 2
    assert capsys.readouterr().err == f"cosim: {folder}: the record of the run is empty\n"
    assert not list(folder.glob("*report*"))
