"""The report of a run of a system of FMUs: connected signals over time, and a table of all of them."""

from __future__ import annotations

import re
import shutil
from collections.abc import Collection, Iterator, Sequence
from itertools import cycle, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cosim.report.web_page import FIGURES, inline_figure, render_page
from cosim.results.extremes import even_edges, extreme_rows
from cosim.results.record import Rows
from cosim.results.run_result import REPORT, SUMMARY, SYSTEM
from cosim.results.system_run import SystemRun
from cosim.simulation.signals import Column
from cosim.ssp.system_description import SystemDescription, read_system
from cosim.ssp.variable_groups import LAST_PART
from plant_fmu.archive import temporary_folder

if TYPE_CHECKING:  # importing Matplotlib takes as long as all other imports together
    from matplotlib.figure import Figure

    from cosim.report.figures.style import NamedFigure

_MAX_WHOLE_ROWS = 200_000  # maximum number of rows of a record that is drawn as a whole
_PARTS = 500  # of a longer record, of which the extremes of each are drawn
_PER_PANEL, _PER_FIGURE = 8, 6  # maximum numbers of lines and of panels
_HEIGHT = 1.7  # inches of a panel


def write_system_report(run: SystemRun, formats: Collection[str]) -> list[Path]:
    """Write the report of a run of a system of FMUs into its folder: its page, and its figures as files."""
    from matplotlib import rc_context

    from cosim.report.figures.layout import FIGURE_STYLE

    system = read_system(run.folder / SYSTEM)
    with temporary_folder(".report-", run.folder) as scratch:
        (scratch / FIGURES).mkdir()
        with rc_context(FIGURE_STYLE):
            shown = {figure.name: inline_figure(figure, scratch / FIGURES, "png" in formats)
                     for figure in _drawings(run, system)}  # fmt: skip
        shutil.rmtree(run.folder / FIGURES, ignore_errors=True)
        (scratch / FIGURES).replace(run.folder / FIGURES)
        written = [run.folder / REPORT] if "html" in formats else []
        if written:
            values = {"run": run, "system": system, "figures": shown, "signals": list(_ranges(run)),
                      "files": [run.record.file.name, SUMMARY, SYSTEM]}  # fmt: skip
            (scratch / REPORT).write_text(render_page("cosim.report/system_report.html.j2", **values), encoding="utf-8")
            (scratch / REPORT).replace(run.folder / REPORT)
    return written + sorted((run.folder / FIGURES).iterdir())


def _ranges(run: SystemRun) -> Iterator[tuple[Column, float, float, float, float]]:
    """Yield each signal with its values at start and end, its minimum and its maximum."""
    least = greatest = np.full(len(run.record.columns), np.nan)
    for block in run.record.blocks():
        values = block.to_array()
        least, greatest = np.fmin(least, np.fmin.reduce(values)), np.fmax(greatest, np.fmax.reduce(values))
    first, last = run.record.take([0, len(run.record) - 1]).to_array()
    yield from list(zip(run.record.columns, first, last, least, greatest, strict=True))[1:]


def _drawings(run: SystemRun, system: SystemDescription) -> Iterator[NamedFigure]:
    """Yield figures of the connected signals of each FMU, or of all if none is connected; panels by unit and array."""
    from cosim.report.figures.style import NamedFigure

    connected = {".".join(line.start) for line in system.lines}
    for fmu in system.sources:
        of_fmu = [column for column in run.record.columns if column.name.startswith(f"{fmu}.")]
        columns = [column for column in of_fmu if column.name in connected or not connected]
        groups: dict[tuple[str, str], list[Column]] = {}
        for column in columns:
            groups.setdefault((column.unit, LAST_PART.sub("", column.name)), []).append(column)
        panels = [part for group in groups.values() for part in _parts(group, _PER_PANEL)]
        for i, part in enumerate(_parts(panels, _PER_FIGURE)):
            caption = f"{'Connected outputs' if connected else 'Outputs'} of {fmu}{', continued' if i else ''}."
            yield NamedFigure(f"{_file_name(fmu)}-{i + 1}", caption, _draw(run, fmu, part))


def _draw(run: SystemRun, fmu: str, panels: Sequence[Sequence[Column]]) -> Figure:
    from cosim.report.figures.layout import legend, limits_of, panel_grid
    from cosim.report.figures.panels import DASHES
    from cosim.report.figures.style import CYCLE, thin

    names = [column.name for panel in panels for column in panel]
    labels = [name.removeprefix(f"{fmu}.") for name in names]
    rows = _rows(run.record, names)
    figure, axes = panel_grid([_HEIGHT] * len(panels), [1.0], labels, 0.0)
    entries, styles = {}, zip(cycle(CYCLE), cycle(dash for dash in DASHES for _ in CYCLE), strict=False)
    for ax, panel in zip(axes[:, 0], panels, strict=True):
        for column, (color, dash) in zip(panel, islice(styles, len(panel)), strict=True):
            line = ax.plot(*thin(rows["time"], rows[column.name]), color=color, linestyle=dash)
            entries[column.name.removeprefix(f"{fmu}.")] = line[0]
        ax.set_ylim(limits_of([rows[column.name] for column in panel]))
        ax.set_ylabel(f"[{panel[0].unit or '–'}]")
    axes[-1, 0].set_xlabel("time [s]")
    legend(figure, entries)
    return figure


def _rows(record: Rows, names: Sequence[str]) -> Rows:
    """Return some signals: of a long record, where they have their extremes."""
    names = ["time", *names]
    if len(record) <= _MAX_WHOLE_ROWS:
        return record.take(range(len(record)), names)
    blocks = ([block[name] for name in names] for block in record.blocks(names))
    return record.take(extreme_rows(blocks, len(names), even_edges(len(record), _PARTS)), names)


def _parts(items: Sequence[Any], size: int) -> list[Sequence[Any]]:
    return [items[i : i + size] for i in range(0, len(items), size)]


def _file_name(name: str) -> str:
    return re.sub(r"[^\w.-]", "_", name)
