"""A report as pages of A4, drawn by Matplotlib: text, tables and figures, all as vectors."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure, SubFigure

from cosim.report.contents import Contents, Table
from cosim.report.figures.figures import draw_all
from cosim.report.figures.layout import FIGURE_STYLE, WIDTH, Sheet
from cosim.report.figures.style import FigureData
from cosim.report.line_breaking import BOLD, MONO, PLAIN, Face, wrapped

_A4 = (8.27, 11.69)  # inches
_LEFT = (_A4[0] - WIDTH) / 2.0
_TOP, _END = 0.85, 10.85  # inches from the top of the page
_FOOT = 11.25
_LEADING = 1.4  # of the size of the letters
_POINT = 1.0 / 72.0  # inch
_SOFT = "#444444"
_DPI = 110
_STYLE: Any = {"pdf.fonttype": 42, "text.parse_math": False}  # whole fonts: text stays text


def pages_of(data: FigureData, contents: Contents, about: str) -> list[Figure]:
    """Return the pages of a report.

    Parameters
    ----------
    data : FigureData
        Its figures are drawn.
    contents : Contents
        What it says.
    about : str
        The run in a line below the title.

    Returns
    -------
    list of Figure
        A4, with their numbers at the foot.
    """
    with mpl.rc_context(FIGURE_STYLE | _STYLE):
        document = _Document()
        document.text(contents.title, 17.0, BOLD, after=4.0)
        document.text(about, 9.0, PLAIN, colour=_SOFT, after=10.0)
        document.headed("What was asked", contents.asked)
        document.headed("What happened", contents.verdict)
        for remark in contents.remarks:
            document.text(remark, 9.5, BOLD, after=6.0)
        if contents.claims:
            document.table(contents.claims)
        document.space(12.0)
        draw_all(data, document.sheet_for)
        for table in (contents.regions, *contents.numbers, contents.setting):
            if table:
                document.table(table)
        document.headed("To repeat it", contents.repeats)
        document.lines(contents.repeat)
        document.headed("Frames", _FRAMES)
        document.heading("The scenario's file")
        document.columns(contents.scenario.splitlines())
        return document.numbered(contents.title)


_FRAMES = (
    "Positions are in the NED world: north, east, down, in metres. The body frame points forward, starboard, down. A "
    "clearance is positive where a region is respected, negative where it is violated."
)


def write_pdf(pages: Sequence[Figure], file: Path, title: str) -> Path:
    """Write pages as a PDF, and return the file."""
    about = {"Title": title, "Creator": "subreach", "CreationDate": None}
    with mpl.rc_context(_STYLE), PdfPages(file, metadata=about) as pdf:
        for page in pages:
            pdf.savefig(page)
    return file


def write_pngs(pages: Sequence[Figure], folder: Path) -> list[Path]:
    """Write each page as a PNG into a folder, and return the files."""
    files = [folder / f"report-{i + 1}.png" for i in range(len(pages))]
    with mpl.rc_context(_STYLE):
        for page, file in zip(pages, files, strict=True):
            page.savefig(file, dpi=_DPI)
    return files


class _Document:
    """Pages that fill from the top."""

    def __init__(self) -> None:
        self._pages: list[Figure] = []
        self._figures = 0
        self._turn()

    def _turn(self) -> None:
        self._page = Figure(figsize=_A4)
        self._pages.append(self._page)
        self._y = _TOP

    def _need(self, inches: float) -> None:
        if self._y + inches > _END and self._y > _TOP:
            self._turn()

    def _put(self, x: float, y: float, line: str, size: float, face: Face, colour: str) -> None:
        self._page.text(
            x / _A4[0], 1.0 - y / _A4[1], line, fontsize=size, family=face.family, weight=face.weight, color=colour,
            va="baseline",
        )  # fmt: skip

    def text(self, text: str, size: float, face: Face, colour: str = "black", after: float = 0.0) -> None:
        """Set a paragraph; `after` is the space below it [pt]."""
        for line in wrapped(text, WIDTH, size, face):
            self._need(_LEADING * size * _POINT)
            self._y += _LEADING * size * _POINT
            self._put(_LEFT, self._y, line, size, face, colour)
        self.space(after)

    def space(self, points: float) -> None:
        """Leave some room."""
        self._y += points * _POINT

    def heading(self, title: str, room: float = 0.8) -> None:
        """Set a heading that stays with `room` inches of what follows."""
        self._need(room)
        self.space(10.0 if self._y > _TOP else 0.0)
        self.text(title, 12.0, BOLD, after=3.0)

    def headed(self, title: str, text: str) -> None:
        """Set a heading and a paragraph."""
        self.heading(title)
        self.text(text, 10.0, PLAIN, after=4.0)

    def lines(self, lines: Sequence[str]) -> None:
        """Set lines as they are, in letters of one width."""
        for line in lines:
            self.text(line, 7.5, MONO)
        self.space(6.0)

    def columns(self, lines: Sequence[str]) -> None:
        """Set lines in letters of one width, in two columns a page."""
        size, wide = 7.0, WIDTH / 2.0 - 0.1
        broken = [part for line in lines for part in wrapped(line, wide, size, MONO)]
        leading = 1.3 * size * _POINT
        while broken:
            fit = max(1, int((_END - self._y) / leading))
            deep = min(fit, -(-len(broken) // 2))
            for i, part in enumerate(broken[: 2 * deep]):
                x = _LEFT + (i // deep) * WIDTH / 2.0
                self._put(x, self._y + (i % deep + 1) * leading, part, size, MONO, "black")
            self._y += deep * leading
            broken = broken[2 * deep :]
            if broken:
                self._turn()

    def table(self, table: Table) -> None:
        """Set a table under its title; its head stands again on every page."""
        size = 8.0
        self.heading(table.title, room=1.2)
        widths = [WIDTH * width / sum(table.widths) for width in table.widths]
        if table.head:
            self._row(table.head, widths, size, BOLD, 0.9)
        for row in table.rows:
            if self._y + self._height(row, widths, size, PLAIN) > _END:
                self._turn()
                if table.head:
                    self._row(table.head, widths, size, BOLD, 0.9)
            self._row(row, widths, size, PLAIN, 0.3)
        self.space(4.0)

    @staticmethod
    def _height(row: Sequence[str], widths: Sequence[float], size: float, face: Face) -> float:
        most = max(len(wrapped(text, width - 0.1, size, face)) for text, width in zip(row, widths, strict=True))
        return (most * _LEADING * size + 4.0) * _POINT

    def _row(self, row: Sequence[str], widths: Sequence[float], size: float, face: Face, line: float) -> None:
        x, height = _LEFT, self._height(row, widths, size, face)
        for text, width in zip(row, widths, strict=True):
            for i, part in enumerate(wrapped(text, width - 0.1, size, face)):
                self._put(x, self._y + (i + 1) * _LEADING * size * _POINT, part, size, face, "black")
            x += width
        self._y += height
        self._rule(self._y, line)

    def _rule(self, y: float, width: float) -> None:
        ends = (_LEFT / _A4[0], (_LEFT + WIDTH) / _A4[0])
        self._page.add_artist(
            mpl.lines.Line2D(
                ends, [1.0 - y / _A4[1]] * 2, linewidth=width, color="black", transform=self._page.transFigure
            )
        )

    def sheet_for(self, caption: str) -> Sheet[SubFigure]:
        """Return what gives room for a figure, with its number and caption below."""
        self._figures += 1
        below = wrapped(f"Figure {self._figures}. {caption}", WIDTH, 9.0, PLAIN)

        def sheet(height: float) -> SubFigure:
            self._need(height + (len(below) * _LEADING * 9.0 + 6.0) * _POINT)
            above = self._y
            grid = self._page.add_gridspec(
                3, 3, wspace=0.0, hspace=0.0, width_ratios=[_LEFT, WIDTH, _A4[0] - _LEFT - WIDTH],
                height_ratios=[above, height, _A4[1] - above - height],
            )  # fmt: skip
            figure = self._page.add_subfigure(grid[1, 1], facecolor="none")
            self._y += height
            for line in below:
                self._y += _LEADING * 9.0 * _POINT
                self._put(_LEFT, self._y, line, 9.0, PLAIN, _SOFT)
            self.space(16.0)
            return figure

        return sheet

    def numbered(self, title: str) -> list[Figure]:
        """Return the pages, with a line at the foot of each."""
        for i, page in enumerate(self._pages):
            self._page = page
            number = f"{i + 1} / {len(self._pages)}"
            self._put(_LEFT, _FOOT, wrapped(title, WIDTH - 0.8, 8.0, PLAIN)[0], 8.0, PLAIN, _SOFT)
            page.text(
                (_LEFT + WIDTH) / _A4[0], 1.0 - _FOOT / _A4[1], number, fontsize=8.0, family=PLAIN.family, color=_SOFT,
                ha="right", va="baseline",
            )  # fmt: skip
        return self._pages
