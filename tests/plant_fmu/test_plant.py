"""`Plant` against FMPy's own calls, and invalid values and call orders."""

import copy
import pickle
import shutil
from pathlib import Path

import fmpy
import numpy as np
import pytest

import plant_fmu
from plant_fmu import Plant, PlantError, load_vehicle
from plant_fmu.build import cached_fmu
from plant_fmu.errors import VehicleError
from tests.plant_fmu.conftest import WRENCH, drive


def test_plant_steps_equal_fmpy_steps(make_plant, make_slave, fmi):
    slave, plant = make_slave("odin", fmi).start(), make_plant("odin", fmi)
    for k in range(100):
        inputs = 20.0 * np.sin(0.1 * k + np.arange(14))
        slave.set_values(dict(zip(plant.inputs.names, inputs.tolist(), strict=True)))
        slave.time = k * 0.01  # the time that rounding does not move
        slave.step(0.01)
        plant.inputs.values[:] = inputs
        plant.step(0.01)
        assert plant.outputs.values.tolist() == slave.get(*plant.outputs.names)
        assert plant.read_flags().tolist() == [slave.flag(name) for name in plant.flags.names]
    assert not plant.read_flags().any()
    plant["thrust[2]"] = 28.0
    plant.step(0.01)
    assert [n for n, cut in zip(plant.flags.names, plant.read_flags(), strict=True) if cut] == ["thrust_saturated[2]"]
    assert plant["thrust_saturated[2]"] is True


def test_channels_are_those_of_the_description(make_plant, fmi):
    plant = make_plant("odin", fmi)
    described = fmpy.read_model_description(str(cached_fmu(load_vehicle("odin"), fmi))).modelVariables
    assert plant.names == tuple(v.name for v in described)
    outputs = [v for v in described if v.causality == "output"]
    for channels, kinds in ((plant.outputs, ("Real", "Float64")), (plant.flags, ("Boolean",))):
        found = [(c.name, c.unit, c.description) for c in channels.channels]
        assert found == [(v.name, v.unit or "", v.description) for v in outputs if v.type in kinds]
        assert len(channels) == len(channels.values)
        with pytest.raises(ValueError):
            channels.values[0] = 1
    assert list(plant.inputs.names[-6:]) == WRENCH and plant.inputs.channels[-1].unit == "N.m"


def test_a_plant_is_made_of_a_name_a_file_a_vehicle_or_an_fmu(make_plant, tmp_path):
    vehicle, toml = load_vehicle("odin"), tmp_path / "boat.toml"
    shutil.copy(Path(plant_fmu.__file__).parent / "vehicles" / "odin.toml", toml)
    fmu = cached_fmu(vehicle, 2)
    runs = [drive(make_plant(source)) for source in ("odin", str(toml), toml, vehicle, fmu, str(fmu))]
    assert all(np.array_equal(run, runs[0]) for run in runs)
    assert make_plant(fmu).fmi == 2 and make_plant("odin").fmi == 3 and make_plant("odin").name == "odin"


@pytest.mark.parametrize(
    ("source", "fmi", "kind", "words"),
    [
        ("odinn", 3, VehicleError, "'odinn' is unknown"),
        ("missing.fmu", 3, PlantError, r"missing.fmu: No such file"),
        ("odin", 1, PlantError, "FMI version is 1, expected 2 or 3"),
        (7, 3, PlantError, "plant is 7, expected a vehicle"),
    ],
)
def test_invalid_plant_sources_are_rejected(source, fmi, kind, words):
    with pytest.raises(kind, match=words):
        Plant(source, fmi)


# ---- values ----


def test_values_are_sent_by_their_type(make_plant, fmi):
    plant = make_plant("odin", fmi, start=False)
    plant.set({"seed": 7, "free_surface": True, "hull_radius": 0.3, "mass": 130})
    plant.set({"position.z": np.float32(2.5), "thrust[1]": np.int64(3)})
    plant.initialize()
    assert [plant[n] for n in ("seed", "free_surface", "mass", "position.z", "thrust[1]")] == [7, True, 130, 2.5, 3]
    plant.reset()
    plant.set({"seed": 8.0, "free_surface": 0.0})
    plant.initialize()
    assert (plant["seed"], plant["free_surface"]) == (8, False)


