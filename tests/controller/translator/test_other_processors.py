"""A law as C on other processors, emulated: the bits of x86 and Python."""

import importlib.util
import shutil
import subprocess
import sys

import numpy as np
import pytest

from controller import LAWS, FunctionLaw, Gains, IsmailDunniganLaw, LawError, translate_law
from controller.compiling.function import BoundCall
from controller.regions import pack
from controller.translator.program import Program
from controller.translator.static_data import static_data
from controller.translator.types import type_of
from tests.controller.translator.flights import GOAL, PERIOD, REGIONS, Flight

pytestmark = pytest.mark.timeout(900)  # compilers and emulators take minutes for a law beside other tests

STEPS = 1500
# reads what each step is given, and writes forces, estimate and report
MAIN = """
#include <stdio.h>
static int filled(double *data, int64_t n) { return fread(data, 8, (size_t)n, stdin) == (size_t)n; }
int main(void)
{
    law_arguments *a = &law_data;
    while (filled(a->a0.position.data, 3)) {
        if (!filled(a->a0.quaternion.data, 4) || !filled(a->a0.velocity_body.data, 6)
            || !filled(a->a0.thruster_health.data, a->a0.thruster_health.n0) || !filled(a->a0.deviation.data, 12)
            || !filled(a->a3.data, a->a3.n0)
            || !filled(a->a2.shifts.data, a->a2.shifts.n0 * 3))
            return 1;
        law(a);
        fwrite(a->a6.data, 8, (size_t)a->a6.n0, stdout);
        fwrite(a->a5.estimate.data, 8, 4, stdout);
        REPORT
    }
    return 0;
}
"""
WASM = """
import sys, wasmtime
program, given, taken = sys.argv[1:]
engine = wasmtime.Engine()
linker, store, config = wasmtime.Linker(engine), wasmtime.Store(engine), wasmtime.WasiConfig()
linker.define_wasi()
config.stdin_file, config.stdout_file = given, taken
store.set_wasi(config)
instance = linker.instantiate(store, wasmtime.Module.from_file(engine, program))
try:
    instance.exports(store)["_start"](store)
except wasmtime.ExitTrap as ended:
    sys.exit(ended.code)
"""


def numbers_of(report):
    """Return the numbers of a report, and the C that writes them: of an array, or of the fields of a state."""
    if isinstance(report, np.ndarray):
        return report.copy(), f"fwrite(a->a5.report.data, 8, {report.size}, stdout);"
    parts = [np.ravel(report.storage(name)) for name in report._fields]
    lines = [f"fwrite(a->a5.report.{n}.data, 8, {x.size}, stdout);" for n, x in zip(report._fields, parts, strict=True)]
    return np.concatenate(parts), " ".join(lines)


@pytest.mark.slow
@pytest.mark.parametrize("target", ["x86_64-linux-musl", "aarch64-linux-musl", "arm-linux-musleabihf", "wasm32-wasi"])
@pytest.mark.parametrize("law", sorted(LAWS))
def test_bits_are_those_of_this_machine(law, target, tmp_path):
    pytest.importorskip("ziglang", reason="the build extra is not installed")
    emulator = {"aarch64": "qemu-aarch64", "arm": "qemu-arm"}.get(target.partition("-")[0])
    if emulator and not shutil.which(emulator):
        pytest.skip(f"{emulator} is not installed")
    if target.startswith("wasm") and importlib.util.find_spec("wasmtime") is None:
        pytest.skip("wasmtime is not installed")
    flight, program = Flight(law, 11), Program()
    program.export("law", flight.function, tuple(map(type_of, flight.arguments)))
    text = program.text() + static_data(program, "law", flight.arguments)
    text += MAIN.replace("REPORT", numbers_of(flight.memory.report)[1])
    (tmp_path / "law.c").write_text(text, encoding="utf-8")
    built, given, taken = tmp_path / "law.exe", tmp_path / "given", tmp_path / "taken"
    subprocess.run(
        [
            sys.executable, "-m", "ziglang", "cc", "-target", target, "-std=c99", "-O2", "-ffp-contract=off", "-Wall",
            "-Wextra", "-Wpedantic", "-Werror", str(tmp_path / "law.c"), "-o", str(built), "-lm",
        ],
        check=True, timeout=900,
    )  # fmt: skip
    inputs, outputs, step = bytearray(), [], BoundCall(flight.function, flight.arguments).call
    for _ in range(STEPS):
        flight.advance()
        inputs += b"".join(x.tobytes() for x in (*flight.state, flight.weights, flight.regions.shifts))
        step()
        outputs += [flight.forces.copy(), flight.memory.estimate.copy(), numbers_of(flight.memory.report)[0]]
    given.write_bytes(inputs)
    if target.startswith("wasm"):
        subprocess.run([sys.executable, "-c", WASM, str(built), str(given), str(taken)], check=True, timeout=900)
        found = np.fromfile(taken)
    else:
        with given.open("rb") as file:
            command = [emulator, str(built)] if emulator else [str(built)]
            done = subprocess.run(command, stdin=file, capture_output=True, check=True, timeout=900)
        found = np.frombuffer(done.stdout)
    np.testing.assert_array_equal(found, np.concatenate(outputs))


def test_law_with_mismatched_regions_or_of_unknown_type_is_rejected():
    goal, rocks = pack([GOAL]), pack(REGIONS[:2])
    law = IsmailDunniganLaw(Gains(), [1.0, 0.0, 0.0, 0.0], PERIOD, n_regions=2)
    assert "void dock(const void *words)" in translate_law(law, goal, rocks, name="dock")
    with pytest.raises(LawError, match="1 goals and 1 regions, expected 1 and the 2 of the law"):
        translate_law(law, goal, pack(REGIONS[:1]))
    with pytest.raises(LawError, match="2 goals"):
        translate_law(law, rocks, rocks)
    with pytest.raises(LawError, match=r"of type FunctionLaw, expected one of controller\.LAWS"):
        translate_law(FunctionLaw(lambda *_: [0.0] * 6), goal, rocks)


def test_empty_arrays_are_initialized_to_null():
    flight, program = Flight("pd"), Program()
    program.export("law", flight.function, tuple(map(type_of, flight.arguments)))
    assert "{NULL, 0}" in static_data(program, "law", flight.arguments)  # its report
