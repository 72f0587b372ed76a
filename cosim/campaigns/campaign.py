"""A campaign from its scenes to its folder: fly what is not flown yet, join, summarise."""

from __future__ import annotations

import contextlib
import itertools
import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tqdm import tqdm

from cosim.campaigns.folder import SUMMARY, CampaignFolder, write_text
from cosim.campaigns.law_gains import gains_from
from cosim.campaigns.plan import plan_of
from cosim.campaigns.results import Results
from cosim.campaigns.scene_store import SceneStore
from cosim.campaigns.summary import summarise
from cosim.campaigns.workers import Task, fly_all
from cosim.errors import RunError
from cosim.scene_run import Conditions

BATCH = 8  # scenes: some tenths of a second of work, which is what a kill can cost


@dataclass(frozen=True)
class Campaign:
    """Where a campaign was written, and what it came to."""

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
    progress: bool = False,
) -> Campaign:
    """Fly every scene of a file by a law, or those that are left, and write results and summary.

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
        If there is no such law, the folder holds something else, or cannot be written, or a worker dies.
    LawError
        If the law cannot work with the gains.
    BuildError, PlantError
        If there is no FMU of the vehicle.
    KeyboardInterrupt
        After Ctrl-C; what is done is kept.
    """
    if workers < 1:
        raise RunError(f"workers is {workers}, expected 1 or more")
    task = Task(law, gains_from(law) if gains is None else gains, conditions or Conditions())
    with contextlib.ExitStack() as stack:
        store = scenes if isinstance(scenes, SceneStore) else stack.enter_context(SceneStore(scenes))
        flyer = stack.enter_context(task.flyer())
        plan = plan_of(law, task.gains, task.conditions, len(store), store.digest)
        folder = stack.enter_context(CampaignFolder(out, plan))
        try:
            flown = 0
            if folder.complete:
                folder.remove_parts()
                results = folder.results()
            else:
                done = folder.load_parts()
                left = [seed for seed in store.seeds if seed not in done]
                with (
                    _bar(law, len(store), len(done), progress) as bar,
                    contextlib.closing(fly_all(flyer, task, _batches(store, left), workers)) as flights,
                ):
                    for rows in flights:
                        folder.add(rows)
                        flown += len(rows)
                        bar.update(len(rows))
                results = folder.join()
            summary = summarise(plan, results)
            write_text(out / SUMMARY, json.dumps(summary, indent=2) + "\n")
        except OSError as error:
            raise RunError(f"{out}: {error.strerror or error}") from error
    return Campaign(out, results, summary, flown)


def _batches(store: SceneStore, seeds: list[int]) -> Iterator[list[bytes]]:
    remaining = iter(seeds)
    while batch := list(itertools.islice(remaining, BATCH)):
        yield store.lines(batch)


def _bar(law: str, scenes: int, done: int, progress: bool) -> Any:
    return tqdm(
        total=scenes, initial=done, desc=law, unit="scene", disable=None if progress and sys.stderr else True,
        bar_format="{desc} {percentage:3.0f}%|{bar}| {n}/{total} [{elapsed}<{remaining}, {rate_fmt}]",
    )  # fmt: skip
