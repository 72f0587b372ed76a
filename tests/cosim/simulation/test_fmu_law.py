"""An FMU of the user's as the law: the same bits as the law that it was made of, its map, and each of its failures."""

import contextlib
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from cosim import Master, check_scenario, generate_scenes, load_run, load_scenario, run_scenario
from cosim.batch.fused import FusedFlyer
from cosim.batch.variation import Variation
from cosim.campaigns.scenes.scene_rows import SCHEMA
from cosim.campaigns.store.results import Results
from cosim.command_line.cli import main
from cosim.errors import ScenarioError
from cosim.results.file_copies import files_of
from cosim.simulation.commands import commands as cmd
from cosim.simulation.commands.sources import CommandQueue
from cosim.simulation.fmu_map import require_unit
from cosim.simulation.loaded_fmu import LoadedFmu
from cosim.ssp.controller import controller_component
from plant_fmu import PlantError
from plant_fmu.build import cached_fmu
from tests.architecture.modules import ROOT
from tests.cosim.simulation.keep import kept_rows
from tests.foreign_fmu import MODES, build_foreign_fmu

SHORT = ["time.duration=3", "time.step=0.01", "time.control=0.01", "time.arbiter=0.01", "arbiter.engine=closed"]
WRENCH = {f"wrench.{axis}": 20 + i for i, axis in enumerate("XYZKMN")}
VELOCITY = {f"velocity.{axis}": 10 + i for i, axis in enumerate("uvwpqr")}
OTHER_INPUTS, OTHER_OUTPUTS = (
    {name.replace(".", "_"): reference for name, reference in names.items()} for names in (VELOCITY, WRENCH)
)
MAP = [
    *(f"law.inputs.{name.replace('.', '_')}={name}" for name in VELOCITY),
    *(f"law.outputs.{name.replace('.', '_')}={name}" for name in WRENCH),
]


@pytest.fixture(params=[2, 3], ids=["fmi2", "fmi3"])
def fmi(request):
    return request.param


@pytest.fixture(scope="module")
def fmus(once):
    """Return the folder with brakes, FMUs of either version, with names of their own and with those of signals."""

    def make(folder):
        for fmi in (2, 3):
            build_foreign_fmu(folder / f"brake{fmi}.fmu", fmi, inputs=VELOCITY, outputs=WRENCH)
            build_foreign_fmu(folder / f"other{fmi}.fmu", fmi, inputs=OTHER_INPUTS, outputs=OTHER_OUTPUTS)

    return once("fmu-laws", make)


def braked(fmus, fmi, *changes, mode="ok", at=1.0):
    settings = [f"law.file={fmus / f'brake{fmi}.fmu'}", "law.parameters.gain=-40", f"law.parameters.at={at}"]
    return load_scenario("paper", [*SHORT, *settings, f"law.parameters.mode={MODES.index(mode)}", *changes])


@pytest.mark.medium
@pytest.mark.parametrize("name", ["paper", "paper-deployable"])
def test_packaged_controller_has_the_bits_of_its_law(fmi, tmp_path, name):
    """In a run, in flights without a record, and in a run with another law's noise."""
    native = load_scenario(name, SHORT)
    shutil.copy(cached_fmu(controller_component(native), fmi), tmp_path / "controller.fmu")
    foreign = load_scenario(name, [*SHORT, f"law.file={tmp_path / 'controller.fmu'}"])
    one, other = kept_rows(native), kept_rows(foreign)
    for column in one.signals.columns:
        if not column.name.startswith("law."):
            np.testing.assert_array_equal(one[column.name], other[column.name], column.name)
    values, seeds = np.array([[0.0], [0.5], [0.0]]), np.zeros(3, np.int64)
    outcomes = []
    for scenario in (native, foreign):
        with FusedFlyer(Variation(scenario, ["initial.position.0"])) as flyer:
            outcomes.append(flyer.fly(values, seeds).outcomes)
    assert outcomes[1][0].tobytes() == outcomes[1][2].tobytes()
    for field in outcomes[0].dtype.names:
        np.testing.assert_allclose(outcomes[1][field], outcomes[0][field], rtol=1e-12, atol=1e-12, err_msg=field)


