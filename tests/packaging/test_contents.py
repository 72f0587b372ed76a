"""The content of the wheel and of the source distribution."""

import tarfile
import tomllib
import zipfile
from email import message_from_string
from pathlib import PurePosixPath

import fmpy
import packaging.tags
import packaging.utils
import pytest
from fmpy.validation import validate_fmu

from controller.compiling.library import library_name
from cosim.batch.shipped_functions import shipped_texts
from plant_fmu import build_fmu, load_vehicle
from plant_fmu.build import cached_fmu
from plant_fmu.compiling import prebuilt
from plant_fmu.compiling.platforms import PLATFORMS, native_platform
from plant_fmu.vehicle import shipped_vehicles
from tests.packaging.conftest import ROOT
from tests.plant_fmu.test_sources import trajectory

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]  # the first of them builds and installs
PACKAGES = ("controller", "cosim", "plant_fmu")
BESIDE = ("CHANGELOG.md", "CITATION.cff", "CONTRIBUTING.md", "LICENSE", "README.md", "hatch_build.py", "pyproject.toml")
MOST = 4.5e6  # bytes, of a wheel with the libraries of all platforms


@pytest.fixture(scope="session")
def project():
    return tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def expected_libraries():
    structures = prebuilt.shipped_structures()
    assert sorted(structure.constants["N_THRUSTERS"] for structure in structures) == [6, 8]
    return {prebuilt.file_name(structure, fmi) for structure in structures for fmi in (2, 3)}


def expected_functions(platforms):
    """Libraries of what is run as C, with their checksums."""
    names = {library_name(text) for text in shipped_texts().values()}
    files = {f"{platform.name}/{name}{platform.suffix}" for platform in platforms for name in names}
    return {f"controller/prebuilt/{file}{end}" for file in files for end in ("", ".sha256")}


def of_packages(tracked):
    return {name for name in tracked if PurePosixPath(name).parts[0] in PACKAGES}


def test_wheel_holds_only_the_packages(wheel, unpacked, tracked, project):
    info = f"subreach-{project['version']}.dist-info"
    names = {path.relative_to(unpacked).as_posix() for path in unpacked.rglob("*") if path.is_file()}
    own = {name for name in names if not name.startswith(info)}
    libraries = {f"plant_fmu/prebuilt/{name}" for name in expected_libraries()}
    libraries |= expected_functions(PLATFORMS.values())
    assert own == of_packages(tracked) | {"plant_fmu/LICENSE"} | libraries
    assert {f"{package}/py.typed" for package in PACKAGES} <= own
    assert all((unpacked / name).read_bytes() == (ROOT / name).read_bytes() for name in of_packages(tracked))
    assert (unpacked / "plant_fmu/LICENSE").read_bytes() == (ROOT / "LICENSE").read_bytes()
    assert (unpacked / info / "licenses/LICENSE").read_bytes() == (ROOT / "LICENSE").read_bytes()
    assert (unpacked / info / "entry_points.txt").read_text().split() == [
        "[console_scripts]",
        "cosim",
        "=",
        "cosim.command_line.cli:run_console",
    ]
    assert wheel.name == f"subreach-{project['version']}-py3-none-any.whl"
    assert wheel.stat().st_size < MOST


def test_source_distribution_holds_the_build_inputs(dist, tracked):
    (path,) = dist.glob("*.tar.gz")
    with tarfile.open(path) as archive:
        names = {member.name.partition("/")[2] for member in archive.getmembers() if member.isfile()}
    libraries = {f"plant_fmu/prebuilt/{name}" for name in expected_libraries()}
    libraries |= expected_functions(PLATFORMS.values())
    assert names - {"PKG-INFO", ".gitignore"} == of_packages(tracked) | set(BESIDE) | libraries
    assert path.stat().st_size < MOST


def test_distribution_metadata_is_complete(unpacked, project):
    (path,) = unpacked.glob("*.dist-info/METADATA")
    metadata = message_from_string(path.read_text())
    assert (metadata["Name"], metadata["Version"]) == ("subreach", project["version"])
    assert metadata["License-Expression"] == "BSD-3-Clause"
    assert metadata["Requires-Python"] == ">=3.11"
    classifiers = metadata.get_all("Classifier")
    assert {f"Programming Language :: Python :: 3.{minor}" for minor in (11, 12, 13)} <= set(classifiers)
    assert metadata.get_all("Project-URL") is None  # there is none yet
    assert set(metadata.get_all("Provides-Extra")) == set(project["optional-dependencies"])


