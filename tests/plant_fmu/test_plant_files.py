"""Several plants, foreign and broken FMUs, and removal of temporary files."""

import gc
import os
import threading
from xml.etree import ElementTree as ET

import numpy as np
import pytest

import plant_fmu.running.co_simulation_instance
from plant_fmu import Plant, PlantError, load_vehicle
from plant_fmu.build import cached_fmu
from tests.plant_fmu.conftest import drive, members, packed


def edited(tmp_path, edit):
    """Return a copy of an FMU whose description was edited."""
    files = members(cached_fmu(load_vehicle("odin"), 3))
    root = ET.fromstring(files["modelDescription.xml"])
    edit(root)
    return packed(tmp_path / "edited.fmu", files | {"modelDescription.xml": ET.tostring(root)})


# ---- several at once, and foreign ones ----


def test_threads_have_a_plant_each(scratch, fmi):
    here, runs = os.getcwd(), {}

    def work(i):
        with Plant("odin", fmi) as plant:
            plant.initialize()
            state = plant.save()
            drive(plant)
            plant.restore(state)
            runs[i] = drive(plant)

    cached_fmu(load_vehicle("odin"), fmi)
    threads = [threading.Thread(target=work, args=(i,)) for i in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(runs) == 6 and all(np.array_equal(run, runs[0]) for run in runs.values())
    assert os.getcwd() == here and list(scratch.iterdir()) == []


def shuffle(root):
    """Turn the variables' order about, and take inputs, Booleans and all that is optional away."""
    variables, structure, interface = (root.find(tag) for tag in ("ModelVariables", "ModelStructure", "CoSimulation"))
    gone = {v.get("valueReference") for v in variables if v.get("causality") == "input" or v.tag == "Boolean"}
    variables[:] = [v for v in reversed(variables) if v.get("valueReference") not in gone]
    structure[:] = [e for e in structure if e.get("valueReference") not in gone]
    for entry in structure:
        entry.attrib.pop("dependencies", None)
        entry.attrib.pop("dependenciesKind", None)
    for key in [key for key in interface.attrib if key.startswith(("canGet", "canSer", "provides"))]:
        del interface.attrib[key]


def test_reordered_fmu_without_optional_capabilities_works(make_plant, tmp_path):
    plant, ours = make_plant(edited(tmp_path, shuffle)), make_plant()
    assert (len(plant.inputs), len(plant.flags)) == (0, 0)
    assert plant.outputs.names == ours.outputs.names[::-1]
    plant["buoyancy"] = ours["buoyancy"] = 1300.0
    for _ in range(10):
        plant.step(0.1)
        ours.step(0.1)
    assert plant.outputs.values[::-1].tolist() == ours.outputs.values.tolist()
    assert plant.read_flags().shape == (0,)
    for act, words in (
        (plant.save, "cannot save its state"),
        (lambda: plant.deserialize(b""), "cannot serialize its state"),
        (lambda: plant.jacobian(["position.x"], ["mass"]), "provides no directional derivatives"),
    ):
        with pytest.raises(PlantError, match=words):
            act()


# ---- nothing is left behind ----


@pytest.mark.medium
def test_unreferenced_plant_is_freed(scratch):
    plant = Plant("odin")
    assert len(list(scratch.iterdir())) == 1
    del plant
    gc.collect()
    assert list(scratch.iterdir()) == []


def test_failed_construction_leaves_no_files(tmp_path, scratch, monkeypatch):
    (tmp_path / "text.fmu").write_bytes(b"no zip")
    with pytest.raises(PlantError, match="is no FMU: File is not a zip file"):
        Plant(tmp_path / "text.fmu")

    def interrupted(instance, brief):
        raise KeyboardInterrupt

    monkeypatch.setattr(plant_fmu.running.co_simulation_instance, "BoundCalls", interrupted)
    with pytest.raises(KeyboardInterrupt):
        Plant("odin")
    assert list(scratch.iterdir()) == []


def test_a_plant_that_fails_in_its_block_is_closed(scratch):
    with pytest.raises(PlantError, match="unknown"), Plant("odin") as plant:
        plant["nothing"] = 1.0
    assert list(scratch.iterdir()) == []
