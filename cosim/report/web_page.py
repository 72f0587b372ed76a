"""Builder of pages: one HTML file with its figures, which opens without a network."""

from __future__ import annotations

import html
import math
import shutil
from collections.abc import Iterable, Sequence
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

from cosim.report.inline_svg import inline_svg
from cosim.report.report import FIGURES
from plant_fmu.archive import temporary_folder

if TYPE_CHECKING:  # importing Matplotlib takes as long as all other imports together
    from cosim.report.figures.style import NamedFigure

_PAGE = Template("""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>$title</title>
<style>
:root { --ink: #1a1a1a; --faint: #555; --paper: #fff; --line: #ccc; --block: #f5f5f5; --link: #0062a0; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e6e6e6; --faint: #aaa; --paper: #16181a; --line: #444; --block: #262626; --link: #6cbcf0; }
}
body { font: 16px/1.5 Georgia, serif; color: var(--ink); background: var(--paper); }
body { max-width: 46rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; line-height: 1.2; } h2 { font-size: 1.15rem; margin-top: 2.2rem; }
a { color: var(--link); } .faint { color: var(--faint); font-size: .9rem; }
.verdict { border-left: 4px solid var(--link); padding: .2rem 0 .2rem 1rem; font-size: 1.08rem; }
figure { margin: 1.4rem 0; } figure svg { width: 100%; height: auto; display: block; }
figcaption { font-size: .9rem; color: var(--faint); }
.wide { overflow-x: auto; } table { border-collapse: collapse; width: 100%; font-size: .88rem; margin: .8rem 0; }
th, td { text-align: left; vertical-align: top; padding: .35rem .6rem; border-bottom: 1px solid var(--line); }
thead th { border-bottom: 2px solid var(--ink); vertical-align: bottom; }
tbody th { font-weight: normal; } td { font-variant-numeric: tabular-nums; }
code, pre { font-size: .85em; background: var(--block); } code { padding: .1em .3em; overflow-wrap: anywhere; }
pre { padding: .8rem; overflow-x: auto; }
td code { white-space: nowrap; }
</style>
</head>
<body>
<h1>$title</h1>
$body
</body>
</html>
""")


class Html(str):
    """Text that is HTML already; all other text is escaped."""


def code(text: str) -> Html:
    """Format text as code."""
    return Html(f"<code>{html.escape(text)}</code>")


def link(where: str, text: str) -> Html:
    """Format a link; `where` is relative to the page."""
    return Html(f'<a href="{html.escape(where)}">{html.escape(text)}</a>')


def wall(text: str) -> Html:
    """Mark text that depends on the wall clock, which repetitions do not reproduce."""
    return Html(f'<span class="wall">{html.escape(text)}</span>')


def number(x: float | None, digits: int = 4) -> str:
    """Format a number for tables, a dash for None, NaN and infinity."""
    if x is None or not math.isfinite(x):
        return "–"
    text = f"{x:.0f}" if 10**digits <= abs(x) < 1e9 else f"{x:.{digits}g}"
    return text.replace("-", "−")


def interval(rate: dict[str, Any]) -> str:
    """Format a rate of `cosim.campaigns.analysis.statistics.rate` with its interval."""
    if rate["share"] is None:
        return "–"
    return f"{100 * rate['share']:.1f} % ({100 * rate['low']:.1f} to {100 * rate['high']:.1f})"


class Page:
    """A page that is built piece by piece.

    Parameters
    ----------
    title : str
        Title of the page.
    """

    def __init__(self, title: str) -> None:
        self._title = title
        self._pieces: list[str] = []

    def verdict(self, text: str) -> None:
        """Add the sentence with the result."""
        self._pieces.append(f'<p class="verdict">{_escaped(text)}</p>')

    def heading(self, text: str) -> None:
        """Begin a section."""
        self._pieces.append(f"<h2>{_escaped(text)}</h2>")

    def paragraph(self, text: str, faint: bool = False) -> None:
        """Add a paragraph."""
        self._pieces.append(f'<p class="faint">{_escaped(text)}</p>' if faint else f"<p>{_escaped(text)}</p>")

    def block(self, text: str) -> None:
        """Add lines of code."""
        self._pieces.append(f"<pre>{_escaped(text)}</pre>")

    def table(self, head: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
        """Add a table whose first column names the rows."""
        body = "".join(
            f'<tr><th scope="row">{_escaped(first)}</th>{"".join(f"<td>{_escaped(cell)}</td>" for cell in cells)}</tr>'
            for first, *cells in rows
        )
        names = "".join(f'<th scope="col">{_escaped(name)}</th>' for name in head)
        self._pieces.append(
            f'<div class="wide"><table><thead><tr>{names}</tr></thead><tbody>{body}</tbody></table></div>'
        )

    def add(self, piece: Html) -> None:
        """Add a piece of HTML, such as a figure."""
        self._pieces.append(piece)

    def html(self) -> str:
        """Return the whole page."""
        return _PAGE.substitute(title=html.escape(self._title), body="\n".join(self._pieces))


def write_figures(folder: Path, drawings: Iterable[NamedFigure]) -> dict[str, Html]:
    """Write figures as SVG below a folder, and replace those of an earlier page.

    Parameters
    ----------
    folder : Path
        Folder of the campaign.
    drawings : iterable of NamedFigure
        The figures; they are drawn while they are written.

    Returns
    -------
    dict of str to Html
        HTML of each figure with its caption, by name.

    Raises
    ------
    OSError
        If the figures cannot be written; the earlier ones stay.
    """
    import matplotlib as mpl

    from cosim.report.figures.style import STYLE

    with temporary_folder(f".{FIGURES}-", folder) as scratch:
        with mpl.rc_context(STYLE):  # applies while figures are drawn and written
            shown = {drawing.name: inline_figure(drawing, scratch) for drawing in drawings}
        scratch.chmod(0o755)
        shutil.rmtree(folder / FIGURES, ignore_errors=True)
        if shown:
            scratch.replace(folder / FIGURES)
    return shown


def inline_figure(drawing: NamedFigure, folder: Path) -> Html:
    """Write a figure into a folder, and return it as HTML with its caption."""
    inline = inline_svg(drawing.write(folder), drawing.caption)
    return Html(f"<figure>{inline}<figcaption>{html.escape(drawing.caption)}</figcaption></figure>")


def _escaped(text: str) -> str:
    return text if isinstance(text, Html) else html.escape(text).replace(" %", "\N{NO-BREAK SPACE}%")
