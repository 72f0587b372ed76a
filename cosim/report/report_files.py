"""The report of a run: an HTML page, and its figures as files for papers."""

from __future__ import annotations

import shutil
from collections.abc import Collection
from pathlib import Path

from cosim.report.contents import contents_of
from cosim.report.figure_process import FigureProcess
from cosim.report.web_page import FIGURES, inline_figure, render_page
from cosim.results.run_result import REPORT, SCENARIO, SUMMARY, Run
from plant_fmu.archive import temporary_folder

FORMATS = ("html", "png")


def write_report(run: Run, formats: Collection[str], figure_process: FigureProcess | None) -> list[Path]:
    """Write the report of a run into its folder."""
    # All files are written to a temporary folder, and replace the old ones at the end.
    with temporary_folder(".report-", run.folder) as scratch:
        files = _with_figures(run, formats, scratch, figure_process)
        shutil.rmtree(run.folder / FIGURES, ignore_errors=True)
        (scratch / FIGURES).replace(run.folder / FIGURES)
        written = [file.replace(run.folder / file.name) for file in files]
        return written + sorted((run.folder / FIGURES).iterdir())


def _with_figures(run: Run, formats: Collection[str], folder: Path, figure_process: FigureProcess | None) -> list[Path]:
    """Write the figures, and the page with them."""
    (folder / FIGURES).mkdir()
    shown = figure_process.draw(run, folder / FIGURES) if figure_process and "png" not in formats else None
    if shown is None:
        # importing Matplotlib takes as long as all other imports together
        from cosim.report.figures.figures import drawings
        from cosim.report.figures.sampled_rows import make_figure_data

        drawn = drawings(make_figure_data(run))
        shown = {drawing.name: inline_figure(drawing, folder / FIGURES, "png" in formats) for drawing in drawn}
    if "html" not in formats:
        return []
    files = {path.name for path in run.folder.iterdir()} | {SUMMARY, SCENARIO}
    values = {"run": run, "contents": contents_of(run), "about": about(run), "figures": shown, "files": files}
    page = folder / REPORT
    page.write_text(render_page("cosim.report/run_report.html.j2", **values), encoding="utf-8")
    return [page]


def about(run: Run) -> str:
    """Describe the run in a line: scenario or log, vehicle, law and arbiter."""
    s = run.scenario
    if s.log:
        return f"A log of {s.vehicle.title}, imported from {s.log}."
    return f"A run of the scenario {s.name}: {s.vehicle.title}, {s.law.name} law, {s.arbiter.engine} arbiter."
