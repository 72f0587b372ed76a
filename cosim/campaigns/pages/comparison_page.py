"""The page of a comparison of laws."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from controller import LAWS
from cosim.campaigns.analysis.campaign_summary import SPREADS, worst_table
from cosim.campaigns.pages.campaign_page import FACTS, spreads_of
from cosim.campaigns.pages.replays import PageContents, write_page_with_replays
from cosim.campaigns.pages.sections import LABELS
from cosim.campaigns.rerun import complete_results
from cosim.campaigns.scenes.scene_rows import SCHEMA
from cosim.campaigns.store.results import Results
from cosim.errors import RunError
from cosim.scenario.law_factory import OwnLaw

if TYPE_CHECKING:
    from cosim.report.figures.style import NamedFigure

NUMBERS = "compare.json"
PAGE = "compare.html"
_LISTED = 3  # number of worst scenes listed for each law, unless more have replays
_SEEN = ("reach_time", "min_clearance")  # columns that are drawn scene by scene


def _is_law(name: str) -> bool:
    """Return True for the name of a law's folder."""
    return name in LAWS or (Path(name).name == name and "." in name.strip("."))


def write_comparison_page(folder: Path, replays: int, laws: Sequence[OwnLaw] = ()) -> Path:
    """Write ``compare.html`` and its figures, and replays of each law's worst scenes, with all laws on one page."""

    def compute(numbers: dict[str, Any]) -> PageContents:
        laws = numbers.get("laws")
        if not (isinstance(laws, dict) and laws and all(map(_is_law, laws))):
            raise RunError(f"{folder / NUMBERS}: holds no comparison of laws")
        results = {law: complete_results(folder / law, SCHEMA) for law in laws}
        worst = [
            {"law": law, "number": i} | row
            for law, rows in results.items()
            for i, row in enumerate(worst_table(rows, folder / law, max(_LISTED, replays)))
        ]
        return PageContents(
            {"worst": worst}, _drawings(results, numbers) if worst else [],
            dict.fromkeys(row["row"] for row in worst if row["number"] < replays), [folder / law for law in results],
            lambda key: f"Scene {key} by {', '.join(results)}",
        )  # fmt: skip

    return write_page_with_replays(folder / PAGE, folder / NUMBERS, compute, laws)


def _drawings(results: Mapping[str, Results], numbers: dict[str, Any]) -> Iterator[NamedFigure]:
    from cosim.campaigns.pages.campaign_figures import Rated, distributions, forest, side_by_side
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
