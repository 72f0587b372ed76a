"""Building FMUs, and rejected builds."""

import os
import re
import shutil
import stat
import subprocess
import sys
import tempfile
from importlib import metadata
from pathlib import Path

import pytest

import plant_fmu
from plant_fmu import build_fmu, load_vehicle
from plant_fmu.__main__ import main
from plant_fmu.archive import write_atomic
from plant_fmu.build import cached_fmu
from plant_fmu.compiling.compiler import find_compiler
from plant_fmu.compiling.platforms import native_platform
from plant_fmu.errors import BuildError
from plant_fmu.installing import install_hint
from tests.plant_fmu.conftest import CoSimulationInstance, members

ROOT = Path(__file__).parents[2]
ODIN = (ROOT / "plant_fmu" / "vehicles" / "odin.toml").read_text()
MUTE = f"{sys.executable} -c raise(SystemExit('error:_no_luck'))"  # a compiler that fails


def written(tmp_path, *changes):
    """Write ODIN's file with other texts in it."""
    text = ODIN
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "boat.toml"
    path.write_text(text)
    return path


@pytest.fixture
def build(tmp_path, capsys):
    """Return a function that runs `build`, which must fail in one line and leave no file, and returns the line."""

    def fail(*words, vehicle="odin", out="x.fmu"):
        before = sorted(tmp_path.rglob("*"))
        assert main(["build", "--vehicle", vehicle, "--out", str(tmp_path / out), *words]) == 2
        said = capsys.readouterr()
        assert said.out == "" and said.err.count("\n") == 1 and sorted(tmp_path.rglob("*")) == before
        return said.err

    return fail


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize(
    "words",
    [
        "plant_fmu build --vehicle odin",
        "plant_fmu list",
        "plant_fmu --help",
        "fuzzy_arbiter show section-vi",
        "cosim run paper",
    ],
)
def test_uninstalled_checkout_gives_one_line_error(words):
    """Without site packages, as the Python of the system has them not."""
    bare = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    command = [sys.executable, "-S", "-m", *words.split()]
    done = subprocess.run(command, cwd=ROOT, env=bare, capture_output=True, text=True)
    hint = r": run \S+ -m pip install \./fuzzy_arbiter \. in the checkout of subreach"
    expected = rf"({hint}|, expected what pyproject\.toml requires)\n"
    assert re.fullmatch(rf"{words.split()[0]}: \w+ is not installed" + expected, done.stderr), done.stderr
    assert (done.returncode, done.stdout) == (2, "")


def test_checkout_with_only_dependencies_gives_one_line_error(build, monkeypatch):
    def version(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "version", version)
    command = install_hint("./fuzzy_arbiter", ".")
    assert build() == f"plant_fmu: subreach is not installed: run {command} in the checkout of subreach\n"


def test_package_exports_its_listed_names():
    for name in plant_fmu.__all__:
        assert getattr(plant_fmu, name).__name__ == name
    with pytest.raises(AttributeError, match="module 'plant_fmu' has no attribute 'built_fmu'"):
        plant_fmu.built_fmu  # noqa: B018


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cc") is None, reason="there is no cc; test_platforms has the compiler of ziglang")
def test_builds_are_reproducible(tmp_path, fmi, monkeypatch, capsys):
    """In a folder of another name, which no library names; a build leaves the environment alone."""
    before = cached_fmu(load_vehicle("odin"), fmi)
    (tmp_path / "another place").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "another place"))
    environment = dict(os.environ), os.getcwd()
    again = tmp_path / "again.fmu"
    assert main(["build", "--vehicle", "odin", "--fmi", str(fmi), "--out", str(again)]) == 0
    assert capsys.readouterr().out == f"{again}\n"
    assert (dict(os.environ), os.getcwd()) == environment
    assert again.read_bytes() == before.read_bytes()
    (library,) = [data for name, data in members(again).items() if name.startswith("binaries/")]
    places = (str(tmp_path), tempfile.gettempdir(), "/tmp", "/home", "/root", sys.prefix, "plant_fmu")
    assert not [place for place in places if place.encode() in library]
    assert not re.search(rb"\w\w\.c\0", library)  # a file's name: the bytes of ".c" alone may be an address


def test_vehicles_are_listed_and_named_in_errors(build, capsys):
    assert "bluerov2, bluerov2_heavy, bluerov2_heavy_trimmed, bluerov2_heavy_wu, odin, rexrov" in build(vehicle="odyn")
    assert main(["list"]) == 0
    assert "unsourced" in capsys.readouterr().out


