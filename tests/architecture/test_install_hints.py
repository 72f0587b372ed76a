"""Install hints come from one helper, use the bounds of ``pyproject.toml``, and are accepted by pip."""

import ast
import re
import shlex
import subprocess
import sys
import tomllib

import pytest

from plant_fmu.installing import install_hint
from tests.architecture.modules import FILES, PACKAGES, ROOT, tree_of

REQUIREMENT = re.compile(r"[A-Za-z][\w.-]*>=[\d.]+")


def required():
    """Requirements by extra, without their markers; those of the base under ""."""
    project, arbiter = (
        tomllib.loads((ROOT / file).read_text(encoding="utf-8"))["project"]
        for file in ("pyproject.toml", "fuzzy_arbiter/pyproject.toml")
    )
    base = [*project["dependencies"], *arbiter["dependencies"], *arbiter["optional-dependencies"]["skfuzzy"]]
    extras = {"": base, **project["optional-dependencies"]}
    return {extra: {text.partition(";")[0] for text in texts} for extra, texts in extras.items()}


def test_install_commands_occur_only_in_install_hints():
    """Nor of the name of this distribution in an index, which has none there."""
    files = [
        path for package in PACKAGES for path in (ROOT / package).rglob("*") if path.suffix in (".py", ".j2", ".txt")
    ]
    assert len(files) > len(FILES)
    wrong = re.compile(r"pip3? install|subreach\[")
    assert [str(path) for path in files if wrong.search(path.read_text(encoding="utf-8"))] == []


@pytest.mark.medium
def test_requirements_in_hints_match_declared_bounds():
    named = {
        (module, node.value)
        for module, path in FILES.items()
        for node in ast.walk(tree_of(path))
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and REQUIREMENT.fullmatch(node.value)
    }
    known = set().union(*required().values())
    assert {text for _, text in named} > {"ziglang>=0.13"}
    assert [(module, text) for module, text in named if text not in known] == []


def test_hints_name_all_requirements_of_an_extra():
    from cosim.export.formats import FORMATS

    extras = required()
    assert set(FORMATS["mcap"].needs) == extras["mcap"]
    assert set(FORMATS["rrd"].needs) == extras["rerun"]
    assert extras["notebook"] == {"pandas>=2.2"}  # of Run.frame
    (everything,) = extras["all"]
    others = {"", "all", "dev", "docs", "importers"}
    assert set(everything.removeprefix("subreach[")[:-1].split(",")) == extras.keys() - others


@pytest.mark.slow
def test_hint_is_accepted_by_pip_from_a_shell(monkeypatch):
    """For what is there already, without a network."""
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    done = subprocess.run(install_hint("numpy>=2.1.3", "rich>=13"), shell=True, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert re.findall(r"already satisfied: (\S+)", done.stdout)[:2] == ["numpy>=2.1.3", "rich>=13"]


@pytest.mark.parametrize("short", [True, False])
@pytest.mark.parametrize("name", ["python", "python3"])
@pytest.mark.parametrize("folder", ["env", "my env"])
def test_hint_names_the_running_python(monkeypatch, tmp_path, folder, name, short):
    """Its short name stands there where the shell knows it: in an environment that is active."""
    bins = tmp_path / folder / "bin"
    bins.mkdir(parents=True)
    for link in ("python", "python3"):
        (bins / link).symlink_to(sys.executable)
    monkeypatch.setattr(sys, "executable", str(bins / name))
    monkeypatch.setenv("PATH", str(bins if short else tmp_path))
    shown = "python" if short else str(bins / name)
    assert shlex.split(install_hint("mcap>=1.2")) == [shown, "-m", "pip", "install", "mcap>=1.2"]
    if short and name == "python3":  # of two Pythons in one folder
        (bins / "python").unlink()
        (bins / "python").touch(0o755)
        assert shlex.split(install_hint("mcap>=1.2"))[0] == str(bins / name)


def test_windows_paths_are_kept_unquoted(monkeypatch):
    monkeypatch.setattr("shutil.which", lambda name: None)
    monkeypatch.setattr(sys, "executable", r"C:\env\Scripts\python.exe")
    assert install_hint("mcap>=1.2") == r'C:\env\Scripts\python.exe -m pip install "mcap>=1.2"'
