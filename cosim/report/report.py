"""The report of a run: an HTML page, a PDF, or pictures of its pages, and its figures as files for papers."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from cosim.report.contents import Contents, contents_of
from cosim.results.run_result import REPORT, Run

if TYPE_CHECKING:  # see write_report
    from cosim.report.figures.style import FigureData

FIGURES = "figures"
FORMATS = ("html", "pdf", "png")


def write_report(run: Run, formats: Collection[str] = ("html",)) -> list[Path]:
    """Write the report of a run into its folder.

    All is written beside what is there, and put in its place when all is done.

    Parameters
    ----------
    run : Run
        Finished, interrupted or killed.
    formats : collection of str
        Of `FORMATS`: ``html`` is ``report.html`` with its figures as SVG, ``pdf`` is ``report.pdf``, ``png`` is
        ``report-1.png`` and so on, with the figures as SVG and PNG.

    Returns
    -------
    list of Path
        The files, the figures last.
    """
    # Matplotlib takes as long to import as all else together
    from cosim.report.figures.sampled_rows import story_of

    scratch = Path(tempfile.mkdtemp(prefix=".report-", dir=run.folder))
    try:
        told = _Told(story_of(run), contents_of(run), about(run))
        files = [*_with_figures(told, formats, scratch), *_pages(told, formats, scratch)]
        if (scratch / FIGURES).exists():
            shutil.rmtree(run.folder / FIGURES, ignore_errors=True)
            (scratch / FIGURES).replace(run.folder / FIGURES)
        if "png" in formats:
            for page in run.folder.glob("report-*.png"):  # of an earlier report, which may have had more
                page.unlink()
        written = [file.replace(run.folder / file.name) for file in files]
        return written + (sorted((run.folder / FIGURES).iterdir()) if {"html", "png"} & set(formats) else [])
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


@dataclass(frozen=True)
class _Told:
    """What a report is made of, whatever it is written as."""

    data: FigureData
    contents: Contents
    about: str


def _with_figures(told: _Told, formats: Collection[str], folder: Path) -> list[Path]:
    """Write the figures, and the page that holds them."""
    if not {"html", "png"} & set(formats):
        return []
    from cosim.report.figures.figures import drawings

    (folder / FIGURES).mkdir()
    shown = [
        (drawing.name, drawing.caption, drawing.write(folder / FIGURES, png="png" in formats))
        for drawing in drawings(told.data)
    ]
    if "html" not in formats:
        return []
    from cosim.report.html import html_report

    page = folder / REPORT
    page.write_text(html_report(told.contents, told.about, shown), encoding="utf-8")
    return [page]


def _pages(told: _Told, formats: Collection[str], folder: Path) -> list[Path]:
    """Write the pages, as one document or as pictures."""
    if not {"pdf", "png"} & set(formats):
        return []
    from cosim.report.pdf import pages_of, write_pdf, write_pngs

    pages = pages_of(told.data, told.contents, told.about)
    files = [write_pdf(pages, folder / "report.pdf", told.contents.title)] if "pdf" in formats else []
    return files + (write_pngs(pages, folder) if "png" in formats else [])


def about(run: Run) -> str:
    """Return the run in a line."""
    s = run.scenario
    return f"A run of the scenario {s.name}: {s.vehicle.title}, {s.law.name} law, {s.arbiter.engine} arbiter."