@pytest.mark.medium(fast=14)
@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("mas", 1.0, r"'mas' is unknown; did you mean 'mass'\?"),
        ("xyzzy!", 1.0, r"'xyzzy!' is unknown; expected one of the \d+ in plant.names"),
        ("mass", float("nan"), "mass is nan, expected a number in kg"),
        ("mass", "heavy", "mass is 'heavy', expected a number in kg"),
        ("mass", True, "mass is True, expected a number"),
        ("mass", None, "mass is None, expected a number"),
        ("mass", -5.0, "mass = -5 refused"),
        ("mass", float("inf"), "mass = inf refused"),
        ("thrust[1]", float("nan"), r"thrust\[1\] is nan, expected a number in N"),
        ("seed", 1.5, "seed is 1.5, expected a whole number"),
        ("seed", 2**31, "seed is 2147483648, expected a whole number from -2147483648 to 2147483647"),
        ("seed", -1, "seed"),
        ("seed", float("inf"), "seed is inf, expected a whole number"),
        ("free_surface", 2, "free_surface is 2, expected true or false"),
        ("free_surface", "yes", "free_surface is 'yes', expected true or false"),
        ("actuation.X", 1.0, "actuation.X cannot be set, expected a parameter"),
        ("thrust_saturated[1]", True, r"thrust_saturated\[1\] cannot be set, expected a parameter"),
    ],
)
@pytest.mark.parametrize("set_value", [lambda plant, name, value: plant.set({"buoyancy": 1000.0, name: value}),
                                       Plant.__setitem__], ids=["set", "item"])  # fmt: skip
def test_wrong_values_are_named(make_plant, set_value, name, value, words):
    plant = make_plant(start=False)
    with pytest.raises(PlantError, match=words) as caught:
        set_value(plant, name, value)
    assert "\n" not in str(caught.value)
    plant.initialize()
    assert plant["mass"] == 125.0 and plant["buoyancy"] == 1228.25  # nothing was set


def test_initialize_fixes_start_values_and_leaves_parameters_tunable(make_plant, fmi):
    plant = make_plant("odin", fmi)
    for name in ("position.x", "quaternion.e0"):
        with pytest.raises(PlantError, match=f"{name} cannot be set any more: initialize"):
            plant[name] = 1.0
    plant["buoyancy"] = 1300.0
    plant.step(0.1)
    assert plant["velocity.w"] < -0.01 and plant["buoyancy"] == 1300.0


def test_inputs_act_from_the_start_and_hold(make_plant, fmi):
    plant = make_plant("odin", fmi, start=False)
    plant.set({"wrench.X": 20.0})
    plant.inputs.values[plant.inputs.names.index("wrench.Y")] = 5.0
    plant.initialize()
    assert (plant["actuation.X"], plant["actuation.Y"]) == (20.0, 5.0)
    plant.step(0.1)
    plant.step(0.1)
    assert (plant["wrench.X"], plant["actuation.X"]) == (20.0, 20.0)
    plant["wrench.X"] = 0.0
    plant.step(0.1)
    assert plant["actuation.X"] == 0.0


def test_nan_input_rejects_the_step_and_the_plant_continues(make_plant, fmi):
    plant, other = make_plant("odin", fmi), make_plant("odin", fmi)
    plant.inputs.values[3] = np.nan
    with pytest.raises(PlantError, match=r"^t = 0 s: thrust\[4\] = nan refused"):
        plant.step(0.01)
    plant.inputs.values[3] = 0.0
    assert plant.time == 0.0
    assert np.array_equal(drive(plant), drive(other))


# ---- order of calls ----

