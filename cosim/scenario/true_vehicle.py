"""The vehicle as simulated: that of its file with the scenario's `plant.parameters`, and its FMU's start values."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
from numpy.typing import NDArray

from controller.theory import Model
from cosim.scenario.scenario import Scenario
from cosim.scenario.sensor_suite import scenario_sensors
from plant_fmu.vehicle import Vehicle

Array = NDArray[np.float64]

_INDEXED = re.compile(r"(\w+)\[(\d+)(?:,(\d+))?\]")
_SYMMETRIC = ("added_mass", "inertia")


def true_vehicle(scenario: Scenario) -> Vehicle:
    """Return the vehicle with the scenario's `plant.parameters`."""
    # Thrusters' limits are multiplied by their effectiveness, so that one that is failed from the start gives no force.
    vehicle, over = scenario.vehicle, scenario.plant.parameters
    changed: dict[str, float | Array] = {}
    effectiveness = np.ones(vehicle.n_thrusters)
    for name, value in over.items():
        stem, index = _split_name(name)
        if stem == "thrust_effectiveness":
            effectiveness[index] = value
        elif hasattr(vehicle, stem):
            if not index:
                changed[stem] = float(value)
                continue
            array = np.array(changed.get(stem, getattr(vehicle, stem)))
            array[index] = value
            if stem in _SYMMETRIC:
                array[index[::-1]] = value
            changed[stem] = array
    for limit in ("thrust_min", "thrust_max"):
        changed[limit] = np.asarray(changed.get(limit, getattr(vehicle, limit))) * effectiveness
    return dataclasses.replace(vehicle, **changed)  # type: ignore[arg-type]


def start_values(scenario: Scenario) -> dict[str, float]:
    """Return the parameters and start values that the FMU gets before initialization."""
    initial, plant, limit = scenario.initial, scenario.plant, scenario.limit
    values = {"substep": plant.substep, "wrench_time_constant": limit.time_constant}
    if limit.force < np.inf:
        values["wrench_force_limit"] = limit.force
    for prefix, names, numbers in (
        ("current", "xyz", plant.current),
        ("position", "xyz", initial.position),
        ("quaternion", ("e0", "e1", "e2", "e3"), initial.quaternion),
        ("velocity", "uvwpqr", initial.velocity),
    ):
        values |= {f"{prefix}.{name}": number for name, number in zip(names, numbers, strict=True)}
    return values | scenario_sensors(scenario) | plant.parameters


def true_model(scenario: Scenario) -> Model:
    """Return the model of the true vehicle for the stability analysis."""
    vehicle = true_vehicle(scenario)
    return Model(
        np.ascontiguousarray(vehicle.mass_matrix),
        np.array(vehicle.linear_damping),
        np.array(vehicle.quadratic_damping),
        scenario.true_restoring_parameters,
    )


def _split_name(name: str) -> tuple[str, tuple[int, ...]]:
    """Split a parameter's name into the attribute of a vehicle and the index of the element."""
    indexed = _INDEXED.fullmatch(name)
    if indexed:
        return indexed[1], tuple(int(i) - 1 for i in indexed.groups()[1:] if i is not None)
    stem, _, axes = name.partition(".")
    letters = "XYZKMN" if stem == "trim" else "xyz"
    return stem, tuple(letters.index(axis) for axis in axes if axis in letters)
