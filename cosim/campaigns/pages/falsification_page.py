"""The page of a search for the worst rows, or of an estimate of a rare event's probability."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cosim.campaigns.pages.replays import Replay, write_page_with_replays
from cosim.campaigns.pages.sections import basis, refused_section
from cosim.campaigns.reruns.repeat import require_complete
from cosim.campaigns.store.folder import PLAN, RESULTS, SUMMARY, held
from cosim.errors import RunError
from cosim.io.strict_json import read_json, understood
from cosim.report.web_page import Html, Page, code, number, write_figures

if TYPE_CHECKING:
    from cosim.report.figures.style import NamedFigure

PAGE = "falsification.html"
_LABELS = {"clearance": "least clearance [m]", "violation": "weighted violation [m s]", "arrival": "arrival [s]"}
_UNITS = {"clearance": "m", "violation": "m s", "arrival": "s"}


def write_falsification_page(folder: Path, replays: int) -> Path:
    """Write ``falsification.html`` and its figure, and replays of the worst rows.

    Parameters
    ----------
    folder : Path
        Folder of a complete search.
    replays : int
        Number of listed worst rows that are flown again step by step, each with its own page.

    Returns
    -------
    Path
        Path of the page.

    Raises
    ------
    RunError
        If the folder holds no such search, or cannot be written.
    KeyboardInterrupt
        After Ctrl-C; the page is written without the replays.
    """
    require_complete(folder)
    summary = read_json(folder / SUMMARY)
    if not isinstance(summary.get("search"), dict):
        raise RunError(f"{folder / SUMMARY}: holds no search")
    with held(folder):
        with understood(folder / SUMMARY):
            figures = write_figures(folder, _drawings(summary))
            worst = [row["row"] for row in summary["worst"]][:replays]
        write_page_with_replays(
            folder / PAGE, folder / SUMMARY, lambda shown: _page(summary, figures, shown), worst, [folder],
            lambda key: f"{summary['title']}: {key}",
        )  # fmt: skip
    return folder / PAGE


def falsification_lines(summary: dict[str, Any]) -> Iterator[str]:
    """Yield the lines about a search for a terminal.

    Parameters
    ----------
    summary : dict
        Summary from `cosim.campaigns.falsification.falsification.run_falsification`.

    Yields
    ------
    str
        Line without a newline.
    """
    s = summary
    if s["estimate"]:
        yield f"{s['title']}: {_estimated(s['estimate'])}, from {s['flown']} flights"
    else:
        for name, found in (("search", s), ("random", s["random"])):
            worst = f", worst {_value(s, found['worst'][0], True)}" if found["worst"] else ""
            yield f"{name + ':':7} {found['flown']} flights, {found['violations']} with a violation{worst}"
    for worst in s["worst"][:1]:
        yield f"worst: {worst['command']}"


def _drawings(s: dict[str, Any]) -> Iterator[NamedFigure]:
    from matplotlib.figure import Figure

    from cosim.campaigns.pages.figures import WIDTH
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
    for name, found, color in (("search", s, BLUE), ("random", s["random"], ORANGE)):
        flights, costs = zip(*[*found["best"], [found["flown"], found["best"][-1][1]]], strict=True)
        axes.step(flights, [_of_cost(s, cost) for cost in costs], where="post", color=color, label=name)
    axes.set(xlabel="flights", ylabel=f"worst so far: {label}")
    axes.legend()
    yield NamedFigure("convergence", "The worst of the search and of random flights, after so many flights.", figure)


def _page(s: dict[str, Any], figures: Mapping[str, Html], shown: Mapping[int, Replay]) -> Page:
    search, unit = s["search"], "scene" if s["kind"] == "scenes" else "row"
    rare = s["estimate"]
    page = Page(f"{s['title']}: {'how rare a violation is' if rare else 'the worst that a search finds'}")
    page.verdict(_verdict(s, unit))
    page.heading("Level by level" if rare else "Flight by flight")
    for figure in figures.values():
        page.add(figure)
    if rare:
        page.paragraph(
            "Adaptive multilevel splitting replaces the half of the flights with more clearance by variations of the "
            "other half, again and again. The interval takes variations of the same first flight for dependent: the "
            f"last ones come from {rare['families']} of the first.",
            faint=True,
        )
        page.table(
            [_LABELS["clearance"], "probability of less"],
            [[number(level), f"{share:.2e}"] for level, share in rare["levels"]],
        )
    else:
        page.paragraph(
            "A tenth of the flights is random. Then CMA-ES searches by turns widely and narrowly, in the generator's "
            "ranges or those given, and normal numbers within three standard deviations. The flights of a search are "
            "no sample: shares of them are no rates.",
            faint=True,
        )
    page.heading(f"The worst {unit}s")
    page.paragraph(f"Of {unit}s that are near to each other, the worst one. A replay shows the flight in the browser.")
    label, random = _LABELS[search["objective"]], s["random"]["worst"] if s["random"] else []
    page.table(
        [f"{unit} found", label, *(["at random", label] if random else []), "replay", "command that repeats it"],
        [
            [
                *_cells(s, found),
                *(_cells(s, drawn) if random else []),
                shown[found["row"]].cell() if found and found["row"] in shown else "–",
                code(found["command"]) if found else "–",
            ]
            for found, drawn in zip_longest(s["worst"], random)
        ],
    )
    refused_section(page, unit, s["refused"], {})
    page.heading("What it rests on")
    page.paragraph(
        Html(
            f"Every flight is a row of {code(RESULTS)}; every number of this page is in {code(SUMMARY)}. "
            f"The rows follow from what {code(PLAN)} names, the seed of the search included."
        )
    )
    page.table(["", ""], [[key.replace("_", " "), str(value)] for key, value in search.items()])
    basis(page, s)
    return page


def _verdict(s: dict[str, Any], unit: str) -> str:
    if s["estimate"]:
        return f"The probability of a violation: {_estimated(s['estimate'])}, from {s['flown']} flights."

    def of(found: dict[str, Any]) -> str:
        worst = f"; the worst is {_value(s, found['worst'][0], True)}" if found["worst"] else ""
        return f"{found['violations']} {unit}s with a violation and {found['not_reached']} that did not arrive{worst}"

    return f"In {s['flown']} flights the search found {of(s)}. As many random ones: {of(s['random'])}."


def _estimated(estimate: Mapping[str, Any]) -> str:
    if not estimate["probability"]:
        return f"below {estimate['high']:.2g} (97.5 %), none was found"
    return f"{estimate['probability']:.2g} ({estimate['low']:.2g} to {estimate['high']:.2g} at 95 %)"


def _cells(s: dict[str, Any], row: dict[str, Any] | None) -> list[str]:
    return [str(row["row"]), _value(s, row)] if row else ["–", "–"]


def _value(s: dict[str, Any], row: dict[str, Any], unit: bool = False) -> str:
    objective = s["search"]["objective"]
    if objective == "arrival" and -row["cost"] >= s["horizon"]:
        return "never"
    return number(_of_cost(s, row["cost"]), 3) + (f" {_UNITS[objective]}" if unit else "")


def _of_cost(s: dict[str, Any], cost: float) -> float:
    return cost if s["search"]["objective"] == "clearance" else -cost
