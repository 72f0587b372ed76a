"""The page of an ablation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cosim.campaigns.ablation import NUMBERS, PAGE, VARIANTS, WHOLE
from cosim.campaigns.analysis.worst_rows import LISTED
from cosim.campaigns.pages.replays import Replay, write_page_with_replays
from cosim.campaigns.pages.sections import basis, with_interval
from cosim.campaigns.reruns.repeat import complete_results
from cosim.campaigns.scenes.kinds import scene_kinds
from cosim.campaigns.scenes.rows import SCHEMA
from cosim.campaigns.store.results import Results
from cosim.errors import RunError
from cosim.io.strict_json import read_json, understood
from cosim.report.web_page import Html, Page, code, interval, number, write_figures

if TYPE_CHECKING:
    from cosim.report.figures.style import NamedFigure


def write_ablation_page(folder: Path, replays: int) -> Path:
    """Write ``ablation.html`` and its figures, and replays of the scenes that a part changes most.

    Parameters
    ----------
    folder : Path
        Folder of a complete ablation.
    replays : int
        Number of scenes that all variants fly again step by step.

    Returns
    -------
    Path
        Path of the page.

    Raises
    ------
    RunError
        If the folder holds no ablation, or cannot be written.
    KeyboardInterrupt
        After Ctrl-C; the page is written without the replays.
    """
    numbers = read_json(folder / NUMBERS)
    variants = numbers.get("variants")
    if not (isinstance(variants, dict) and WHOLE in variants and variants.keys() <= {WHOLE, *VARIANTS}):
        raise RunError(f"{folder / NUMBERS}: holds no ablation")
    results = {name: complete_results(folder / name, SCHEMA) for name in variants}
    changed = _changed(results)[: max(LISTED, replays)]
    try:
        with understood(folder / NUMBERS):
            figures = write_figures(folder, _drawings(numbers))
        write_page_with_replays(
            folder / PAGE, folder / NUMBERS, lambda shown: _page(numbers, changed, figures, shown),
            [key for key, *_ in changed[:replays]], [folder / name for name in results],
            lambda key: f"Scene {key} by {', '.join(results)}",
        )  # fmt: skip
    except OSError as error:
        raise RunError(f"{folder}: {error.strerror or error}") from error
    return folder / PAGE


def _changed(results: Mapping[str, Results]) -> list[tuple[int, str, str, float, float]]:
    """Return scenes by difference of weighted violation: seed, kind, variant, and both values; each scene once."""
    whole, found = results[WHOLE].number("weighted_violation"), []
    seeds, kinds = results[WHOLE]["seed"], scene_kinds(results[WHOLE]).kinds
    for name, rows in results.items():
        other = rows.number("weighted_violation")
        found += [
            (abs(other[i] - whole[i]), int(seeds[i]), str(kinds[i]), name, float(whole[i]), float(other[i]))
            for i in np.flatnonzero(np.isfinite(other - whole))
            if name != WHOLE and other[i] != whole[i]
        ]
    once: dict[int, tuple[int, str, str, float, float]] = {}
    for _, seed, *rest in sorted(found, key=lambda of: (-of[0], of[1], of[3])):
        once.setdefault(seed, (seed, *rest))  # type: ignore[arg-type]
    return list(once.values())


def _drawings(numbers: dict[str, Any]) -> Iterator[NamedFigure]:
    from cosim.campaigns.pages.figures import Rated, forest
    from cosim.report.figures.style import NamedFigure

    lines = [
        Rated(fact, name, of["scenes"], of[fact])
        for fact in ("completed", "violation")
        for name, of in numbers["variants"].items()
    ]
    yield NamedFigure("rates", "How many scenes each variant completed, and violated a region in.", forest(lines))


def _page(
    numbers: dict[str, Any],
    changed: list[tuple[int, str, str, float, float]],
    figures: Mapping[str, Html],
    shown: Mapping[int, Replay],
) -> Page:
    variants, n = numbers["variants"], numbers["scenes"]
    page = Page(f"What the parts of the law {numbers['law']} are worth, on {n} scene{'s' if n > 1 else ''}")
    page.verdict(_verdict(variants))
    page.heading("Variants")
    page.add(figures["rates"])
    _table(page, variants)
    page.paragraph(
        "Only whole, only variant: scenes that only one of the two completes, reached without a violation; p by "
        "McNemar's exact test. Weighted violation: mean over the scenes of the integral of how deep each region is "
        "violated, times its priority; ratio: that of the whole law to that of the variant, below 1 where the part "
        "helps. Reach time: median of the whole law's less the variant's, where both complete. Thrust variation: the "
        "same ratio, below 1 where the thrusters are quieter with the part. Intervals are at 95 %, of ratios by the "
        "bootstrap over scenes.",
        faint=True,
    )
    if variants[WHOLE]["kinds"]:
        page.heading("By kind of scene")
        for name, of in variants.items():
            if name != WHOLE:
                page.paragraph(Html(f"{code(name)}: {of['description']}."))
                _table(page, of["kinds"], "kind")
    if changed:
        page.heading("Where it changed most")
        page.table(
            ["scene", "kind", "variant", "weighted violation, m s", "whole law's, m s", "replay"],
            [
                [str(seed), kind, name, number(other), number(whole), shown[seed].cell() if seed in shown else "–"]
                for seed, kind, name, whole, other in changed
            ],
        )
    page.heading("What it rests on")
    page.paragraph(Html(f"Each variant has the folder of a campaign; every number is in {code(NUMBERS)}."))
    basis(page, numbers)
    return page


def _verdict(variants: dict[str, Any]) -> str:
    worse: list[str] = []
    same: list[str] = []
    for name, of in variants.items():
        if name != WHOLE:
            (worse if _helps(of) else same).append(name)
    text = f"The whole law is better than {', '.join(worse)}. " if worse else ""
    if same:
        text += f"On these scenes nothing shows that it is better than {', '.join(same)}."
    return text.strip()


def _helps(of: dict[str, Any]) -> bool:
    """Return True if a part significantly improves completed scenes or weighted violation."""
    pairs, ratio = of["paired"], of["weighted_violation"]
    more = pairs["p"] is not None and pairs["p"] < 0.05 and pairs["only_one"] > pairs["only_other"]
    return more or (ratio["high"] is not None and ratio["high"] < 1.0)


def _table(page: Page, rows: dict[str, Any], first: str = "variant") -> None:
    page.table(
        [
            first, "scenes", "completed", "only whole", "only variant", "p", "weighted violation, m s", "ratio",
            "reach time, s", "thrust variation",
        ],
        [
            [
                name,
                str(of["scenes"]),
                interval(of["completed"]),
                str(of["paired"]["only_one"]),
                str(of["paired"]["only_other"]),
                number(of["paired"]["p"], 2),
                number(of["weighted_violation"]["other"]),
                with_interval(of["weighted_violation"], "ratio", 3),
                with_interval(of["reach_time"], "median", 3),
                with_interval(of["thrust_variation"], "ratio", 3),
            ]
            for name, of in rows.items()
        ],
    )  # fmt: skip
