"""The report of a run: an HTML page, a PDF, or pictures of its pages, and its figures as files for papers."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Collection
from pathlib import Path

from cosim.flown_run import FlownRun
from cosim.report_contents import contents_of

REPORT = "report.html"
FIGURES = "figures"
FORMATS = ("html", "pdf", "png")


def write_report(run: FlownRun, formats: Collection[str] = ("html",)) -> list[Path]:
    """Write the report of a run into its folder.

    All is written beside what is there, and put in its place when all is done.

    Parameters
    ----------
    run : FlownRun
        Finished, interrupted or killed.
    formats : collection of str
        Of `FORMATS`: ``html`` is ``report.html`` with its figures as SVG, ``pdf`` is ``report.pdf``, ``png`` is
        ``report-1.png`` and so on, with the figures as SVG and PNG.

    Returns
    -------
    list of Path
        The files, without the figures.
    """
    scratch = Path(tempfile.mkdtemp(prefix=".report-", dir=run.path))
    try:
        files = [*_with_figures(run, formats, scratch), *_pages(run, formats, scratch)]
        if (scratch / FIGURES).exists():
            shutil.rmtree(run.path / FIGURES, ignore_errors=True)
            (scratch / FIGURES).replace(run.path / FIGURES)
        if "png" in formats:
            for page in run.path.glob("report-*.png"):  # of an earlier report, which may have had more
                page.unlink()
        return [file.replace(run.path / file.name) for file in files]
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def _with_figures(run: FlownRun, formats: Collection[str], folder: Path) -> list[Path]:
    """Write the figures, and the page that holds them."""
    if not {"html", "png"} & set(formats):
        return []
    # Matplotlib takes as long to import as all else together
    from cosim.drawing import Story
    from cosim.figures import drawings

    (folder / FIGURES).mkdir()
    story = Story(run.scenario, run.record, run.summary)
    shown = [
        (drawing.name, drawing.caption, drawing.write(folder / FIGURES, png="png" in formats))
        for drawing in drawings(story)
    ]
    if "html" not in formats:
        return []
    from cosim.report_html import html_report

    page = folder / REPORT
    page.write_text(html_report(contents_of(run), about(run), shown), encoding="utf-8")
    return [page]


def _pages(run: FlownRun, formats: Collection[str], folder: Path) -> list[Path]:
    """Write the pages, as one document or as pictures."""
    if not {"pdf", "png"} & set(formats):
        return []
    from cosim.report_pages import pages_of, write_pdf, write_pngs

    pages = pages_of(run, contents_of(run), about(run))
    files = [write_pdf(pages, folder / "report.pdf", run.scenario.title)] if "pdf" in formats else []
    return files + (write_pngs(pages, folder) if "png" in formats else [])


def about(run: FlownRun) -> str:
    """Return the run in a line."""
    s = run.scenario
    return f"A run of the scenario {s.name}: {s.vehicle.title}, {s.law.name} law, {s.arbiter.engine} arbiter."
