"""Sections that the pages of campaigns, sweeps and comparisons have in common."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from cosim.campaigns.analysis.statistics import QUANTILES
from cosim.campaigns.analysis.worst_rows import ORDER, Worst, rerun_command
from cosim.campaigns.pages.replays import Replay
from cosim.report.web_page import Page, code, interval, number

LABELS = {  # of columns: what they are called, with unit
    "reached": "reached the goal",
    "settled": "settled there",
    "violated": "violated a hard region",
    "reach_time": "reach time [s]",
    "settle_time": "settle time [s]",
    "min_clearance": "least clearance [m]",
    "weighted_violation": "weighted violation [m s]",
    "closest_to_goal": "least distance to the goal [m]",
    "effort": "effort [N s]",
    "thrust_variation": "thrust variation [N]",
    "max_force": "greatest force [N]",
    "max_speed": "greatest speed [m/s]",
    "final_x": "position x at the end [m]",
    "final_y": "position y at the end [m]",
    "final_z": "position z at the end [m]",
    "phi1": "estimate of φ1 at the end [N]",
    "phi2": "estimate of φ2 at the end [N m]",
    "phi3": "estimate of φ3 at the end [N m]",
    "phi4": "estimate of φ4 at the end [N m]",
    "stopped_at": "stopped by the plant at [s]",
}
_WORDS = {"violation": "violated a region", "violated": LABELS["violated"]}


class Group(NamedTuple):
    """Some rows, and what they came to."""

    name: str
    rows: int
    rates: Mapping[str, dict[str, Any]]
    quantiles: Mapping[str, Mapping[str, float | None]]


def rates_table(page: Page, unit: str, groups: Sequence[Group], facts: Sequence[str]) -> None:
    """Add how often each fact happens in each group.

    Parameters
    ----------
    page : Page
        That it is added to.
    unit : str
        What the rows are called.
    groups : sequence of Group
        A row each.
    facts : sequence of str
        A column each.
    """
    page.table(
        ["", unit, *(_WORDS.get(fact, fact) for fact in facts)],
        [[g.name, str(g.rows), *(interval(g.rates[fact]) for fact in facts)] for g in groups],
    )


def quantiles_table(page: Page, groups: Sequence[Group]) -> None:
    """Add the quantiles of each number that there is, group below group.

    Parameters
    ----------
    page : Page
        That it is added to.
    groups : sequence of Group
        All with the same numbers.
    """
    there = [name for name in groups[0].quantiles if any(g.quantiles[name]["0.5"] is not None for g in groups)]
    names = ["median" if q == 0.5 else f"{100 * q:g} %" for q in QUANTILES]
    page.table(
        ["", *(["of"] if len(groups) > 1 else []), *names],
        [
            [
                "" if i else LABELS[name],
                *([g.name] if len(groups) > 1 else []),
                *map(number, g.quantiles[name].values()),
            ]
            for name in there
            for i, g in enumerate(groups)
        ],
    )


def worst_section(
    page: Page, folder: Path, unit: str, worst: Sequence[Worst], shown: Mapping[int, Replay], kinds: Mapping[int, str]
) -> None:
    """Add the worst rows, with links to their replays and the commands that repeat them.

    Parameters
    ----------
    page : Page
        That it is added to.
    folder : Path
        Of the campaign.
    unit : str
        What a row is called.
    worst : sequence of Worst
        The rows.
    shown : mapping from int to Replay
        By key; the others have none.
    kinds : mapping from int to str
        What each row is like; empty where they are all alike.
    """
    page.heading(f"The worst {unit}s")
    page.paragraph(f"{ORDER} A replay shows the flight in the browser, moving.")
    page.table(
        [unit, *(["kind"] if kinds else []), "what came of it", "to be seen", "again, with full record"],
        [
            [
                str(w.key),
                *([kinds[w.key]] if kinds else []),
                w.why,
                shown[w.key].cell() if w.key in shown else "–",
                code(rerun_command(folder, w.key)),
            ]
            for w in worst
        ],
    )


def refused_section(page: Page, unit: str, refused: int, reasons: Mapping[str, str]) -> None:
    """Add why rows were refused, if any were.

    Parameters
    ----------
    page : Page
        That it is added to.
    unit : str
        What a row is called.
    refused : int
        How many.
    reasons : mapping from str to str
        Of the first ones, by their key.
    """
    if refused:
        page.heading(f"Refused {unit}s")
        first = "" if len(reasons) == refused else f", of which these are the first {len(reasons)}"
        page.paragraph(f"{refused} could not be flown{first}.")
        page.table([unit, "why"], list(reasons.items()))


def basis(page: Page, summary: Mapping[str, Any]) -> None:
    """Add what the rows rest on.

    Parameters
    ----------
    page : Page
        That it is added to.
    summary : mapping from str to object
        Of a campaign or sweep.
    """
    versions = ", ".join(f"{name} {version}" for name, version in summary["versions"].items())
    page.paragraph(f"Code {summary['code_sha256'][:12]}…; {versions}.", faint=True)
