"""Comparison of several laws on the same scenes, each in a campaign, and in pairs on the scenes that one completes."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from controller import LAWS, Law
from cosim.campaigns.analysis.campaign_summary import median, rates_of
from cosim.campaigns.analysis.statistics import Facts, count_pairs, median_difference
from cosim.campaigns.campaign import run_campaign
from cosim.campaigns.pages.comparison_page import NUMBERS, PAGE
from cosim.campaigns.pages.replays import WORST
from cosim.campaigns.runner import Campaign
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.law_gains import gains_from, label_of, to_law
from cosim.campaigns.scenes.scene_file import SceneStore
from cosim.campaigns.scenes.scene_work import SceneTask
from cosim.campaigns.store.results import Results
from cosim.errors import RunError
from cosim.io.atomic_file import write_atomic
from cosim.io.strict_json import json_text
from cosim.report.web_page import FIGURES
from cosim.scenario.law_factory import OwnLaw


@dataclass(frozen=True)
class Comparison:
    r"""Folder and results of a comparison or an ablation.

    Examples
    --------
    >>> from pathlib import Path
    >>> import cosim
    >>> _ = Path("scenes.jsonl").write_text("\n".join(cosim.generate_scenes(2)))
    >>> comparison = cosim.compare(Path("scenes.jsonl"), ["pd", "sun_cheah"], Path("both"))
    >>> sorted(comparison.campaigns)
    ['pd', 'sun_cheah']
    """

    folder: Path
    campaigns: dict[str, Campaign]  # campaign of each law, or of each variant of the law
    numbers: dict[str, Any]  # content of ``compare.json`` or ``ablation.json``


def compare(
    scenes: str | Path,
    laws: Sequence[str | Law | OwnLaw],
    out: str | Path,
    conditions: Conditions | None = None,
    gains: Mapping[str, Any] | None = None,
    workers: int = 1,
    progress: bool = False,
) -> Comparison:
    r"""Fly the same scenes by several laws, and write the numbers side by side.

    Parameters
    ----------
    scenes : str or Path
        File of the scenes with one JSON object per line; ``-`` for standard input.
    laws : sequence of str or Law
        Two or more laws, each as for `run_campaign`.
    out : str or Path
        A folder that does not exist, is empty, or holds a comparison of the same scenes. It has the folder of a
        campaign for each law, which is continued.
    conditions : Conditions, optional
        Conditions of the flights; default: those of the score.
    gains : mapping from str to NamedTuple, optional
        Gains of each law by its name or file; default: the law's own defaults.
    workers : int
        Number of processes.
    progress : bool
        True to show a bar for each law, if there is a terminal.

    Returns
    -------
    Comparison
        Folder and numbers, with a campaign for each law.

    Raises
    ------
    RunError
        If the laws cannot be compared, or the folder holds something else or cannot be written.
    Exception
        All errors of `run_campaign`.

    Examples
    --------
    >>> from pathlib import Path
    >>> import cosim
    >>> _ = Path("scenes.jsonl").write_text("\n".join(cosim.generate_scenes(2)))
    >>> comparison = cosim.compare(Path("scenes.jsonl"), ["pd", "sun_cheah"], Path("both"))
    >>> sorted(path.name for path in comparison.folder.iterdir() if path.is_dir())
    ['pd', 'sun_cheah']
    """
    of_laws = [to_law(law) for law in laws]
    made = {label_of(law): gains_from(law) for law in of_laws}  # raises an error for an unknown law
    if len(laws) < 2 or len(made) < len(laws):
        raise RunError(f"laws are {', '.join(map(str, of_laws)) or 'none'}, expected two or more, each once")
    out, gains, conditions = Path(out), gains or {}, conditions or Conditions()
    refuse_other_files(out, {NUMBERS, PAGE, *LAWS, *made}, "a comparison")

    def numbers(campaigns: Mapping[str, Campaign]) -> dict[str, Any]:
        results = {law: campaign.results for law, campaign in campaigns.items()}
        return {
            "laws": {law: campaign.summary for law, campaign in campaigns.items()},
            "pairs": [medians_where_completed(one, other, results) for one, other in itertools.permutations(made, 2)],
            "paired": [paired_differences(one, other, results) for one, other in itertools.combinations(made, 2)],
        }

    tasks = {label_of(law): SceneTask(law, gains.get(str(law)) or made[label_of(law)], conditions) for law in of_laws}
    return fly_each(Path(scenes), out, tasks, NUMBERS, numbers, workers, progress)


def fly_each(
    scenes: Path,
    out: Path,
    tasks: Mapping[str, SceneTask],
    file: str,
    compute_numbers: Callable[[Mapping[str, Campaign]], dict[str, Any]],
    workers: int,
    progress: bool,
) -> Comparison:
    """Fly the same scenes by each task, as a campaign in the folder of its name, and write the numbers to a file."""
    with SceneStore(scenes) as store:
        campaigns = {
            name: run_campaign(store, task.law, out / name, task.conditions, task.gains, workers, progress=progress)
            for name, task in tasks.items()
        }
        numbers = {"scenes": len(store), "scenes_sha256": store.digest, **compute_numbers(campaigns)}
    try:
        write_atomic(out / file, json_text(numbers))
    except OSError as error:
        raise RunError(f"{out}: {error.strerror or error}") from error
    return Comparison(out, campaigns, numbers)


def medians_where_completed(one: str, other: str, results: Mapping[str, Results]) -> dict[str, Any]:
    """Compare two laws on the scenes that the first of them completes without a violation."""
    rows = completed_scenes(results[one])
    return {
        "completed_by": one,
        "scenes": int(rows.sum()),
        "beside": other,
        "completed_by_both": int((rows & completed_scenes(results[other])).sum()),
        "reach_time": {law: median(results[law].number("reach_time", missing=np.inf)[rows]) for law in (one, other)},
        "effort": {law: median(results[law].number("effort")[rows]) for law in (one, other)},
    }


def paired_differences(one: str, other: str, results: Mapping[str, Results]) -> dict[str, Any]:
    """Compare two laws scene by scene."""
    by_one, by_other = completed_scenes(results[one]), completed_scenes(results[other])
    both = by_one & by_other
    return {
        "laws": [one, other],
        **count_pairs(by_one, by_other),
        "differences": {
            name: median_difference((results[one].number(name) - results[other].number(name))[both])
            for name in ("reach_time", "effort")
        },
    }


def completed_scenes(results: Results) -> Facts:
    """Return a mask of the scenes that were reached without a violation, shape (scenes,)."""
    return rates_of(results)["completed"]


def refuse_other_files(out: Path, own: set[str], kind: str) -> None:
    """Raise `RunError` if a folder holds files other than `own` and those of pages; `kind` names the expected one."""
    if out.is_dir():
        known = {*own, *(f".{name}" for name in own), FIGURES, WORST}
        others = sorted(p.name for p in out.iterdir() if p.name not in known and not p.name.startswith(f".{FIGURES}"))
        if others:
            raise RunError(f"{out}: holds {others[0]!r}, expected a new folder or that of {kind}")
