"""fuzzy-arbiter: the content of its wheel, its dependencies, and its tests from the source distribution."""

import os
import subprocess
import sys
import tarfile
import zipfile
from email import message_from_string
from importlib import metadata
from pathlib import Path

import pytest

from tests.docs.pages import blocks
from tests.packaging.conftest import ROOT, run

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]  # the first of them builds and installs
BESIDE = {"LICENSE", "README.md", "pyproject.toml"}
MOST = 1e6  # bytes, of the wheel's content


def names(wheel):
    with zipfile.ZipFile(wheel) as archive:
        return {name for name in archive.namelist() if ".dist-info/" not in name}


@pytest.fixture(scope="module")
def alone(arbiter_wheel, tmp_path_factory):
    """Return the Python of an environment with the wheel and NumPy alone, made without a network."""
    folder = tmp_path_factory.mktemp("alone")
    run(sys.executable, "-m", "venv", "--without-pip", folder / "env")
    python = next(path for path in (folder / "env").glob("*/python*") if path.is_file())
    site = Path(run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))").strip())
    for part in {file.parts[0] for file in metadata.files("numpy") if file.parts[0].startswith("numpy")}:
        (site / part).symlink_to(Path(metadata.distribution("numpy").locate_file(part)))
    run(sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--no-index", arbiter_wheel)
    return lambda *words: run(python, *words, cwd=folder, env={"PATH": os.environ["PATH"]})


def test_arbiter_wheel_is_complete_and_disjoint_from_the_main_wheel(arbiter_wheel, own_wheel, tracked):
    own = {name for name in tracked if name.startswith("fuzzy_arbiter/")}
    assert names(arbiter_wheel) == own - {f"fuzzy_arbiter/{name}" for name in BESIDE}
    assert not names(arbiter_wheel) & names(own_wheel)
    assert "fuzzy_arbiter/py.typed" in names(arbiter_wheel)
    with zipfile.ZipFile(arbiter_wheel) as archive:
        assert sum(file.file_size for file in archive.infolist()) < MOST
        assert archive.read(next(name for name in archive.namelist() if name.endswith("licenses/LICENSE"))) == (
            (ROOT / "LICENSE").read_bytes()
        )
        fields = message_from_string(
            archive.read(next(n for n in archive.namelist() if n.endswith("METADATA"))).decode()
        )
    assert (fields["Name"], fields["License-Expression"]) == ("fuzzy-arbiter", "BSD-3-Clause")
    assert [text for text in fields.get_all("Requires-Dist") if "extra ==" not in text] == ["numpy>=2.1.3"]
    assert set(fields.get_all("Provides-Extra")) == {"numba", "plot", "skfuzzy", "test", "tune"}


def test_readme_examples_need_only_numpy(alone):
    code = "\n".join(block.text for block in blocks(ROOT / "fuzzy_arbiter" / "README.md") if block.language == "python")
    code += "\nimport sys; print(round(arbiter(asks)['visibility'], 9), arbiter.verify().ok, 'scipy' in sys.modules)"
    assert alone("-c", code).split() == ["0.896", "True", "False"]
    assert "R5" in alone("-m", "fuzzy_arbiter", "explain", "section-vi", "0.75", "1", "0")
    version = metadata.version("fuzzy-arbiter")
    assert alone("-m", "fuzzy_arbiter", "--version").split() == ["fuzzy_arbiter", version]
    where = Path(alone("-c", "import fuzzy_arbiter; print(fuzzy_arbiter.__file__)").strip())
    assert "site-packages" in where.parts


@pytest.mark.parametrize(
    ("code", "line"),
    [
        ("Arbiter(engine='skfuzzy')", "is not installed, expected the extra fuzzy-arbiter[skfuzzy]"),
        ("pictures.terms(Arbiter(), 'shape')", "Matplotlib is not installed, expected the extra fuzzy-arbiter[plot]"),
        ("Arbiter().compiled()", "Numba is not installed, expected the extra fuzzy-arbiter[numba]"),
    ],
)
def test_missing_extra_is_named(alone, code, line):
    words = (
        f"from fuzzy_arbiter import Arbiter, ArbiterError, pictures\ntry: {code}\nexcept ArbiterError as e: print(e)"
    )
    (said,) = alone("-c", words).splitlines()
    assert said.endswith(line)


def test_arbiter_tests_run_from_the_source_distribution(arbiter_dist, arbiter_wheel, tmp_path):
    (path,) = arbiter_dist.glob("*.tar.gz")
    with tarfile.open(path) as archive:
        archive.extractall(
            tmp_path, **({"filter": "data"} if hasattr(tarfile, "data_filter") else {})
        )  # from 3.11.4 on
    (folder,) = tmp_path.iterdir()
    with zipfile.ZipFile(arbiter_wheel) as archive:
        archive.extractall(tmp_path / "installed")
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"],
        cwd=folder, env={**os.environ, "PYTHONPATH": str(tmp_path / "installed")}, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-3000:]

    assert "passed" in done.stdout.splitlines()[-1]
