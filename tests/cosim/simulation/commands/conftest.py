"""Runs that receive commands."""

import numpy as np
import pytest

from cosim.scenario.scenario import load_scenario
from cosim.simulation.master import Master
from tests.cosim.simulation.keep import Keep


class Script:
    """Commands by step."""

    exhausted = False

    def __init__(self, commands):
        self._commands = dict(commands)

    def take(self, k):
        return self._commands.pop(k, [])


class Commanded(Keep):
    """What a run under commands left, by column."""

    def __init__(self, master):
        super().__init__(master)
        self.master = master

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
            kept = Commanded(master)
            master.run([kept], commands=script if hasattr(script, "take") else Script(script), awaiting=awaiting)
            kept.rows = np.array(kept.rows)
            return kept

    return run
