"""Common sections of the pages of campaigns, sweeps and comparisons."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from cosim.campaigns.analysis.statistics import QUANTILES
from cosim.campaigns.analysis.worst_rows import ORDER, Worst, rerun_command
from cosim.campaigns.pages.replays import Replay
from cosim.report.web_page import Page, code, interval, number

LABELS = {  # names of columns with units
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
    """Rates and quantiles of a group of rows."""

    name: str
    rows: int  # number of rows
    rates: Mapping[str, dict[str, Any]]  # rate of each outcome
    quantiles: Mapping[str, Mapping[str, float | None]]  # quantiles of each column


def rates_table(page: Page, unit: str, groups: Sequence[Group], facts: Sequence[str]) -> None:
    """Add a table of the rate of each fact in each group.

    Parameters
    ----------
    page : Page
        Page to which the table is added.
    unit : str
        Word for rows in the plural, such as ``"scenes"``.
    groups : sequence of Group
        Groups, a row of the table each.
    facts : sequence of str
        Names of the rates, a column of the table each.
    """
    page.table(
        ["", unit, *(_WORDS.get(fact, fact) for fact in facts)],
        [[g.name, str(g.rows), *(interval(g.rates[fact]) for fact in facts)] for g in groups],
    )


def quantiles_table(page: Page, groups: Sequence[Group]) -> None:
    """Add a table of the quantiles of each column with numbers, group below group.

    Parameters
    ----------
    page : Page
        Page to which the table is added.
    groups : sequence of Group
        Groups with quantiles of the same columns.
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
        Page to which the section is added.
    folder : Path
        Folder of the campaign.
    unit : str
        Word for a row, such as ``"scene"``.
    worst : sequence of Worst
        Worst rows, the worst first.
    shown : mapping from int to Replay
        Existing replays by key.
    kinds : mapping from int to str
        Kind of each row by key; empty if all are of one kind.
    """
    page.heading(f"The worst {unit}s")
    page.paragraph(f"{ORDER} A replay shows the flight in the browser.")
    page.table(
        [unit, *(["kind"] if kinds else []), "result", "replay", "command that repeats it"],
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


def with_interval(of: Mapping[str, float | None], name: str, digits: int = 4) -> str:
    """Format the number `name` of a statistic with its interval, a dash for None."""
    if of[name] is None:
        return "–"
    return f"{number(of[name], digits)} ({number(of['low'], digits)} to {number(of['high'], digits)})"


def refused_section(page: Page, unit: str, refused: int, reasons: Mapping[str, str]) -> None:
    """Add a table of the reasons for refusing rows, if there are any.

    Parameters
    ----------
    page : Page
        Page to which the section is added.
    unit : str
        Word for a row, such as ``"scene"``.
    refused : int
        Number of refused rows.
    reasons : mapping from str to str
        Reasons for refusing the first of them, by key.
    """
    if refused:
        page.heading(f"Refused {unit}s")
        first = "" if len(reasons) == refused else f", of which these are the first {len(reasons)}"
        page.paragraph(f"{refused} could not be flown{first}.")
        page.table([unit, "why"], list(reasons.items()))


def basis(page: Page, summary: Mapping[str, Any]) -> None:
    """Add the versions of code and libraries on which the rows depend.

    Parameters
    ----------
    page : Page
        Page to which the versions are added.
    summary : mapping from str to object
        Summary of a campaign, sweep or search, or the numbers of an ablation.
    """
    versions = ", ".join(f"{name} {version}" for name, version in summary["versions"].items())
    page.paragraph(f"Code {summary['code_sha256'][:12]}…; {versions}.", faint=True)
