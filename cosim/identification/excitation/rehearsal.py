"""Simulation of a schedule of segments on the plant: its motion, and the sensors' measurements of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cosim.identification.log import Log, make_topic
from cosim.scenario.scenario import Scenario
from cosim.simulation.commands.commands import Command
from cosim.simulation.commands.sources import ScheduledCommands
from cosim.simulation.master import Master
from cosim.simulation.stepped_plant import SteppedPlant

Array = NDArray[np.float64]

_STATE = (
    *(f"position.{axis}" for axis in "xyz"), *(f"quaternion.e{i}" for i in range(4)),
    *(f"velocity.{name}" for name in "uvwpqr"),
)  # fmt: skip
DVL_PERIOD = 0.15  # s, time between two velocities of the DVL
# standard deviations of the sensors' noise [m/s, rad/s, m, rad]
NOISE = {"velocity": 0.005, "angular_velocity": 0.002, "depth": 0.003, "attitude": 0.005}


@dataclass(frozen=True)
class Rehearsal:
    """A simulated run, row by row."""

    times: Array  # (rows,) s
    states: Array  # (rows, 13) position [m, NED], quaternion, velocity [m/s, rad/s, body frame]
    thrust: Array  # (rows, thrusters) N, commanded forces

    def log(self) -> Log:
        """Return the sensors' measurements without noise, together with the standard deviations of the noise."""
        every = max(1, round(DVL_PERIOD / float(self.times[1] - self.times[0])))
        parts = {
            "velocity": (slice(None, None, every), slice(7, 10)), "angular_velocity": (slice(None), slice(10, 13)),
            "depth": (slice(None), slice(2, 3)), "attitude": (slice(None), slice(3, 7)),
        }  # fmt: skip
        topics = tuple(
            make_topic(name, self.times[rows], self.states[rows, columns], NOISE[name])
            for name, (rows, columns) in parts.items()
        )
        return Log("rehearsal", self.times, self.thrust, np.zeros((len(self.times), 6)), topics)


def rehearse(
    scenario: Scenario, commands: Sequence[tuple[int, Command]], plant: SteppedPlant | None = None
) -> Rehearsal:
    """Simulate a run with scheduled commands."""
    source, rows = ScheduledCommands(commands), []
    with Master(scenario, plant=plant) as master:
        columns = [column.name for column in master.signals.columns]
        thrust = [f"thrust[{i + 1}]" for i in range(scenario.vehicle.n_thrusters)]
        kept = [columns.index(name) for name in (*_STATE, *thrust)]
        for k in range(scenario.steps + 1):
            master.step(k, source)
            rows.append(master.row[kept])
    found: Array = np.array(rows)
    return Rehearsal(scenario.time.step * np.arange(len(found), dtype=np.float64), found[:, :13], found[:, 13:])