@pytest.mark.medium(fast=1)
def test_map_connects_other_names(fmus, fmi):
    """And a brake of C is the brake: a wrench of -40 times the velocity."""
    same = kept_rows(braked(fmus, fmi))
    other = kept_rows(braked(fmus, fmi, f"law.file={fmus / f'other{fmi}.fmu'}", *MAP))
    for name in ("position.x", "wrench.X", "wrench.N"):
        np.testing.assert_array_equal(same[name], other[name])
    np.testing.assert_allclose(same["wrench.Z"][1:], -40.0 * same["velocity.w"][1:], rtol=1e-15)


def test_a_closed_law_has_freed_its_fmu(fmus):
    scenario = braked(fmus, 3)
    loaded = LoadedFmu(scenario.law.fmu, scenario.time.control, "time.control")
    loaded.close()
    loaded.close()
    with pytest.raises(PlantError, match="is closed"):
        loaded.plant.initialize()


def test_all_signals_that_a_law_receives_can_be_connected(fmus):
    signals = ["SR1.value", "goal.clearance", "goal.gradient.x", "weight.SR1", "membership.obstacle", "time"]
    changes = [f"law.inputs.{name}={signal}" for name, signal in zip(VELOCITY, signals, strict=True)]
    run = kept_rows(braked(fmus, 3, *changes, "law.parameters.gain=1.0"))
    for i, name in enumerate(signals):
        if name != "goal.gradient.x" and not name.startswith("weight."):
            np.testing.assert_array_equal(run[list(WRENCH)[i]][:-1], run[name][:-1], name)
    assert (run["wrench.Z"][:-1] != 0.0).all()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["law.file=none.fmu"], r"law.file: none.fmu: No such file"),
        (["law.file=law.zip"], "law.file is 'law.zip', expected a name that ends in .fmu"),
        (["law.inputs.foo=position.x"], "law.inputs.foo: brake3.fmu has no variable of this name"),
        (["law.inputs.gain=position.x"], "gain of brake3.fmu is of causality parameter, expected input"),
        (["law.inputs.velocity.u=positoin.x"], "which is no signal; did you mean 'position.x'"),
        (["law.outputs.velocity.u=wrench.X"], "velocity.u of brake3.fmu is of causality input, expected output"),
        (["law.outputs.wrench.X=wrench.Q"], "law.outputs.wrench.X is 'wrench.Q', which no law sets"),
        (["law.outputs.wrench.X=wrench.Y", "law.outputs.wrench.Y=wrench.Y"], "which another output sets"),
        (["law.outputs.wrench.X=thrust[1]"], "set both wrench and thrust"),
        (["law.parameters.gian=1"], "law.parameters: FMU variable 'gian' is unknown; did you mean 'gain'"),
        (["law.digest=abc"], r"brake3.fmu has the digest .*, expected abc"),
        (["law.gains.k=1"], "gains has 'k', expected no gains with an FMU as the law"),
        (["law.name=pd", "law.inputs.a=b"], "law.inputs is {.*}, expected none without law.file"),
    ],
)
def test_invalid_maps_are_refused(fmus, changes, words, capsys, monkeypatch, tmp_path):
    """In one line, which names the key; nothing is left of the run, and `cosim check` says the same."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ScenarioError, match=words):
        Master(braked(fmus, 3, *changes)).close()
    changes = [f"--set={change}" for change in (*SHORT, f"law.file={fmus / 'brake3.fmu'}", *changes)]
    assert main(["run", "paper", *changes, "--out", "run"]) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1 and not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("unit", "factors", "expected", "fits"),
    [
        ("", None, "m/s", True), ("-", None, "", True), ("1", None, "", True), ("-", None, "m/s", False),
        ("Nm", None, "N.m", True), ("N*m", None, "N.m", True), ("furlong", {"m": "1", "s": "-1"}, "m/s", True),
        ("deg/s", {"s": "-1", "rad": "1", "factor": "0.0174"}, "rad/s", False), ("Hz", {"s": "-1"}, "rad/s", True),
        ("kN", {"kg": "1", "m": "1", "s": "-2", "factor": "1000"}, "N", False),
        ("degC", {"K": "1", "offset": "273.15"}, "m", False), ("m", {"m": "1", "offset": "1"}, "m/s", False),
        ("one", {"kg": "0"}, "", True), ("percent", {"factor": "0.01"}, "", False), ("m/s", {"K": "1"}, "m/s", True),
    ],
)  # fmt: skip
def test_base_units_are_compared(unit, factors, expected, fits):
    """By the definition of a unit, unless its name is the expected one; without a unit anything fits."""
    file = SimpleNamespace(units={} if factors is None else {unit: factors}, path=Path("it.fmu"))
    variable = SimpleNamespace(name="x", unit=unit)
    with contextlib.nullcontext() if fits else pytest.raises(ScenarioError, match=f"x of it.fmu is in '{unit}'"):
        require_unit("law.inputs.x", file, variable, expected)


def test_units_are_compared(tmp_path):
    units = {"velocity.u": "km/h"}
    path = build_foreign_fmu(tmp_path / "it.fmu", 3, inputs=VELOCITY, outputs=WRENCH, units=tuple(units.items()))
    scenario = load_scenario("paper", [*SHORT, f"law.file={path}"])
    words = "law.inputs.velocity.u: velocity.u of it.fmu is in 'km/h', expected 'm/s'"
    with pytest.raises(ScenarioError, match=words):
        Master(scenario)
    assert [finding.text for finding in check_scenario(scenario).failed if finding.topic == "law"] == [words]


def test_check_compares_the_period_with_the_steps_of_the_fmu(fmus, tmp_path):
    build_foreign_fmu(tmp_path / "it.fmu", 3, inputs=VELOCITY, outputs=WRENCH, fixedInternalStepSize="0.02")
    findings = [check_scenario(braked(fmus, 3, *change)).findings for change in ([], [f"law.file={tmp_path}/it.fmu"])]
    steps = [next(f for f in found if f.name == "step") for found in findings]
    assert [step.status for step in steps] == ["holds", "fails"] and "0.02 s" in steps[1].advice
    with pytest.raises(ScenarioError, match=r"time\.control: it\.fmu: step is 0\.01 s, expected a multiple"):
        Master(braked(fmus, 3, f"law.file={tmp_path}/it.fmu"))


@pytest.mark.medium(fast=4)
@pytest.mark.parametrize(
    ("mode", "words"),
    [
        ("error", "t = 1 s: "), ("fatal", "t = 1 s: out of memory"), ("discard", "t = 1.005 s: the FMU discarded"),
        ("end", "t = 1.005 s: the FMU requests the end"), ("nan", "t = 1 s: wrench.X is nan, expected a finite force"),
        ("null message", "t = 1 s: the FMU failed without a message: Error"),
        ("no input", "t = 1 s: the FMU failed without a message: Discard"),
    ],
)  # fmt: skip
def test_failures_name_fmu_and_time_and_keep_the_record(fmus, fmi, tmp_path, mode, words):
    with pytest.raises(PlantError) as caught:
        run_scenario(braked(fmus, fmi, mode=mode), tmp_path / "run", report=False)
    assert str(caught.value).startswith(f"brake{fmi}.fmu: {words}") and "\n" not in str(caught.value)
    run = load_run(tmp_path / "run")
    assert run.summary["status"] == f"failed: {caught.value}"
    assert run.record["time"][-1] == pytest.approx(0.99)


def test_parts_of_steps_are_failures(fmus, tmp_path):
    """FMI 2.0 does not say how far a step went that succeeded."""
    with pytest.raises(PlantError, match=r"brake3\.fmu: t = 1\.005 s: the FMU made a part of the step alone"):
        kept_rows(braked(fmus, 3, mode="short"))


def test_failed_rows_are_refused_and_others_fly(fmus, fmi):
    """One copy of the FMU, which is reset before each row, or loaded anew after a fatal error."""
    for mode in ("error", "fatal"):
        scenario = braked(fmus, fmi, mode=mode)
        with FusedFlyer(Variation(scenario, ["law.parameters.at"])) as flyer:
            flown = flyer.fly(np.array([[9.0], [1.0], [9.0]]), np.zeros(3, np.int64))
        assert list(flown.refused) == [1] and "t = 1 s" in flown.refused[1]
        assert flown.outcomes[0].tobytes() == flown.outcomes[2].tobytes()


def hanging_run(fmus, folder, timeout, *options, at):
    """Start a run of an FMU that hangs from a time on [s], as a terminal does: in a group of processes of its own."""
    scenario = braked(fmus, 3, "time.duration=100", "time.step=0.001", mode="hang", at=at)
    (folder / "it.toml").write_bytes(files_of(scenario)["scenario.toml"])
    shutil.copy(fmus / "brake3.fmu", folder)
    call = [sys.executable, "-m", "cosim", "run", "it.toml", "--set", f"law.timeout={timeout}", "--out", "run"]
    posix = {"start_new_session": True} if os.name == "posix" else {}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return subprocess.Popen([*call, *options], cwd=folder, text=True, **pipes, **posix)


def wait_for_hang(process):
    """Return once a process has used so much of its processor that its FMU hangs."""
    used = 0
    while used < 5 * os.sysconf("SC_CLK_TCK"):
        time.sleep(0.1)
        used = int(Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()[11])


@pytest.mark.medium
def test_hang_ends_the_process_and_keeps_the_record(fmus, tmp_path):
    with hanging_run(fmus, tmp_path, 1.0, "--rate", "20", at=90.0) as process:
        _, errors = process.communicate(timeout=60)
    assert process.returncode != 0
    assert "brake3.fmu: t = 90 s: doStep has not returned for 1 s" in errors
    run = load_run(tmp_path / "run")
    assert run.summary["status"] == "killed" and run.record["time"][-1] > 10.0


@pytest.mark.medium
@pytest.mark.skipif(sys.platform != "linux", reason="signals of a terminal, and /proc")
def test_stopped_runs_are_kept_and_interrupted_hangs_end(fmus, tmp_path):
    """As by Ctrl-Z, fg and Ctrl-C in a terminal, and a debugger's stop of one process."""
    with hanging_run(fmus, tmp_path, 30.0, at=0.5) as process:
        wait_for_hang(process)
        for stop in (os.killpg, os.kill):
            stop(process.pid, signal.SIGSTOP)
            time.sleep(1.5)
            stop(process.pid, signal.SIGCONT)
        assert process.poll() is None
        os.killpg(process.pid, signal.SIGINT)
        _, errors = process.communicate(timeout=20)
    assert process.returncode != 0 and errors.count("\n") == 1
    assert "t = 0.5 s: the run was interrupted, and doStep has not returned" in errors


