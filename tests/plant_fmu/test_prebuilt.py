"""Prebuilt libraries: equal to compiled ones, and unused where they do not fit."""

import dataclasses
import os
import struct
import zipfile
from hashlib import sha256

import pytest

from plant_fmu import build_fmu, load_vehicle
from plant_fmu.build import cached_fmu
from plant_fmu.compiling import prebuilt
from plant_fmu.compiling.compiler import cross_compiler, find_compiler
from plant_fmu.compiling.libraries import compiled_libraries
from plant_fmu.compiling.platforms import cross_platforms, native_platform
from plant_fmu.compiling.signature import re_sign
from plant_fmu.description import token
from plant_fmu.errors import BuildError
from plant_fmu.vehicle_component import make_vehicle_component
from tests.plant_fmu.conftest import EACH_FMI, EACH_VEHICLE, STATES, CoSimulationInstance
from tests.plant_fmu.libraries import macs, signed_pages

HERE = native_platform()


@pytest.fixture
def fmi():
    """FMI's version where a test names none: each is a compilation."""
    return 3


@pytest.fixture
def folder(once, fmi):
    """A folder as in a wheel, with this machine's libraries alone."""

    def make(folder):
        for general in prebuilt.shipped_structures():
            ((_, library),) = compiled_libraries(general, prebuilt.STAND_IN, fmi, [(HERE, find_compiler())])
            with zipfile.ZipFile(folder / prebuilt.file_name(general, fmi), "w") as archive:
                archive.writestr(f"{HERE.name}{HERE.suffix}", library)

    return once(f"prebuilt-here-{fmi}", make)


@pytest.fixture
def compiled():
    """Return a function that returns a vehicle's FMU as this machine's compiler builds it, regardless of patches."""
    with_compiler = prebuilt.FOLDER, os.environ.get("CC")

    def fmu(vehicle, fmi):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(prebuilt, "FOLDER", with_compiler[0])
            if with_compiler[1] is None:
                patch.delenv("CC", raising=False)
            else:
                patch.setenv("CC", with_compiler[1])
            return cached_fmu(load_vehicle(vehicle), fmi)

    return fmu


@pytest.fixture
def no_compiler(folder, monkeypatch):
    """A package with prebuilt libraries on a machine without a compiler."""
    monkeypatch.setattr(prebuilt, "FOLDER", folder)
    monkeypatch.setenv("CC", "no-such-compiler")


@pytest.mark.medium
@pytest.mark.parametrize("vehicle", EACH_VEHICLE)
@EACH_FMI
def test_prebuilt_plant_equals_a_compiled_one(vehicle, fmi, compiled, no_compiler, tmp_path):
    path = build_fmu(load_vehicle(vehicle), fmi, tmp_path / "x.fmu")
    answers = []
    for file in (compiled(vehicle, fmi), path):
        slave = CoSimulationInstance(file).start(**{"velocity.p": 0.3})
        slave.set_values({"thrust[2]": 20.0})
        slave.step(1.0)
        parameters = [v.name for v in slave.description.modelVariables if v.causality == "parameter"]
        answers.append(slave.get(*STATES, *(name for name in parameters if name not in ("seed", "free_surface"))))
        slave.close()
    assert len(answers[0]) > 150 and max(map(abs, answers[0])) > 1.0
    assert answers[0] == answers[1]


@pytest.mark.medium
def test_prebuilt_library_takes_custom_vehicle_parameters(no_compiler, tmp_path):
    own = dataclasses.replace(load_vehicle("odin"), name="own", mass=130.25)
    slave = CoSimulationInstance(build_fmu(own, 3, tmp_path / "own.fmu")).start()
    assert slave.get("mass") == [130.25]
    slave.close()


@pytest.mark.medium
def test_other_thruster_count_needs_the_compiler(no_compiler, tmp_path):
    odin = load_vehicle("odin")
    given = {name: value[..., :5] for name, value in vars(odin).items() if name.startswith("thrust")}
    own = dataclasses.replace(odin, name="own", autopilot=None, **given)
    with pytest.raises(BuildError, match="no C compiler"):
        build_fmu(own, 3, tmp_path / "own.fmu")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("change", ["source", "flag", "header", "C library"])
