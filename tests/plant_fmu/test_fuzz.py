"""The C code under AddressSanitizer and UndefinedBehaviorSanitizer, called in random orders with random values."""

import subprocess
from pathlib import Path

import pytest

from plant_fmu import load_vehicle
from plant_fmu.compiling.compiler import find_compiler
from plant_fmu.vehicle_component import make_vehicle_component
from tests.plant_fmu.nulls import HEADERS, SANITIZERS, write_sources


@pytest.mark.medium
@pytest.mark.parametrize(
    ("seed", "calls", "level"),
    [(1, 50_000, "-O0"), pytest.param(2, 1_000_000, "-O1", marks=pytest.mark.slow)],
    ids=["short", "long"],
)
@pytest.mark.parametrize(
    ("fmi", "arrays"), [pytest.param(2, False, marks=pytest.mark.slow), (3, False), (3, True)],
    ids=["fmi2", "fmi3", "arrays"],
)  # fmt: skip
def test_any_call_order_is_memory_safe(tmp_path, fmi, arrays, seed, calls, level):
    """No fault of memory or arithmetic, and no number out that is none; most functions succeed now and then."""
    sources = write_sources(tmp_path, fmi, make_vehicle_component(load_vehicle("odin"), arrays=arrays))
    options = ["-std=c99", "-g", level, *SANITIZERS, f"-DFMI={fmi}", f"-I{tmp_path}", f"-I{HEADERS}"]
    files = [*sources, str(Path(__file__).parent / "fuzz.c"), "-o", str(tmp_path / "fuzz"), "-lm"]
    done = subprocess.run([*find_compiler(), *options, *files], capture_output=True, text=True)
    if done.returncode != 0:
        pytest.skip(f"the compiler has no sanitizers: {done.stderr[-300:]}")
    done = subprocess.run([tmp_path / "fuzz", str(seed), str(calls)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-500:] + done.stderr[-3000:]
    accepted = [int(n) for n in done.stdout.split("accepted")[1].split()]
    assert sum(accepted) > calls / 10
    assert min(accepted) > 0
