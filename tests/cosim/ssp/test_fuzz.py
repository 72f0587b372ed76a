"""The C code of controller and arbiter under the sanitizers, called in random orders with random values."""

import subprocess
from pathlib import Path

import fmpy
import pytest

from cosim.scenario.scenario import load_scenario
from cosim.ssp import arbiter_component, controller_component
from plant_fmu.build import neutral_members
from plant_fmu.compiling.compiler import find_compiler
from tests.plant_fmu.nulls import faults, sweep_sources

HERE = Path(__file__).parent


@pytest.mark.slow
@pytest.mark.parametrize("make", [controller_component, arbiter_component])
def test_any_call_order_is_memory_safe(make, tmp_path):
    """No fault of memory or arithmetic, and no number out that is none; every function succeeds now and then."""
    for name, data in neutral_members(make(load_scenario(HERE / "all-shapes.toml")), 3).items():
        if name.startswith("sources/"):
            (tmp_path / Path(name).name).write_bytes(data)
    program = tmp_path / "fuzz"
    command = [
        *find_compiler(), "-std=c99", "-g", "-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all",
        f"-I{tmp_path}", f"-I{Path(fmpy.__file__).parent / 'c-code'}",
        *map(str, tmp_path.glob("*.c")), str(HERE / "fuzz.c"), "-o", str(program), "-lm",
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        pytest.skip(f"the compiler has no sanitizers: {done.stderr[-300:]}")
    done = subprocess.run([program, "1", "500000"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-500:] + done.stderr[-3000:]
    assert min(int(n) for n in done.stdout.split()[1:]) > 0, done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("make", [controller_component, arbiter_component])
def test_null_pointers_are_rejected(make, fmi, tmp_path):
    """Every function with each of its pointers NULL in turn is an error, never a crash."""
    rows = sweep_sources(tmp_path, fmi, make(load_scenario(HERE / "all-shapes.toml")))
    assert len(rows) > 500
    assert faults(rows) == []
