"""The wheel in an empty environment, away from the checkout, on a machine without a compiler."""

import json
import os

import pytest

from tests.packaging.conftest import run

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]  # the first of them builds and installs


@pytest.fixture
def bare(installed, tmp_path):
    """Return what runs a command where nothing but the environment's own programs is found."""
    env = {"PATH": str(installed.parent), "HOME": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "cache")}
    env |= {key: os.environ[key] for key in ("SYSTEMROOT", "TEMP") if key in os.environ}  # Windows
    return lambda *words: run(installed.parent / words[0], *words[1:], cwd=tmp_path, env=env)


def test_environment_has_no_compiler(bare):
    code = "import shutil, importlib.util as u; print(shutil.which('cc'), shutil.which('gcc'), u.find_spec('ziglang'))"
    assert bare("python", "-c", code).split() == ["None", "None", "None"]


def test_installed_requirements_are_consistent(bare):
    assert "No broken requirements found" in bare("python", "-m", "pip", "check")


@pytest.mark.parametrize("scenario", ["paper", "docking"])
def test_run_writes_a_report(bare, tmp_path, scenario):
    bare("cosim", "run", scenario, "--set", "time.duration=0.5", "--out", "run")
    assert json.loads((tmp_path / "run" / "summary.json").read_text())
    assert all(
        (tmp_path / "run" / name).stat().st_size > 1000 for name in ("report.html", "replay.html", "record.parquet")
    )


def test_laws_are_compared_on_generated_scenes(bare, tmp_path):
    bare("cosim", "scenes", "--count", "2", "--out", "scenes.jsonl")
    bare("cosim", "compare", "scenes.jsonl", "--laws", "deployable,pd", "--replays", "0", "--out", "side")
    assert (tmp_path / "side" / "deployable" / "results.parquet").exists()


@pytest.mark.parametrize("fmi", ["2", "3"])
def test_fmus_are_written_and_load_in_fmpy(bare, fmi):
    bare(
        "python", "-m", "plant_fmu", "build", "--vehicle", "odin", "--fmi", fmi, "--platforms", "all", "--out", "x.fmu"
    )
    simulated = "fmpy.simulate_fmu('x.fmu', stop_time=0.1, start_values={'wrench.X': 50.0})"
    assert 0.0 < float(bare("python", "-c", f"import fmpy; print({simulated}['position.x'][-1])")) < 1.0


def test_missing_extra_is_named(bare):
    with pytest.raises(AssertionError, match=r'python -m pip install "distributed>=') as failed:
        bare(
            "cosim", "sweep", "paper", "--vary", "initial.position.1=-1:1", "--samples", "2", "--dask", "--out", "sweep"
        )
    assert "Traceback" not in str(failed.value)


def test_missing_compiler_is_named(bare):
    with pytest.raises(AssertionError, match=r'python -m pip install "ziglang>='):
        bare("cosim", "export", "--to", "ssp", "paper-limited", "--set", "arbiter.engine=closed", "--out", "x.ssp")
