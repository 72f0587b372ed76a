"""Malicious FMUs: both readers reject each in the same line, and nothing of it is written or run."""

import io
import os
import platform
import re
import stat
import struct
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import pytest

from plant_fmu import Plant, PlantError, load_vehicle, unpacking
from plant_fmu.build import cached_fmu
from plant_fmu.checking.fmu_file import read_fmu
from plant_fmu.errors import FmuFileError
from plant_fmu.running import instance
from plant_fmu.shared_library import library_defect

SOUND = (
    '<fmiModelDescription fmiVersion="3.0" modelName="m" instantiationToken="t">'
    '<CoSimulation modelIdentifier="m"/><ModelVariables>'
    '<Float64 name="time" valueReference="0" causality="independent"/>'
    "</ModelVariables><ModelStructure/></fmiModelDescription>"
)


@pytest.fixture
def read(tmp_path, monkeypatch):
    """Return a function that opens an FMU that must be rejected, and returns the message."""
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(scratch))

    def refused(path):
        before = set(tmp_path.rglob("*"))
        said = []
        for reader in (read_fmu, Plant):
            with pytest.raises((FmuFileError, PlantError)) as caught:
                reader(path)
            said.append(str(caught.value))
        assert said[0] == said[1]
        assert said[0].startswith(f"{path}: ") and "\n" not in said[0] and len(said[0]) < 2000 + len(str(path))
        assert set(tmp_path.rglob("*")) == before
        return said[0]

    return refused


def archive(path, members, description=SOUND, **writing):
    with zipfile.ZipFile(path, "w", **writing) as made:
        made.writestr("modelDescription.xml", description)
        for member, data in members:
            made.writestr(member, data)
    return path


def described(tmp_path, old, new):
    assert old in SOUND
    return archive(tmp_path / "it.fmu", [], SOUND.replace(old, new))


# ---- the zip file ----


LINK = zipfile.ZipInfo("binaries")
LINK.external_attr = (stat.S_IFLNK | 0o777) << 16
OUTSIDE = ["../out", "a/../../out", "/out", "C:/out", "C:out", "a\\..\\..\\out", "\\\\host\\out", ".."]
OUTSIDE += ["a\nb", "a\x1bb"]
TWICE = [
    ("a", "a"), ("a", "A"), ("x/ß", "x/SS"), ("é", "e\u0301"), ("d/a", "d//a"), ("a", "./a"), ("a./b", "a/b. "),
    ("a/", "a"), ("modelDescription.xml",),
]  # fmt: skip
EXTERNAL = '<!DOCTYPE x SYSTEM "file:///etc/passwd">'


@pytest.mark.filterwarnings("ignore:Duplicate name")
@pytest.mark.parametrize(
    ("members", "words"),
    [
        *(([(name, "x")], "leads out|no name of a file|has a backslash") for name in OUTSIDE),
        ([(LINK, "/tmp")], "leads out"),
        *(([(name, f"{i}") for i, name in enumerate(names)], "would be written over") for names in TWICE),
        ([("sources/buildDescription.xml", f"{EXTERNAL}<x/>")], r"buildDescription\.xml is no XML that can be read"),
    ],
)
def test_hostile_members_are_rejected(tmp_path, read, members, words):
    assert re.search(words, read(archive(tmp_path / "it.fmu", members)))
    assert not (tmp_path.parent / "out").exists()


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_duplicate_folder_entries_are_accepted(tmp_path):
    path = archive(tmp_path / "it.fmu", [("resources/", ""), ("resources/a", "x"), ("resources/", "")])
    assert read_fmu(path).fmi == 3
    unpacking.unpack(path, tmp_path / "folder", ["linux64", "x86_64-linux"])
    assert (tmp_path / "folder" / "resources" / "a").read_text() == "x"


