"""The page of a campaign of scenes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cosim.campaigns.analysis.campaign_summary import LISTED, OF_ALL, SPREADS, rates_of, worst_table
from cosim.campaigns.pages.replays import PageContents, write_page_with_replays
from cosim.campaigns.pages.sections import LABELS
from cosim.campaigns.rerun import complete_results
from cosim.campaigns.scenes.kinds import FEATURES, SceneKinds, scene_kinds
from cosim.campaigns.scenes.scene_rows import SCHEMA
from cosim.campaigns.store.folder import SUMMARY
from cosim.campaigns.store.plan import SCENES
from cosim.campaigns.store.results import Results
from cosim.errors import RunError
from cosim.report.web_page import interval
from cosim.scenario.law_factory import OwnLaw

if TYPE_CHECKING:
    from cosim.report.figures.style import NamedFigure

PAGE = "campaign.html"
FACTS = ("completed", "reached", "violation")  # rates on the page, in this order
_DRAWN = ("completed", "violation")  # rates that are drawn over the features of scenes


def write_campaign_page(folder: Path, replays: int, laws: Sequence[OwnLaw] = ()) -> Path:
    """Write ``campaign.html`` and its figures, and replays of the worst scenes."""

    def compute(summary: dict[str, Any]) -> PageContents:
        if summary.get("kind") != SCENES:
            raise RunError(f"{folder / SUMMARY}: holds no campaign of scenes")
        results = complete_results(folder, SCHEMA)
        kinds, worst = scene_kinds(results), worst_table(results, folder, max(LISTED, replays))
        groups = {"all": summary} | summary["kinds"]
        values = {
            "worst": worst, "groups": groups, "stopped": summary["stopped"] - summary["refused"],
            "kinds": dict(zip(results["seed"].tolist(), kinds.kinds.tolist(), strict=True)),
        }  # fmt: skip
        return PageContents(
            values, _drawings(results, kinds, groups) if worst else [], [row["row"] for row in worst[:replays]],
            [folder], lambda key: f"Scene {key} by the {summary['law']} law",
        )  # fmt: skip

    return write_page_with_replays(folder / PAGE, folder / SUMMARY, compute, laws)


def campaign_lines(summary: dict[str, Any]) -> Iterator[str]:
    """Yield the lines about a campaign for a terminal."""
    s = summary
    yield f"{s['law']}: {s['reached']} of {s['scenes']} scenes reached, {s['violations']} with a violation"
    yield f"completed {interval(s['rates']['completed'])}"
    for worst in s["worst"][:1]:
        yield f"worst: {worst['command']}"


def spreads_of(results: Results, groups: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the values whose distributions are drawn, by column and group; groups (scenes,)."""
    reached, spreads = results["reached"], {}
    for name in SPREADS:
        counts = np.ones(len(results), dtype=bool) if name in (*OF_ALL, "reach_time") else reached
        spreads[name] = {group: results.number(name)[rows & counts] for group, rows in groups.items()}
    return spreads


def _drawings(results: Results, kinds: SceneKinds, groups: Mapping[str, Any]) -> Iterator[NamedFigure]:
    from cosim.campaigns.pages.campaign_figures import Key, Rated, binned_rates, distributions, forest, scatter
    from cosim.report.figures.style import NamedFigure

    labeled = {name if len(groups) > 1 else "": numbers for name, numbers in groups.items()}
    lines = [Rated(fact, label, n["scenes"], n["rates"][fact]) for fact in FACTS for label, n in labeled.items()]
    yield NamedFigure("rates", "How many scenes were completed, reached, and violated a region.", forest(lines))

    which = dict(kinds.groups()) or {"all": np.ones(len(results), dtype=bool)}
    yield from distributions(spreads_of(results, which), "Effort and variation of the thrust: where it was reached.")

    keys = [
        Key(f"{name} [{FEATURES[name]}]" if FEATURES[name] else f"number of {name}", values)
        for name, values in kinds.features.items()
        if np.ptp(values) > 0.0
    ]
    if keys:
        facts = rates_of(results)
        caption = "Outcomes by what the scenes are like, in parts of the range with about as many scenes each."
        if any(0 < facts[name].sum() < len(results) for name in _DRAWN):
            yield NamedFigure("depends", caption, binned_rates(keys, {name: facts[name] for name in _DRAWN}))
        caption = "Least clearance of each scene; below 0 a region is violated."
        column = results.number("min_clearance")
        drawn = scatter(keys, column, LABELS["min_clearance"], facts["reached"], facts["violation"])
        yield NamedFigure("clearances", caption, drawn)
