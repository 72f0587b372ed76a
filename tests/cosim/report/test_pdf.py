"""Reports as PDF and PNG, read back by readers that know nothing of what wrote them; and what a bad run leaves."""

import shutil
import struct

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pypdf
import pytest

from cosim.command_line.cli import main
from cosim.report.figures.layout import WIDTH
from cosim.report.line_breaking import BOLD, MONO, PLAIN, wrapped
from cosim.report.report import write_report
from cosim.results.paper_claims import paper_claims
from cosim.results.record import RECORD
from cosim.results.run_result import load_run
from cosim.results.wording import asked, verdict
from cosim.run import run_folder

pytestmark = pytest.mark.slow

SHORT = ("arbiter.engine=closed", "time.duration=0.3")
A4 = (595.276, 841.89)  # pt


@pytest.fixture(scope="module")
def folder(shipped_run, tmp_path_factory):
    """A run of the paper's scenario, reported as PDF and PNG."""
    made = tmp_path_factory.mktemp("reported") / "run"
    shutil.copytree(shipped_run("paper", *SHORT).folder, made)
    (made / "report-99.png").touch()  # of an earlier report, which had more pages
    assert main(["report", str(made), "--format", "pdf,png"]) == 0
    return made


def text_of(reader):
    """All text, with its lines joined."""
    return " ".join(" ".join(page.extract_text() for page in reader.pages).split())


def test_the_pdf_says_what_the_run_was_asked_and_what_it_did(folder):
    run, reader = load_run(folder), pypdf.PdfReader(folder / "report.pdf")
    text = text_of(reader)
    assert asked(run.scenario) in text
    assert verdict(run.summary) in text
    for claim in paper_claims(run.scenario, run.summary):
        for words in claim.measured.split():
            assert words in text
    for i in range(1, 11):
        assert f"Figure {i}." in text
    assert "cosim run scenario.toml --out again" in text
    assert reader.metadata.title == run.scenario.title


def test_the_pdf_has_pages_of_a4_with_numbers(folder):
    pages = pypdf.PdfReader(folder / "report.pdf").pages
    assert 5 <= len(pages) <= 12
    for i, page in enumerate(pages):
        assert [float(x) for x in page.mediabox[2:]] == pytest.approx(A4, abs=0.5)
        assert f"{i + 1} / {len(pages)}" in page.extract_text()


def test_the_pdf_carries_its_fonts_and_no_pictures(folder):
    fonts = set()
    for page in pypdf.PdfReader(folder / "report.pdf").pages:
        assert not page.images
        for font in page["/Resources"]["/Font"].values():
            inner = font.get_object()
            (inner,) = inner.get("/DescendantFonts", [inner])
            inner = inner.get_object()
            assert inner["/Subtype"] in ("/TrueType", "/CIDFontType2")
            assert "/FontFile2" in inner["/FontDescriptor"].get_object()
            fonts.add(str(inner["/BaseFont"]))
    assert any("Serif" in name for name in fonts) and any("Mono" in name for name in fonts)


def test_the_pictures_are_the_pages_and_the_figures(folder):
    pages = len(pypdf.PdfReader(folder / "report.pdf").pages)
    files = [folder / f"report-{i + 1}.png" for i in range(pages)]
    assert sorted(folder.glob("report-*.png")) == sorted(files)
    for file in files:
        assert size_of(file) == (round(8.27 * 110 - 0.5), round(11.69 * 110 - 0.5))
    svgs, pngs = ({p.stem for p in (folder / "figures").glob(f"*.{kind}")} for kind in ("svg", "png"))
    assert svgs == pngs and len(svgs) == 10
    for name in pngs:
        assert size_of(folder / "figures" / f"{name}.png")[0] == WIDTH * 160
    assert not (folder / "report.html").exists()


def size_of(png):
    data = png.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n" and data[-8:-4] == b"IEND"
    return struct.unpack(">II", data[16:24])


def test_the_same_run_gives_the_same_pdf(folder):
    first = (folder / "report.pdf").read_bytes()
    write_report(load_run(folder), ["pdf"])
    assert (folder / "report.pdf").read_bytes() == first


