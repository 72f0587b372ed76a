"""FMUs beside the plant: against a master of FMPy's slaves, in runs and in flights without a record; each failure."""

import contextlib
import importlib

import numpy as np
import pytest
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

from cosim import Master, check_scenario, load_run, run_scenario
from cosim.batch.fused import FusedFlyer
from cosim.batch.variation import Variation
from cosim.command_line.cli import main
from cosim.errors import CosimError, RunError, ScenarioError
from cosim.simulation.commands import commands as cmd
from cosim.simulation.commands.sources import CommandQueue
from plant_fmu import PlantError, load_vehicle
from plant_fmu.build import cached_fmu
from plant_fmu.vehicle_component import make_vehicle_component
from tests.cosim.components import CURRENT, FORCE, POSITION, beside, build_fmu, numbered, short
from tests.cosim.simulation.keep import kept_rows
from tests.foreign_fmu import MODES, build_foreign_fmu


@pytest.fixture(params=[2, 3], ids=["fmi2", "fmi3"])
def fmi(request):
    return request.param


class Slave:
    """An FMU 2.0 in FMPy, with its variables by name."""

    def __init__(self, path, folder, start):
        description = read_model_description(str(path), validate=False)
        self.references = {v.name: v.valueReference for v in description.modelVariables}
        self.fmu = FMU2Slave(
            guid=description.guid, modelIdentifier=description.coSimulation.modelIdentifier,
            unzipDirectory=extract(str(path), str(folder)), instanceName="it",
        )  # fmt: skip
        self.fmu.instantiate()
        self.fmu.setupExperiment()
        self.set(start)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def set(self, values):
        self.fmu.setReal([self.references[name] for name in values], [*map(float, values.values())])

    def get(self, names):
        return dict(zip(names, self.fmu.getReal([self.references[name] for name in names]), strict=True))

    def close(self):
        self.fmu.terminate()
        self.fmu.freeInstance()


def in_fmpy(scenario, fmus, wrenches, order, folder):
    """Return the positions of the plant with tether and current, under given wrenches."""
    plant = cached_fmu(make_vehicle_component(load_vehicle("odin"), coupled=True), 2)
    step, position, rows = scenario.time.step, scenario.initial.position, []
    start = numbered(POSITION, 0)
    start = {name: position[i] for name, i in start.items()}
    with contextlib.ExitStack() as opened:

        def load(path, values):
            slave = Slave(path, folder / path.stem, values)
            opened.callback(slave.close)
            return slave

        body = load(plant, start | {"substep": scenario.plant.substep})
        tether = load(fmus / "tether2.fmu", {"mode": MODES.index("tether"), "gain": 200.0} | start)
        current = load(
            fmus / "current2.fmu", {"mode": MODES.index("current"), "gain": 0.3, "position.z": start["position.z"]}
        )
        outputs = tether.get(FORCE) | current.get(CURRENT)
        for k, wrench in enumerate(wrenches):
            pose, before = body.get(POSITION), outputs
            rows.append(list(pose.values()))
            tether.set(pose)
            current.set({"position.z": pose["position.z"]})
            for slave in (tether, current):
                slave.fmu.doStep(k * step, step)
            outputs = tether.get(FORCE) | current.get(CURRENT)
            body.set(dict(zip((f"wrench.{axis}" for axis in "XYZKMN"), wrench, strict=True)))
            body.set(outputs if order == "gauss-seidel" else before)
            body.fmu.doStep(k * step, step)
    return np.array(rows)


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("order", ["gauss-seidel", "jacobi"])
def test_master_equals_an_independent_one(fmus, fmi, order, tmp_path):
    scenario = beside(fmus, fmi, "tether", "current", changes=[f"master.order={order}"])
    run = kept_rows(scenario)
    wrenches = np.column_stack([run[f"wrench.{axis}"] for axis in "XYZKMN"])
    if order == "jacobi":
        wrenches = np.vstack([np.zeros(6), wrenches[:-1]])
    expected = in_fmpy(scenario, fmus, wrenches, order, tmp_path)
    np.testing.assert_allclose(np.column_stack([run[name] for name in POSITION]), expected, rtol=0.0, atol=1e-9)
    assert np.abs(run["load.world.force.x"]).max() > 10.0 and np.ptp(run["current_input.x"]) > 0.1


def test_outputs_are_columns_of_the_beginning_of_a_step(fmus, fmi):
    run = kept_rows(beside(fmus, fmi, "tether", "current"))
    columns = {column.name: column for column in run.signals.columns}
    assert columns["tether.load.world.force.z"].unit == "N" and columns["current.current_input.x"].unit == "m/s"
    for name in FORCE:  # what a step applies is given at its end (Gauss-Seidel)
        np.testing.assert_array_equal(run[name][:-2], run[f"tether.{name}"][1:-1], name)


def test_map_connects_other_names(fmus, fmi):
    maps = {"inputs": dict(zip(short(POSITION), POSITION, strict=True))}
    maps["outputs"] = dict(zip(short(FORCE), FORCE, strict=True))
    one, other = kept_rows(beside(fmus, fmi, "tether")), kept_rows(beside(fmus, fmi, "line", line=maps))
    for name in (*POSITION, *FORCE):
        np.testing.assert_array_equal(one[name], other[name], name)


