"""The summary of a sweep as text: a page of Markdown, and the lines that the command prints."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from cosim.campaigns.sweep_summary import FACTS
from cosim.flying.outcome import FIELDS

_TOLD = 0.1  # rank correlations that are worth a place in the table


def sweep_lines(summary: dict[str, Any]) -> Iterator[str]:
    """Yield the lines that tell a sweep on a terminal.

    Parameters
    ----------
    summary : dict
        Of `summarise_sweep`.

    Yields
    ------
    str
        Without its end.
    """
    s = summary
    yield f"{s['name']}: {s['flown']} of {s['rows']} rows flown, {s['refused']} refused, {s['stopped']} stopped early"
    for fact in FACTS:
        yield f"{fact:15} {_rate(s[fact])}"
    for name, found in s["quantiles"].items():
        if found["0.5"] is not None:
            yield f"{name:15} {found['0.5']:.4g} {FIELDS[name][1]} ({found['0.05']:.4g} to {found['0.95']:.4g})"
    for worst in s["worst"][:1]:
        yield f"worst: {worst['command']}"


def sweep_page(summary: dict[str, Any]) -> str:
    """Return the page of a sweep.

    Parameters
    ----------
    summary : dict
        Of `summarise_sweep`.

    Returns
    -------
    str
        Markdown.
    """
    return "\n".join(_page(summary)) + "\n"


def _page(s: dict[str, Any]) -> Iterator[str]:
    yield f"# {s['name']}: a sweep of {s['rows']} rows"
    yield ""
    yield f"Design {s['design']}, seed {s['seed']}, engine {s['engine']}. {s['flown']} rows were flown, {s['refused']}"
    yield f"refused; {s['stopped']} flights stopped early. Intervals are at 95 %, by Wilson."
    if s["reasons"]:
        yield from _table(["refused row", "why"], [[row, why.replace("|", "\\|")] for row, why in s["reasons"].items()])
    yield from _table(["key", "values"], [[f"`{key}`", _range(vary)] for key, vary in s["vary"].items()])
    yield from _table(["rows that", "share"], [[fact, _rate(s[fact])] for fact in FACTS])
    names = [f"{float(q):.0%}".replace("%", " %") for q in next(iter(s["quantiles"].values()))]
    spread = [[f"{name} [{FIELDS[name][1]}]", *map(_number, q.values())] for name, q in s["quantiles"].items()]
    yield from _table(["quantiles", *names], spread)
    yield ""
    yield "## The worst rows"
    rows = [[str(w["row"]), f"{w['why']}, {_told(w)}", f"`{w['command']}`"] for w in s["worst"]]
    yield from _table(["row", "why", "to repeat it"], rows)
    yield ""
    yield "## Which key matters for what"
    yield ""
    yield f"Rank correlations by Spearman; those below {_TOLD} are left out here, all are in `summary.json`."
    outcomes = [name for name in FIELDS if any(_strong(of[name]) for of in s["rank_correlations"].values())]
    table = [
        [f"`{key}`", *(f"{of[name]['rho']:+.2f}" if _strong(of[name]) else "" for name in outcomes)]
        for key, of in s["rank_correlations"].items()
    ]
    yield from _table(["key", *outcomes], table if outcomes else [])


def _table(head: list[str], rows: list[list[str]]) -> Iterator[str]:
    yield ""
    if not rows:
        yield "None."
        return
    yield f"| {' | '.join(head)} |"
    yield f"|{'---|' * len(head)}"
    for row in rows:
        yield f"| {' | '.join(row)} |"


def _range(vary: dict[str, Any]) -> str:
    if "values" in vary:
        return ", ".join(f"{x:g}" for x in vary["values"])
    points = f", {vary['points']} points" if "points" in vary else ""
    return f"{vary['low']:g} to {vary['high']:g}{points}{', logarithmic' if vary['log'] else ''}"


def _rate(rate: dict[str, Any]) -> str:
    if rate["share"] is None:
        return "–"
    return f"{rate['rows']}: {100 * rate['share']:.1f} % ({100 * rate['low']:.1f} to {100 * rate['high']:.1f})"


def _told(worst: dict[str, Any]) -> str:
    name, value = next((name, value) for name, value in worst.items() if name in FIELDS)
    return f"`{name}` {value:.4g} {FIELDS[name][1]}"


def _number(x: float | None) -> str:
    return "–" if x is None else f"{x:.4g}"


def _strong(correlation: dict[str, float] | None) -> bool:
    return correlation is not None and abs(correlation["rho"]) >= _TOLD
