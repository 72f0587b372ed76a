"""The order of a step: Jacobi's is that of masters that exchange all values at once."""

import numpy as np
import pytest

from controller import VehicleState
from controller.regions import pack
from cosim.law import law_of
from cosim.master import Master
from cosim.scenario import CRITERIA, load_scenario
from cosim.start_values import start_values
from fuzzy_arbiter import Arbiter, ramp
from plant_fmu import Plant

SHORT = [
    'arbiter.engine="closed"', "time.duration=6.0", "time.step=0.01", "time.control=0.02", "time.arbiter=0.03",
    "limit.force=120.0",
]  # fmt: skip


class Rows:
    def __init__(self):
        self.rows = []

    def observe(self, k, row):
        self.rows.append(row.copy())


def rows_of(scenario):
    rows = Rows()
    with Master(scenario) as master:
        master.run([rows])
        return np.array(rows.rows), master.signals


class Part:
    """What a master of other parts sees: outputs that were made in the step before, of inputs at its beginning."""

    def __init__(self, size):
        self.outputs = np.zeros(size)
        self.coming = np.zeros(size)

    def exchange(self):
        self.outputs[:] = self.coming


def jacobi_by_parts(scenario):
    """The definition: three parts, and nothing handed on but at the end of a step."""
    arbiter, law = Arbiter(), law_of(scenario)
    goal, regions = pack([scenario.goal_region]), pack([r.region for r in scenario.regions])
    of = [CRITERIA.index(r.criterion) for r in scenario.regions]
    n = len(of)
    wrench, asked, weights = Part(6), Part(len(CRITERIA)), Part(len(CRITERIA))
    values, gradients, turnings, clearances = np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n)
    positions, seen_weights = [], []
    with Plant(scenario.vehicle) as plant:
        plant.set(start_values(scenario))
        plant.initialise()
        for k in range(scenario.steps + 1):
            position = np.array([plant[f"position.{axis}"] for axis in "xyz"])
            attitude = np.array([plant[f"quaternion.e{i}"] for i in range(4)])
            velocity = np.array([plant[f"velocity.{axis}"] for axis in "uvwpqr"])
            positions.append(position)
            seen_weights.append(weights.outputs.copy())
            state = VehicleState(position, attitude, velocity, np.ones(8))
            regions.evaluate(position, attitude, values, gradients, turnings, clearances)
            asked.coming[:] = 0.0
            for criterion, clearance in zip(of, clearances, strict=True):
                asked.coming[criterion] = max(asked.coming[criterion], ramp(clearance, scenario.arbiter.ramp))
            if k % scenario.arbiter_every == 0:
                weights.coming[:] = arbiter(asked.outputs.tolist())
            if k % scenario.control_every == 0:
                law.step(state, goal, regions, weights.outputs[of], wrench.coming)
            if k < scenario.steps:
                for axis, value in zip("XYZKMN", wrench.outputs, strict=True):
                    plant[f"wrench.{axis}"] = value
                plant.step(scenario.time.step)
            for part in (wrench, asked, weights):
                part.exchange()
    return np.array(positions), np.array(seen_weights)


def test_jacobi_is_three_parts_that_exchange_at_the_end_of_each_step():
    scenario = load_scenario("paper", [*SHORT, 'master.order="jacobi"'])
    rows, signals = rows_of(scenario)
    positions, weights = jacobi_by_parts(scenario)
    at = signals.index("position.x")
    np.testing.assert_array_equal(rows[:, at : at + 3], positions)
    at = signals.index(f"weight.{CRITERIA[0]}")
    np.testing.assert_array_equal(rows[:, at : at + 3], weights)
    assert weights.max() > 0.5


def test_the_orders_come_together_as_the_step_gets_shorter():
    def apart(step):
        given = [*SHORT[:2], *(f"time.{key}={step}" for key in ("step", "control", "arbiter")), SHORT[-1]]
        ends = []
        for order in ("gauss-seidel", "jacobi"):
            rows, signals = rows_of(load_scenario("paper", [*given, f'master.order="{order}"']))
            at = signals.index("position.x")
            ends.append(rows[-1, at : at + 3])
        return np.linalg.norm(ends[0] - ends[1])

    coarse, fine = apart(0.02), apart(0.005)
    assert fine > 1e-6
    assert coarse / fine == pytest.approx(4.0, rel=0.4)  # of first order in the step
