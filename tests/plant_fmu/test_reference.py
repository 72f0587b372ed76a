"""The FMU against trajectories computed outside this project."""

import json

import numpy as np
import pytest

from plant_fmu import load_vehicle
from tests.conftest import DATA
from tests.plant_fmu.conftest import STATES, WRENCH

RUNS = json.loads((DATA / "runs.json").read_text())


def drive(slave, run, rows):
    """Run the segments without limits, and return the state at every row's time."""
    thrusts = [f"thrust[{i + 1}]" for i in range(8)]
    slave.set_values({f"thrust_{side}[{i + 1}]": s * 1e6 for i in range(8) for side, s in (("min", -1), ("max", 1))})
    slave.set_values({f"current.{a}": c for a, c in zip("xyz", run["current"], strict=True)})
    slave.start(**dict(zip(STATES, run["x0"], strict=True)))
    ends = np.cumsum([duration for duration, *_ in run["segments"]])
    states = [slave.get(*STATES)]
    for now, then in zip(rows[:-1, 0], rows[1:, 0], strict=True):
        _, forces, wrench = run["segments"][int(np.searchsorted(ends, now + 1e-9))]
        slave.set_values(dict(zip((*thrusts, *WRENCH), (*forces, *wrench), strict=True)))
        slave.step(then - now)
        states.append(slave.get(*STATES))
    return np.array(states)


@pytest.mark.medium
@pytest.mark.parametrize("name", RUNS)
def test_fmu_states_match_reference_trajectories(name, fmi, make_slave):
    rows = np.loadtxt(DATA / f"{name}.csv", delimiter=",", skiprows=1)
    states = drive(make_slave(RUNS[name]["vehicle"], fmi), RUNS[name], rows)
    assert np.abs(states - rows[:, 1:]).max() < 1e-6


@pytest.mark.parametrize(("vehicle", "limit"), [("odin", 27.0), ("bluerov2_heavy", 40.0)])
def test_thrust_limits_are_the_published_ones(vehicle, limit):
    np.testing.assert_array_equal([load_vehicle(vehicle).thrust_max, -load_vehicle(vehicle).thrust_min], limit)


def test_error_falls_with_the_fourth_power_of_the_substep(make_slave):
    def end(substep):
        slave = make_slave("bluerov2_heavy")
        slave.set_values({f"quadratic_damping[{i + 1}]": 0.0 for i in range(6)})
        slave.set_values({f"linear_damping[{i + 1}]": d for i, d in enumerate((14, 20, 33, 0.3, 0.8, 0.4))})
        slave.start(substep=substep, **{"position.z": 1.0, "velocity.p": 0.4, "velocity.v": 0.3, "current.x": 0.2})
        slave.set_values(dict(zip(WRENCH, (8.0, -5.0, 3.0, 0.2, -0.3, 0.4), strict=True)))
        slave.step(4.0)
        return np.array(slave.get(*STATES))

    truth = end(0.001)
    errors = [np.abs(end(h) - truth).max() for h in (0.08, 0.04, 0.02)]
    commands = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all((commands > 3.7) & (commands < 4.4)), (errors, commands)
