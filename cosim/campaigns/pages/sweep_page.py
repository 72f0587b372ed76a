"""The page of a sweep, and the lines that its command prints."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cosim.batch.outcome import FIELDS
from cosim.campaigns.analysis.statistics import CHANCE
from cosim.campaigns.analysis.worst_rows import LISTED, Worst, worst_rows
from cosim.campaigns.pages.replays import Replay, write_page_with_replays
from cosim.campaigns.pages.sections import (
    LABELS,
    Group,
    basis,
    quantiles_table,
    rates_table,
    refused_section,
    worst_section,
)
from cosim.campaigns.reruns.repeat import complete_results, require_complete
from cosim.campaigns.store.folder import PLAN, RESULTS, SUMMARY, held
from cosim.campaigns.store.plan import SWEEP
from cosim.campaigns.store.results import Results
from cosim.campaigns.sweeps.rows import schema_of
from cosim.campaigns.sweeps.summary import FACTS
from cosim.errors import RunError
from cosim.io.strict_json import read_json, understood
from cosim.report.web_page import Html, Page, code, interval, number, write_figures
from cosim.results.run_result import SCENARIO

if TYPE_CHECKING:
    from cosim.report.figures.style import NamedFigure

PAGE = "sweep.html"
_LEAST_SHARE, _LEAST_RHO = 0.01, 0.1  # least effects and rank correlations in the table
_SHOWN, _VALUES = 8, 12  # greatest numbers of keys in figures and table, and of values listed for a key


def write_sweep_page(folder: Path, replays: int) -> Path:
    """Write ``sweep.html`` and its figures, and replays of the worst rows.

    Parameters
    ----------
    folder : Path
        Folder of a complete sweep.
    replays : int
        Number of worst rows that are flown again step by step, each with its own page.

    Returns
    -------
    Path
        Path of the page.

    Raises
    ------
    RunError
        If the folder holds no such sweep, or cannot be written.
    KeyboardInterrupt
        After Ctrl-C; the page is written without the replays.
    """
    require_complete(folder)
    summary = read_json(folder / SUMMARY)
    if summary.get("kind") != SWEEP or not isinstance(summary.get("vary"), dict):
        raise RunError(f"{folder / SUMMARY}: holds no sweep")
    with understood(folder / SUMMARY):
        schema = schema_of(tuple(summary["vary"]))
    results = complete_results(folder, schema)
    with held(folder):
        worst = worst_rows(results, max(LISTED, replays))
        with understood(folder / SUMMARY):
            figures = write_figures(folder, _drawings(results, summary) if worst else [])
        write_page_with_replays(
            folder / PAGE, folder / SUMMARY, lambda shown: _page(folder, summary, worst, figures, shown),
            [w.key for w in worst[:replays]], [folder], lambda key: f"Row {key} of the sweep of {summary['name']}",
        )  # fmt: skip
    return folder / PAGE


def sweep_lines(summary: dict[str, Any]) -> Iterator[str]:
    """Yield the lines about a sweep for a terminal.

    Parameters
    ----------
    summary : dict
        Summary from `summarize_sweep`.

    Yields
    ------
    str
        Line without a newline.
    """
    s = summary
    yield f"{s['name']}: {s['flown']} of {s['rows']} rows flown, {s['refused']} refused, {s['stopped']} stopped early"
    for fact in FACTS:
        yield f"{fact:15} {s[fact]['rows']}: {interval(s[fact])}"
    for name, found in s["quantiles"].items():
        if found["0.5"] is not None:
            yield f"{name:15} {found['0.5']:.4g} {FIELDS[name][1]} ({found['0.05']:.4g} to {found['0.95']:.4g})"
    for worst in s["worst"][:1]:
        yield f"worst: {worst['command']}"


def _drawings(results: Results, s: dict[str, Any]) -> Iterator[NamedFigure]:
    from cosim.campaigns.pages.figures import Key, Rated, binned_rates, distributions, forest, scatter
    from cosim.report.figures.style import NamedFigure

    flown = results.absent("refused")
    lines = [Rated(fact, "", s["flown"], s[fact]) for fact in FACTS]
    yield NamedFigure(
        "rates", "How many rows reached the goal, settled there, and violated a hard region.", forest(lines)
    )

    columns = {name: {"": results.number(name)[flown]} for name in s["quantiles"]}
    yield from distributions(columns, "Rows without a value leave a curve below 100 %.")

    keys = [
        Key(s["words"][name], column, bool(s["vary"][name].get("log")))
        for name in _by_weight(s)
        if np.ptp(column := results.number(name)[flown]) > 0.0
    ][:_SHOWN]
    if keys:
        reached, violated = results.fact("reached")[flown], results.fact("violated")[flown]
        caption = (
            "Outcomes by what varies, in parts of the range with about as many rows each; what matters most first."
        )
        if any(0 < fact.sum() < len(fact) for fact in (reached, violated)):
            yield NamedFigure("depends", caption, binned_rates(keys, {"reached": reached, "violated": violated}))
        for name in ("min_clearance", "reach_time"):
            column = results.number(name)[flown]
            if _any(column):
                caption = f"{LABELS[name].partition(' [')[0].capitalize()} of each row by what varies."
                drawn = scatter(keys, column, LABELS[name], reached, violated)
                yield NamedFigure(f"by-{name}".replace("_", "-"), caption, drawn)


def _any(values: Any) -> bool:
    return bool(np.isfinite(values).any())


def _by_weight(s: dict[str, Any]) -> list[str]:
    """Return the keys by descending effect on the outcomes."""
    outcomes = ("reached", "violated", "min_clearance", "reach_time")

    def weight(key: str) -> float:
        return max(of["share"] if (of := s["effects"][key][name]) else 0.0 for name in outcomes)

    return sorted(s["vary"], key=lambda key: -weight(key))


def _page(
    folder: Path, s: dict[str, Any], worst: Sequence[Worst], figures: Mapping[str, Html], shown: Mapping[int, Replay]
) -> Page:
    page = Page(f"{s['name']}: a sweep of {s['rows']} row{'s' if s['rows'] > 1 else ''}")
    page.verdict(_verdict(s))
    page.table(
        ["what varies", "key", "values"],
        [[s["words"][key], code(key), _range(vary)] for key, vary in s["vary"].items()],
    )
    page.paragraph(f"Scenario: {s['title']}, but for what varies.", faint=True)
    page.paragraph(f"Design {s['design']}, seed {s['seed']}, engine {s['engine']}.", faint=True)
    if worst:
        group = Group("all", s["flown"], {fact: s[fact] for fact in FACTS}, s["quantiles"])
        page.heading("How often")
        page.add(figures["rates"])
        rates_table(page, "rows flown", [group], FACTS)
        page.paragraph("Of the rows that were flown; intervals are at 95 %, by Wilson.", faint=True)
        page.heading("How much")
        page.add(figures.get("distributions", Html("")))
        quantiles_table(page, [group])
        page.heading("Which key matters for what")
        for name in ("depends", "by-min-clearance", "by-reach-time"):
            page.add(figures.get(name, Html("")))
        _effects(page, s)
        worst_section(page, folder, "row", worst, shown, {})
    refused_section(page, "row", s["refused"], s["reasons"])
    page.heading("What it rests on")
    page.paragraph(
        Html(
            f"Every row is in {code(RESULTS)}, every number of this page in {code(SUMMARY)}. What stays is in "
            f"{code(SCENARIO)}, what varies and how in {code(PLAN)}."
        )
    )
    basis(page, s)
    return page


def _verdict(s: dict[str, Any]) -> str:
    if not s["flown"]:
        return f"None of the {s['rows']} rows could be flown."
    text = (
        f"Of {s['flown']} rows that were flown, {s['reached']['rows']} reached the goal, {interval(s['reached'])}, and "
    )
    text += f"{s['violated']['rows']} violated a hard region, {interval(s['violated'])}."
    if s["stopped"]:
        text += f" {s['stopped']} were stopped early by the plant."
    return text + (f" {s['refused']} were refused." if s["refused"] else "")


def _effects(page: Page, s: dict[str, Any]) -> None:
    """Add a table of the effects and rank correlations of the most important keys with each outcome."""
    ranked = set(_by_weight(s)[:_SHOWN])
    keys, rows = [key for key in s["vary"] if key in ranked], []
    for name in FIELDS:
        effects = [s["effects"][key][name] for key in keys]
        cells = [_effect(of, s["rank_correlations"][key][name]) for key, of in zip(keys, effects, strict=True)]
        if any(cells):
            floors = [of["floor"] for of in effects if of]
            rows.append([LABELS[name], *cells, _percent(max(floors)) if floors else "–"])
    if not rows:
        page.paragraph("No outcome depends on a key alone by more than chance.")
        return
    page.table(["", *(s["words"][key] for key in keys), "chance reaches"], rows)
    page.paragraph(
        "In percent: the share of an outcome's variance that goes with a key alone, whether up, down or both (its "
        "first-order Sobol' index, estimated by a line in each bin of the key). The rest goes with several keys "
        "together, or with what is random. The last column is what chance reaches in one cell of a hundred; shares "
        "below it are left out. ρ: rank correlation by Spearman, above 0 where the outcome goes up with the key; left "
        f"out within {number(_LEAST_RHO)} of 0, and where chance gives as much in one cell of a hundred. All are in "
        "summary.json" + (f", with the other {more} keys." if (more := len(s["vary"]) - len(keys)) else "."),
        faint=True,
    )


def _effect(effect: dict[str, float] | None, correlation: dict[str, float] | None) -> str:
    """Format effect and rank correlation of a key and an outcome; an empty text if they are not significant."""
    measures = []
    if effect is not None and effect["share"] >= max(effect["floor"], _LEAST_SHARE):
        measures.append(_percent(effect["share"]))
    if correlation is not None and abs(correlation["rho"]) >= _LEAST_RHO and correlation["p"] < CHANCE:
        measures.append(f"ρ\N{NO-BREAK SPACE}{correlation['rho']:+.2f}".replace("-", "−"))
    return ", ".join(measures)


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"


def _range(vary: dict[str, Any]) -> str:
    if len(vary.get("values", ())) > _VALUES:
        return f"{len(vary['values'])} values, {min(vary['values']):.4g} to {max(vary['values']):.4g}"
    if "values" in vary:
        return ", ".join(f"{x:g}" for x in vary["values"])
    points = f", {vary['points']} points" if "points" in vary else ""
    return f"{vary['low']:g} to {vary['high']:g}{points}{', logarithmic' if vary['log'] else ''}"
