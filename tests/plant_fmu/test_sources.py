"""The sources in an FMU: complete, and equal in results once compiled."""

import ctypes
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import pytest
from fmpy import read_model_description
from fmpy.build import build_platform_binary
from lxml import etree

from plant_fmu import load_vehicle
from plant_fmu.build import cached_fmu
from plant_fmu.compiling.compiler import find_compiler
from plant_fmu.compiling.platforms import native_platform
from tests.plant_fmu.conftest import STATES, CoSimulationInstance
from tests.plant_fmu.test_endurance import make

FMPY = Path(fmpy.__file__).parent


@pytest.fixture
def bare(fmi, tmp_path):
    """The FMU's folder without its binaries."""
    with zipfile.ZipFile(cached_fmu(load_vehicle("odin"), fmi)) as archive:
        archive.extractall(tmp_path / "bare")
    shutil.rmtree(tmp_path / "bare" / "binaries")
    return tmp_path / "bare"


def trajectory(path):
    slave = CoSimulationInstance(path).start(**{"velocity.p": 0.3})
    slave.set_values({"thrust[2]": 20.0})
    states = []
    for _ in range(100):
        slave.step(0.1)
        states += slave.get(*STATES)
    slave.close()
    return states


def test_source_list_is_complete(bare, fmi):
    (configuration, *_) = read_model_description(bare).buildConfigurations
    assert configuration.modelIdentifier == "odin"
    (files,) = configuration.sourceFileSets
    assert sorted(files.sourceFiles) == sorted(path.name for path in (bare / "sources").glob("*.c"))
    assert f"fmi{fmi}.c" in files.sourceFiles and f"fmi{5 - fmi}.c" not in files.sourceFiles
    text = (bare / "modelDescription.xml").read_text()
    assert text.count("<SourceFiles>") == (2 if fmi == 2 else 0)  # of both interfaces


def test_sources_are_complete_but_for_the_headers_of_fmi(bare, fmi):
    names = {path.name for path in (bare / "sources").iterdir()}
    assert "vehicle.h" in names
    assert not {name for name in names if re.fullmatch(r"fmi\d\w+\.h", name)}
    included = {
        name for path in (bare / "sources").glob("*.[ch]") for name in re.findall(r'#include "(.+)"', path.read_text())
    }
    assert included - names == {f"fmi{fmi}Functions.h"}


@pytest.mark.parametrize("fmi", [3])
def test_build_description_is_schema_valid(bare):
    schema = etree.XMLSchema(etree.parse(FMPY / "schema" / "fmi3" / "fmi3BuildDescription.xsd"))
    description = etree.parse(bare / "sources" / "buildDescription.xml")
    schema.assertValid(description)
    libraries = {
        configuration.get("platform"): [library.get("name") for library in configuration.findall("Library")]
        for configuration in description.findall("BuildConfiguration")
    }
    assert libraries[None] == ["m"]  # of the one for any platform
    assert libraries["x86_64-windows"] == []
    assert {files.get("language") for files in description.iter("SourceFileSet")} == {"C99"}


@pytest.mark.slow
def test_sources_compiled_by_fmpy_give_the_same_plant(bare, fmi, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(Path(sys.executable).parent), prepend=":")  # for the cmake of FMPy's own needs
    needed = (("cmake",), ("cc",), ("c++", "g++", "clang++"), ("make",))
    missing = [tools for tools in needed if not any(map(shutil.which, tools))]
    if missing or native_platform().system == "windows":
        pytest.skip(f"FMPy compiles with CMake, a C and a C++ compiler and make; missing: {missing}")
    (tmp_path / "build").mkdir()
    build_platform_binary(bare, tmp_path / "build")
    assert len(list((bare / "binaries").glob("*/odin.*"))) == 1
    expected = trajectory(cached_fmu(load_vehicle("odin"), fmi))
    assert max(map(abs, expected)) > 1.0
    packed = Path(shutil.make_archive(str(bare), "zip", bare))
    assert trajectory(packed) == pytest.approx(expected, rel=1e-10, abs=1e-10)


@pytest.mark.slow
def test_two_vehicles_can_be_linked_into_one_library(tmp_path):
    """Each under its own names, and each with its own numbers."""
    descriptions, objects, library = {}, [], tmp_path / "two.so"
    for name in ("odin", "rexrov"):
        folder = tmp_path / name
        with zipfile.ZipFile(cached_fmu(load_vehicle(name), 3)) as archive:
            archive.extractall(folder)
        descriptions[name] = read_model_description(folder)
        command = [*find_compiler(), "-std=c99", "-fPIC", "-c", f"-I{FMPY / 'c-code'}", *folder.glob("sources/*.c")]
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
        objects += folder.glob("*.o")
    command = [*find_compiler(), "-shared", *objects, "-o", library, "-lm"]
    subprocess.run(command, check=True, capture_output=True)
    loaded, masses, one = ctypes.CDLL(str(library)), [], ctypes.c_size_t(1)
    for name, description in descriptions.items():
        plant, value = make(loaded, description.guid.encode(), f"{name}_"), ctypes.c_double()
        (reference,) = (v.valueReference for v in description.modelVariables if v.name == "mass")
        arguments = ((ctypes.c_uint * 1)(reference), one, ctypes.byref(value), one)
        assert loaded[f"{name}_fmi3GetFloat64"](plant, *arguments) == 0
        masses.append(value.value)
    assert masses == [125.0, 1862.87]