def test_run_folder_repeats_the_run(fmus, fmi, tmp_path):
    first = run_scenario(braked(fmus, fmi), tmp_path / "run", report=False)
    assert (tmp_path / "run" / f"brake{fmi}.fmu").read_bytes() == (fmus / f"brake{fmi}.fmu").read_bytes()
    again = run_scenario(tmp_path / "run" / "scenario.toml", tmp_path / "again", report=False)
    np.testing.assert_array_equal(first.record["position.x"], again.record["position.x"])
    run_scenario(braked(fmus, fmi), tmp_path / "run", report=False, overwrite=True)
    os.truncate(tmp_path / "run" / f"brake{fmi}.fmu", 100)
    with pytest.raises(ScenarioError, match="has the digest"):
        load_scenario(tmp_path / "run" / "scenario.toml")


def test_another_law_drops_the_map(fmus):
    scenario = braked(fmus, 3)
    assert scenario.law.name == "brake3.fmu"
    other = scenario.replace({"law.name": "pd"})
    assert other.law.fmu is None and not other.table["law"]["parameters"]
    back = other.replace({"law.file": str(fmus / "brake3.fmu")})
    assert back.law.name == "brake3.fmu" and back.table["law"]["gains"] == {}


def test_default_law_replaces_an_fmu(fmus, tmp_path):
    """By its name, in an override and in a scenario that has the other as its base."""
    (tmp_path / "mine.toml").write_text(f'base = "paper"\nlaw = {{ file = "{(fmus / "brake3.fmu").as_posix()}" }}\n')
    (tmp_path / "child.toml").write_text('base = "mine.toml"\nlaw = { name = "ismail_dunnigan" }\n')
    changed = load_scenario(tmp_path / "mine.toml", ["law.name=ismail_dunnigan"])
    for scenario in (changed, load_scenario(tmp_path / "child.toml")):
        assert scenario.law.fmu is None and scenario.law.name == "ismail_dunnigan"
    assert load_scenario(tmp_path / "mine.toml", ["law.name=brake3.fmu"]).law.fmu is not None
    (tmp_path / "none.toml").write_text('base = "mine.toml"\nlaw = { file = "" }\n')
    for scenario in (load_scenario(tmp_path / "mine.toml", ["law.file="]), load_scenario(tmp_path / "none.toml")):
        assert scenario.law.fmu is None and scenario.law.name == "ismail_dunnigan"
    assert load_scenario("paper", ["law.name=pd", "law.file="]).law.name == "pd"


