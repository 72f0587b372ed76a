"""NULL for each pointer of every FMI function: an error with a reason, never a crash."""

import zipfile

import fmpy
import pytest

from plant_fmu import load_vehicle
from plant_fmu.build import cached_fmu
from plant_fmu.vehicle_component import make_vehicle_component
from tests.plant_fmu.libraries import read_libraries
from tests.plant_fmu.nulls import exports, faults, functions, sweep, sweep_sources


@pytest.fixture
def library(fmi, tmp_path):
    """Return the library of ODIN's FMU, and its description."""
    path = cached_fmu(load_vehicle("odin"), fmi)
    with zipfile.ZipFile(path) as archive:
        (name,) = (name for name in archive.namelist() if name.startswith("binaries/"))
        archive.extract(name, tmp_path)
    return tmp_path / name, fmpy.read_model_description(str(path))


def test_null_sweep_covers_every_exported_function(fmi, library):
    known = functions(fmi).keys()
    (native,) = read_libraries(library[0].read_bytes())
    assert known == exports(fmi) == native.exports
    assert library[0].suffix != ".so" or native.needs <= {"libc.so.6", "libm.so.6"}


@pytest.mark.medium(fast=1)
def test_null_pointers_are_rejected(fmi, library, tmp_path):
    path, description = library
    rows = sweep(
        tmp_path, fmi, description.guid, len(description.derivatives), [str(path), f"-Wl,-rpath,{path.parent}"]
    )
    assert len(rows) > 500
    assert faults(rows) == []


@pytest.mark.slow
def test_null_pointers_are_memory_safe(fmi, tmp_path):
    """The same with the sources, under AddressSanitizer and UndefinedBehaviorSanitizer."""
    vehicle = load_vehicle("odin")
    rows = sweep_sources(tmp_path, fmi, make_vehicle_component(vehicle))
    assert len(rows) > 500
    assert faults(rows) == []
