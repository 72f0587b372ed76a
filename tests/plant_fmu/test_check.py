"""`plant_fmu check`: invalid FMUs, and importers that fail, crash or hang."""

import dataclasses

import pytest

from plant_fmu import Plant, PlantError, load_vehicle
from plant_fmu.__main__ import main
from plant_fmu.build import cached_fmu
from plant_fmu.checking.check import IMPORTERS, check_fmu
from plant_fmu.checking.drivers import simulate_in_fmpy
from plant_fmu.checking.fmu_file import read_fmu
from plant_fmu.checking.process import run_importer
from plant_fmu.checking.task import Task
from plant_fmu.compiling.compiler import compile_library, find_compiler
from plant_fmu.compiling.platforms import native_platform
from plant_fmu.errors import TaskError
from tests.plant_fmu import importers
from tests.plant_fmu.conftest import members, packed

FMPY = next(importer for importer in IMPORTERS if importer.name == "FMPy")
DESCRIPTION = "modelDescription.xml"
PLANT = next(importer for importer in IMPORTERS if importer.name.startswith("Plant"))


@pytest.fixture
def odin():
    return cached_fmu(load_vehicle("odin"), 3)


@pytest.fixture
def edited(odin, tmp_path):
    """Return a function that copies ODIN's FMU with other texts in its description, and another library if given."""

    def edit(*changes, library=None):
        files = members(odin)
        for old, new in changes:
            assert old.encode() in files[DESCRIPTION]
            files[DESCRIPTION] = files[DESCRIPTION].replace(old.encode(), new.encode())
        libraries = dict.fromkeys((name for name in files if library and name.startswith("binaries/")), library)
        return packed(tmp_path / "it.fmu", files | libraries)

    return edit


