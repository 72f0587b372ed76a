"""The page of a campaign of scenes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cosim.campaigns.analysis.summary import OF_ALL, SPREADS, rates_of
from cosim.campaigns.analysis.worst_rows import LISTED, Worst, worst_rows
from cosim.campaigns.pages.replays import Replay, write_page_with_replays
from cosim.campaigns.pages.sections import (
    Group,
    basis,
    quantiles_table,
    rates_table,
    refused_section,
    worst_section,
)
from cosim.campaigns.reruns.repeat import complete_results, require_complete
from cosim.campaigns.scenes.kinds import FEATURES, SceneKinds, scene_kinds
from cosim.campaigns.scenes.rows import SCHEMA
from cosim.campaigns.store.folder import PLAN, RESULTS, SUMMARY, held
from cosim.campaigns.store.plan import SCENES
from cosim.campaigns.store.results import Results
from cosim.errors import RunError
from cosim.io.strict_json import read_json, understood
from cosim.report.web_page import Html, Page, code, interval, wall, write_figures

if TYPE_CHECKING:
    from cosim.report.figures.style import NamedFigure

PAGE = "campaign.html"
FACTS = ("completed", "reached", "violation")  # rates on the page, in this order
_DRAWN = ("completed", "violation")  # rates that are drawn over the features of scenes


def write_campaign_page(folder: Path, replays: int) -> Path:
    """Write ``campaign.html`` and its figures, and replays of the worst scenes.

    Parameters
    ----------
    folder : Path
        Folder of a complete campaign.
    replays : int
        Number of worst scenes that are flown again step by step, each with its own page.

    Returns
    -------
    Path
        Path of the page.

    Raises
    ------
    RunError
        If the folder holds no such campaign, or cannot be written.
    KeyboardInterrupt
        After Ctrl-C; the page is written without the replays.
    """
    require_complete(folder)
    summary = read_json(folder / SUMMARY)
    if summary.get("kind") != SCENES:
        raise RunError(f"{folder / SUMMARY}: holds no campaign of scenes")
    results = complete_results(folder, SCHEMA)
    with held(folder):
        kinds, worst = scene_kinds(results), worst_rows(results, max(LISTED, replays))
        with understood(folder / SUMMARY):
            figures = write_figures(folder, _drawings(results, kinds, summary) if worst else [])
        write_page_with_replays(
            folder / PAGE, folder / SUMMARY,
            lambda shown: _page(folder, results, kinds, summary, worst, figures, shown),
            [w.key for w in worst[:replays]], [folder], lambda key: f"Scene {key} by the {summary['law']} law",
        )  # fmt: skip
    return folder / PAGE


def campaign_lines(summary: dict[str, Any]) -> Iterator[str]:
    """Yield the lines about a campaign for a terminal.

    Parameters
    ----------
    summary : dict
        Summary from `cosim.campaigns.analysis.summary.summarize_campaign`.

    Yields
    ------
    str
        Line without a newline.
    """
    s = summary
    yield f"{s['law']}: {s['reached']} of {s['scenes']} scenes reached, {s['violations']} with a violation"
    yield f"completed {interval(s['rates']['completed'])}"
    for worst in s["worst"][:1]:
        yield f"worst: {worst['command']}"


def group_of(name: str, part: Mapping[str, Any]) -> Group:
    """Return a summary, or the part of it for one kind of scenes, as a row of tables."""
    return Group(name, part["scenes"], part["rates"], part["quantiles"])


def spreads_of(results: Results, groups: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the values whose distributions are drawn, by column and group.

    Parameters
    ----------
    results : Results
        Rows of a campaign.
    groups : mapping from str to ndarray of bool, shape (scenes,)
        Mask of the scenes of each group.

    Returns
    -------
    dict of str to dict of str to ndarray
        Values by column, then by group. Reach times are NaN where the goal was not reached; the other columns that are
        not in `OF_ALL` hold reached scenes only.
    """
    reached, found = results["reached"], {}
    for name in SPREADS:
        counts = np.ones(len(results), dtype=bool) if name in (*OF_ALL, "reach_time") else reached
        found[name] = {group: results.number(name)[of & counts] for group, of in groups.items()}
    return found


