"""A campaign of scenes: fly the scenes that are left, join the rows, and write the summary."""

from __future__ import annotations

import contextlib
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

from controller import Law
from cosim.campaigns.analysis.campaign_summary import summarize_campaign
from cosim.campaigns.runner import Campaign, carry_out
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.law_gains import gains_from, to_law
from cosim.campaigns.scenes.scene_file import SceneStore
from cosim.campaigns.scenes.scene_work import SceneTask, SceneWork
from cosim.scenario.law_factory import OwnLaw


def run_campaign(
    scenes: str | Path | SceneStore,
    law: str | Law | OwnLaw,
    out: str | Path,
    conditions: Conditions | None = None,
    gains: Any = None,
    workers: int = 1,
    executor: Executor | None = None,
    progress: bool = False,
) -> Campaign:
    r"""Fly the scenes of a file by a law, skipping finished ones, and write results and summary.

    Parameters
    ----------
    scenes : str, Path or SceneStore
        File of the scenes with one JSON object per line, ``-`` for standard input; or a store of scenes read before.
    law : str or Law
        Name of the law, a key of `controller.LAWS`; the .fmu file of one, or a scenario's file whose law is an FMU;
        ``"file.py:name"`` of a law, a function, or a class; or a law, such as a `FunctionLaw`. Each flight has a copy.
    out : str or Path
        A folder that does not exist, is empty, or holds the same campaign. A complete one gets its summary again, a
        partial one is continued.
    conditions : Conditions, optional
        Conditions of the flights; default: those of the score.
    gains : NamedTuple, optional
        Gains of the law; default: its own defaults.
    workers : int
        Number of processes. The rows do not depend on it, except for `worst_step_time`.
    executor : concurrent.futures.Executor, optional
        Executor that flies the scenes, instead of processes started here.
    progress : bool
        True to show a bar, if there is a terminal.

    Returns
    -------
    Campaign
        Folder, rows and summary, with a row for each scene.

    Raises
    ------
    ScenarioError
        If the scenes cannot be read, or two have the same seed.
    RunError
        If there is no such law, the folder holds something else or cannot be written, or processes crash with any
        scene.
    LawError
        If the law refuses the gains.
    BuildError, PlantError
        If there is no FMU of the vehicle.
    KeyboardInterrupt
        After Ctrl-C; finished scenes are kept.

    Examples
    --------
    >>> from pathlib import Path
    >>> import cosim
    >>> _ = Path("scenes.jsonl").write_text("\n".join(cosim.generate_scenes(2)))
    >>> cosim.run_campaign(Path("scenes.jsonl"), "pd", Path("pd")).summary["scenes"]
    2
    """
    out = Path(out)
    made = to_law(law)
    task = SceneTask(made, gains_from(made) if gains is None else gains, conditions or Conditions())
    with contextlib.ExitStack() as stack:
        store = scenes if isinstance(scenes, SceneStore) else stack.enter_context(SceneStore(Path(scenes)))
        work = SceneWork(store, task)
        return carry_out(
            work, out, lambda results: summarize_campaign(work.plan, results, out), workers, executor, progress
        )
