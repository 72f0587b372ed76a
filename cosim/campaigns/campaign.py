"""A campaign from its scenes to its folder: fly what is not flown yet, join, summarise."""

from __future__ import annotations

import contextlib
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cosim.campaigns.analysis.summary import summarise
from cosim.campaigns.runner import carry_out
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.law_gains import gains_from
from cosim.campaigns.scenes.scene_store import SceneStore
from cosim.campaigns.scenes.work import SceneTask, SceneWork
from cosim.campaigns.store.folder import SUMMARY
from cosim.campaigns.store.results import Results
from cosim.io.atomic_file import write_atomic
from cosim.io.strict_json import json_text


@dataclass(frozen=True)
class Campaign:
    r"""Where a campaign was written, and what it came to.

    Examples
    --------
    >>> from pathlib import Path
    >>> import cosim
    >>> _ = Path("scenes.jsonl").write_text("\n".join(cosim.generate_scenes(2)))
    >>> campaign = cosim.run_campaign(Path("scenes.jsonl"), "pd", Path("pd"))
    >>> campaign.flown, len(campaign.results)
    (2, 2)
    """

    folder: Path
    results: Results
    summary: dict[str, Any]
    flown: int  # scenes, by this call; the rest had been flown before


def run_campaign(
    scenes: Path | SceneStore,
    law: str,
    out: Path,
    conditions: Conditions | None = None,
    gains: Any = None,
    workers: int = 1,
    executor: Executor | None = None,
    progress: bool = False,
) -> Campaign:
    r"""Fly every scene of a file by a law, or those that are left, and write results and summary.

    Parameters
    ----------
    scenes : Path or SceneStore
        A file of one JSON object a line, ``-`` for standard input; or scenes that are read already.
    law : str
        One of those in `controller.LAWS`.
    out : Path
        A folder that does not exist, is empty, or holds the same campaign: as a whole, which writes its summary again,
        or as a part, which goes on.
    conditions : Conditions, optional
        How scenes are flown; default: as they are scored.
    gains : NamedTuple, optional
        Of the law; default: its own.
    workers : int
        Processes. Rows are the same for any number, but for `worst_step_time`.
    executor : concurrent.futures.Executor, optional
        That flies the scenes, in the place of processes of our own.
    progress : bool
        Show a bar, if there is a terminal.

    Returns
    -------
    Campaign
        With a row for each scene.

    Raises
    ------
    ScenarioError
        If the scenes cannot be read, or a seed comes twice.
    RunError
        If there is no such law, the folder holds something else or cannot be written, or processes die whatever they
        fly.
    LawError
        If the law cannot work with the gains.
    BuildError, PlantError
        If there is no FMU of the vehicle.
    KeyboardInterrupt
        After Ctrl-C; what is done is kept.

    Examples
    --------
    >>> from pathlib import Path
    >>> import cosim
    >>> _ = Path("scenes.jsonl").write_text("\n".join(cosim.generate_scenes(2)))
    >>> cosim.run_campaign(Path("scenes.jsonl"), "pd", Path("pd")).summary["scenes"]
    2
    """
    task = SceneTask(law, gains_from(law) if gains is None else gains, conditions or Conditions())
    with contextlib.ExitStack() as stack:
        store = scenes if isinstance(scenes, SceneStore) else stack.enter_context(SceneStore(scenes))
        work = SceneWork(store, task)
        summary: dict[str, Any] = {}

        def conclude(results: Results) -> None:
            summary.update(summarise(work.flown, results, out))
            write_atomic(out / SUMMARY, json_text(summary))

        done = carry_out(work, out, workers, executor, progress, conclude)
    return Campaign(out, done.results, summary, done.flown)
