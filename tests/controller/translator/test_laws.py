"""Shipped laws as C against their Python text, run by Python itself, and as C by other compilers."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from controller import LAWS
from controller.compiling.function import BoundCall, c_text
from controller.compiling.library import load_library
from controller.stack_array import interpret
from tests.controller.translator.building import Called, compiled
from tests.controller.translator.flights import Flight, same_bits

pytestmark = pytest.mark.timeout(900)  # compilers take minutes for a law beside other tests

HERE = Path(__file__).parent


@pytest.fixture(scope="module", params=sorted(LAWS))
def library(request, tmp_path_factory):
    """The name of a law, its C text, and the library that this makes."""
    flight = Flight(request.param)
    text = c_text(flight.function, flight.arguments)
    return request.param, text, compiled(text, tmp_path_factory.mktemp(request.param))


def first_difference(law, library, steps, seed, reference=None):
    """Return the first step after which C and a reference differ in forces or memory; None if none does.

    Without a library it is C as laws are flown; without another library, Python itself is the reference.
    """
    own, other = Flight(law, seed), Flight(law, seed)
    call = Called(library, other.arguments) if library else BoundCall(other.function, other.arguments).call
    plain = Called(reference, own.arguments) if reference else lambda: interpret(own.function, own.arguments)
    with np.errstate(all="ignore"):
        for k in range(steps):
            own.advance()
            other.advance()
            plain()
            call()
            if not (same_bits(own.forces, other.forces) and same_bits(own.memory, other.memory)):
                return k
    return None


@pytest.mark.medium(fast=1)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("law", sorted(LAWS))
def test_forces_and_memory_are_those_of_python_itself(law):
    assert first_difference(law, None, 200, seed=8) is None


@pytest.mark.slow
def test_forces_and_memory_are_those_of_python_for_long(library):
    law, _, built = library
    steps = 700 if law == "deployable" else 1700  # of which Python runs a hundred a second
    assert [first_difference(law, built, steps, seed) for seed in range(2, 5)] == [None] * 3


@pytest.mark.slow
@pytest.mark.parametrize(
    "flags", [("-O0",), ("-O3",), ("-O3", "-march=native", "-fno-tree-slp-vectorize")], ids=" ".join
)
def test_any_optimization_gives_the_same_bits(library, flags, tmp_path):
    law, text, built = library
    other = compiled(text, tmp_path, *flags)
    assert first_difference(law, other, 20_000, 6, built) is None


@pytest.mark.slow
def test_another_compiler_gives_the_same_bits(library, tmp_path):
    pytest.importorskip("ziglang", reason="the build extra is not installed")
    law, text, built = library
    other = compiled(text, tmp_path, compiler=[sys.executable, "-m", "ziglang", "cc"])
    assert first_difference(law, other, 3000, 7, built) is None


@pytest.mark.parametrize("law", sorted(LAWS))
def test_generated_code_allocates_no_heap_memory(law):
    flight = Flight(law)
    built = load_library(c_text(flight.function, flight.arguments))._name
    done = subprocess.run(["nm", "-D", "--undefined-only", built], capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip("nm is not there")
    wanted = {line.split()[-1].partition("@")[0] for line in done.stdout.splitlines()}
    ours = {name for name in wanted if not name.startswith("_")}
    assert ours <= {"sqrt", "pow", "cos", "sin", "acos", "atan2", "hypot", "memset", "memcpy", "memmove"}, law


@pytest.mark.slow
def test_sanitizers_report_no_error(library, tmp_path):
    """The library with its checks, in a Python of its own: who loads it late needs the runtime first."""
    law, text, _ = library
    flags = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g", "-O1")
    runtime = subprocess.run(["cc", "-print-file-name=libasan.so"], capture_output=True, text=True, check=False)
    if runtime.returncode or not Path(runtime.stdout.strip()).is_absolute():
        pytest.skip("the compiler has no sanitizers")
    built = compiled(text, tmp_path, *flags, compiler=["cc"])
    code = f"""
from tests.controller.translator.building import Called
from tests.controller.translator.flights import Flight
flight = Flight({law!r}, 9)
call = Called({str(built)!r}, flight.arguments)
for _ in range(3000):
    flight.advance()
    call()
"""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=HERE.parents[2], capture_output=True, text=True, timeout=600, check=False,
        env={
            "LD_PRELOAD": runtime.stdout.strip(), "ASAN_OPTIONS": "detect_leaks=0",
            "PATH": "/usr/bin:/bin", "HOME": str(tmp_path),
        },
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
