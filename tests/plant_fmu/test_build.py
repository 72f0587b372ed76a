"""Building FMUs, and rejected builds."""

import os
import re
import shutil
import stat
import subprocess
import sys
import tempfile
import zipfile
from importlib import metadata
from pathlib import Path

import pytest

import plant_fmu
from plant_fmu import build_fmu, load_vehicle
from plant_fmu.__main__ import main
from plant_fmu.archive import write_atomic
from plant_fmu.build import cached_fmu
from plant_fmu.compiling.compiler import find_compiler
from plant_fmu.errors import BuildError
from plant_fmu.installing import install_hint
from tests.plant_fmu.conftest import CoSimulationInstance

ROOT = Path(__file__).parents[2]
ODIN = (ROOT / "plant_fmu" / "vehicles" / "odin.toml").read_text()


def written(tmp_path, *changes):
    text = ODIN
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "boat.toml"
    path.write_text(text)
    return path


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


def test_checkout_with_only_dependencies_gives_one_line_error(tmp_path, capsys, monkeypatch):
    def version(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "version", version)
    assert main(["build", "--vehicle", "odin", "--out", str(tmp_path / "odin.fmu")]) == 2
    command = install_hint("./fuzzy_arbiter", ".")
    said = f"plant_fmu: subreach is not installed: run {command} in the checkout of subreach\n"
    assert capsys.readouterr() == ("", said)
    assert list(tmp_path.iterdir()) == []


def test_package_exports_its_listed_names():
    for name in plant_fmu.__all__:
        assert getattr(plant_fmu, name).__name__ == name
    with pytest.raises(AttributeError, match="module 'plant_fmu' has no attribute 'built_fmu'"):
        plant_fmu.built_fmu  # noqa: B018


@pytest.mark.parametrize("compiler", ["cc", "ziglang"])
@pytest.mark.slow
def test_builds_are_reproducible(tmp_path, fmi, compiler, monkeypatch, all_platforms):
    """One is of the session, in a folder of another name; a build leaves the environment alone."""
    if compiler == "ziglang":
        before = all_platforms(fmi)
        monkeypatch.setenv("PATH", str(tmp_path))
        monkeypatch.delenv("CC", raising=False)
        assert find_compiler()[:3] == [sys.executable, "-m", "ziglang"]
    elif shutil.which("cc") is None:
        pytest.skip("there is no cc")
    else:
        before = cached_fmu(load_vehicle("odin"), fmi)
    (tmp_path / "another place").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "another place"))
    environment = dict(os.environ), os.getcwd()
    again = build_fmu(load_vehicle("odin"), fmi, tmp_path / "again.fmu")
    assert (dict(os.environ), os.getcwd()) == environment
    assert compiler == "ziglang" or again.read_bytes() == before.read_bytes()
    with zipfile.ZipFile(again) as archive, zipfile.ZipFile(before) as archive_before:
        (name,) = [name for name in archive.namelist() if name.startswith("binaries/")]
        library = archive.read(name)
        assert library == archive_before.read(name)
    places = (str(tmp_path), tempfile.gettempdir(), "/tmp", "/home", "/root", sys.prefix, "plant_fmu")
    assert not [place for place in places if place.encode() in library]
    assert not re.search(rb"\w\w\.c\0", library)  # a file's name: the bytes of ".c" alone may be an address


@pytest.mark.slow
def test_build_command_writes_an_fmu(tmp_path, capsys):
    out = tmp_path / "mine.fmu"
    assert main(["build", "--vehicle", "bluerov2_heavy", "--fmi", "2", "--out", str(out)]) == 0
    assert out.stat().st_size > 10_000
    assert capsys.readouterr().out == f"{out}\n"


def test_list_command_prints_vehicles(capsys):
    assert main(["list"]) == 0
    assert "unsourced" in capsys.readouterr().out


def test_unknown_vehicle_error_lists_known_vehicles(capsys):
    assert main(["build", "--vehicle", "odyn"]) == 2
    assert "bluerov2_heavy, bluerov2_heavy_wu, odin, rexrov" in capsys.readouterr().err