def test_prebuilt_libraries_that_do_not_fit_are_rejected(no_compiler, tmp_path, monkeypatch, change):
    from plant_fmu.compiling import libraries, sources

    if change == "source":
        files = sources._files

        def changed(place):
            return {name: data + b"\n" * (name == "instance.c") for name, data in files(place).items()}

        monkeypatch.setattr(sources, "_files", changed)
    elif change == "flag":
        monkeypatch.setattr(libraries, "FLAGS", (*libraries.FLAGS, "-Os"))
    elif change == "C library":  # of Linux

        def confstr(name):
            raise ValueError("unrecognized configuration name")  # as musl has it

        if HERE.system != "linux":
            pytest.skip("about the C libraries of Linux")
        monkeypatch.setattr("os.confstr", confstr)
    else:
        (tmp_path / "fmi3Functions.h").write_text("other")
        monkeypatch.setattr(libraries, "FMI_HEADERS", tmp_path)
    with pytest.raises(BuildError, match="no C compiler"):
        build_fmu(load_vehicle("odin"), 3, tmp_path / "x.fmu")


def test_missing_platforms_are_compiled(folder, monkeypatch):
    monkeypatch.setattr(prebuilt, "FOLDER", folder)
    odin = make_vehicle_component(load_vehicle("odin"))
    key = token(odin, 3)
    assert prebuilt.prebuilt_libraries(odin, key, 3, [HERE])
    other = dataclasses.replace(HERE, name="riscv64-linux")
    assert prebuilt.prebuilt_libraries(odin, key, 3, [HERE, other]) is None


@pytest.mark.parametrize("damage", ["half", "flipped", "another table"])
def test_damaged_libraries_are_named(folder, tmp_path, monkeypatch, damage):
    monkeypatch.setattr(prebuilt, "FOLDER", tmp_path)
    for file in folder.iterdir():
        data, place = file.read_bytes(), tmp_path / file.name
        with zipfile.ZipFile(place, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr(f"{HERE.name}{HERE.suffix}", b"no table" if damage == "another table" else data)
        data = place.read_bytes()
        if damage == "half":
            place.write_bytes(data[: len(data) // 2])
        elif damage == "flipped":  # in the middle of what is compressed
            place.write_bytes(data[:60] + b"\xff" * 30 + data[90:])
    with pytest.raises(BuildError, match=r"damaged|has another table") as refused:
        build_fmu(load_vehicle("odin"), 3, tmp_path / "x.fmu")
    assert str(tmp_path) in str(refused.value) or damage == "another table"
    assert not (tmp_path / "x.fmu").exists()


def test_libraries_without_a_signature_are_unchanged():
    assert re_sign(b"\x7fELF and more") == b"\x7fELF and more"


@pytest.mark.slow
@pytest.mark.timeout(900)  # the first that needs them compiles for all platforms
def test_prebuilt_libraries_match_linker_output(prebuilt_of_eight, monkeypatch):
    """Even the signature of a Mac's: the linker wrote the one, `re_sign` the other. But for marks of identity."""
    compilers = [(platform, cross_compiler(platform)) for platform in cross_platforms("all")]
    odin = make_vehicle_component(load_vehicle("odin"))
    key = token(odin, 3)
    with zipfile.ZipFile(prebuilt_of_eight) as archive:
        stand_ins = [archive.read(f"{platform.name}{platform.suffix}") for platform, _ in compilers]
    monkeypatch.setattr(prebuilt, "FOLDER", prebuilt_of_eight.parent)
    written = prebuilt.prebuilt_libraries(odin, key, 3, cross_platforms("all"))
    compiled = compiled_libraries(dataclasses.replace(odin, name=prebuilt.NAME), key, 3, compilers)
    assert [platform.name for platform, data in compiled] == [platform.name for platform, data in written]
    for (platform, theirs), (_, ours), before in zip(compiled, written, stand_ins, strict=True):
        assert not differing(ours, theirs) - identity(platform, ours), platform.name
        assert differing(ours, before) - identity(platform, ours), platform.name
        if platform.name == "aarch64-darwin":
            assert all(ours[at:][:32] == sha256(page).digest() for at, page in signed_pages(ours, *macs(ours)))


def differing(one, other):
    assert len(one) == len(other)
    return {i for i, (x, y) in enumerate(zip(one, other, strict=True)) if x != y}


def identity(platform, library):
    """Return the places of what a linker draws from a whole library, to tell builds apart in a debugger."""
    if platform.system == "windows":  # its "time stamp", in the header and in the directory of debug information
        stamp = library[struct.unpack_from("<I", library, 60)[0] + 8 :][:4]
        return {i + j for i in range(len(library)) if library.startswith(stamp, i) for j in range(4)}
    if platform.system == "linux":  # GNU_BUILD_ID, which some compilers ask their linker for
        start = library.find(struct.pack("<3I", 4, 20, 3) + b"GNU\0") + 16
        return set(range(start, start + 20)) if start >= 16 else set()
    (mac,) = macs(library)  # LC_UUID, and with a signature the hash of the page that it is on
    found = set(range(mac.uuid.command_offset + 8, mac.uuid.command_offset + mac.uuid.size))
    for place, _ in signed_pages(library, mac)[:1]:
        found |= set(range(place, place + 32))
    return found
