"""Each example runs from an empty folder, prints something, and is short."""

import ast
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parents[1] / "examples").glob("*.py"))
WRITES = {
    "fmu_alone.py": ["bluerov2.fmu"],
    "fmu_reference.py": ["bluerov2_heavy.fmu", "fmu-reference.png"],
    "mpc.py": ["runs/mpc/report.html"],
    "own_law.py": ["runs/own-law/report.html", "runs/own-law/replay.html", "runs/own-law/summary.json"],
    "own_vehicle.py": ["frame.toml", "frame.fmu", "pool.toml", "runs/frame/record.parquet"],
    "telemetry.py": ["runs/streamed/record.parquet"],
    "ventilation.py": ["ventilation.png", "ventilation.toml"],
}
SAYS = {
    "fmu_alone.py": "14 inputs",
    "learn_by_ppo.py": "after 7.",
    "learn_to_hold.py": "generation 29: ",
    "master.py": "clearance to the goal region +",
    "mpc.py": "in the goal after 1",
    "own_law.py": "law own_law.py:steer: in the goal after",
    "own_vehicle.py": "for good: True",
    "telemetry.py": "last seen at",
}
NEEDS = {"learn_by_ppo.py": "stable_baselines3", "mpc.py": "casadi", "telemetry.py": "pymavlink"}
PACKAGES = ("controller", "cosim", "fuzzy_arbiter", "plant_fmu")


@pytest.mark.slow
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda p: p.name)
def test_example_runs_and_writes_its_documented_files(example, tmp_path):
    pytest.importorskip(NEEDS.get(example.name, "cosim"))
    done = subprocess.run([sys.executable, example], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert SAYS.get(example.name, "") in done.stdout and done.stdout
    assert [file for file in WRITES.get(example.name, []) if not (tmp_path / file).is_file()] == []


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda p: p.name)
def test_importing_an_example_has_no_effect(example, tmp_path, monkeypatch, capfd):
    pytest.importorskip(NEEDS.get(example.name, "cosim"))
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(example), run_name=example.stem)
    assert list(tmp_path.rglob("*")) == []
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda p: p.name)
def test_example_docstring_explains_its_purpose(example):
    assert len((ast.get_docstring(ast.parse(example.read_text())) or "").split()) > 10


def test_master_example_is_short():
    assert len((EXAMPLES[0].parent / "master.py").read_text().splitlines()) <= 40


def test_stream_example_is_short():
    code = ast.parse((EXAMPLES[0].parent / "telemetry.py").read_text()).body[1:]  # behind the docstring
    assert sum(statement.end_lineno - statement.lineno + 1 for statement in code) <= 20


def test_standalone_fmu_example_imports_no_own_package():
    tree = ast.parse((EXAMPLES[0].parent / "fmu_alone.py").read_text())
    imported = [alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names]
    imported += [node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    assert imported and not [name for name in imported if name.startswith(PACKAGES)]