@pytest.mark.parametrize("formats", ["html", "pdf,html,png"])
def test_every_path_that_was_written_is_printed(shipped_run, tmp_path, capsys, formats):
    folder = tmp_path / "run"
    shutil.copytree(shipped_run("paper", *SHORT).folder, folder)
    (folder / "summary.json").unlink()
    before = set(folder.rglob("*"))
    assert main(["report", str(folder), "--format", formats, "-q"]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert sorted(printed) == sorted(str(file) for file in set(folder.rglob("*")) - before if file.is_file())
    assert printed[:2] == [str(folder / "report.html"), str(folder / "replay.html")]


def test_one_bad_folder_does_not_keep_the_others_from_their_report(shipped_run, tmp_path, capsys):
    good, bad = tmp_path / "good", tmp_path / "bad"
    shutil.copytree(shipped_run("paper", *SHORT).folder, good)
    bad.mkdir()
    assert main(["report", str(bad), str(good)]) == 2
    said = capsys.readouterr()
    assert said.err == f"cosim: {bad}: holds no run (scenario.toml is missing)\n"
    assert str(good / "report.html") in said.out
    assert (good / "report.html").exists() and not list(bad.iterdir())


def test_a_format_that_is_none_is_one_line(tmp_path, capsys):
    with pytest.raises(SystemExit):
        main(["report", str(tmp_path), "--format", "html,docx"])
    assert "'docx': expected html, pdf, png" in capsys.readouterr().err


@pytest.mark.parametrize("formats", [["html"], ["pdf"]])
def test_a_full_disk_leaves_what_was_there(shipped_run, tmp_path, monkeypatch, formats):
    folder = tmp_path / "run"
    shutil.copytree(shipped_run("paper", *SHORT, report=True).folder, folder)
    before = {p: p.read_bytes() for p in folder.rglob("*") if p.is_file() and p.name != "summary.json"}

    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", full)
    monkeypatch.setattr("matplotlib.backends.backend_pdf.PdfPages.savefig", full)
    with pytest.raises(run_folder.RunError, match="No space left"):
        run_folder.report_again(folder, formats)
    assert {p: p.read_bytes() for p in folder.rglob("*") if p.is_file() and p.name != "summary.json"} == before


def changed(folder, shipped, change):
    """Copy a run with another record, as a kill leaves it: without a summary."""
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
def test_a_record_that_is_broken_or_short_gives_a_page_that_says_so(shipped_run, tmp_path, change, said):
    folder = changed(tmp_path / "run", shipped_run("paper", *SHORT).folder, change)
    assert main(["report", str(folder)]) == 0
    assert said in (folder / "report.html").read_text()
    assert not list(folder.glob(".*"))


def test_an_empty_record_is_one_line(shipped_run, tmp_path, capsys):
    folder = changed(tmp_path / "run", shipped_run("paper", *SHORT).folder, lambda table: table.slice(0, 0))
    assert main(["report", str(folder), "--format", "pdf"]) == 2
    assert capsys.readouterr().err == f"cosim: {folder}: the record of the run is empty\n"
    assert not list(folder.glob("*report*"))


def test_lines_break_where_words_end_and_fit():
    text = "The vehicle entered the goal region, " * 10 + "x" * 300
    for face in (PLAIN, BOLD, MONO):
        lines = wrapped(text, 3.0, 10.0, face)
        assert "".join(lines).replace(" ", "") == text.replace(" ", "")
        assert max(map(len, lines)) < 3.0 * 72.0 / 10.0 / 0.3
    (line,) = {round(len(line)) for line in wrapped("y" * 1000, 3.0, 10.0, MONO)[:-1]}
    assert line == int(3.0 * 72.0 / 10.0 / (1233 / 2048))  # the advance in the font's own table


def test_letters_that_the_font_lacks_are_marked():
    assert wrapped("Tiefe 水", 3.0, 10.0, PLAIN) == ["Tiefe \ufffd"]