def test_each_dependency_has_a_lower_bound(project):
    extras = [text for texts in project["optional-dependencies"].values() for text in texts]
    for text in (*project["dependencies"], *extras):
        assert ">=" in text or text.startswith(("subreach[", "fuzzy-arbiter[skfuzzy]==")), text
    wanted = {"build", "campaign", "falsify", "learning", "logs", "mcap", "mpc", "notebook", "numba", "rerun", "wasm"}
    (everything,) = project["optional-dependencies"]["all"]
    assert set(everything.removeprefix("subreach[").removesuffix("]").split(",")) == wanted


def test_libraries_exist_for_every_platform(unpacked):
    for path in (unpacked / "plant_fmu" / "prebuilt").iterdir():
        with zipfile.ZipFile(path) as archive:
            assert sorted(archive.namelist()) == sorted(f"{p.name}{p.suffix}" for p in PLATFORMS.values())


def test_wheel_built_from_a_checkout_is_platform_specific(own_wheel, wheel):
    with zipfile.ZipFile(own_wheel) as ours, zipfile.ZipFile(wheel) as released:
        names, everywhere = (
            {name for name in archive.namelist() if ".dist-info/" not in name} for archive in (ours, released)
        )
        here = native_platform()
        assert names == everywhere - expected_functions(PLATFORMS.values()) | expected_functions([here])
        for name in {f"plant_fmu/prebuilt/{name}" for name in expected_libraries()}:
            with zipfile.ZipFile(ours.open(name)) as libraries:
                assert libraries.namelist() == [f"{here.name}{here.suffix}"]
    (tag,) = packaging.utils.parse_wheel_filename(own_wheel.name)[3]
    assert tag in packaging.tags.sys_tags() and tag.platform != "any"


def test_a_checkout_needs_ziglang_for_this_machine_only_without_a_compiler(monkeypatch):
    monkeypatch.chdir(ROOT)
    monkeypatch.syspath_prepend(str(ROOT))
    import hatch_build

    def build_requirements(what):
        return {text.partition(">")[0] for text in getattr(hatch_build, f"get_requires_for_build_{what}")()}

    plant = {"fmpy", "msgspec", "numpy", "platformdirs", "scipy", "tomli-w"}
    monkeypatch.setattr("shutil.which", lambda name: "/usr/bin/cc")
    assert build_requirements("wheel") == plant
    assert build_requirements("sdist") == plant | {"ziglang"}
    assert not build_requirements("editable") & {*plant, "ziglang"}
    monkeypatch.setattr("shutil.which", lambda name: None)
    monkeypatch.delenv("CC", raising=False)
    assert build_requirements("wheel") == plant | {"ziglang"}


@pytest.mark.parametrize("vehicle", shipped_vehicles())
@pytest.mark.parametrize("fmi", [2, 3])
def test_fmus_are_built_without_a_compiler(unpacked, tmp_path, monkeypatch, vehicle, fmi):
    """They are valid, and fly as those that this machine's compiler makes."""
    compiled = cached_fmu(load_vehicle(vehicle), fmi)
    monkeypatch.setattr(prebuilt, "FOLDER", unpacked / "plant_fmu" / "prebuilt")
    monkeypatch.setenv("CC", "no-such-compiler")
    path = build_fmu(load_vehicle(vehicle), fmi, tmp_path / "all.fmu", "all")
    assert validate_fmu(str(path)) == []
    assert trajectory(path) == pytest.approx(trajectory(compiled), rel=1e-10, abs=1e-10)
    described = fmpy.read_model_description(str(path))
    assert described.modelName == vehicle


def test_shipped_libraries_equal_a_fresh_build(unpacked, prebuilt_of_eight):
    """Byte for byte, in another place."""
    shipped = unpacked / "plant_fmu" / "prebuilt" / prebuilt_of_eight.name
    assert prebuilt_of_eight.read_bytes() == shipped.read_bytes()