@pytest.mark.medium(fast=1)
def test_decompression_bombs_are_rejected_unread(tmp_path, read):
    path = tmp_path / "it.fmu"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as made:
        made.writestr("modelDescription.xml", SOUND)
        with made.open("resources/zeros", "w") as member:
            for _ in range(unpacking.FREE_SIZE // 2**20 + 1):
                member.write(bytes(2**20))
    assert path.stat().st_size < 200_000
    assert "expected at most 200 times as many" in read(path)


def header_of(content, name):
    """Return where the local header of a member is."""
    with zipfile.ZipFile(io.BytesIO(content)) as made:
        return made.getinfo(name).header_offset


def encrypted(content, name):
    changed = bytearray(content)
    changed[header_of(content, name) + 6] |= 1
    changed[content.rindex(name.encode()) - 46 + 8] |= 1
    return changed


def flipped(content, name):
    start = header_of(content, name) + 30 + len(name)
    return content[:start] + b"<" + bytes([content[start + 1] ^ 1]) + content[start + 2 :]


def shrunk(content, name):
    """The directory states ten bytes, and the member unpacks to ten million."""
    lying = content.replace(struct.pack("<I", 10_000_000), struct.pack("<I", 10))
    with zipfile.ZipFile(io.BytesIO(lying)) as archive:
        assert archive.getinfo(name).file_size == 10
    return lying


@pytest.mark.parametrize(
    ("change", "name", "words"),
    [
        (lambda content, _: content.replace(b"documentation/aXb", b"documentation/a\0b"), "documentation/aXb",
         "no name of a file"),
        *((encrypted, name, "encrypted") for name in ("modelDescription.xml", "resources/it")),
        *((flipped, name, "is no FMU|no XML") for name in ("modelDescription.xml", "documentation/index.html")),
        (shrunk, "resources/zeros", "is no FMU"),
    ],
)  # fmt: skip
def test_damaged_members_are_rejected(tmp_path, read, change, name, words):
    members = [(name, bytes(10_000_000) if change is shrunk else "words")] if name != "modelDescription.xml" else []
    method = zipfile.ZIP_DEFLATED if change is shrunk else zipfile.ZIP_STORED
    path = archive(tmp_path / "it.fmu", members, compression=method)
    path.write_bytes(change(path.read_bytes(), name))
    assert re.search(words, read(path))


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_unbounded_compression_methods_are_rejected(tmp_path, read, method):
    assert "neither stored nor deflated" in read(archive(tmp_path / "it.fmu", [], compression=method))


def test_oversized_member_list_is_rejected(tmp_path, read):
    path = tmp_path / "it.fmu"
    entry = struct.pack("<4s4B4HL2L5H2L", b"PK\1\2", 20, 3, 20, 0, *[0] * 14) + b"a"
    entry = entry[:28] + struct.pack("<H", 1) + entry[30:]
    count = unpacking.MAX_READ // len(entry) + 2
    end = struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, 65535, 65535, count * len(entry), 0, 0)
    path.write_bytes(entry * count + end)
    assert f"larger than {unpacking.MAX_READ} bytes" in read(path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes by name")
def test_named_pipe_is_rejected_without_blocking(tmp_path, read):
    os.mkfifo(tmp_path / "it.fmu")
    assert "expected a file" in read(tmp_path / "it.fmu")


# ---- its model description ----

LAUGHS = "".join(f'<!ENTITY e{i} "{f"&e{i - 1};" * 10}">' for i in range(1, 12))
TYPED = [
    f'<!DOCTYPE x [<!ENTITY e0 "ha">{LAUGHS}]>' + SOUND.replace('modelName="m"', 'modelName="&e11;"'),
    '<!DOCTYPE x [<!ENTITY e SYSTEM "file:///etc/passwd">]>' + SOUND.replace("<ModelStructure/>", "&e;"),
    '<!DOCTYPE x SYSTEM "http://127.0.0.1:9/x.dtd">' + SOUND,
    ('<?xml version="1.0" encoding="UTF-16"?><!DOCTYPE x [<!ENTITY e "ha">]>' + SOUND).encode("utf-16"),
]
BROKEN = [
    "<a>" * 100_000, '<?xml version="1.0" encoding="nonsense"?><a/>', '<?xml version="1.0" encoding="utf-7"?><a/>',
    "<a b='\0'/>", b"\xff\xfe\xff", "",
]  # fmt: skip


@pytest.mark.parametrize("document", TYPED + BROKEN)
def test_hostile_xml_descriptions_are_rejected(tmp_path, read, document):
    words = "document type" if document in TYPED else "no XML that can be read"
    assert words in read(archive(tmp_path / "it.fmu", [], document))


TEN_THOUSAND = '<Dimension start="10000"/>'
VARIABLE = 'name="time" valueReference="0" causality="independent"/>'


ALIASES = '<Alias name="b"/>' * 5


@pytest.mark.parametrize(
    ("limit", "value", "members", "more", "words"),
    [
        ("MAX_FILES", 5, 6, "", "holds 7 files"),
        ("MAX_SIZE", 5_999, 6, "", "bytes when extracted, expected at most 5999"),
        ("MAX_XML", 1000, 0, " " * 1000, "expected at most 1000"),
        ("MAX_ELEMENTS", 5, 0, "<a/><b/>", "more than 5 elements"),
        ("MAX_VARIABLES", 5, 0, f"<Float64 {VARIABLE}" * 5, "more than 5 variables"),
        ("MAX_VARIABLES", 5, 0, f"<Float64 {VARIABLE[:-2]}>{ALIASES}</Float64>", "more than 5 variables"),
    ],
)
def test_oversized_contents_are_rejected_before_they_are_read(
    tmp_path, read, monkeypatch, limit, value, members, more, words
):
    monkeypatch.setattr(unpacking, limit, value)
    files = [(f"resources/{i}", "0" * 1000) for i in range(members)]
    assert words in read(archive(tmp_path / "it.fmu", files, SOUND.replace("</ModelV", f"{more}</ModelV")))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('Identifier="m"', 'Identifier="../../../m"', "modelIdentifier"),
        ('Identifier="m"', 'Identifier="/m"', "modelIdentifier"),
        ('Identifier="m"', 'Identifier=""', "modelIdentifier"),
        ('Identifier="m"', f'Identifier="{"m" * 100_000}"', "modelIdentifier"),
        ('Reference="0"', f'Reference="{2**32}"', "expected a whole number of at most 4294967295"),
        ('Reference="0"', f'Reference="{"9" * 5000}"', "valueReference"),
        ('Reference="0"', 'Reference="-1"', "valueReference"), ('Reference="0"', 'Reference="1_0"', "valueReference"),
        (' valueReference="0"', "", "valueReference"), ('name="time"', "", "has no name"),
        ('name="time"', 'name=""', "has 0 characters"),
        ('name="time"', f'name="{"n" * 1_000_000}"', "1000000 characters"),
        (VARIABLE, 'name="a" valueReference="1"><Dimension start="1000000000"/></Float64>', "a dimension"),
        (VARIABLE, f'name="a" valueReference="1">{TEN_THOUSAND * 3}</Float64>', "entries"),
        ("<ModelV", '<DefaultExperiment stepSize="0"/><ModelV', "stepSize"),
        ("<ModelV", '<DefaultExperiment stepSize="NaN"/><ModelV', "stepSize"),
        ("<ModelV", '<DefaultExperiment stepSize="-1"/><ModelV', "stepSize"),
        ("<ModelV", '<DefaultExperiment stopTime="INF"/><ModelV', "stopTime"),
        ("<ModelV", '<DefaultExperiment startTime="x"/><ModelV', "startTime"),
        ('fmiVersion="3.0"', 'fmiVersion="1.0"', "FMI version is '1.0', expected 2.0 or 3.0"),
        (SOUND, "<svg/>", "FMI version is '', expected 2.0 or 3.0"),
        ('fmiVersion="3.0"', 'fmiVersion="3"', "FMI version is '3', expected 2.0 or 3.0"),
        ('fmiVersion="3.0"', 'fmiVersion="2.1"', "FMI version"), ('fmiVersion="3.0"', "", "FMI version is ''"),
        ('modelName="m"', 'modelName="m" numberOfEventIndicators="1000000000"', "numberOfEventIndicators"),
    ],
)  # fmt: skip
def test_invalid_description_numbers_and_names_are_rejected(tmp_path, read, old, new, words):
    assert words in read(described(tmp_path, old, new))