def test_ziglang_compiles_where_there_is_no_cc(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: name == "ziglang" or None)
    assert find_compiler() == [sys.executable, "-m", "ziglang", "cc", "-target", native_platform().target]


def test_missing_compiler_gives_one_line_error(build, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert build() == (
        "plant_fmu: no C compiler: neither cc nor the ziglang package was found; "
        f'{sys.executable} -m pip install "ziglang>=0.13"\n'  # in full, for there is no python on this PATH
    )


@pytest.mark.medium(fast=3)
@pytest.mark.parametrize(
    ("compiler", "words"),
    [
        (MUTE, "no_luck"),
        (f"{sys.executable} -c pass", "neither a library nor a message"),
        ("gcc 'x", "quotation"),
        ("no-such-compiler", "not on the PATH"),
    ],
)
def test_failing_compiler_leaves_no_file(build, monkeypatch, compiler, words):
    monkeypatch.setenv("CC", compiler)
    assert words in build()


def test_platforms_without_fmi_name_are_rejected(build, monkeypatch):
    monkeypatch.setattr("platform.machine", lambda: "riscv64")
    assert "riscv64" in build()


@pytest.mark.parametrize(
    ("out", "words"), [("nowhere/x.fmu", "No such file"), ("cc", ""), ("folder", "is no file"), ("pipe", "is no file")]
)
def test_unwritable_path_is_rejected_before_compiling(build, tmp_path, monkeypatch, out, words):
    """No compiler has run by then: this one would leave a file."""
    compiler = tmp_path / "cc"
    compiler.write_text(f"#!/bin/sh\ntouch {tmp_path / 'ran'}\nexit 1\n")
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")
    assert words in build(out=f"{out}/x.fmu" if out == "cc" else out)


@pytest.mark.skipif(os.name != "posix", reason="of POSIX")
def test_file_permissions_follow_the_umask(tmp_path):
    before = os.umask(0o027)
    try:
        write_atomic(tmp_path / "x.ssv", b"new")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "x.ssv").stat().st_mode) == 0o640
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"new"]


@pytest.mark.slow
def test_custom_vehicle_with_six_thrusters_and_full_added_mass_builds(tmp_path):
    rows = "\n".join(f"    [{', '.join('1.0' if i == j else '0.1' for j in range(6))}]," for i in range(6))
    path = written(
        tmp_path,
        ("[62.5, 62.5, 62.5, 0.0, 0.0, 0.0]", f"[\n{rows}\n]"),
        (ODIN[ODIN.index("matrix = [") : ODIN.index("force_min")], f"matrix = [\n{rows}\n]\n"),
    )
    slave = CoSimulationInstance(build_fmu(load_vehicle(path), 3, tmp_path / "six.fmu")).start()
    assert "thrust[6]" in slave.by_name and "thrust[7]" not in slave.by_name
    slave.set_values({"thrust[6]": 20.0})
    slave.step(0.1)
    assert slave.get("actuation.N", "actuation.X") == pytest.approx([20.0, 2.0])
    slave.close()


# ---- the cache ----


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """Return ODIN's FMU in a cache of the test's own, and its bytes."""
    good = cached_fmu(load_vehicle("odin"), 3)
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda *_, **__: str(tmp_path))
    path = tmp_path / "fmu" / good.name
    path.parent.mkdir()
    shutil.copy(good, path)
    return path, good.read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("damage", ["half", "a byte of a third", "a byte of two thirds"])
def test_damaged_cached_fmu_is_rebuilt(kept, damage):
    path, whole = kept
    at = len(whole) // 3 * (2 if "two" in damage else 1)
    flipped = whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :]
    path.write_bytes(whole[: len(whole) // 2] if damage == "half" else flipped)
    assert cached_fmu(load_vehicle("odin"), 3) == path
    assert path.read_bytes() == whole


def test_cached_fmu_is_reused_for_its_compiler_or_without_one(kept, monkeypatch):
    path, _ = kept
    assert cached_fmu(load_vehicle("odin"), 3) == path
    monkeypatch.setenv("CC", MUTE)
    with pytest.raises(BuildError, match="no_luck"):  # the other compiler is asked
        cached_fmu(load_vehicle("odin"), 3)
    monkeypatch.setenv("CC", "no-such-compiler")
    assert cached_fmu(load_vehicle("odin"), 3) == path
    path.write_bytes(b"damaged")
    with pytest.raises(BuildError, match="no-such-compiler"):
        cached_fmu(load_vehicle("odin"), 3)
