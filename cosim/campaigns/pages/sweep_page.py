"""The page of a sweep, and the lines that its command prints."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cosim.batch.outcome import FIELDS
from cosim.campaigns.analysis.campaign_summary import LISTED, worst_table
from cosim.campaigns.analysis.statistics import CHANCE
from cosim.campaigns.pages.replays import PageContents, write_page_with_replays
from cosim.campaigns.pages.sections import LABELS
from cosim.campaigns.parameter_sweep import FACTS
from cosim.campaigns.rerun import complete_results
from cosim.campaigns.store.folder import SUMMARY
from cosim.campaigns.store.plan import SWEEP
from cosim.campaigns.store.results import Results
from cosim.campaigns.sweeps.sweep_rows import schema_of
from cosim.errors import RunError
from cosim.report.web_page import interval
from cosim.scenario.law_factory import OwnLaw

if TYPE_CHECKING:
    from cosim.report.figures.style import NamedFigure

PAGE = "sweep.html"
_MIN_SHARE, _MIN_RHO = 0.01, 0.1  # least effects and rank correlations in the table
_SHOWN, _VALUES = 8, 12  # maximum numbers of keys in figures and table, and of values listed for a key


def write_sweep_page(folder: Path, replays: int, laws: Sequence[OwnLaw] = ()) -> Path:
    """Write ``sweep.html`` and its figures, and replays of the worst rows."""

    def compute(summary: dict[str, Any]) -> PageContents:
        if summary.get("kind") != SWEEP or not isinstance(summary.get("vary"), dict):
            raise RunError(f"{folder / SUMMARY}: holds no sweep")
        results = complete_results(folder, schema_of(tuple(summary["vary"])))
        worst = worst_table(results, folder, max(LISTED, replays))
        shown = set(_by_weight(summary)[:_SHOWN])
        ranked = [key for key in summary["vary"] if key in shown]
        rates = {fact: summary[fact] for fact in FACTS}
        values = {
            "worst": worst, "min_rho": _MIN_RHO, "max_values": _VALUES,
            "groups": {"all": {"scenes": summary["flown"], "rates": rates, "quantiles": summary["quantiles"]}},
            "ranked": [summary["words"][key] for key in ranked], "effects": list(_effects(summary, ranked)),
        }  # fmt: skip
        return PageContents(
            values, _drawings(results, summary) if worst else [], [row["row"] for row in worst[:replays]], [folder],
            lambda key: f"Row {key} of the sweep {summary['name']}",
        )  # fmt: skip

    return write_page_with_replays(folder / PAGE, folder / SUMMARY, compute, laws)


def sweep_lines(summary: dict[str, Any]) -> Iterator[str]:
    """Yield the lines about a sweep for a terminal."""
    s = summary
    yield f"{s['name']}: {s['flown']} of {s['rows']} rows flown, {s['refused']} refused, {s['stopped']} stopped early"
    for fact in FACTS:
        yield f"{fact:15} {s[fact]['rows']}: {interval(s[fact])}"
    for name, numbers in s["quantiles"].items():
        if numbers["0.5"] is not None:
            yield f"{name:15} {numbers['0.5']:.4g} {FIELDS[name][1]} ({numbers['0.05']:.4g} to {numbers['0.95']:.4g})"
    if best := s["best"]:
        yield f"best: {best['command']} (settled at {best['settle_time']:.2f} s): {best['changes']}"
    for worst in s["worst"][:1]:
        yield f"worst: {worst['command']}"


def _drawings(results: Results, s: dict[str, Any]) -> Iterator[NamedFigure]:
    from cosim.campaigns.pages.campaign_figures import Key, Rated, binned_rates, distributions, forest, scatter
    from cosim.report.figures.style import NamedFigure

    is_flown = results.is_null("refused")
    lines = [Rated(fact, "", s["flown"], s[fact]) for fact in FACTS]
    caption = "How many rows reached the goal, settled there, and violated a hard region."
    yield NamedFigure("rates", caption, forest(lines))

    columns = {name: {"": results.number(name)[is_flown]} for name in s["quantiles"]}
    yield from distributions(columns, "Rows without a value leave a curve below 100 %.")

    keys = [
        Key(s["words"][name], column, bool(s["vary"][name].get("log")))
        for name in _by_weight(s)
        if np.ptp(column := results.number(name)[is_flown]) > 0.0
    ][:_SHOWN]
    if keys:
        reached, violated = results.fact("reached")[is_flown], results.fact("violated")[is_flown]
        caption = (
            "Outcomes by what varies, in parts of the range with about as many rows each, what matters most first."
        )
        if any(0 < fact.sum() < len(fact) for fact in (reached, violated)):
            yield NamedFigure("depends", caption, binned_rates(keys, {"reached": reached, "violated": violated}))
        for name in ("min_clearance", "reach_time"):
            column = results.number(name)[is_flown]
            if np.isfinite(column).any():
                caption = f"{LABELS[name].partition(' [')[0].capitalize()} of each row by what varies."
                drawn = scatter(keys, column, LABELS[name], reached, violated)
                yield NamedFigure(f"by-{name}".replace("_", "-"), caption, drawn)


def _by_weight(s: dict[str, Any]) -> list[str]:
    """Return the keys by descending effect on the outcomes."""
    outcomes = ("reached", "violated", "min_clearance", "reach_time")

    def weight(key: str) -> float:
        return max(effect["share"] if (effect := s["effects"][key][name]) else 0.0 for name in outcomes)

    return sorted(s["vary"], key=lambda key: -weight(key))


def _effects(s: dict[str, Any], ranked: list[str]) -> Iterator[list[str]]:
    """Yield cells of a table: an outcome, its effect and rank correlation of each key, and what chance reaches."""
    for name in FIELDS:
        effects = [s["effects"][key][name] for key in ranked]
        cells = [_effect(one, s["rank_correlations"][key][name]) for key, one in zip(ranked, effects, strict=True)]
        if any(cells):
            floors = [one["floor"] for one in effects if one]
            yield [LABELS[name], *cells, _format_percent(max(floors)) if floors else "–"]


def _effect(effect: dict[str, float] | None, correlation: dict[str, float] | None) -> str:
    """Format effect and rank correlation of a key and an outcome; an empty text if they are not significant."""
    measures = []
    if effect is not None and effect["share"] >= max(effect["floor"], _MIN_SHARE):
        measures.append(_format_percent(effect["share"]))
    if correlation is not None and abs(correlation["rho"]) >= _MIN_RHO and correlation["p"] < CHANCE:
        measures.append(f"ρ\N{NO-BREAK SPACE}{correlation['rho']:+.2f}".replace("-", "−"))
    return ", ".join(measures)


def _format_percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"