@pytest.mark.medium
def test_check_passes_and_prints_a_table(fmi, capsys):
    odin = cached_fmu(load_vehicle("odin"), fmi)
    assert main(["check", str(odin), "--stop-time", "0.5", "--set", "wrench.X=5", "--set", "wrench.N=0.1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split() == ["importer", "version", "type", "verdict", "difference", "note"]
    names = [importer.name for importer in IMPORTERS]
    assert [line[: lines[0].index("version")].strip() for line in lines[1 : 1 + len(names)]] == names
    assert not any("failed" in line for line in lines)
    assert (read_fmu(odin).stop_time, read_fmu(odin).step) == (10.0, 0.01)  # of the default experiment


@pytest.mark.medium
def test_validator_finding_fails_the_check(edited, capsys):
    broken = edited(('<Unit name="kg.m2">', '<Unit name="kg.m3">'))
    assert main(["check", str(broken), "--stop-time", "0.01"]) == 1
    line = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("FMPy validation"))
    assert "failed" in line and "kg.m2" in line


def simulate_off(fmu, task, folder):
    """A driver whose outputs are slightly wrong."""
    values, note = simulate_in_fmpy(fmu, task, folder)
    return {name: value + 1e-6 for name, value in values.items()}, note


@pytest.mark.medium
def test_importer_with_another_result_fails_the_check(odin):
    off = dataclasses.replace(FMPY, name="off", driver=f"{__name__}:simulate_off")
    results = {result.importer: result for result in check_fmu(odin, 0.1, importers=(FMPY, PLANT, off))}
    assert results["off"].status == "failed"
    assert results["off"].difference == pytest.approx(1e-6, rel=1e-3)
    assert "ends at" in results["off"].note
    assert results[PLANT.name].status == "ok"
    assert results[PLANT.name].difference < 1e-12


@pytest.mark.medium
@pytest.mark.parametrize(
    ("old", "new", "status"),
    [
        ('unit="m"', 'unit="parsec"', "ok"),
        ('instantiationToken="{', 'instantiationToken="{0', "failed"),
        (' start="', ' was="', "ok"),
        ('causality="independent"', 'causality="local"', "ok"),
        ("CoSimulation", "ScheduledExecution", "does not apply"),
        ('modelIdentifier="odin"', 'modelIdentifier="other"', "does not apply"),
    ],
)
def test_check_says_what_plant_says(edited, scratch, old, new, status):
    path = edited((old, new))
    row = run_importer(PLANT, read_fmu(path), Task(0.1, 0.1))
    assert row.status == status
    if status == "ok":
        Plant(path).close()
        return
    with pytest.raises(PlantError) as caught:
        Plant(path)
    assert str(caught.value).startswith(f"{path}: ") and "\n" not in str(caught.value)
    assert list(scratch.iterdir()) == []
    assert row.note.removeprefix("the FMU ").partition(",")[0] in str(caught.value)
    assert status != "failed" or row.note == str(caught.value)


def test_importers_that_take_time_with_the_square_of_the_variables_do_not_apply_to_many(odin):
    fmu = read_fmu(odin)
    many = dataclasses.replace(fmu, variables=fmu.variables[:1] * 100_000)
    slow = [importer.name for importer in importers.IMPORTERS if "square" in importer.objection(many)]
    assert slow == ["Ecos", "CasADi"]
    assert not any("square" in importer.objection(fmu) for importer in importers.IMPORTERS)


@pytest.mark.medium
@pytest.mark.parametrize(
    ("deed", "words"),
    [
        ("abort();", "crashed (signal 6"),
        pytest.param("for (;;) { }", "not done after 1 s", marks=pytest.mark.slow),
        ("exit(0);", "ended without an answer"),
    ],
)
def test_fmu_that_crashes_its_importer_fails_the_check(edited, tmp_path, deed, words):
    (tmp_path / "bad.c").write_text(
        f"#include <stdlib.h>\n__attribute__((constructor)) static void loaded(void) {{ {deed} }}\nint nothing;\n"
    )
    library = tmp_path / "bad.so"
    compile_library(find_compiler(), native_platform(), [tmp_path / "bad.c"], [], library)
    fmu = read_fmu(edited(library=library.read_bytes()))
    result = run_importer(FMPY, fmu, Task(), timeout=1.0 if "for" in deed else 60.0)
    assert result.status == "failed" and words in result.note


@pytest.mark.medium
def test_fmu_log_messages_are_in_the_note(odin):
    result = run_importer(FMPY, read_fmu(odin), Task(stop_time=0.1, start={"mass": -1.0}))
    assert result.status == "failed"
    assert "mass = -1" in result.note and "\n" not in result.note


@pytest.mark.medium
def test_check_does_not_apply_without_a_binary_for_this_platform(odin, tmp_path):
    other = packed(tmp_path / "other.fmu", {DESCRIPTION: members(odin)[DESCRIPTION]})
    statuses = {(result.interface, result.status) for result in check_fmu(other)}
    assert statuses == {("", "ok"), ("CS", "does not apply")}


def test_files_that_are_no_fmu_are_named(tmp_path, capsys):
    """In one line; tests/security has hostile ones."""
    (tmp_path / "text.fmu").write_text("no zip")
    packed(tmp_path / "empty.fmu", {})
    for name, words in (
        ("none.fmu", "No such file"), ("", "directory"), ("text.fmu", "zip"), ("empty.fmu", "no modelDescription.xml"),
    ):  # fmt: skip
        assert main(["check", str(tmp_path / name)]) == 2
        captured = capsys.readouterr()
        assert captured.out == "" and captured.err.count("\n") == 1
        assert captured.err.startswith(f"plant_fmu: {tmp_path / name}: ") and words in captured.err


def test_invalid_tasks_are_rejected(odin):
    for task, words in (
        ((1.0, 0.3), "whole number of steps"), ((-1.0,), "positive"), ((0.1, 0.1, {"masss": 1.0}), "mean 'mass'"),
    ):  # fmt: skip
        with pytest.raises(TaskError, match=words):
            check_fmu(odin, *task)