BEFORE = (
    lambda plant: plant.step(0.1), Plant.read_flags, lambda plant: plant.jacobian(["actuation.X"], ["wrench.X"]),
    lambda plant: plant["mass"], lambda plant: plant["position.x"],
)  # fmt: skip
AFTER = (
    *BEFORE, Plant.initialize, Plant.reset, Plant.save, lambda plant: plant.set({"mass": 1.0}),
    lambda plant: plant["thrust[1]"],
)  # fmt: skip


def test_calls_need_a_plant_that_is_initialized_and_open(make_plant, fmi):
    plant = make_plant("odin", fmi, start=False)
    for act in BEFORE:
        with pytest.raises(PlantError, match=r"before initialize\(\)"):
            act(plant)
    assert plant["thrust[1]"] == 0.0
    plant.initialize()
    with pytest.raises(PlantError, match=r"initialized already; reset\(\) it first"):
        plant.initialize()
    state = plant.save()
    for _ in range(2):
        plant.close()
    for act in (*AFTER, lambda plant: plant.restore(state), lambda plant: plant.serialize(state)):
        with pytest.raises(PlantError, match="plant odin is closed"):
            act(plant)
    plant.free(state)
    assert "closed" in repr(plant) and f"FMI {fmi}.0" in repr(plant)


@pytest.mark.parametrize("step", [0.0, -0.1, np.nan, np.inf, "0.1", None, True, pytest.param(10**400, id="huge")])
def test_invalid_steps_are_rejected(make_plant, step):
    plant = make_plant()
    plant.step(0.1)
    with pytest.raises(PlantError, match=r"step is .*, expected seconds above 0"):
        plant.step(step)
    plant.step(0.1)
    assert plant.time == 0.2


def test_time_accumulates_no_rounding_error(make_plant):
    plant = make_plant(start=False)
    plant.initialize(time=100.0)
    plant.step(0.5)
    assert plant.time == 100.5
    plant = make_plant()
    for k in range(1, 1001):
        plant.step(0.001)
        assert plant.time == k * 0.001
    assert plant["time"] == pytest.approx(1.0, abs=1e-12)
    plant.step(0.5)
    plant.step(0.25)
    assert plant.time == 1.75
    plant = make_plant()
    for k in range(1, 3001):
        plant.step(np.float32(0.01))
        assert type(plant.time) is float and plant.time == k * float(np.float32(0.01))


def test_reset_restores_the_initial_state(make_plant, fmi):
    plant, fresh = make_plant("odin", fmi), make_plant("odin", fmi)
    drive(plant)
    plant["mass"] = 140.0
    plant.reset()
    assert plant.time == 0.0 and not plant.initialized and not plant.inputs.values.any()
    plant.initialize()
    assert plant["mass"] == 125.0
    assert np.array_equal(drive(plant), drive(fresh))


@pytest.mark.parametrize("duplicate", [copy.copy, copy.deepcopy, pickle.dumps])
def test_a_plant_and_a_state_cannot_be_copied(make_plant, duplicate):
    """Two hands on one instance would free it under each other."""
    plant = make_plant("odin")
    for thing in (plant, plant.save()):
        with pytest.raises(PlantError, match="cannot be copied or pickled"):
            duplicate(thing)


def test_failed_initialization_error_names_the_remedy(make_plant):
    plant = make_plant(start=False)
    plant.set({"dvl.velocity_noise": 0.1})
    with pytest.raises(PlantError, match=r"needs the sensor's rate .*; reset\(\), then set valid values"):
        plant.initialize()
    plant.reset()
    plant.set({"dvl.velocity_noise": 0.1, "dvl.rate": 5.0})
    plant.initialize()


def test_former_names_warn_and_work(make_plant):
    plant = make_plant(start=False)
    for former, now in (("initialise", "initialize"), ("serialise", "serialize"), ("deserialise", "deserialize")):
        with pytest.warns(DeprecationWarning, match=f"{former} is now {now}"):
            assert getattr(plant, former) == getattr(plant, now)
    with pytest.warns(DeprecationWarning, match="initialised is now initialized"):
        assert plant.initialised is False
    with pytest.raises(AttributeError, match="no attribute 'finish'"):
        plant.finish  # noqa: B018