def test_commands_steer_beside_the_fmu(fmus):
    """The FMU begins again where it regains control."""
    scenario = braked(fmus, 3, "commands.enabled=true", "commands.obstacles=0")
    queue = CommandQueue()
    with Master(scenario) as master:
        for k in range(60):
            if k in (20, 40):
                queue.submit(cmd.Arm(k == 40))
            master.step(k, queue)
            if k in (19, 30, 59):
                assert (np.abs(master.row[master.signals.index("wrench.Z")]) > 0.0) == (k != 30)


def test_errors_name_the_time_of_the_run(fmus, fmi):
    """Also after the FMU began again."""
    scenario = braked(fmus, fmi, "commands.enabled=true", mode="error", at=0.3)
    queue = CommandQueue()
    with Master(scenario) as master:
        for k in range(50):
            if k in (10, 20):
                queue.submit(cmd.Arm(k == 20))
            master.step(k, queue)
        with pytest.raises(PlantError, match=r"fmu: t = 0\.5 s: "):
            master.step(50, queue)


def test_forces_that_no_output_sets_are_zero(tmp_path):
    """Also after a pilot commanded them."""
    build_foreign_fmu(tmp_path / "z.fmu", 3, inputs={"velocity.w": 12}, outputs={"wrench.Z": 22})
    scenario = load_scenario("paper", [*SHORT, f"law.file={tmp_path}/z.fmu", "commands.enabled=true"])
    queue, forces = CommandQueue(), []
    with Master(scenario) as master:
        for k in range(30):
            if k == 5:
                queue.submit(cmd.SetMode("manual"))
                queue.submit(cmd.ManualControl((0.5, 0, 0, 0, 0, 0)))
            if k == 20:
                queue.submit(cmd.SetMode("reach"))
            master.step(k, queue)
            forces.append(master.row[master.signals.index("wrench.X")])
    assert forces[15] > 0.0 and forces[-1] == 0.0