# ---- its binary ----


def binary(tmp_path, data):
    with zipfile.ZipFile(cached_fmu(load_vehicle("odin"), 3)) as source:
        description = source.read("modelDescription.xml").decode()
    place = f"binaries/{fmpy.platform_tuple}/odin{fmpy.sharedLibraryExtension}"
    return archive(tmp_path / "it.fmu", [(place, data)], description)


@pytest.fixture(scope="module")
def no_fmu(tmp_path_factory):
    folder = tmp_path_factory.mktemp("library")
    (folder / "it.c").write_text("int harmless(void) { return 1; }\n")
    subprocess.run(["cc", "-shared", "-fPIC", "-o", folder / "it.so", folder / "it.c"], check=True)
    return (folder / "it.so").read_bytes()


ON_LINUX = pytest.mark.skipif(sys.platform != "linux" or platform.machine() != "x86_64", reason="of another machine")


@ON_LINUX
def test_libraries_without_fmi_functions_are_rejected(tmp_path, no_fmu):
    with pytest.raises(PlantError) as caught:
        Plant(binary(tmp_path, no_fmu))
    assert str(caught.value).startswith(str(tmp_path / "it.fmu")) and "\n" not in str(caught.value)


@ON_LINUX
def test_libraries_for_other_machines_are_rejected(tmp_path, read, no_fmu):
    def edited(*changes):
        data = bytearray(no_fmu)
        for at, byte in changes:
            data[at] = byte
        return bytes(data)

    for data, words in (
        (b"", "is no ELF library"),
        (b"MZ" + bytes(100), "is no ELF library"),
        (edited((4, 7)), "is no ELF library: its class or byte order is unknown"),
        (edited((16, 2)), "is no ELF library but another ELF file"),
        (edited((18, 0xB7)), "is for processor aarch64, expected x86_64"),
        (edited((18, 0xF3)), "is for processor 243, expected x86_64"),
        (edited((5, 2)), ""),  # big-endian: its numbers make no sense
    ):
        assert f"binaries/x86_64-linux/odin.so {words}" in read(binary(tmp_path, data))