def test_missing_compiler_gives_one_line_error(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    out = tmp_path / "x.fmu"
    assert main(["build", "--vehicle", "odin", "--out", str(out)]) == 2
    assert capsys.readouterr().err == (
        "plant_fmu: no C compiler: neither cc nor the ziglang package was found; "
        f'{sys.executable} -m pip install "ziglang>=0.13"\n'  # in full, for there is no python on this PATH
    )
    assert list(tmp_path.iterdir()) == []


@pytest.mark.medium(fast=3)
@pytest.mark.parametrize(
    ("compiler", "words"),
    [
        (f"{sys.executable} -c raise(SystemExit('error:_no_luck'))", "no_luck"),
        (f"{sys.executable} -c pass", "neither a library nor a message"),
        ("gcc 'x", "quotation"),
        ("no-such-compiler", "not on the PATH"),
    ],
)
def test_failing_compiler_leaves_no_file(tmp_path, monkeypatch, compiler, words):
    monkeypatch.setenv("CC", compiler)
    with pytest.raises(BuildError, match=words):
        build_fmu(load_vehicle("odin"), 3, tmp_path / "x.fmu")
    assert list(tmp_path.iterdir()) == []


def test_platforms_without_fmi_name_are_rejected(tmp_path, monkeypatch):
    monkeypatch.setattr("platform.machine", lambda: "riscv64")
    with pytest.raises(BuildError, match="riscv64"):
        build_fmu(load_vehicle("odin"), 3, tmp_path / "x.fmu")


def test_only_regular_files_are_replaced(tmp_path):
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")
    for name in ("folder", "pipe"):
        with pytest.raises(BuildError, match=r"is no file"):
            build_fmu(load_vehicle("odin"), 3, tmp_path / name)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["folder", "pipe"]


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
def test_custom_vehicle_with_six_thrusters_and_full_added_mass_builds(tmp_path, make_slave):
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


@pytest.mark.parametrize(("folder", "words"), [("nowhere", "No such file or directory"), ("cc", "")])
def test_unwritable_path_is_rejected_before_compiling(tmp_path, monkeypatch, capsys, folder, words):
    """No compiler has run by then."""
    ran = tmp_path / "ran"
    compiler = tmp_path / "cc"
    compiler.write_text(f"#!/bin/sh\ntouch {ran}\nexit 1\n")
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    assert main(["build", "--vehicle", "odin", "--out", str(tmp_path / folder / "odin.fmu")]) == 2
    message = capsys.readouterr().err
    assert words in message and message.count("\n") == 1
    assert not ran.exists()


@pytest.mark.slow
@pytest.mark.parametrize("damage", ["half", "a byte of a third", "a byte of two thirds"])
def test_damaged_cached_fmu_is_rebuilt(tmp_path, monkeypatch, damage):
    good = cached_fmu(load_vehicle("odin"), 3)
    whole = good.read_bytes()
    at = len(whole) // 3 * (2 if "two" in damage else 1)
    damaged = whole[: len(whole) // 2] if damage == "half" else whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :]
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda *_, **__: str(tmp_path))
    path = tmp_path / "fmu" / good.name
    path.parent.mkdir()
    path.write_bytes(damaged)
    assert cached_fmu(load_vehicle("odin"), 3) == path
    assert path.read_bytes() == whole


def test_cached_fmu_is_reused_for_its_compiler_or_without_one(tmp_path, monkeypatch):
    good = cached_fmu(load_vehicle("odin"), 3)
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda *_, **__: str(tmp_path))
    there = tmp_path / "fmu" / good.name
    there.parent.mkdir()
    shutil.copy(good, there)
    assert cached_fmu(load_vehicle("odin"), 3) == there
    monkeypatch.setenv("CC", f"{sys.executable} -c raise(SystemExit('error:_asked'))")
    with pytest.raises(BuildError, match="asked"):  # the other compiler is
        cached_fmu(load_vehicle("odin"), 3)
    monkeypatch.setenv("CC", "no-such-compiler")
    assert cached_fmu(load_vehicle("odin"), 3) == there
    there.write_bytes(b"damaged")
    with pytest.raises(BuildError, match="no-such-compiler"):
        cached_fmu(load_vehicle("odin"), 3)


def test_parameter_file_on_a_full_disk_leaves_no_partial_file(tmp_path, monkeypatch, capsys):
    """The disk is full when the last byte comes."""

    def full(source, target):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", full)
    assert main(["ssv", "--vehicle", "odin", "--out", str(tmp_path / "odin.ssv")]) == 2
    assert "No space left on device" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
