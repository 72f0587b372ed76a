"""A plant's state, saved, restored and as bytes; its derivatives against published mass and thruster matrices."""

import gc

import numpy as np
import pytest

from plant_fmu import PlantError, load_vehicle
from tests.plant_fmu.conftest import WRENCH, drive

ACCELERATIONS = tuple(f"der(velocity.{a})" for a in "uvwpqr")


def test_restored_run_continues_bit_for_bit(make_plant, fmi):
    """Here, and as bytes in another plant."""
    plant = make_plant("odin", fmi, **{"imu.rate": 50.0, "imu.acceleration_noise": 0.1, "seed": 3})
    drive(plant)
    plant["thrust[1]"] = 77.0
    state = plant.save()
    assert state.time == plant.time == 0.5
    first, end = drive(plant), plant.time
    assert plant.outputs.values[0] != 0.0
    other, data = make_plant("odin", fmi, start=False), plant.serialize(state)
    for there, kept in ((plant, state), (plant, state), (other, other.deserialize(data))):
        there.restore(kept)
        assert there["thrust[1]"] == 77.0 and there.time == 0.5
        assert np.array_equal(drive(there), first) and there.time == end


def test_state_saved_before_initialize_can_be_restored(make_plant, fmi):
    plant = make_plant("odin", fmi, start=False)
    plant["mass"] = 130.0
    state = plant.save()
    plant.initialize()
    first = drive(plant)
    plant.restore(state)
    assert not plant.initialized
    plant.initialize()
    assert plant["mass"] == 130.0 and np.array_equal(drive(plant), first)


def test_invalid_state_bytes_are_rejected(make_plant):
    plant = make_plant()
    data = plant.serialize(plant.save())
    for wrong, words in (
        (b"", "got 0 bytes, expected a serialized state"),
        (b"x" * 1000, "got 1000 bytes, expected a serialized state"),
        (data[:-1], "damaged"),
        (data[:-9] + bytes([data[-9] ^ 1]) + data[-8:], "damaged"),
        *((foreign.serialize(foreign.save()), "of another FMU")
          for foreign in (make_plant("odin", 2), make_plant("bluerov2_heavy"))),
    ):  # fmt: skip
        with pytest.raises(PlantError, match=words):
            plant.deserialize(wrong)


def test_states_are_freed_once_and_never_used_again(make_plant, fmi):
    plant, other = make_plant("odin", fmi), make_plant("odin", fmi)
    state = plant.save()
    for act in (other.restore, other.free):
        with pytest.raises(PlantError, match="of another plant"):
            act(state)
    plant.free(state)
    plant.free(state)
    with pytest.raises(PlantError, match="the state was freed"):
        plant.restore(state)


@pytest.mark.medium
def test_unreferenced_states_are_freed(make_plant, monkeypatch):
    plant = make_plant()
    freed = []
    free = plant._instance.fmu.freeFMUState
    monkeypatch.setattr(plant._instance.fmu, "freeFMUState", lambda state: (freed.append(state.value), free(state)))
    kept = plant.save()
    for _ in range(20):
        plant.save()
    gc.collect()
    plant.restore(kept)
    assert len(freed) == 20
    plant.close()
    assert len(freed) == 21


# ---- derivatives ----


@pytest.mark.parametrize("name", ["odin", pytest.param("rexrov", marks=pytest.mark.slow)])
def test_accelerations_by_wrench_are_the_inverse_of_the_mass_matrix(make_plant, name, fmi):
    plant, vehicle = make_plant(name, fmi), load_vehicle(name)
    np.testing.assert_allclose(
        plant.jacobian(ACCELERATIONS, WRENCH), np.linalg.inv(vehicle.mass_matrix), rtol=1e-9, atol=1e-12
    )
    if name == "odin":  # without lag
        actuation = [name.replace("wrench", "actuation") for name in WRENCH]
        found = plant.jacobian(actuation, plant.inputs.names[:8])
        np.testing.assert_allclose(found, vehicle.thruster_matrix, atol=1e-12)


@pytest.mark.medium
def test_derivatives_use_inputs_not_yet_sent_by_a_step(make_plant):
    plant = make_plant()
    assert plant.jacobian(["actuation.X"], ["thrust[1]"])[0, 0] > 0.7
    plant["thrust[1]"] = 1000.0  # far beyond its limit
    assert plant.jacobian(["actuation.X"], ["thrust[1]"])[0, 0] == 0.0
    assert plant.jacobian([], ["thrust[1]"]).shape == (0, 1)
    assert plant.jacobian(["actuation.X"], []).shape == (1, 0)


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize(
    ("unknowns", "knowns", "words"),
    [
        (["actuation.Q"], ["wrench.X"], "'actuation.Q' is unknown"),
        (["thrust_saturated[1]"], ["wrench.X"], r"thrust_saturated\[1\] is of type Boolean, expected a real scalar"),
        (["actuation.X"], ["actuation.Y"], "derivatives of actuation.X by actuation.Y: "),
    ],
)
def test_unavailable_derivatives_are_named(make_plant, fmi, unknowns, knowns, words):
    with pytest.raises(PlantError, match=words):
        make_plant("odin", fmi).jacobian(unknowns, knowns)
