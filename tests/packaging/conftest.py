"""What is shipped, built once from a clean copy of the tracked files, and installed once in an empty environment.

Two distributions: fuzzy-arbiter from its folder, and subreach, which needs it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def tracked() -> list[str]:
    """Names of the files of a clean clone."""
    if shutil.which("git") is None or not (ROOT / ".git").exists():
        pytest.skip("this is no git checkout: there is no telling what belongs to it")
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    return [name for name in listed.split("\0") if (ROOT / name).is_file()]


def run(*command: object, **more: object) -> str:
    """Run a command; on failure, show its output."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False, **more)
    assert done.returncode == 0, f"{command}: {done.returncode}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def build(tracked: list[str], folder: Path, *flags: str, project: str = ".") -> None:
    """Build what is shipped of a project, in a folder, from a clean copy of the checkout."""
    copy = folder / "copy"
    for name in tracked:
        (copy / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, copy / name)
    clean = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    run(sys.executable, "-m", "build", "--no-isolation", *flags, "--outdir", folder, copy / project, env=clean)
    assert sorted(path.relative_to(copy).as_posix() for path in copy.rglob("*.zip")) == [], "left in the checkout"


@pytest.fixture(scope="session")
def dist(tracked, once) -> Path:
    """Return a folder with the source distribution and the wheel that is built from it."""
    pytest.importorskip("ziglang", reason="the build extra is not installed: nothing compiles for all platforms")

    return once("dist", lambda folder: build(tracked, folder))


@pytest.fixture(scope="session")
def wheel(dist) -> Path:
    """Return the wheel."""
    (path,) = dist.glob("*.whl")
    return path


@pytest.fixture(scope="session")
def arbiter_dist(tracked, once) -> Path:
    """Return a folder with the source distribution of fuzzy-arbiter and the wheel that is built from it."""
    return once("arbiter-dist", lambda folder: build(tracked, folder, project="fuzzy_arbiter"))


@pytest.fixture(scope="session")
def arbiter_wheel(arbiter_dist) -> Path:
    """Return the wheel of fuzzy-arbiter."""
    (path,) = arbiter_dist.glob("*.whl")
    return path


@pytest.fixture(scope="session")
def own_wheel(tracked, once) -> Path:
    """Return a wheel that is built from a checkout, as ``pip install ./fuzzy_arbiter .`` does."""
    (path,) = once("own-wheel", lambda folder: build(tracked, folder, "--wheel")).glob("*.whl")
    return path


@pytest.fixture(scope="session")
def unpacked(wheel, tmp_path_factory) -> Path:
    """Return the content of the wheel."""
    folder = tmp_path_factory.mktemp("wheel")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder)
    return folder


def program(folder: Path) -> Path:
    """Return the Python of an environment; lib/python3.x is none."""
    return next(path for path in (folder / "env").glob("*/python*") if path.is_file())


@pytest.fixture(scope="session")
def installed(wheel, arbiter_wheel, once) -> Path:
    """Return an environment with only both wheels and their requirements."""

    def install(folder: Path) -> None:
        run(sys.executable, "-m", "venv", folder / "env")
        pip = [program(folder), "-m", "pip", "install", "--quiet", "--no-compile", "--disable-pip-version-check"]
        run(*pip, arbiter_wheel, wheel)

    return program(once("installed", install))
