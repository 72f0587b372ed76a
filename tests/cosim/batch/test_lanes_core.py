"""The plant in lanes against the FMU: the same source, compiled a second time."""

import ctypes
from pathlib import Path

import numpy as np
import pytest

from cosim.batch.lanes import Batch
from cosim.batch.lanes_library import lanes_library
from plant_fmu import Plant, PlantError, load_vehicle
from plant_fmu.variables import variables

CORE = Path(__file__).with_name("lanes_core.c")
STEP, SUBSTEP, STEPS = 0.01, 0.004, 150

LEVEL = {f"quaternion.e{i}": float(i == 0) for i in range(4)}
WATER = {"current.x": 0.3, "current.y": -0.2, "current_shear.x": 0.1, "current_shear.z": 0.02}
SURFACE = {"free_surface": True, "hull_radius": 0.31, "position.z": 0.05}
BOTTOM = {"bottom_depth": 2.0, "hull_radius": 0.3, "position.z": 1.68, **LEVEL, "velocity.w": 0.4, "velocity.u": 0.5}
# what each vehicle has that the others beside it have not
FEATURES = {
    "plain": {},
    "water": WATER,
    "surface": SURFACE,
    "bottom": BOTTOM,
    "lag": {"wrench_time_constant": 0.05, **{f"thrust_time_constant[{i}]": 0.03 * i for i in range(1, 9)}},
    "rate limit": {f"thrust_rate_limit[{i}]": 200.0 for i in range(1, 9)} | {"thrust_time_constant[2]": 0.1},
    "dead band": {f"thrust_dead_band[{i}]": 0.1 for i in range(1, 9)}
    | {f"thrust_curve[{i}]": 0.7 for i in range(1, 9)},
    "limit": {"wrench_force_limit": 40.0, "thrust_effectiveness[3]": 0.4},
    "all": WATER | SURFACE | {"wrench_time_constant": 0.02, "thrust_rate_limit[1]": 100.0, "bottom_depth": 0.3},
    "too fast": {"velocity.u": 40.0, "velocity.r": 3.0, "quadratic_damping[1]": 6e4},  # the guard stops it
    "goes too far": {
        "position.x": 999_999.9,
        "velocity.u": 5.0,
        **{f"quaternion.e{i}": float(i == 0) for i in range(4)},
    },
}


@pytest.fixture(scope="module")
def vehicle():
    return load_vehicle("odin")


@pytest.fixture(scope="module")
def plant(vehicle):
    with Plant(vehicle) as plant:
        yield plant


def numbers(features, rng):
    """Return start values that no other vehicle has, by name."""
    drawn = {
        "mass": 125.0 * rng.uniform(0.9, 1.1),
        "weight": 1226.0 * rng.uniform(0.97, 1.03),
        "r_G.x": rng.uniform(-0.02, 0.02),
        "r_G.z": 0.05 * rng.uniform(0.8, 1.2),
        "added_mass[1,5]": rng.uniform(-5.0, 5.0),
        "linear_damping[3]": rng.uniform(5.0, 60.0),
        "substep": SUBSTEP,
        "position.z": rng.uniform(1.0, 3.0),
        **{f"velocity.{name}": rng.uniform(-0.6, 0.6) for name in "uvwpqr"},
        **{f"quaternion.e{i}": value for i, value in enumerate(rng.normal(size=4))},
    }
    size = np.linalg.norm([drawn[f"quaternion.e{i}"] for i in range(4)])
    drawn |= {f"quaternion.e{i}": drawn[f"quaternion.e{i}"] / size for i in range(4)}
    return drawn | features


