"""A report as one HTML file that opens without a network."""

from __future__ import annotations

import html
from collections.abc import Sequence
from importlib import resources
from string import Template

from cosim.report.contents import Contents
from cosim.report.inline_svg import inline_svg
from cosim.report.table import Table
from cosim.results.run_result import REPLAY


def html_report(contents: Contents, about: str, figures: Sequence[tuple[str, str, str]]) -> str:
    """Make the HTML page of a report.

    Parameters
    ----------
    contents : Contents
        Contents of the report.
    about : str
        Line below the title, which describes the run.
    figures : sequence of (str, str, str)
        Name, caption and SVG of each figure.

    Returns
    -------
    str
        The page as HTML.
    """
    template = (resources.files("cosim.report") / "page.html").read_text(encoding="utf-8")
    return Template(template).substitute(
        title=html.escape(contents.title),
        about=f'{html.escape(about)} <a href="{REPLAY}">See it move</a>.',
        asked=html.escape(contents.asked),
        verdict=html.escape(contents.verdict),
        remarks="\n".join(f'<p class="remark">{html.escape(remark)}</p>' for remark in contents.remarks),
        claims=_section(contents.claims, "claims"),
        figures="\n".join(_figure(i + 1, *figure) for i, figure in enumerate(figures)),
        regions=_section(contents.regions, "regions"),
        numbers="\n".join(_section(table, "numbers", "h3") for table in contents.numbers),
        setting=_section(contents.setting, "setting"),
        scenario=html.escape(contents.scenario),
        repeats=html.escape(contents.repeats),
        commands=html.escape("\n".join(contents.repeat)),
        files="Beside this page: " + "; ".join(
            f'<a href="{name}">{name}</a>, {html.escape(what)}'
            for name, what in (
                (REPLAY, "the run to be seen again"), *contents.files, ("figures/", "the figures as vector files"),
            )
        ) + ".",
    )  # fmt: skip


def _section(table: Table | None, name: str, heading: str = "h2") -> str:
    return f"<{heading}>{html.escape(table.title)}</{heading}>\n{_table(table, name)}" if table else ""


def _table(table: Table, name: str) -> str:
    head = "".join(f'<th scope="col">{html.escape(text)}</th>' for text in table.head)
    rows = "\n".join(
        f'<tr><th scope="row">{html.escape(first)}</th>'
        + "".join(f"<td>{html.escape(text)}</td>" for text in rest)
        + "</tr>"
        for first, *rest in table.rows
    )
    kind = name if table.head else f"{name} pairs"
    above = f"<thead><tr>{head}</tr></thead>" if head else ""
    # a wide table scrolls in its own box, also by keyboard
    return (
        f'<div class="wide" tabindex="0" role="region" aria-label="{html.escape(table.title)}"><table class="{kind}">'
        f"{above}<tbody>\n{rows}\n</tbody></table></div>"
    )


def _figure(index: int, name: str, caption: str, svg: str) -> str:
    inline = inline_svg(svg, caption)
    words = f"<b>Figure {index}.</b> {html.escape(caption)}"
    link = f'<a href="figures/{name}.svg">SVG</a>'
    return f'<figure id="{name}"><div tabindex="0">{inline}</div><figcaption>{words} ({link})</figcaption></figure>'
