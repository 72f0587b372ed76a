"""A run as it stands in its folder, whether it was finished, interrupted or killed."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cosim.came import as_it_came
from cosim.errors import RunError
from cosim.record import Record, load_record
from cosim.scenario import Scenario, load_scenario
from cosim.summary import seconds_or_none, summarise

SCENARIO = "scenario.toml"
SUMMARY = "summary.json"
ORDERS = "orders.jsonl"


@dataclass(frozen=True, eq=False)
class FlownRun:
    """A run that is over."""

    path: Path  # its folder
    planned: Scenario  # as its file has it, by the law that flew it
    scenario: Scenario  # as it came: with those obstacles that did, and with the target of the end
    record: Record
    summary: dict[str, Any]


def load_run(path: Path) -> FlownRun:
    """Open a run that is done, was interrupted, or was killed.

    Parameters
    ----------
    path : Path
        The run folder.

    Returns
    -------
    FlownRun
        Its summary is made anew from its record.

    Raises
    ------
    RunError
        If the folder holds no run that can be read.
    ScenarioError
        If its scenario is none.
    """
    if not (path / SCENARIO).is_file():
        raise RunError(f"{path}: holds no run ({SCENARIO} is missing)")
    scenario = load_scenario(path / SCENARIO)
    status, wall_time = "killed", None
    try:
        before = json.loads((path / SUMMARY).read_text(encoding="utf-8"))
        status, wall_time = str(before["status"]), seconds_or_none(before["wall_time"])
        law = dataclasses.replace(scenario.law, name=str(before["law"]))  # or who flew in its place
        scenario = dataclasses.replace(scenario, name=str(before["scenario"]), law=law)
    except FileNotFoundError:
        pass
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise RunError(f"{path / SUMMARY}: cannot be read: {error}") from error
    return flown_run(path, scenario, status, wall_time)


def flown_run(path: Path, scenario: Scenario, status: str, wall_time: float | None) -> FlownRun:
    """Return a run of which is known how it ended.

    Parameters
    ----------
    path : Path
        The run folder.
    scenario : Scenario
        What was run.
    status : str
        How it ended.
    wall_time : float or None
        What the stepping took [s].

    Returns
    -------
    FlownRun
        With its summary.

    Raises
    ------
    RunError
        If the record cannot be read, or is not of this scenario.
    """
    record = load_record(path)
    try:
        time = record["time"]
        if not (np.isfinite(time).all() and (np.diff(time) > 0.0).all()):
            raise RunError(f"{path}: the times of the record do not rise from row to row")
        came = as_it_came(scenario, record)
        summary = summarise(came, record, status, wall_time)
    except KeyError as error:
        raise RunError(f"{path}: the record has no column {error}, which its scenario calls for") from error
    if scenario.commands.enabled:
        summary["orders"] = _lines(path / ORDERS)
    return FlownRun(path, scenario, came, record, summary)


def _lines(file: Path) -> int:
    return len(file.read_bytes().splitlines()) if file.exists() else 0
