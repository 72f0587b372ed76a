"""A run in its folder, finished, interrupted or killed."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from controller import LAWS
from cosim.errors import RunError
from cosim.io.strict_json import read_json
from cosim.results.as_flown import scenario_as_flown
from cosim.results.log_facts import IMPORT
from cosim.results.record import RECORD, Record, load_record
from cosim.results.recorder import record_schema
from cosim.results.required_columns import require_columns
from cosim.results.signal_plot import plot_signals
from cosim.results.summary import summarize
from cosim.scenario.scenario import Scenario, load_scenario
from plant_fmu.errors import printable
from plant_fmu.installing import install_hint

SCENARIO = "scenario.toml"
SUMMARY = "summary.json"
COMMANDS_LOG = "commands.jsonl"
REPORT = "report.html"
REPLAY = "replay.html"
SYSTEM = "system.ssp"  # copy of a system of FMUs that was run

_MAX_WALL_TIME = 1e12  # s, bound of a plausible wall-clock time


@dataclass(frozen=True, eq=False)
class Run:
    """A run in its folder: finished, interrupted or killed.

    Examples
    --------
    >>> import cosim
    >>> run = cosim.run_scenario(cosim.load_scenario("paper", ["time.duration=0.2"]), "run", report=False)
    >>> run.summary["status"], run.summary["reached"]
    ('completed', False)
    >>> run.table().num_rows
    201
    """

    folder: Path
    planned: Scenario  # scenario of its file, with the law that flew it
    scenario: Scenario  # as flown: with the obstacles that were added, and with the last target
    record: Record  # signals over time, read at their first use
    summary: dict[str, Any]

    def files(self) -> dict[str, Path]:
        """Return the existing files of the run, by kind."""
        named = {"scenario": SCENARIO, "record": RECORD, "summary": SUMMARY, "report": REPORT, "replay": REPLAY}
        named |= {"commands": COMMANDS_LOG, "import": IMPORT}
        return {what: self.folder / name for what, name in named.items() if (self.folder / name).exists()}

    def table(self) -> Any:
        """Return the record as an Arrow table.

        Returns
        -------
        pyarrow.Table
            A row per step, a column per signal; each field's metadata has its ``unit``.
        """
        columns = self.record.columns
        return pa.table([self.record[column.name] for column in columns], schema=record_schema(columns))

    def frame(self) -> Any:
        """Return the record as a pandas data frame.

        Returns
        -------
        pandas.DataFrame
            A row per step, a column per signal.

        Raises
        ------
        RunError
            If pandas is not installed.
        """
        try:
            import pandas as pd
        except ImportError as error:
            command = install_hint("pandas>=2.2")
            raise RunError(f"a data frame needs pandas, of the extra notebook: {command}") from error
        return pd.DataFrame({column.name: self.record[column.name] for column in self.record.columns})

    def plot(self, *signals: str, ax: Any = None) -> Any:
        """Draw signals over time, each unit in axes of its own, one below the other.

        Parameters
        ----------
        *signals : str
            Names, or patterns such as ``"weight.*"``. Default: the clearance of the goal and of each region.
        ax : matplotlib.axes.Axes, optional
            Axes to draw signals of one unit into; default: new ones.

        Returns
        -------
        matplotlib.axes.Axes
            Axes with a line for each signal of the first unit; ``ax.figure.axes`` has those of all units.

        Raises
        ------
        RunError
            If the record has no such signal, or `ax` is given for signals of several units.
        """
        return plot_signals(self.record, signals or ("*.clearance",), self.scenario.title, ax)

    def replay(self) -> Path:
        """Return the path of the replay page.

        Returns
        -------
        Path
            An HTML file that opens in a browser without a network.

        Raises
        ------
        RunError
            If the run has no replay.
        """
        if "replay" not in self.files():
            raise RunError(f"{self.folder}: has no {REPLAY}; `cosim report --replay {self.folder}` writes it")
        return self.folder / REPLAY

    def __repr__(self) -> str:
        status, end = self.summary.get("status"), self.summary.get("simulated_time")
        return f"Run({str(self.folder)!r}: {self.scenario.name}, {status}, {end} s)"

    def _repr_html_(self) -> str:
        """Return the run as a small table, for notebooks."""
        rows = {"folder": self.folder, "scenario": self.scenario.title, "law": self.scenario.law.name}
        rows |= {key: value for key, value in self.summary.items() if isinstance(value, str | int | float)}
        cells = "".join(f"<tr><th>{escape(str(k))}</th><td>{escape(str(v))}</td></tr>" for k, v in rows.items())
        return f"<table>{cells}</table>"


def load_run(path: str | Path) -> Run:
    """Open a run that was completed, interrupted or killed.

    Parameters
    ----------
    path : str or Path
        The run folder.

    Returns
    -------
    Run
        The run with a summary that is computed from its record.

    Raises
    ------
    RunError
        If the folder holds no run that can be read.
    ScenarioError
        If its scenario is invalid.

    Examples
    --------
    >>> import cosim
    >>> run = cosim.run_scenario(cosim.load_scenario("paper", ["time.duration=0.2"]), "run", report=False)
    >>> cosim.load_run(run.folder).summary["status"]
    'completed'
    """
    path = Path(path)
    if (path / SYSTEM).is_file():
        raise RunError(
            f"{path}: holds a run of a system of FMUs, which has no known vehicle; expected a scenario's run"
        )
    if not (path / SCENARIO).is_file():
        raise RunError(f"{path}: holds no run ({SCENARIO} is missing)")
    scenario = load_scenario(path / SCENARIO, imported=True)
    status, wall_time = "killed", None
    if (path / SUMMARY).exists():
        scenario, status, wall_time = _read_summary(path / SUMMARY, scenario)
    return open_run(path, scenario, status, wall_time)


def _read_summary(file: Path, scenario: Scenario) -> tuple[Scenario, str, float | None]:
    """Return the scenario with the law in the summary, the run's status, and its wall time [s]."""
    before = read_json(file)
    name, law, status = (_text(file, before, key) for key in ("scenario", "law", "status"))
    # an external autopilot may have flown instead of the law, but only in runs without commands
    if law != scenario.law.name and (law in LAWS or scenario.commands.enabled):
        raise RunError(f"{file}: law is {law!r}, expected {scenario.law.name!r} as in {SCENARIO}")
    took = before.get("wall_time")
    if not (took is None or (type(took) in (int, float) and 0.0 <= took < _MAX_WALL_TIME)):
        raise RunError(f"{file}: wall_time is {took!r}, expected seconds, or null")
    flown = dataclasses.replace(scenario, name=name, law=dataclasses.replace(scenario.law, name=law))
    return flown, status, None if took is None else float(took)


def _text(file: Path, summary: dict[str, Any], key: str) -> str:
    """Return a text of a summary, without characters that could control a terminal."""
    if key not in summary:
        raise RunError(f"{file}: {key} is missing, expected the summary of a run")
    if not isinstance(summary[key], str):
        raise RunError(f"{file}: {key} is {summary[key]!r}, expected a text")
    return printable(summary[key])


def open_run(path: Path, scenario: Scenario, status: str, wall_time: float | None) -> Run:
    """Open a run whose status and wall time are known; wall_time [s]."""
    record = load_record(path)
    require_columns(scenario, record)
    last = -np.inf
    for block in record.blocks(["time"]):
        time = block["time"]
        if not (np.isfinite(time).all() and (np.diff(time, prepend=last) > 0.0).all()):
            raise RunError(f"{path}: the times of the record do not rise from row to row")
        last = time[-1]
    as_flown = scenario_as_flown(scenario, record)
    summary = summarize(as_flown, record, status, wall_time)
    if scenario.commands.enabled:
        log = path / COMMANDS_LOG
        # the command of a line that was cut was not applied
        summary["commands"] = log.read_bytes().count(b"\n") if log.exists() else 0
    return Run(path, scenario, as_flown, record, summary)
