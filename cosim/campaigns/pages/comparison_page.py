"""The page of a comparison of laws."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from controller import LAWS
from cosim.campaigns.analysis.summary import SPREADS
from cosim.campaigns.analysis.worst_rows import ORDER, Worst, rerun_command, worst_rows
from cosim.campaigns.pages.campaign_page import FACTS, group_of, spreads_of
from cosim.campaigns.pages.replays import Replay, write_page_with_replays
from cosim.campaigns.pages.sections import LABELS, basis, quantiles_table, rates_table, with_interval
from cosim.campaigns.reruns.repeat import complete_results
from cosim.campaigns.scenes.rows import SCHEMA
from cosim.campaigns.store.folder import SUMMARY
from cosim.campaigns.store.results import Results
from cosim.errors import RunError
from cosim.io.strict_json import read_json, understood
from cosim.report.web_page import Html, Page, code, interval, number, wall, write_figures

if TYPE_CHECKING:
    from cosim.report.figures.style import NamedFigure

NUMBERS = "compare.json"
PAGE = "compare.html"
_LISTED = 3  # number of worst scenes listed for each law, unless more have replays
_SEEN = ("reach_time", "min_clearance")  # columns that are drawn scene by scene


def write_comparison_page(folder: Path, replays: int) -> Path:
    """Write ``compare.html`` and its figures, and replays of the worst scenes of each law, with all laws on one page.

    Parameters
    ----------
    folder : Path
        Folder of a complete comparison.
    replays : int
        Number of worst scenes of each law that all laws fly again step by step.

    Returns
    -------
    Path
        Path of the page.

    Raises
    ------
    RunError
        If the folder holds no such comparison, or cannot be written.
    KeyboardInterrupt
        After Ctrl-C; the page is written without the replays.
    """
    numbers = read_json(folder / NUMBERS)
    laws = numbers.get("laws")
    if not (isinstance(laws, dict) and laws and laws.keys() <= LAWS.keys()):
        raise RunError(f"{folder / NUMBERS}: holds no comparison of laws")
    results = {law: complete_results(folder / law, SCHEMA) for law in numbers["laws"]}
    worst = {law: worst_rows(rows, max(_LISTED, replays)) for law, rows in results.items()}
    try:
        with understood(folder / NUMBERS):
            figures = write_figures(folder, _drawings(results, numbers) if any(worst.values()) else [])
        write_page_with_replays(
            folder / PAGE, folder / NUMBERS, lambda shown: _page(folder, numbers, worst, figures, shown),
            dict.fromkeys(w.key for of in worst.values() for w in of[:replays]), [folder / law for law in results],
            lambda key: f"Scene {key} by {', '.join(results)}",
        )  # fmt: skip
    except OSError as error:
        raise RunError(f"{folder}: {error.strerror or error}") from error
    return folder / PAGE


def _drawings(results: Mapping[str, Results], numbers: dict[str, Any]) -> Iterator[NamedFigure]:
    from cosim.campaigns.pages.comparison_figures import side_by_side
    from cosim.campaigns.pages.figures import Rated, distributions, forest
    from cosim.report.figures.style import NamedFigure

    laws = numbers["laws"]
    lines = [Rated(fact, law, of["scenes"], of["rates"][fact]) for fact in FACTS for law, of in laws.items()]
    yield NamedFigure("rates", "How many scenes each law completed, reached, and violated a region in.", forest(lines))
    by_law = {law: spreads_of(rows, {law: np.ones(len(rows), dtype=bool)}) for law, rows in results.items()}
    columns = {name: {law: by_law[law][name][law] for law in laws} for name in SPREADS}
    yield from distributions(columns, "Effort and variation of the thrust: where the law reached the goal.")
    first, *others = laws
    for other in others:
        caption = f"Each scene by its value with {first} (across) and {other} (up). On the line both are equal."
        drawn = side_by_side(first, results[first], other, results[other], [(name, LABELS[name]) for name in _SEEN])
        yield NamedFigure(f"scenes-{first}-{other}", caption, drawn)


def _page(
    folder: Path,
    numbers: dict[str, Any],
    worst: Mapping[str, list[Worst]],
    figures: Mapping[str, Html],
    shown: Mapping[int, Replay],
) -> Page:
    laws, n = numbers["laws"], numbers["scenes"]
    page = Page(f"{', '.join(laws)} on {n} scene{'s' if n > 1 else ''}")
    page.verdict(_verdict(numbers))
    if any(worst.values()):
        groups = [group_of(law, of) for law, of in laws.items()]
        page.heading("How often")
        page.add(figures["rates"])
        rates_table(page, "scenes", groups, FACTS)
        text = (
            "Completed: inside the goal region to the end, with no region violated on the way. Intervals are at 95 %, "
        )
        page.paragraph(text + "by Wilson.", faint=True)
        page.heading("How much")
        page.add(figures.get("distributions", Html("")))
        quantiles_table(page, groups)
        page.paragraph("Quantiles over the scenes that each law reached, of the least clearance over all.", faint=True)
        page.heading("Scene by scene")
        _paired(page, numbers)
        for name, figure in figures.items():
            if name.startswith("scenes-"):
                page.add(figure)
        _completed_by(page, numbers)
        _worst(page, folder, worst, shown)
    page.heading("What it rests on")
    page.paragraph(
        Html(
            f"Each law has a folder of its own, that of a campaign. All laws flew the same scenes; every number of "
            f"this page is in {code(NUMBERS)}, and in {code(SUMMARY)} of each law."
        )
    )
    page.table(
        ["law", "gains", "stopped by the plant", "refused", "longest call"],
        [
            [
                law,
                ", ".join(f"{name} {value:g}" for name, value in of["gains"].items()),
                str(of["stopped"] - of["refused"]),
                str(of["refused"]),
                "–" if of["worst_step_time"] is None else wall(f"{1e3 * of['worst_step_time']:.3g} ms"),
            ]
            for law, of in laws.items()
        ],
    )
    basis(page, next(iter(laws.values())))
    return page


def _verdict(numbers: dict[str, Any]) -> str:
    done = {law: of["rates"]["completed"] for law, of in numbers["laws"].items()}
    text = "; ".join(f"{law} completed {of['rows']}, {interval(of)}" for law, of in done.items())
    return f"Of {numbers['scenes']} scenes {text}."


def _paired(page: Page, numbers: dict[str, Any]) -> None:
    """Add a table of pairs of laws: scenes that only one completes, and differences where both do."""
    page.table(
        ["", "both complete", "only the first", "only the second", "neither", "p", "reach time, s", "effort, N s"],
        [
            [
                " against ".join(of["laws"]),
                *(str(of[name]) for name in ("both", "only_one", "only_other", "neither")),
                number(of["p"], 2),
                *(with_interval(of["differences"][name], "median") for name in ("reach_time", "effort")),
            ]
            for of in numbers["paired"]
        ],
    )
    page.paragraph(
        "p: probability that the scenes which one law alone completes are at least so uneven if both laws are equally "
        "good (McNemar, exact). Last columns: over the scenes that both complete, the median of the first "
        "law's less the second's, with its 95 % interval.",
        faint=True,
    )


def _completed_by(page: Page, numbers: dict[str, Any]) -> None:
    head = ["completed by", "scenes", "beside", "by both", "reach time, s", "beside", "effort, N s", "beside"]
    rows = []
    for pair in numbers["pairs"]:
        one, other = pair["completed_by"], pair["beside"]
        medians = [number(pair[what][law]) for what in ("reach_time", "effort") for law in (one, other)]
        rows.append([one, str(pair["scenes"]), other, str(pair["completed_by_both"]), *medians])
    page.table(head, rows)
    page.paragraph(
        "Medians of both laws over the scenes that the law in the first column completes. A scene that the other law "
        "does not reach counts as infinite.",
        faint=True,
    )


def _worst(page: Page, folder: Path, worst: Mapping[str, list[Worst]], shown: Mapping[int, Replay]) -> None:
    page.heading("The worst scenes of each law")
    page.paragraph(f"{ORDER} A replay shows the flights of all laws in the browser.")
    page.table(
        ["law", "scene", "result", "replay", "command that repeats it"],
        [
            [
                law,
                str(w.key),
                w.why,
                shown[w.key].cell() if w.key in shown else "–",
                code(rerun_command(folder / law, w.key)),
            ]
            for law, of in worst.items()
            for w in of
        ],
    )
