"""An engine with known outcomes that steps no plant, for tests of the code around engines."""

import os
import signal
import time

import numpy as np
import pytest

from cosim.batch.outcome import FIELDS, BatchResult, empty_outcomes
from cosim.campaigns.sweeps import sweep_rows
from cosim.campaigns.sweeps.design import Design, vary_from
from cosim.errors import RunError
from cosim.scenario.scenario import load_scenario

KEYS = ("initial.position.1", "regions.SR1.gain", "law.gains.k_p1")
VARY = ("initial.position.1=-2:2", "regions.SR1.gain=500:5000:log", "law.gains.k_p1=10:30")


class Fake:
    """Outcomes that follow from values and seed of each row alone; rows beyond `refused_above` are refused."""

    row_time = 0.0  # s
    refused_above = np.inf  # of the first value

    def __init__(self, variation, own=None):
        self.variation = variation

    def fly(self, values, seeds):
        outcomes, refused = empty_outcomes(len(seeds)), {}
        for i, row in enumerate(values):
            if self.row_time:
                time.sleep(self.row_time)
            self.meet(row)
            if row[0] > self.refused_above:
                refused[i] = f"{self.variation.keys[0]} is {row[0]}, expected less"
        x = np.where(values[:, 0] > self.refused_above, np.nan, values[:, 0])
        for name, (kind, _, _) in FIELDS.items():
            outcomes[name] = x > 0.0 if kind is np.bool_ else x * 0.1 + np.sum(values, axis=1) + seeds * 1e-9
        outcomes["min_clearance"] = np.where(seeds % 5 == 0, np.inf, x)
        outcomes["stopped_at"] = np.nan
        outcomes["reach_time"] = np.where(x > 0.0, x * 3.0, np.nan)
        return BatchResult(outcomes, refused)

    def meet(self, row):
        """Do what a row of these values does to a process."""

    def close(self):
        pass


class Slow(Fake):
    row_time = 0.01


class Choosy(Fake):
    refused_above = 1.5


class Poisoned(Fake):
    """A row whose first value is between 1 and 1.04 kills the process."""

    def meet(self, row):
        if 1.0 < row[0] < 1.04:
            os.kill(os.getpid(), signal.SIGKILL)


class Unfit(Fake):
    def __init__(self, variation, own=None):
        raise RunError("the engine cannot fly this")


@pytest.fixture
def fakes(monkeypatch):
    """Let sweeps fly by `Fake`; return a function that chooses another class of this file."""

    def choose(engine):
        monkeypatch.setattr(sweep_rows, "FusedFlyer", engine)

    choose(Fake)
    return choose


def design(n=50, kind="random", seed=3, vary=VARY):
    return Design(vary_from(vary), kind, n, seed)


def paper():
    return load_scenario("paper")


def expected(n=50):
    """Return the rows that the fake makes of the design."""
    d, rows = design(n), np.arange(n)
    values, seeds = d.values(rows), d.seeds(rows)
    outcomes = Fake(None).fly(values, seeds).outcomes
    table = []
    for i in range(n):
        row = {"row": i} | dict(zip(KEYS, values[i].tolist(), strict=True)) | {"seed": int(seeds[i])}
        row |= {name: outcomes[name][i].item() for name in FIELDS}
        table.append({k: None if v != v else v for k, v in row.items()} | {"refused": None, "arrivals": None})
    return table
