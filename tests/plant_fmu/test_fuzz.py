"""The C code under AddressSanitizer and UndefinedBehaviorSanitizer, called in random orders with random values."""

import subprocess
from pathlib import Path

import fmpy
import pytest

from plant_fmu import load_vehicle
from plant_fmu.build import neutral_members
from plant_fmu.compiling.compiler import find_compiler

HERE = Path(__file__).parent


@pytest.fixture(scope="module")
def fuzzer(tmp_path_factory):
    """Return a function that builds the fuzzer of one FMI version."""

    def build(fmi, level):
        folder = tmp_path_factory.mktemp(f"fuzz{fmi}")
        for name, data in neutral_members(load_vehicle("odin"), fmi).items():
            if name.startswith("sources/"):
                (folder / Path(name).name).write_bytes(data)
        program = folder / "fuzz"
        command = [
            *find_compiler(), "-std=c99", "-g", level, "-fsanitize=address,undefined", "-fno-sanitize-recover=all",
            f"-DFMI={fmi}", f"-I{folder}", f"-I{Path(fmpy.__file__).parent / 'c-code'}",
            *map(str, folder.glob("*.c")), str(HERE / "fuzz.c"), "-o", str(program), "-lm",
        ]  # fmt: skip
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            pytest.skip(f"the compiler has no sanitizers: {done.stderr[-300:]}")
        return program

    return build


@pytest.mark.medium
@pytest.mark.parametrize(
    ("seed", "calls", "level"),
    [(1, 50_000, "-O0"), pytest.param(2, 1_000_000, "-O1", marks=pytest.mark.slow)],
    ids=["short", "long"],
)
@pytest.mark.parametrize("fmi", [pytest.param(2, marks=pytest.mark.slow), 3], ids=["fmi2", "fmi3"])
def test_any_call_order_is_memory_safe(fuzzer, fmi, seed, calls, level):
    """No fault of memory or arithmetic, and no number out that is none; most functions succeed now and then."""
    done = subprocess.run([fuzzer(fmi, level), str(seed), str(calls)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-500:] + done.stderr[-3000:]
    accepted = [int(n) for n in done.stdout.split("accepted")[1].split()]
    assert sum(accepted) > calls / 10
    assert min(accepted) > 0