@ON_LINUX
@pytest.mark.parametrize("kept", [4, 0.2, 0.5, 0.9, -1])
def test_libraries_that_are_cut_short_are_rejected(tmp_path, read, no_fmu, kept):
    """The system's loader would map what is not there, and end the process with SIGBUS."""
    kept = int(kept * len(no_fmu)) if 0 < kept < 1 else kept
    assert "is cut short" in read(binary(tmp_path, no_fmu[:kept]))
    if kept > 0:
        assert "is no ELF library" in read(binary(tmp_path, no_fmu[:kept].ljust(len(no_fmu), b"\0")))


@pytest.mark.parametrize(("bits", "order"), [(1, "<"), (1, ">"), (2, "<"), (2, ">")])
def test_elf_headers_are_read_in_each_class_and_byte_order(bits, order):
    sizes, words = ((52, 32, 40), "III") if bits == 1 else ((64, 56, 64), "QQQ")
    header = b"\x7fELF" + bytes([bits, "<>".index(order) + 1, 1]).ljust(12, b"\0")
    header += struct.pack(
        f"{order}HHI{words}IHHHHHH", 3, 62 if bits == 2 else 3, 1, 0, sizes[0], 0, 0, *sizes[:2], 1, 0, 0, 0
    )
    if bits == 1:
        program = struct.pack(f"{order}8I", 1, 100, 0, 0, 400, 400, 5, 4096)
    else:
        program = struct.pack(f"{order}IIQQQQQQ", 1, 5, 100, 0, 0, 400, 400, 4096)
    data = (header + program).ljust(500, b"\0")
    machine = "x86_64-linux" if bits == 2 else "x86-linux"
    said = "" if order == "<" else f"is for processor {machine[:-6]}, big-endian, expected {machine[:-6]}"
    assert library_defect(io.BytesIO(data), 500, machine) == said
    if order == "<":
        for kept in (4, 10, 50, 60, 90, 130, 499):
            assert "is cut short" in library_defect(io.BytesIO(data[:kept]), kept, machine)
    other = "is for processor x86" + ("_64" if bits == 2 else "") + (", big-endian" if order == ">" else "")
    assert library_defect(io.BytesIO(data), 500, "aarch64-linux") == f"{other}, expected aarch64"


