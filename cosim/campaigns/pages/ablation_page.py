"""The page of an ablation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cosim.campaigns.ablation import NUMBERS, PAGE, VARIANTS, WHOLE
from cosim.campaigns.analysis.campaign_summary import LISTED
from cosim.campaigns.pages.replays import PageContents, write_page_with_replays
from cosim.campaigns.rerun import complete_results
from cosim.campaigns.scenes.kinds import scene_kinds
from cosim.campaigns.scenes.scene_rows import SCHEMA
from cosim.campaigns.store.results import Results
from cosim.errors import RunError

if TYPE_CHECKING:
    from cosim.report.figures.style import NamedFigure


def write_ablation_page(folder: Path, replays: int) -> Path:
    """Write ``ablation.html`` and its figures, and replays of the scenes that a part changes most."""

    def compute(numbers: dict[str, Any]) -> PageContents:
        variants = numbers.get("variants")
        if not (isinstance(variants, dict) and WHOLE in variants and variants.keys() <= {WHOLE, *VARIANTS}):
            raise RunError(f"{folder / NUMBERS}: holds no ablation")
        results = {name: complete_results(folder / name, SCHEMA) for name in variants}
        changed = _largest_changes(results)[: max(LISTED, replays)]
        worse = [name for name, effect in variants.items() if name != WHOLE and _helps(effect)]
        return PageContents(
            {"changed": changed, "worse": worse, "same": [name for name in variants if name not in (WHOLE, *worse)]},
            _drawings(numbers), [change["seed"] for change in changed[:replays]], [folder / name for name in results],
            lambda key: f"Scene {key} by {', '.join(results)}",
        )  # fmt: skip

    return write_page_with_replays(folder / PAGE, folder / NUMBERS, compute)


def _largest_changes(results: Mapping[str, Results]) -> list[dict[str, Any]]:
    """Return each scene with the variant that changes its weighted violation most, the largest change first."""
    whole = results[WHOLE].number("weighted_violation")
    seeds, kinds = results[WHOLE]["seed"].tolist(), scene_kinds(results[WHOLE]).kinds.tolist()
    changes = [
        {"seed": seeds[i], "kind": kinds[i], "variant": name, "violation": float(other[i]), "whole": float(whole[i])}
        for name, other in ((name, rows.number("weighted_violation")) for name, rows in results.items())
        for i in np.flatnonzero(np.isfinite(other - whole) & (other != whole))
    ]
    changes.sort(key=lambda c: (-abs(c["violation"] - c["whole"]), c["seed"], c["variant"]))
    largest: dict[int, dict[str, Any]] = {}
    for change in changes:
        largest.setdefault(change["seed"], change)
    return list(largest.values())


def _drawings(numbers: dict[str, Any]) -> Iterator[NamedFigure]:
    from cosim.campaigns.pages.campaign_figures import Rated, forest
    from cosim.report.figures.style import NamedFigure

    variants = numbers["variants"].items()
    lines = [Rated(fact, name, n["scenes"], n[fact]) for fact in ("completed", "violation") for name, n in variants]
    yield NamedFigure("rates", "How many scenes each variant completed, and violated a region in.", forest(lines))


def _helps(effect: dict[str, Any]) -> bool:
    """Return True if a part significantly improves completed scenes or weighted violation."""
    pairs, ratio = effect["paired"], effect["weighted_violation"]
    more = pairs["p"] is not None and pairs["p"] < 0.05 and pairs["only_one"] > pairs["only_other"]
    return more or (ratio["high"] is not None and ratio["high"] < 1.0)