def test_former_names_of_loads_are_read(fmus, tmp_path, caplog):
    """In a map, as the name of an output without a map, of a column, and of the plant's input; with one line."""
    former = [name.replace("load", "external") for name in FORCE]
    maps = {"inputs": dict(zip(short(POSITION), POSITION, strict=True))}
    maps["outputs"] = dict(zip(short(FORCE), former, strict=True))
    one, other = kept_rows(beside(fmus, 3, "tether")), kept_rows(beside(fmus, 3, "line", line=maps))
    build_fmu(tmp_path, 3, "tether", inputs=numbered(POSITION, 10), outputs=numbered(former, 20))
    unmapped = kept_rows(beside(tmp_path, 3, "tether"))
    for name, old in zip(FORCE, former, strict=True):
        np.testing.assert_array_equal(one[name], other[name], name)
        np.testing.assert_array_equal(one[name], unmapped[name], name)
        assert [r.message for r in caplog.records].count(f"variable {old} is now {name}") <= 1
    assert any("is now" in record.message for record in caplog.records)


@pytest.mark.medium
@pytest.mark.parametrize("by", ["inputs", "outputs"])
def test_components_are_connected_with_each_other(fmus, by):
    """In the order of their connections, whatever that of the file; Jacobi's order delays each by a step."""
    depth = {"first": {"inputs": {"u": "position.z"}}}
    second = {"inputs": {"u": "first.y"}} if by == "inputs" else {}
    maps = {
        "first": depth["first"] | ({"outputs": {"y": "second.u"}} if by == "outputs" else {}),
        "second": second | {"parameters": {"gain": 2.0}},
    }
    for order, delay in (("gauss-seidel", 1), ("jacobi", 2)):
        run = kept_rows(beside(fmus, 3, "gain:second", "gain:first", changes=[f"master.order={order}"], **maps))
        np.testing.assert_array_equal(run["second.y"][2:], 2.0 * run["position.z"][2 - delay : -delay])


@pytest.mark.medium
def test_flights_without_a_record_are_the_runs(fmus, fmi):
    scenario = beside(fmus, fmi, "tether", "current")
    varied = Variation(scenario, ["components.tether.parameters.gain", "initial.position.1"])
    with FusedFlyer(varied) as flyer:
        flown = flyer.fly(np.array([[200.0, 0.0], [50.0, 1.0], [200.0, 0.0]]), np.zeros(3, np.int64))
    assert not flown.refused and flown.outcomes[0].tobytes() == flown.outcomes[2].tobytes()
    for outcome, changes in zip(
        flown.outcomes, ({}, {"components.tether.parameters.gain": 50.0, "initial.position.1": 1.0}), strict=False
    ):
        run = kept_rows(scenario.replace(changes))
        np.testing.assert_array_equal([outcome[f"final_{axis}"] for axis in "xyz"], [run[n][-1] for n in POSITION])


@pytest.mark.medium
def test_run_folder_repeats_the_run(fmus, fmi, tmp_path):
    """With two FMUs whose files have one name."""
    (tmp_path / "other").mkdir()
    build_foreign_fmu(tmp_path / "other" / f"tether{fmi}.fmu", fmi, inputs={"u": 10}, outputs={"y": 20})
    more = {"name": "other", "file": str(tmp_path / "other" / f"tether{fmi}.fmu"), "inputs": {"u": "position.z"}}
    scenario = beside(fmus, fmi, "tether")
    scenario = scenario.replace({"components": [*scenario.table["components"], more]})
    first = run_scenario(scenario, tmp_path / "run", report=False)
    assert {path.name for path in (tmp_path / "run").glob("*.fmu")} == {f"tether{fmi}.fmu", f"tether{fmi}-2.fmu"}
    again = run_scenario(tmp_path / "run" / "scenario.toml", tmp_path / "again", report=False)
    for column in first.record.columns:
        np.testing.assert_array_equal(first.record[column.name], again.record[column.name], column.name)
    run_scenario(scenario, tmp_path / "run", report=False, overwrite=True)


def test_reset_by_commands_and_steps_one_by_one(fmus):
    """Steps one by one have the bits of blocks, also while commands steer."""
    scenario = beside(fmus, 3, "tether", changes=["commands.enabled=true", "commands.obstacles=0"])
    queue, blocks = CommandQueue(), kept_rows(beside(fmus, 3, "tether"))
    with Master(scenario) as master:
        for k in range(301):
            master.step(k, queue)
            np.testing.assert_array_equal(master.true_state.position, [blocks[name][k] for name in POSITION])
        queue.submit(cmd.Arm(False))


