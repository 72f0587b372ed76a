"""A run as it stands in its folder, whether it was finished, interrupted or killed."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from controller import LAWS
from cosim.errors import RunError
from cosim.io.strict_json import read_json
from cosim.results.as_flown import scenario_as_flown
from cosim.results.record import Record, load_record
from cosim.results.required_columns import require_columns
from cosim.results.summary import summarise
from cosim.scenario.scenario import Scenario, load_scenario
from plant_fmu.errors import printable

SCENARIO = "scenario.toml"
SUMMARY = "summary.json"
COMMANDS_LOG = "commands.jsonl"

_LONGEST = 1e12  # s, of the wall clock


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
    if (path / SUMMARY).exists():
        scenario, status, wall_time = _concluded(path / SUMMARY, scenario)
    return flown_run(path, scenario, status, wall_time)


def _concluded(file: Path, scenario: Scenario) -> tuple[Scenario, str, float | None]:
    """Return the scenario by who flew it, how that ended, and what it took [s], as the summary has them."""
    before = read_json(file)
    name, law, status = (_text(file, before, key) for key in ("scenario", "law", "status"))
    # an autopilot flies in the law's place, but nothing of it could be commanded
    if law != scenario.law.name and (law in LAWS or scenario.commands.enabled):
        raise RunError(f"{file}: law is {law!r}, expected {scenario.law.name!r} as in {SCENARIO}")
    took = before.get("wall_time")
    if not (took is None or (type(took) in (int, float) and 0.0 <= took < _LONGEST)):
        raise RunError(f"{file}: wall_time is {took!r}, expected seconds, or null")
    flown = dataclasses.replace(scenario, name=name, law=dataclasses.replace(scenario.law, name=law))
    return flown, status, None if took is None else float(took)


def _text(file: Path, summary: dict[str, Any], key: str) -> str:
    """Return a text of a summary, which a terminal will only show."""
    if key not in summary:
        raise RunError(f"{file}: {key} is missing, expected the summary of a run")
    if not isinstance(summary[key], str):
        raise RunError(f"{file}: {key} is {summary[key]!r}, expected a text")
    return printable(summary[key])


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
    require_columns(scenario, record)
    last = -np.inf
    for block in record.blocks(["time"]):
        time = block["time"]
        if not (np.isfinite(time).all() and (np.diff(time, prepend=last) > 0.0).all()):
            raise RunError(f"{path}: the times of the record do not rise from row to row")
        last = time[-1]
    came = scenario_as_flown(scenario, record)
    summary = summarise(came, record, status, wall_time)
    if scenario.commands.enabled:
        summary["commands"] = _lines(path / COMMANDS_LOG)
    return FlownRun(path, scenario, came, record, summary)


def _lines(file: Path) -> int:
    return len(file.read_bytes().splitlines()) if file.exists() else 0
