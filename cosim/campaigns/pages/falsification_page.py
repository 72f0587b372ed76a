"""The page of a search for the worst rows, or of an estimate of a rare event's probability."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cosim.campaigns.pages.replays import PageContents, write_page_with_replays
from cosim.campaigns.store.folder import SUMMARY
from cosim.errors import RunError
from cosim.report.web_page import number
from cosim.scenario.law_factory import OwnLaw

if TYPE_CHECKING:
    from cosim.report.figures.style import NamedFigure

PAGE = "falsification.html"
_LABELS = {"clearance": "minimum clearance [m]", "violation": "weighted violation [m s]", "arrival": "arrival [s]"}
_UNITS = {objective: label[label.index("[") + 1 : -1] for objective, label in _LABELS.items()}


def write_falsification_page(folder: Path, replays: int, laws: Sequence[OwnLaw] = ()) -> Path:
    """Write ``falsification.html`` and its figure, and replays of the worst rows."""

    def compute(summary: dict[str, Any]) -> PageContents:
        if not isinstance(summary.get("search"), dict):
            raise RunError(f"{folder / SUMMARY}: holds no search")
        random = summary["random"]["worst"] if summary["random"] else []
        values = {
            "unit": "scene" if summary["kind"] == "scenes" else "row", "random": random,
            "label": _LABELS[summary["search"]["objective"]], "worst": list(zip_longest(summary["worst"], random)),
            "estimate": _format_estimate(summary["estimate"]) if summary["estimate"] else "",
            "value": lambda row, unit=False: _value(summary, row, unit),
        }  # fmt: skip
        keys = [row["row"] for row in summary["worst"]][:replays]
        return PageContents(values, _drawings(summary), keys, [folder], lambda key: f"{summary['title']}: {key}")

    return write_page_with_replays(folder / PAGE, folder / SUMMARY, compute, laws)


def falsification_lines(summary: dict[str, Any]) -> Iterator[str]:
    """Yield the lines about a search for a terminal."""
    s = summary
    if s["estimate"]:
        yield f"{s['title']}: {_format_estimate(s['estimate'])}, from {s['flown']} flights"
    else:
        for name, numbers in (("search", s), ("random", s["random"])):
            worst = f", worst {_value(s, numbers['worst'][0], True)}" if numbers["worst"] else ""
            yield f"{name + ':':7} {numbers['flown']} flights, {numbers['violations']} with a violation{worst}"
    for worst in s["worst"][:1]:
        yield f"worst: {worst['command']}"


def _drawings(s: dict[str, Any]) -> Iterator[NamedFigure]:
    from matplotlib.figure import Figure

    from cosim.campaigns.pages.campaign_figures import WIDTH
    from cosim.report.figures.style import BLUE, ORANGE, NamedFigure

    figure = Figure(figsize=(WIDTH, 3.0), layout="constrained")
    axes = figure.add_subplot()
    label = _LABELS[s["search"]["objective"]]
    if s["estimate"]:
        levels = s["estimate"]["levels"]
        axes.semilogy([cost for cost, _ in levels], [share for _, share in levels], color=BLUE, marker="o", ms=3)
        axes.set(xlabel=label, ylabel="probability of less")
        yield NamedFigure("levels", "How likely a flight comes as near or nearer, level by level.", figure)
        return
    for name, numbers, color in (("search", s, BLUE), ("random", s["random"], ORANGE)):
        if best := numbers["best"]:  # empty if every flight was refused
            flights, costs = zip(*[*best, [numbers["flown"], best[-1][1]]], strict=True)
            axes.step(flights, [_outcome_from_cost(s, cost) for cost in costs], where="post", color=color, label=name)
    if not axes.lines:
        return
    axes.set(xlabel="flights", ylabel=f"worst so far: {label}")
    axes.legend()
    yield NamedFigure("convergence", "The worst of the search and of random flights, after so many flights.", figure)


def _format_estimate(estimate: Mapping[str, Any]) -> str:
    if not estimate["probability"]:
        return f"below {estimate['high']:.2g} (97.5 %), none was found"
    return f"{estimate['probability']:.2g} ({estimate['low']:.2g} to {estimate['high']:.2g} at 95 %)"


def _value(s: dict[str, Any], row: dict[str, Any] | None, unit: bool = False) -> str:
    if row is None:
        return "–"
    objective = s["search"]["objective"]
    if objective == "arrival" and -row["cost"] >= s["horizon"]:
        return "never"
    return number(_outcome_from_cost(s, row["cost"]), 3) + (f" {_UNITS[objective]}" if unit else "")


def _outcome_from_cost(s: dict[str, Any], cost: float) -> float:
    return cost if s["search"]["objective"] == "clearance" else -cost
