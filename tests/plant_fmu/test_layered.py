"""Reference results in FMUs: the FMU against them, their manifest against FMPy's schema."""

import shutil
from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy import extract, simulate_fmu
from fmpy.ssp.ssd import read_ssv
from fmpy.util import read_csv
from lxml import etree

from plant_fmu import build_fmu, load_vehicle
from plant_fmu.__main__ import main
from plant_fmu.build import cached_fmu
from plant_fmu.contents.layered import FOLDER, layered_files, reference_files
from plant_fmu.contents.reference import COLUMNS, reference
from plant_fmu.vehicle import shipped_vehicles
from tests.plant_fmu.conftest import EACH_VEHICLE

XSD = Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3LayeredStandardManifest.xsd"
LS = "{http://fmi-standard.org/fmi-ls-manifest}"


@pytest.fixture
def unpacked():
    """Return a function that unpacks an FMU and returns the folder of the layered standard in it."""
    folders = []

    def unpack(fmu):
        folders.append(Path(extract(str(fmu))))
        return folders[-1] / FOLDER

    yield unpack
    for folder in folders:
        shutil.rmtree(folder)


def gap(fmu, folder, name):
    """Return the greatest difference, in any column at any row, of an FMU's run from the results beside it."""
    expected = read_csv(folder / f"{name}_out.csv")
    start = {p.name: p.value for p in read_ssv(str(folder / f"{name}_start.ssv")).parameters}
    columns = expected.dtype.names
    result = simulate_fmu(
        str(fmu), fmi_type="CoSimulation", stop_time=expected["time"][-1], output_interval=0.2, start_values=start,
        input=read_csv(folder / f"{name}_in.csv"), output=columns[1:],
    )  # fmt: skip
    got, want = (np.array(rows.tolist()) for rows in (result, expected))
    difference = got - want
    angles = [columns.index(f"attitude.{a}") for a in ("roll", "pitch", "yaw")]
    difference[:, angles] = np.angle(np.exp(1j * difference[:, angles]))
    return np.abs(difference).max()


@pytest.mark.parametrize("name", EACH_VEHICLE)
def test_fmu_reproduces_its_reference_results(name, fmi, unpacked):
    fmu = cached_fmu(load_vehicle(name), fmi)
    assert gap(fmu, unpacked(fmu), name) < 1e-6


@pytest.mark.slow
def test_custom_vehicle_with_full_actuator_model_matches_reference(fmi, tmp_path, unpacked):
    like = load_vehicle("bluerov2_heavy")
    n = like.n_thrusters
    rng = np.random.default_rng(1)
    coupled = rng.normal(size=(6, 6))
    own = replace(
        like,
        name="own",
        r_G=np.array([0.02, -0.01, 0.03]),
        inertia=np.array([[0.4, 0.02, -0.03], [0.02, 0.5, 0.01], [-0.03, 0.01, 0.6]]),
        added_mass=like.added_mass + 0.01 * (coupled + coupled.T),
        thrust_min=np.full(n, -30.0),
        thrust_time_constant=np.where(np.arange(n) % 2, 0.15, 0.0),
        thrust_rate_limit=np.where(np.arange(n) % 4 == 1, 60.0, 0.0),
        thrust_dead_band=np.full(n, 0.05),
        thrust_curve=np.full(n, 0.7),
    )
    folder = unpacked(build_fmu(own, fmi, tmp_path / "own.fmu"))
    assert sorted(f.name for f in folder.iterdir()) == ["fmi-ls-manifest.xml", "own.ssv"]
    for name, text in reference_files(own, reference(own)).items():
        (tmp_path / name).write_text(text)
    assert gap(tmp_path / "own.fmu", tmp_path, "own") < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped_vehicles())
def test_reference_files_match_the_equations(name, tmp_path):
    assert main(["reference", "--vehicle", name, "--out", str(tmp_path)]) == 0
    files = layered_files(load_vehicle(name))
    for end in ("in.csv", "out.csv"):
        (tmp_path / f"kept_{end}").write_text(files[f"{name}_{end}"])
        kept, made = read_csv(tmp_path / f"kept_{end}"), read_csv(tmp_path / f"{name}_{end}")
        assert kept.dtype.names == made.dtype.names
        assert np.allclose(np.array(kept.tolist()), np.array(made.tolist()), rtol=0.0, atol=1e-8)
    (tmp_path / "kept.ssv").write_text(files[f"{name}_start.ssv"])
    kept, made = (
        [(p.name, p.value, p.unit) for p in read_ssv(str(tmp_path / f)).parameters]
        for f in ("kept.ssv", f"{name}_start.ssv")
    )
    assert kept == made


@pytest.mark.parametrize("name", shipped_vehicles())
@pytest.mark.slow
def test_maneuver_excites_every_axis_and_reaches_limits(name):
    vehicle = load_vehicle(name)
    made = reference(vehicle)
    moved = dict(zip(COLUMNS, np.ptp(made.results, axis=0), strict=True))
    assert all(moved[f"velocity.{a}"] > 0.1 for a in "uvwpqr")
    assert np.any(made.inputs[:, 1 : 1 + vehicle.n_thrusters] > vehicle.thrust_max)


def test_manifest_is_valid(fmi, unpacked):
    folder = unpacked(cached_fmu(load_vehicle("odin"), fmi))
    root = etree.parse(folder / "fmi-ls-manifest.xml").getroot()
    assert root.tag == "fmiReferences"
    # FMPy has the schema of the attributes that every layered standard's root must have, on an element of its own
    bare = etree.Element(f"{LS}fmiLayeredStandardManifest", dict(root.attrib))
    etree.XMLSchema(file=str(XSD)).assertValid(bare)
    assert root.get(f"{LS}fmi-ls-name") == "org.fmi-standard.fmi-ls-ref"
    assert root.get(f"{LS}fmi-ls-version") == "1.0.0-beta.1"
    related = {r.get("source"): r.get("role") for r in root.findall("Related")}
    roles = ("parameter", "parameter", "testcase", "result")
    assert related == dict(zip(("odin.ssv", "odin_start.ssv", "odin_in.csv", "odin_out.csv"), roles, strict=True))
    assert {f.name for f in folder.iterdir()} == {*related, "fmi-ls-manifest.xml"}
    # what the standard's own schema lets be there
    assert {e.tag for e in root.iterdescendants()} == {"Related", "Label"}
    assert {key for e in root.findall("Related") for key in e.attrib} == {"type", "source", "role", "description"}
    labels = {r.get("source"): [label.get("name") for label in r.findall("Label")] for r in root.findall("Related")}
    manoeuvre = ["manoeuvre:reference"]
    assert labels == {"odin.ssv": [], **dict.fromkeys(("odin_start.ssv", "odin_in.csv", "odin_out.csv"), manoeuvre)}


def test_changed_vehicle_carries_no_shipped_reference_results():
    odin = load_vehicle("odin")
    assert "odin_out.csv" in layered_files(odin)
    assert layered_files(replace(odin, weight=1230.0)).keys() == {"fmi-ls-manifest.xml", "odin.ssv"}