@ON_LINUX
def test_libraries_beside_the_fmus_own_are_checked(tmp_path, read, no_fmu):
    with zipfile.ZipFile(binary(tmp_path, no_fmu), "a") as made:
        made.writestr("binaries/x86_64-linux/readme.txt", "not a library")
        made.writestr("binaries/aarch64-linux/odin.so", b"not checked here")
        made.writestr("binaries/x86_64-linux/libhelper.so.1", no_fmu[:-10])
    assert "libhelper.so.1 is cut short" in read(tmp_path / "it.fmu")


FOREIGN = [  # libraries that FMPy ships, built by others
    path for suffix in ("so", "dll", "dylib") for path in sorted(Path(fmpy.__file__).parent.glob(f"**/*.{suffix}"))
]
SYSTEMS = {".so": "linux", ".dll": "windows", ".dylib": "darwin"}


@pytest.mark.parametrize("path", FOREIGN, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_libraries_of_each_system_are_accepted_whole_and_refused_cut(path):
    data = path.read_bytes()
    processor = next((name for name in ("aarch64", "x86_64") if name in str(path.parent.name)), "x86_64")
    here = f"{'x86' if path.parent.name in ('win32', 'linux32') else processor}-{SYSTEMS[path.suffix]}"

    def defect(data, platform=here, **more):
        return library_defect(io.BytesIO(data), len(data), platform, **more)

    assert defect(data) == ""
    for kept in (40, 200, 1000, len(data) // 2, len(data) - 1):
        assert "cut short" in defect(data[:kept]) and "cut short" in defect(data[:kept], is_loaded=False)
    other = "aarch64" if here.startswith("x86") else "x86_64"
    if path.suffix != ".dylib":  # those are universal
        assert f"expected {other}" in defect(data, f"{other}-{SYSTEMS[path.suffix]}")
    assert "is no" in defect(data, "x86_64-linux" if path.suffix != ".so" else "x86_64-windows")


def test_extracted_files_are_private_to_the_owner(monkeypatch):
    made = []
    monkeypatch.setattr(instance, "unpack", lambda *of: made.append(of[1]) or unpacking.unpack(*of))
    plant = Plant("odin")
    assert stat.S_IMODE(made[0].stat().st_mode) == 0o700
    plant.close()
    assert not made[0].exists()


def test_only_members_needed_for_a_run_are_extracted(tmp_path):
    members = ["binaries/x86_64-linux/it.so", "binaries/x86_64-linux/of/it.so", "binaries/aarch64-linux/it.so",
               "documentation/index.html", "sources/it.c", "resources/sources/it.c", "extra/it/a.xml"]  # fmt: skip
    path = archive(tmp_path / "it.fmu", [(name, "x") for name in members])
    unpacking.unpack(path, tmp_path / "folder", ["linux64", "x86_64-linux"])
    found = {file.relative_to(tmp_path / "folder").as_posix() for file in (tmp_path / "folder").rglob("*.*")}
    assert found - {"modelDescription.xml"} == {
        "binaries/x86_64-linux/it.so", "binaries/x86_64-linux/of/it.so", "resources/sources/it.c", "extra/it/a.xml"
    }  # fmt: skip


def test_no_binary_of_another_folder_is_loaded(tmp_path):
    """An identifier that leads out of the FMU would load a foreign library."""
    with zipfile.ZipFile(cached_fmu(load_vehicle("odin"), 3)) as source:
        description = source.read("modelDescription.xml").decode()
        library = source.read(f"binaries/{fmpy.platform_tuple}/odin{fmpy.sharedLibraryExtension}")
    (tmp_path / f"planted{fmpy.sharedLibraryExtension}").write_bytes(library)
    path = archive(
        tmp_path / "it.fmu", [], description.replace('Identifier="odin"', f'Identifier="{tmp_path / "planted"}"')
    )
    with pytest.raises(PlantError, match="modelIdentifier"):
        Plant(path)
