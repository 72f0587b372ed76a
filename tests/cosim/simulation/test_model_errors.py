"""Flights with a plant that differs from the law's model, no thruster failing: none is isolated."""

import json

import numpy as np
import pytest

from benchmarks.thruster_failures import scene
from cosim.batch.fused import FusedFlyer
from cosim.batch.variation import Variation
from cosim.scenario.scenario import load_scenario, validate_scenario
from plant_fmu.vehicle import load_vehicle

LAG = {"bluerov2_heavy": 0.15, "bluerov2_heavy_wu": 0.15}


def fly(scenario):
    """Fly a scenario; return its outcome, and the isolated thrusters."""
    with FusedFlyer(Variation(scenario, ())) as flyer:
        outcome, trace = flyer.fly_one(scenario, trace=True)
    return outcome, set(np.unique(trace["law.failed_thruster"])) - {0.0}


def check(scenario):
    """Require a flight that keeps its hard regions and isolates nothing; return whether it rests in the goal."""
    outcome, isolated = fly(scenario)
    assert not isolated and not outcome["violated"], scenario.title
    return bool(outcome["settled"])


@pytest.mark.medium
@pytest.mark.parametrize(
    ("vehicle", "case", "count"),
    [
        ("bluerov2_heavy", "uneven", 3),
        ("odin", "dead band", 3),
        ("odin", "weak", 8),
        ("rexrov", "weak", 8),
        ("bluerov2_heavy", "weak", 8),
        ("odin", "uneven", 8),
        ("rexrov", "uneven", 8),
        ("bluerov2_heavy_wu", "uneven", 8),
        ("odin", "half drag", 8),
        ("rexrov", "half drag", 8),
        ("bluerov2_heavy", "half drag", 8),
        ("bluerov2_heavy_wu", "half drag", 8),
        ("bluerov2_heavy_wu", "other set", 4),
        ("odin", "gusts", 4),
        ("rexrov", "gusts", 4),
        pytest.param("bluerov2_heavy", "weak", 60, marks=pytest.mark.slow),
        pytest.param("bluerov2_heavy", "uneven", 60, marks=pytest.mark.slow),
    ],
)
def test_no_healthy_thruster_is_isolated(vehicle, case, count):
    model = load_vehicle(vehicle)
    for seed in range(count):
        table = scene(model, case, seed, LAG.get(vehicle), 15.0, 0.0) | {"vehicle": vehicle}
        assert check(validate_scenario(json.loads(json.dumps(table)), f"{case} {seed}"))


@pytest.mark.medium
@pytest.mark.parametrize("seeds", [range(6), pytest.param(range(6, 40), marks=pytest.mark.slow)], ids=["few", "many"])
def test_regions_are_kept_with_an_eighth_of_the_drag_of_the_file(seeds):
    """Drag and added mass of the other published set of the BlueROV2."""
    for seed in seeds:
        table = scene(load_vehicle("bluerov2_heavy"), "other set", seed, 0.15, 15.0, 0.0) | {
            "vehicle": "bluerov2_heavy"
        }
        with FusedFlyer(Variation(validate_scenario(json.loads(json.dumps(table)), f"other set {seed}"), ())) as flyer:
            outcome, trace = flyer.fly_one(flyer.variation.base, trace=True)
        assert outcome["settled"] and not outcome["violated"], seed
        assert trace["law.drag"].min() < 0.4  # the true one is 0.13 to 0.3


@pytest.mark.medium
@pytest.mark.parametrize(
    ("name", "limits"),
    [
        ("docking", (24, 28)),
        ("depth-transit", (32, 33)),
        ("harbour", (20, 24)),
        ("pipe-inspection", (20, 28)),
        ("inspection-visibility", (20, 24, 28, 32)),
    ],
)
def test_shipped_scenarios_are_flown_with_weak_thrusters(name, limits):
    """True limits of 20 to 33 N where the vehicle's file says 40 N."""
    for limit in limits:
        changes = [f"plant.parameters.thrust_max[{j}]={float(limit)}" for j in range(1, 9)]
        changes += [f"plant.parameters.thrust_min[{j}]={-float(limit)}" for j in range(1, 9)]
        assert check(load_scenario(name, ["arbiter.engine=closed", "time.duration=60.0", *changes]))
