"""Runs that receive commands."""

import numpy as np
import pytest

from cosim.scenario.scenario import load_scenario
from cosim.simulation.master import Master


class Script:
    """Commands by step."""

    exhausted = False

    def __init__(self, commands):
        self._commands = dict(commands)

    def take(self, k):
        return self._commands.pop(k, [])


class Rows:
    """Observer that keeps every row."""

    def __init__(self):
        self.rows = []

    def observe(self, k, row):
        self.rows.append(row.copy())


class Commanded:
    """What a run under commands left, by column."""

    def __init__(self, master, rows):
        self.rows, self._at = np.array(rows), master.signals.index
        self.master = master

    def __getitem__(self, name):
        return self.rows[:, self._at(name)]

    def stack(self, *names):
        return np.stack([self[name] for name in names], axis=1)

    @property
    def position(self):
        return self.stack(*(f"position.{axis}" for axis in "xyz"))


@pytest.fixture
def fly():
    def run(script, *overrides, name="pipe-inspection", awaiting=None):
        scenario = load_scenario(name, ["commands.enabled=true", *overrides])
        with Master(scenario) as master:
            rows = Rows()
            master.run([rows], commands=script if hasattr(script, "take") else Script(script), awaiting=awaiting)
            return Commanded(master, rows.rows)

    return run
