"""`plant_fmu check`: invalid FMUs, and importers that fail, crash or hang."""

import dataclasses
import shutil
import stat
import zipfile

import pytest

from plant_fmu import Plant, PlantError, load_vehicle, unpacking
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

FMPY = next(importer for importer in IMPORTERS if importer.name == "FMPy")
PLANT = next(importer for importer in IMPORTERS if importer.name.startswith("Plant"))
DESCRIPTION = '<fmiModelDescription fmiVersion="3.0"><ModelVariables/></fmiModelDescription>'


@pytest.fixture
def odin():
    return cached_fmu(load_vehicle("odin"), 3)


def write(path, **members):
    """Write a zip of members whose names have __ for a slash."""
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in members.items():
            archive.writestr(name.replace("__", "/"), text)
    return path


def changed(source, target, change):
    """Copy an FMU, passing each member's bytes through `change(name, data)`."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            new.writestr(name, change(name, old.read(name)))
    return target


def refused(path, capsys, *words):
    assert main(["check", str(path)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith(f"plant_fmu: {path}: ")
    assert captured.err.count("\n") == 1
    for word in words:
        assert word in captured.err


@pytest.mark.medium
def test_check_passes_and_prints_a_table(fmi, capsys):
    odin = cached_fmu(load_vehicle("odin"), fmi)
    assert main(["check", str(odin), "--stop-time", "0.5", "--set", "wrench.X=5", "--set", "wrench.N=0.1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split() == ["importer", "version", "type", "verdict", "difference", "note"]
    assert [importer.name for importer in IMPORTERS] == [
        next(name for name in sorted((i.name for i in IMPORTERS), key=len, reverse=True) if line.startswith(name))
        for line in lines[1 : 1 + len(IMPORTERS)]
    ]
    assert not any("failed" in line for line in lines)


def test_times_come_from_the_default_experiment(odin):
    fmu = read_fmu(odin)
    assert (fmu.stop_time, fmu.step) == (10.0, 0.01)


@pytest.mark.medium
def test_validator_finding_fails_the_check(odin, tmp_path, capsys):
    def drop_unit(name, data):
        return data.replace(b'<Unit name="kg.m2">', b'<Unit name="kg.m3">') if name.endswith(".xml") else data

    broken = changed(odin, tmp_path / "broken.fmu", drop_unit)
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
def test_fmu_log_messages_are_in_the_note(odin):
    result = run_importer(FMPY, read_fmu(odin), Task(stop_time=0.1, start={"mass": -1.0}))
    assert result.status == "failed"
    assert "mass = -1" in result.note and "\n" not in result.note


@pytest.mark.medium
@pytest.mark.parametrize(
    ("old", "new", "status"),
    [
        ('unit="m"', 'unit="parsec"', "failed"),
        ('instantiationToken="{', 'instantiationToken="{0', "failed"),
        (' start="', ' was="', "failed"),
        ('causality="independent"', 'causality="local"', "failed"),
        ("CoSimulation", "ScheduledExecution", "does not apply"),
        ('modelIdentifier="odin"', 'modelIdentifier="other"', "does not apply"),
    ],
)
def test_check_says_what_plant_says(odin, tmp_path, old, new, status):
    path = changed(
        odin,
        tmp_path / "it.fmu",
        lambda name, data: data.replace(old.encode(), new.encode()) if "Desc" in name else data,
    )
    with pytest.raises(PlantError) as caught:
        Plant(path)
    row = run_importer(PLANT, read_fmu(path), Task(0.1, 0.1))
    assert row.status == status
    if status == "failed":
        assert row.note == str(caught.value)
    else:
        assert row.note.removeprefix("the FMU ").partition(",")[0] in str(caught.value)


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
def test_fmu_that_crashes_its_importer_fails_the_check(odin, tmp_path, deed, words):
    (tmp_path / "bad.c").write_text(
        f"#include <stdlib.h>\n__attribute__((constructor)) static void loaded(void) {{ {deed} }}\nint nothing;\n"
    )
    library = tmp_path / "bad.so"
    compile_library(find_compiler(), native_platform(), [tmp_path / "bad.c"], [], library)

    def replaced(name, data):
        return library.read_bytes() if name.startswith("binaries/") else data

    fmu = read_fmu(changed(odin, tmp_path / "bad.fmu", replaced))
    result = run_importer(FMPY, fmu, Task(), timeout=1.0 if "for" in deed else 60.0)
    assert result.status == "failed"
    assert words in result.note


@pytest.mark.medium
def test_check_does_not_apply_without_a_binary_for_this_platform(odin, tmp_path):
    other = tmp_path / "other.fmu"
    with zipfile.ZipFile(odin) as old, zipfile.ZipFile(other, "w") as new:
        new.writestr("modelDescription.xml", old.read("modelDescription.xml"))
    statuses = {(result.interface, result.status) for result in check_fmu(other)}
    assert statuses == {("", "ok"), ("CS", "does not apply")}


def test_invalid_fmu_files_are_rejected(tmp_path, capsys):
    refused(tmp_path / "none.fmu", capsys, "No such file")
    refused(tmp_path, capsys, "directory")
    (tmp_path / "text.fmu").write_text("no zip")
    refused(tmp_path / "text.fmu", capsys, "zip")
    refused(write(tmp_path / "empty.fmu"), capsys, "no modelDescription.xml")
    refused(write(tmp_path / "bad.fmu", **{"modelDescription.xml": "<fmi"}), capsys, "no XML")
    refused(write(tmp_path / "other.fmu", **{"modelDescription.xml": "<svg/>"}), capsys, "expected 2.0 or 3.0")
    old = DESCRIPTION.replace("3.0", "1.0")
    refused(write(tmp_path / "old.fmu", **{"modelDescription.xml": old}), capsys, "'1.0'", "expected 2.0 or 3.0")
    strange = DESCRIPTION.replace("<ModelVariables/>", "<ModelVariables><Float64/></ModelVariables>")
    refused(write(tmp_path / "strange.fmu", **{"modelDescription.xml": strange}), capsys, "name")


@pytest.mark.parametrize("name", ["../out.txt", "a/../../out.txt", "/out.txt", "C:/out.txt", "a\\..\\out.txt"])
def test_path_traversal_is_rejected(tmp_path, capsys, name):
    path = write(tmp_path / "slip.fmu", **{"modelDescription.xml": DESCRIPTION, name: "x"})
    refused(path, capsys, "leads out")


def test_links_are_refused(tmp_path, capsys):
    path = write(tmp_path / "link.fmu", **{"modelDescription.xml": DESCRIPTION})
    with zipfile.ZipFile(path, "a") as archive:
        link = zipfile.ZipInfo("resources/link")
        link.external_attr = (stat.S_IFLNK | 0o777) << 16
        archive.writestr(link, "/etc")
    refused(path, capsys, "leads out")


def test_oversized_members_are_rejected(tmp_path, capsys, monkeypatch):
    path = write(tmp_path / "large.fmu", **{"modelDescription.xml": DESCRIPTION, "resources/zeros": "0" * 10_000})
    monkeypatch.setattr(unpacking, "MAX_SIZE", 9_999)
    refused(path, capsys, "refused", "expected at most 9999")
    monkeypatch.setattr(unpacking, "MAX_FILES", 1)
    refused(path, capsys, "holds 2 files")


def test_damaged_files_are_refused(odin, tmp_path, capsys):
    damaged = tmp_path / "damaged.fmu"
    shutil.copy(odin, damaged)
    data = bytearray(damaged.read_bytes())
    data[len(data) // 3] ^= 0xFF
    damaged.write_bytes(data)
    refused(damaged, capsys)


def test_invalid_tasks_are_rejected(odin):
    with pytest.raises(TaskError, match="whole number of steps"):
        check_fmu(odin, 1.0, 0.3)
    with pytest.raises(TaskError, match="positive"):
        check_fmu(odin, -1.0)
    with pytest.raises(TaskError, match="did you mean 'mass'"):
        check_fmu(odin, start={"masss": 1.0})
