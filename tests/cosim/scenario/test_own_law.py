"""Custom laws: run, named in the run folder, and rejected where unsupported."""

import copy
import json
import tomllib

import numpy as np
import pytest

from controller import FunctionLaw, LawError
from controller.law import Diagnostic
from cosim.errors import RunError, ScenarioError
from cosim.precheck.precheck import check_scenario
from cosim.results.record import load_record
from cosim.results.run_result import load_run
from cosim.run.run_scenario import run_scenario
from cosim.scenario.law_factory import law_of
from cosim.scenario.scenario import load_scenario
from cosim.simulation.master import Master
from tests.cosim.simulation.keep import Keep

SHORT = ("arbiter.engine=closed", "time.duration=0.2", "time.step=0.01", "time.control=0.02", "time.arbiter=0.01")
NAME = "tests.cosim.scenario.test_own_law:ahead"


def ahead(state, goal, regions, weights):
    return [20.0, 0.0, 0.0, 0.0, 0.0, 0.0]


@pytest.fixture
def scenario():
    return load_scenario("paper", SHORT)


@pytest.fixture
def named(monkeypatch):
    """Give the function the name that it has however the tests are imported."""
    monkeypatch.setattr(ahead, "__module__", NAME.partition(":")[0])
    return FunctionLaw(ahead)


@pytest.mark.slow
def test_run_with_custom_law_is_complete_and_names_it(scenario, named, tmp_path):
    run = run_scenario(scenario, tmp_path / "run", law=named)
    record = load_record(run.folder)
    assert (record["command.X"] == 20.0).all() and (record["estimate.phi1"] == 0.0).all()
    assert record["velocity.u"][-1] > 0.01
    assert run.summary["law"] == NAME
    assert tomllib.loads((run.folder / "scenario.toml").read_text())["law"] == {
        "name": NAME, "desired_quaternion": [1.0, 0.0, 0.0, 0.0], "gains": {},
    }  # fmt: skip
    report = (run.folder / "report.html").read_text()
    assert NAME in report and "cosim run scenario.toml" not in report
    assert NAME in (run.folder / "replay.html").read_text()


def test_function_law_gives_the_same_run_bit_for_bit(tmp_path):
    scenario = load_scenario("paper", [*SHORT, "time.control=0.01", "time.duration=0.5"])
    law = law_of(scenario)
    run = run_scenario(scenario, tmp_path / "own", report=False, law=law)
    run_scenario(scenario, tmp_path / "shipped", report=False)
    one, other = load_record(tmp_path / "own"), load_record(tmp_path / "shipped")
    assert run.summary["law"] == "controller.laws.ismail_dunnigan:IsmailDunniganLaw"
    assert all(np.array_equal(one[name], other[name], equal_nan=True) for name in other.units)


@pytest.mark.medium
def test_scenario_file_with_custom_law_is_loadable_but_not_runnable(scenario, named, tmp_path):
    run = run_scenario(scenario, tmp_path / "run", report=False, law=named)
    again = load_scenario(run.folder / "scenario.toml")
    assert again.law.name == NAME and again.law.is_custom
    assert check_scenario(again).law == NAME
    for attempt in (lambda: run_scenario(again, tmp_path / "again"), lambda: Master(again)):
        with pytest.raises(RunError, match=f"law.name is '{NAME}', a law in Python"):
            attempt()
    assert not (tmp_path / "again").exists()
    assert run_scenario(again, tmp_path / "again", report=False, law=named).summary["law"] == NAME


def test_invalid_output_of_a_custom_law_leaves_a_readable_run(scenario, tmp_path):
    def late(state, goal, regions, weights):
        return np.zeros(6) if state.position[0] == 0.0 and not calls.append(1) and len(calls) < 5 else np.zeros(3)

    calls = []
    with pytest.raises(LawError, match="late returned"):
        run_scenario(scenario, tmp_path / "run", report=False, law=FunctionLaw(late))
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert summary["status"].startswith("failed: law ") and summary["simulated_time"] == pytest.approx(0.07)


def test_exception_of_a_custom_law_propagates_and_keeps_the_record(scenario, tmp_path):
    def faulty(state, goal, regions, weights):
        calls.append(1)
        return np.zeros(6) if len(calls) < 5 else 1 / 0

    calls = []
    with pytest.raises(ZeroDivisionError):
        run_scenario(scenario, tmp_path / "run", law=FunctionLaw(faulty))
    run = load_run(tmp_path / "run")
    assert run.summary["status"] == "killed" and run.summary["simulated_time"] == pytest.approx(0.07)
    assert run.summary["law"].endswith("faulty")


@pytest.mark.parametrize("law", [ahead, FunctionLaw, 3])
def test_invalid_law_is_rejected(law, scenario, tmp_path):
    with pytest.raises(LawError, match=r"law is .*:.*, expected a FunctionLaw"):
        run_scenario(scenario, tmp_path / "run", law=law)
    assert not (tmp_path / "run").exists()


class Reporting:
    """A law whose outputs change their shapes in step `due`."""

    output, diagnostics = "wrench", (Diagnostic("share", "", "Share"),)

    def __init__(self, due, estimate=(0.0,) * 4, report=(0.0,)):
        self.due, self.k, self.given = due, 0, (estimate, report)

    @property
    def estimate(self):
        return self.given[0] if self.k >= self.due else np.arange(4.0) + self.k

    @property
    def report(self):
        return self.given[1] if self.k >= self.due else [0.5 * self.k]

    def step(self, state, goal, regions, weights, forces):
        self.k += 1
        forces[:] = 0.0


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"report": [1.0, 2.0]}, r"report is \(2,\), expected \(1,\)"),
        ({"report": None}, r"report is \(\), expected \(1,\)"),
        ({"estimate": [1.0] * 3}, r"estimate is \(3,\), expected \(4,\)"),
        ({"estimate": 2.0}, r"estimate is \(\), expected \(4,\)"),
    ],
)
@pytest.mark.parametrize("due", [0, 3])
def test_outputs_of_other_shapes_are_refused(given, words, due, scenario):
    with Master(scenario, Reporting(due, **given)) as master:
        kept = Keep(master)
        with pytest.raises(LawError, match=words):
            master.run([kept])
    assert len(kept.rows) <= 2 * due


def test_a_memory_that_replaces_a_laws_own_is_its_state_from_then_on():
    scenario = load_scenario("docking", SHORT)
    first, second = law_of(scenario), law_of(scenario)
    with Master(scenario, first) as master, Master(scenario, second) as other:
        for k in range(5):
            master.step(k)
            other.step(k)
        second.memory = copy.deepcopy(second.memory)
        second.memory.estimate[:] += 1.0
        first.memory.estimate[:] += 1.0
        for k in range(5, 12):
            master.step(k)
            other.step(k)
        np.testing.assert_array_equal(master.row, other.row)


def test_thruster_output_requires_thruster_actuation(scenario, tmp_path):
    law = FunctionLaw(lambda *_: [1.0] * 8, output="thrusters")
    with pytest.raises(ScenarioError, match=r"actuation.through is 'wrench', expected 'thrusters': law .*<lambda>"):
        run_scenario(scenario, tmp_path / "run", law=law)
    through = load_scenario("paper", [*SHORT, "actuation.through=thrusters"])
    run_scenario(through, tmp_path / "run", report=False, law=law)
    assert (load_record(tmp_path / "run")["thrust[8]"] == 1.0).all()
