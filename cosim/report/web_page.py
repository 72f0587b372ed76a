"""Pages from templates: one HTML file with its figures, which opens without a network."""

from __future__ import annotations

import math
import shutil
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from cosim.report.inline_svg import inline_svg
from cosim.results.wording import format_number
from plant_fmu.archive import temporary_folder
from plant_fmu.contents.html_templates import make_environment

if TYPE_CHECKING:  # importing Matplotlib takes as long as all other imports together
    from jinja2 import Environment

    from cosim.report.figures.style import NamedFigure


FIGURES = "figures"  # folder of the figures as files


class InlineFigure(NamedTuple):
    """A figure as a page shows it."""

    svg: str  # the ``svg`` element
    caption: str


def render_page(template: str, **values: object) -> str:
    """Return a page from its template and values by name; raise KeyError if one of them is missing."""
    from jinja2 import UndefinedError

    try:
        return _environment().get_template(template).render(values)
    except UndefinedError as error:
        raise KeyError(str(error)) from error


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


def with_interval(of: dict[str, float | None], name: str, digits: int = 4) -> str:
    """Format the number `name` of a statistic with its interval, a dash for None."""
    if of[name] is None:
        return "–"
    return f"{number(of[name], digits)} ({number(of['low'], digits)} to {number(of['high'], digits)})"


def count(n: int, word: str) -> str:
    """Format a number of things."""
    return f"{n} {word}{'' if n == 1 else 's'}"


@cache
def _environment() -> Environment:
    return make_environment(
        number=number, interval=interval, with_interval=with_interval, count=count, format_number=format_number
    )


def write_figures(folder: Path, drawings: Iterable[NamedFigure]) -> dict[str, InlineFigure]:
    """Write figures as SVG below a folder, in place of those of an earlier page; raise OSError, and keep those."""
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


def inline_figure(drawing: NamedFigure, folder: Path, png: bool = False) -> InlineFigure:
    """Write a figure into a folder, and return it as a page shows it."""
    return InlineFigure(inline_svg(drawing.write(folder, png), drawing.caption), drawing.caption)