def commands(rng):
    """Return inputs, shape (steps, 14), that jump now and then."""
    held = rng.normal(size=(STEPS // 10 + 1, 14)) * np.array([*[60.0] * 8, *[80.0] * 3, *[20.0] * 3])
    return np.repeat(held, 10, axis=0)[:STEPS]


def by_fmu(plant, start, inputs):
    """Return the states after each step, shape (steps, states), and whether each was taken."""
    plant.reset()
    plant.set(start)
    plant.initialise()
    names = [v.name for v in variables(load_vehicle("odin")) if v.role == "state"]
    states, gone = np.zeros((STEPS, len(names))), np.zeros(STEPS, bool)
    read = plant.native((), names)
    for k in range(STEPS):
        plant.inputs.values[:] = inputs[k]
        try:
            plant.step(STEP)
            gone[k] = True
        except PlantError:
            pass
        states[k] = plant._instance.fmu.getFloat64(read.output_references.tolist())
        if not gone[k]:
            states[k:] = states[k]
            break
    return states, gone


def by_lanes(vehicle, starts, inputs):
    """Return the same of vehicles side by side, shape (vehicles, steps, ...)."""
    library = lanes_library(vehicle, beside=CORE)
    references = {v.name: i for i, v in enumerate(variables(vehicle))}
    defaults = {v.name: v.start for v in variables(vehicle)}
    types = {v.name: v.type for v in variables(vehicle)}
    names = sorted({name for start in starts for name in start}, key=lambda name: types[name] != "real")
    rows = np.array([[float(start.get(name, defaults[name])) for name in names] for start in starts])
    n_reals = sum(types[name] == "real" for name in names)
    n_states = sum(v.role == "state" for v in variables(vehicle))
    refs = np.array([references[name] for name in names], np.uint32)
    whole = refs[n_reals:].copy()
    refusals = np.zeros(len(starts), "S512")
    states = np.zeros((len(starts), STEPS, n_states))
    gone = np.zeros((len(starts), STEPS), np.intc)
    b = Batch(n_rows=len(starts), width=rows.shape[1], n_reals=n_reals, n_integers=len(whole), steps=STEPS)
    b.step, b.substep = STEP, SUBSTEP
    b.reals, b.integers, b.rows, b.refusals = (a.ctypes.data for a in (refs, whole, rows, refusals))
    inputs = np.ascontiguousarray(inputs)
    pointers = [ctypes.c_void_p(a.ctypes.data) for a in (inputs, states, gone)]
    assert library.core_steps(ctypes.byref(b), *pointers) == 1, refusals
    return states, gone.astype(bool)


@pytest.mark.slow  # a library of its own is compiled
def test_each_lane_equals_the_fmu_bit_for_bit(vehicle, plant):
    """Surface, bottom, shear, lags, rate limits, dead bands, refused steps: each lane with its own."""
    rng = np.random.default_rng(8)
    lanes = lanes_library(vehicle, beside=CORE).lanes_count()
    features = list(FEATURES.values())
    refused = 0
    for first in range(0, len(features), lanes):
        these = (features + features)[first : first + lanes]
        starts = [numbers(feature, rng) for feature in these]
        inputs = np.array([commands(rng) for _ in these])
        states, gone = by_lanes(vehicle, starts, inputs)
        for i, start in enumerate(starts):
            expected, went = by_fmu(plant, start, inputs[i])
            assert np.array_equal(gone[i], went), these[i]
            np.testing.assert_array_equal(states[i], expected, err_msg=str(these[i]))
            refused += not went.all()
    assert refused == 2  # else the guard was not tried


@pytest.mark.slow
def test_tested_features_change_the_result(plant):
    """Each changes the motion, so that the comparison above compares it."""
    inputs = commands(np.random.default_rng(3))
    ends = {}
    for name, feature in FEATURES.items():
        plain = {key: value for key, value in feature.items() if key.startswith(("position", "velocity", "quaternion"))}
        pair = [by_fmu(plant, numbers(f, np.random.default_rng(3)), inputs)[0][-1, :13] for f in (plain, feature)]
        ends[name] = float(np.abs(pair[0] - pair[1]).max())
    unmoved = [name for name, change in ends.items() if not change > 1e-6]
    assert unmoved == ["plain", "goes too far"]
