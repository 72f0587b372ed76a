"""Dead band and curve of thrusters: those of the vehicle's file are inverted, others are a disturbance."""

from dataclasses import replace

import numpy as np
import pytest

from controller import FunctionLaw
from cosim.results.record import load_record
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario
from plant_fmu import load_vehicle

PLAIN = load_vehicle("bluerov2_heavy")
CURVED = replace(PLAIN, name="curved", thrust_dead_band=np.full(8, 0.1), thrust_curve=np.linspace(0.0, 1.0, 8))


def fly(folder, scenario, **arguments):
    return load_record(run_scenario(scenario, folder / "run", report=False, **arguments).folder)


@pytest.mark.medium
def test_a_known_curve_changes_commands_and_no_motion(tmp_path):
    flown = {}
    for vehicle in (PLAIN, CURVED):
        (tmp_path / vehicle.name).mkdir()
        scenario = load_scenario("docking", ["time.duration=8"])
        flown[vehicle.name] = fly(tmp_path / vehicle.name, replace(scenario, vehicle=vehicle))
    plain, curved = flown["bluerov2_heavy"], flown["curved"]
    for column in (*(f"position.{axis}" for axis in "xyz"), *(f"thruster_force[{i + 1}]" for i in range(8))):
        np.testing.assert_allclose(curved[column], plain[column], atol=1e-6)
    assert abs(curved["thrust[8]"] - plain["thrust[8]"]).max() > 2.0


@pytest.mark.medium
def test_a_wrench_acts_as_commanded_on_thrusters_with_a_curve(tmp_path):
    wanted = np.array([12.0, -5.0, 3.0, 0.0, 0.0, 1.0])
    law = FunctionLaw(lambda *_: wanted)
    scenario = load_scenario("docking", ["law.name=pd", "time.duration=2"])
    record = fly(tmp_path, replace(scenario, vehicle=CURVED), law=law)
    forces = np.array([record[f"thruster_force[{i + 1}]"][-1] for i in range(8)])
    assert PLAIN.thruster_matrix @ forces == pytest.approx(wanted, abs=1e-3)


@pytest.mark.medium
def test_an_unknown_dead_band_neither_traps_the_vehicle_nor_fails_a_thruster(tmp_path):
    unknown = ["plant.parameters.thrust_dead_band=0.11", "plant.parameters.thrust_rate_limit=40.0"]
    run = run_scenario(load_scenario("docking", unknown), tmp_path / "run", report=False)
    assert run.summary["settled"] and not run.summary["isolations"] and not run.summary["hard_violated"]