def _drawings(results: Results, kinds: SceneKinds, summary: dict[str, Any]) -> Iterator[NamedFigure]:
    from cosim.campaigns.pages.figures import Key, Rated, binned_rates, distributions, forest, scatter
    from cosim.report.figures.style import NamedFigure

    groups = {"all": summary} | summary["kinds"]
    several = len(groups) > 1
    lines = [
        Rated(fact, name if several else "", of["scenes"], of["rates"][fact])
        for fact in FACTS
        for name, of in groups.items()
    ]
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
        drawn = scatter(
            keys, results.number("min_clearance"), "least clearance [m]", facts["reached"], facts["violation"]
        )
        yield NamedFigure("clearances", caption, drawn)


def _page(
    folder: Path,
    results: Results,
    kinds: SceneKinds,
    s: dict[str, Any],
    worst: Sequence[Worst],
    figures: Mapping[str, Html],
    shown: Mapping[int, Replay],
) -> Page:
    n = s["scenes"]
    page = Page(f"The {s['law']} law on {n} scene{'s' if n > 1 else ''}")
    page.verdict(_verdict(s))
    if worst:
        groups = [group_of(name, of) for name, of in ({"all": s} | s["kinds"]).items()]
        page.heading("How often")
        page.add(figures["rates"])
        rates_table(page, "scenes", groups, FACTS)
        text = (
            "Completed: inside the goal region to the end, with no region violated on the way. Intervals are at 95 %, "
        )
        text += "by Wilson."
        if s["kinds"]:
            text += " Kinds: obstacles drift, measurements have noise, a thruster fails; plain is none of it."
        page.paragraph(text, faint=True)
        page.heading("How much")
        page.add(figures.get("distributions", Html("")))
        quantiles_table(page, groups)
        page.paragraph("Quantiles over the scenes that were reached, of the least clearance over all.", faint=True)
        if "clearances" in figures:
            page.heading("What it depends on")
            page.add(figures.get("depends", Html("")))
            page.add(figures["clearances"])
        several = kinds.kinds.tolist() if s["kinds"] else []
        worst_section(page, folder, "scene", worst, shown, dict(zip(results["seed"].tolist(), several, strict=False)))
    refused_section(page, "scene", s["refused"], s["reasons"])
    page.heading("What it rests on")
    page.paragraph(
        Html(
            f"Every scene is a row of {code(RESULTS)}, with its result; every number of this page is in "
            f"{code(SUMMARY)}. The rows follow from the law with its gains, the conditions of the flights, the scenes "
            f"and the code alone, all named in {code(PLAN)}."
        )
    )
    page.table(["", ""], [["gains", _listed(s["gains"])], ["conditions", _listed(s["conditions"])]])
    if s["worst_step_time"] is not None:
        longest = wall(f"{1e3 * s['worst_step_time']:.3g} ms")
        page.paragraph(Html(f"Longest call of the law: {longest}."), faint=True)
    basis(page, s)
    return page


def _verdict(s: dict[str, Any]) -> str:
    flown, done = s["scenes"] - s["refused"], s["rates"]["completed"]
    if not flown:
        return f"None of the {s['scenes']} scenes could be flown."
    text = (
        f"The {s['law']} law completed {done['rows']} of {s['scenes']} scenes, {interval(done)}: it reached the goal "
    )
    text += f"in {s['reached']}, and violated a region in {s['violations']}"
    extra = [f"{s['stopped'] - s['refused']} that the plant stopped"] * (s["stopped"] > s["refused"])
    extra += [f"{s['refused']} that could not be flown"] * bool(s["refused"])
    return text + (f", which counts {' and '.join(extra)}." if extra else ".")


def _listed(table: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} {x:g}" if isinstance(x, float) else f"{name} {x}" for name, x in table.items())
