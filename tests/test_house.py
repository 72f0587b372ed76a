"""The house: who may import whom, and what no room does."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("fuzzy_arbiter", "plant_fmu", "controller", "cosim")
FILES = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
MAY_IMPORT = {
    "fuzzy_arbiter": {"fuzzy_arbiter"},
    "plant_fmu": {"plant_fmu"},
    "controller": {"controller"},
    "cosim": set(PACKAGES),
}


def imports(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module or ""


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(ROOT)))
def test_imports_run_one_way(path):
    package = path.relative_to(ROOT).parts[0]
    used = {name.split(".")[0] for name in imports(path)} & set(PACKAGES)
    assert used <= MAY_IMPORT[package]


def test_the_controller_knows_neither_fmi_nor_mavlink_and_the_arbiter_no_vehicle():
    for package in ("controller", "fuzzy_arbiter"):
        for path in (ROOT / package).rglob("*.py"):
            assert not {name.split(".")[0] for name in imports(path)} & {"fmpy", "pymavlink"}


def test_the_arbiter_takes_what_is_heavy_in_one_file_each():
    for foreign, where in (("numba", "compiled.py"), ("skfuzzy", "engines/scikit.py")):
        users = {p for p in (ROOT / "fuzzy_arbiter").rglob("*.py") if foreign in {n.split(".")[0] for n in imports(p)}}
        assert users == {ROOT / "fuzzy_arbiter" / where}


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(ROOT)))
def test_files_fit_in_the_head(path):
    assert len(path.read_text().splitlines()) <= 400