@pytest.mark.medium
def test_controller_of_the_howto_flies(tmp_path, monkeypatch):
    """A controller made by pythonfmu, in the scenario of docs/howto/your-fmu.md."""
    builder = pytest.importorskip("pythonfmu.builder")
    monkeypatch.chdir(tmp_path)
    page = (ROOT / "docs" / "howto" / "your-fmu.md").read_text(encoding="utf-8")
    code, table = (re.search(rf"```{kind}\n(.*?)```", page, re.S)[1] for kind in ("python", "toml"))
    (tmp_path / "brake.py").write_text(code)
    builder.FmuBuilder.build_FMU(tmp_path / "brake.py", tmp_path)
    (tmp_path / "mine.toml").write_text(table)
    run = run_scenario(load_scenario("mine.toml", ["time.duration=2"]), tmp_path / "run", report=False)
    np.testing.assert_allclose(run.record["wrench.Z"][:-1:10], -80.0 * run.record["velocity.w"][:-1:10], rtol=1e-15)
    assert np.abs(run.record["wrench.Z"]).max() > 0.0


@pytest.mark.medium
def test_campaigns_comparisons_and_repeats_fly_an_fmu(fmus, tmp_path, monkeypatch):
    """By its file, or by that of a scenario; another FMU in its place is no repeat."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(fmus / "brake3.fmu", "mine.fmu")
    (tmp_path / "mine.toml").write_text('base = "paper"\nlaw = { file = "mine.fmu", parameters = { gain = -50.0 } }\n')
    (tmp_path / "scenes.jsonl").write_text("\n".join(generate_scenes(2)))
    rows = []
    for law, changes in (("mine.fmu", ["--set", "gain=-50"]), ("mine.toml", [])):
        assert main(["campaign", "scenes.jsonl", "--law", law, *changes, "--out", law[5:], "--quiet"]) == 0
        results = Results(tmp_path / law[5:] / "results.parquet", SCHEMA)
        rows.append(results.number("min_clearance"))
        assert results.is_null("refused").all()
    assert len(rows[0]) == 2
    np.testing.assert_array_equal(*rows)
    assert main(["compare", "scenes.jsonl", "--laws", "pd,mine.toml", "--out", "both", "--quiet"]) == 0
    assert {"pd", "mine.toml"} <= {path.name for path in (tmp_path / "both").iterdir()}
    assert main(["rerun", "fmu", "1", "--out", "again", "--quiet"]) == 0
    with (tmp_path / "mine.fmu").open("ab") as file:
        file.write(b" ")
    assert main(["rerun", "fmu", "1", "--out", "again2", "--quiet"]) == 2