@pytest.mark.medium(fast=3)
@pytest.mark.parametrize(
    ("mode", "words"),
    [
        ("error", "t = 1 s: "), ("fatal", "t = 1 s: out of memory"), ("discard", "t = 1.005 s: the FMU discarded"),
        ("nan", "t = 1 s: load.world.force.x is nan, expected a finite number"),
    ],
)  # fmt: skip
def test_failures_name_fmu_and_time_and_keep_the_record(fmus, fmi, tmp_path, mode, words):
    maps = {"parameters": {"mode": MODES.index(mode), "at": 1.0}}
    with pytest.raises(PlantError) as caught:
        run_scenario(beside(fmus, fmi, "current", "tether", tether=maps), tmp_path / "run", report=False)
    assert str(caught.value).startswith(f"tether (tether{fmi}.fmu): {words}") and "\n" not in str(caught.value)
    run = load_run(tmp_path / "run")
    assert run.summary["status"] == f"failed: {caught.value}"
    assert run.record["time"][-1] == pytest.approx(0.99)
    with FusedFlyer(Variation(beside(fmus, fmi, "tether", tether=maps), ["components.tether.parameters.at"])) as flyer:
        flown = flyer.fly(np.array([[9.0], [1.0], [9.0]]), np.zeros(3, np.int64))
    assert list(flown.refused) == [1] and flown.outcomes[0].tobytes() == flown.outcomes[2].tobytes()


@pytest.mark.medium(fast=6)
@pytest.mark.parametrize(
    ("names", "maps", "words"),
    [
        (["gain:a", "gain:b"], {"a": {"inputs": {"u": "b.y"}}, "b": {"inputs": {"u": "a.y"}}},
         r"components: (a -> b -> a|b -> a -> b) is a cycle .* --set master.order=jacobi"),
        (["gain:a"], {"a": {"inputs": {"u": "a.y"}}}, "components: a -> a is a cycle"),
        (["tether", "tether:two"], {}, "components.two.outputs.load.world.force.x is .* which another output sets"),
        (["gain:a"], {"a": {"inputs": {"v": "position.x"}}}, "components.a.inputs.v: gain3.fmu has no variable"),
        (["gain:a"], {"a": {"inputs": {"u": "positoin.x"}}}, "is no signal; did you mean 'position.x'"),
        (["gain:a"], {"a": {"inputs": {"y": "position.x"}}}, "y of gain3.fmu is of causality output, expected input"),
        (["gain:a"], {"a": {"inputs": {"u": "velocity.u"}}}, "u of gain3.fmu is in 'm', expected 'm/s'"),
        (["gain:a"], {"a": {"outputs": {"y": "current_input.x"}}}, "y of gain3.fmu is in 'm', expected 'm/s'"),
        (["gain:a"], {"a": {"outputs": {"y": "thrust[1]"}}}, "is no input of the plant or of a component"),
        (["gain:a", "tether"], {"a": {"outputs": {"y": "tether.depth"}}}, "but tether has no such input"),
        (["gain:a", "gain:b"], {"a": {"outputs": {"y": "b.u"}}, "b": {"inputs": {"u": "position.z"}}},
         "components.a.outputs.y is 'b.u', which is connected already"),
        (["gain:position"], {}, "name is 'position', but 'position.y' is a column already, expected another name"),
        (["gain:plant"], {}, "name is 'plant', expected another one"),
        (["gain:a", "gain:a"], {}, "components.*name is 'a', used twice"),
        (["gain:a"], {"a": {"parameters": {"gian": 1.0}}}, "components.a.parameters: FMU variable 'gian' is unknown"),
        (["gain:a"], {"a": {"file": "none.fmu"}}, "components.a.file: none.fmu: No such file"),
        (["gain:a"], {"a": {"digest": "abc"}}, "components.a.file: gain3.fmu has the digest"),
    ],
)  # fmt: skip
def test_invalid_maps_are_refused(fmus, names, maps, words):
    with pytest.raises(ScenarioError, match=words):
        Master(beside(fmus, 3, *names, **maps)).close()


def test_check_compares_without_running(fmus, tmp_path):
    build_foreign_fmu(tmp_path / "x3.fmu", 3, inputs={"u": 10}, outputs={"y": 20}, fixedInternalStepSize="0.02")
    findings = check_scenario(beside(tmp_path, 3, "x")).findings
    found = {finding.name: finding for finding in findings if finding.topic == "components"}
    assert found["x inputs"].text.startswith("u: not connected") and found["x step"].status == "fails"
    loop = {"a": {"inputs": {"u": "b.y"}}, "b": {"inputs": {"u": "a.y"}}}
    failed = check_scenario(beside(fmus, 3, "gain:a", "gain:b", **loop)).failed
    assert any("is a cycle" in finding.text for finding in failed)


def test_what_needs_the_plant_alone_is_refused(fmus, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    scenario = beside(fmus, 3, "tether")
    run_scenario(scenario, tmp_path / "run", report=False)
    assert main(["report", "--replay", "run", "--interactive", "--out", "it.html"]) == 2
    assert "expected none for an interactive replay" in capsys.readouterr().err
    with pytest.raises(CosimError, match=r"plant.fmi is 2, expected 3 with components"):
        scenario.replace({"plant.fmi": 2})
    pytest.importorskip("gymnasium")
    region_env = importlib.import_module("cosim.learning.region_env")
    with pytest.raises(RunError, match="expected none for learning"):
        region_env.RegionEnv(scenario)
