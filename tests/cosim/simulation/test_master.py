"""Stepping: order, periods, actuation, and observers."""

import time
import tomllib

import numpy as np
import pytest

from controller import FunctionLaw
from controller.compiling.function import INTERPRETED
from cosim.scenario.scenario import load_scenario, validate_scenario
from cosim.simulation.master import Master
from plant_fmu import PlantError
from tests.cosim.simulation.keep import kept_rows

SHORT = ["arbiter.engine=closed", "time.duration=0.5"]


def run(name="paper-limited", *overrides):
    return kept_rows(load_scenario(name, [*SHORT, *overrides]))


def test_time_counts_steps_and_the_first_row_is_the_start_and_the_first_decision():
    kept = run()
    assert np.array_equal(kept["time"], np.arange(501) * 0.001)
    assert [kept[f"position.{a}"][0] for a in "xyz"] == [0.0, 0.0, 1.0]
    assert kept["command.X"][0] > 2e4
    assert kept["wrench.X"][0] == kept["command.X"][0]  # Gauss-Seidel: this step's measurement, this step's force
    assert np.linalg.norm([kept[f"actuation.{a}"][0] for a in "XYZ"]) == pytest.approx(108.0)


def test_a_step_is_newtons_law_from_row_to_row():
    """From rest the first millisecond gives F / (m + added mass), by the numbers of the record alone."""
    kept = run("paper-limited", "plant.parameters.r_G.z=0")  # nothing couples surge to pitch
    assert kept["velocity.u"][1] == pytest.approx(kept["actuation.X"][0] / 187.5 * 0.001, rel=1e-6)


def test_control_arbiter_and_estimate_hold_between_their_periods():
    kept = run("paper-limited", "time.control=0.010", "time.arbiter=0.050")
    commands = np.array([kept[f"command.{a}"] for a in "XZ"]).T
    changes = np.flatnonzero(np.any(np.diff(commands, axis=0) != 0.0, axis=1)) + 1
    assert np.all(changes % 10 == 0) and len(changes) > 40
    assert np.all((np.flatnonzero(np.diff(kept["estimate.phi1"])) + 1) % 10 == 0)
    assert np.all(np.flatnonzero(np.diff(kept["membership.depth"])) % 50 == 49)


@pytest.mark.parametrize("limits", ["direction", "per-thruster"])
def test_thruster_forces_realize_the_wrench(limits):
    kept = run("paper", "actuation.through=thrusters", f"actuation.limits={limits}")
    thrusts = np.array([kept[f"thrust[{i + 1}]"] for i in range(8)])[:, :-1]
    assert np.abs(thrusts).max() == pytest.approx(27.0)
    # the last row decides, but acts no more
    assert np.array_equal(thrusts, np.array([kept[f"thruster_force[{i + 1}]"] for i in range(8)])[:, :-1])
    assert not kept["wrench.X"].any()
    x, z = (kept[f"actuation.{a}"][:-1] / kept[f"command.{a}"][:-1] for a in "XZ")
    assert np.allclose(x, z, rtol=1e-9) == (limits == "direction")


def test_current_and_parameters_reach_the_plant():
    still, moving = run("paper-limited"), run("paper-limited", "plant.current=[0.0,0.5,0.0]")
    assert still["velocity.v"][-1] == 0.0 and moving["velocity.v"][-1] > 0.0
    heavy = run("paper-limited", "plant.parameters.mass=250")
    assert heavy["velocity.u"][-1] < still["velocity.u"][-1]


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("plant.parameters.mass=-5", "mass = -5 refused"),
        ("plant.parameters.r_G.z=5e3", "r_G.z = 5000 refused"),
        ("initial.position=[1e9,0,0]", "position.x"),
    ],
)
def test_fmu_rejection_is_reported(override, words):
    with pytest.raises(Exception, match=words):
        Master(load_scenario("paper", [override]))


def test_step_error_names_its_time():
    with (
        Master(load_scenario("paper", [*SHORT, "law.gains.k_p1=1e9"])) as master,
        pytest.raises(PlantError, match=r"t = 0 s: wrench"),
    ):
        master.run()


@pytest.mark.slow
def test_closed_masters_leave_no_temporary_files(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    for _ in range(20):
        with Master(load_scenario("paper", [*SHORT, "time.duration=0.005"])) as master:
            master.run()
    assert list(tmp_path.iterdir()) == []


def test_rate_paces_by_the_wall_clock():
    """No time is asserted beyond the one that was asked for."""
    with Master(load_scenario("paper-limited", [*SHORT, "time.duration=0.2"])) as master:
        master.run()  # warm
    with Master(load_scenario("paper-limited", [*SHORT, "time.duration=0.2"])) as master:
        before = time.perf_counter()
        master.run(rate=1.0)
        assert time.perf_counter() - before >= 0.2


class Blocks:
    """Observer that keeps blocks of rows."""

    def __init__(self):
        self.sizes, self.rows = [], []

    def observe(self, k, row):
        self.observe_block(k, row[None])

    def observe_block(self, first, rows):
        assert first == len(self.rows)
        self.sizes.append(len(rows))
        self.rows.extend(rows.copy())


@pytest.mark.parametrize(
    "changes",
    [[], ["sensing.position_noise=0.02"], ["sensing.position_noise=0.02", "time.control=0.1"], ["plant.fmi=2"]],
)
def test_blocks_hold_the_rows_of_single_steps(changes):
    scenario = load_scenario("paper-limited", [*SHORT, *changes])
    blocks = Blocks()
    with Master(scenario) as master:
        master.run([blocks])
        assert master.plant.time == pytest.approx(0.5)
    assert max(blocks.sizes) > 1
    np.testing.assert_array_equal(blocks.rows, kept_rows(scenario).rows)


def test_a_plant_that_python_steps_gives_the_rows_of_one_that_c_steps():
    failures = (
        "failures=[{thruster=2,time=0.1},{thruster=1,time=0.2,effectiveness=0.4},{thruster=3,time=0.3,stuck=true}]"
    )
    scenario = load_scenario("sitl", ["time.duration=0.5", failures])
    rows = kept_rows(scenario).rows
    np.testing.assert_array_equal(kept_rows(scenario.replace({"plant.fmi": 2})).rows, rows)


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize(
    "changes",
    [
        ["commands.enabled=true"],
        ["master.order=jacobi"],
        ["sensing.through=sensors", "sensing.position_noise=0", "sensing.velocity_noise=0"],
        ["failures=[{thruster=2,time=0.1}]"],
    ],
)
def test_python_runs_the_step_with_the_bits_of_c(changes, monkeypatch):
    scenario = load_scenario("docking", ["arbiter.engine=closed", "time.duration=0.2", *changes])
    compiled = kept_rows(scenario).rows
    monkeypatch.setenv(INTERPRETED, "1")
    np.testing.assert_array_equal(kept_rows(scenario).rows, compiled)


@pytest.mark.parametrize("error", [ZeroDivisionError, KeyboardInterrupt])
def test_an_error_of_a_python_law_ends_the_block_before_its_step(error):
    calls, blocks = [], Blocks()

    def law(state, *_):
        calls.append(state.position)
        if len(calls) == 300:
            raise error
        return [5.0, 0.0, 0.0, 0.0, 0.0, 0.0]

    with Master(load_scenario("paper", SHORT), FunctionLaw(law)) as master, pytest.raises(error):
        master.run([blocks])
    assert len(calls) == 300 and len(blocks.rows) == 299 and max(blocks.sizes) > 1


def test_a_region_may_be_called_law():
    table = load_scenario("docking", ["arbiter.engine=closed", "time.duration=1.0"]).toml()
    kept = kept_rows(validate_scenario(tomllib.loads(table.replace('"port wall"', '"law"')), "renamed"))
    plain = kept_rows(validate_scenario(tomllib.loads(table), "plain"))
    for other in ("law.clearance", "law.desired_speed"):
        np.testing.assert_array_equal(kept[other], plain[other.replace("law.clearance", "port wall.clearance")])
    assert kept["law.desired_speed"].any()


def test_a_law_of_a_user_gets_plain_arrays_and_the_options_of_numpy():
    seen = []

    def law(state, goal, regions, weights):
        seen.append((type(state.position), type(weights), type(goal.clearances), np.max(weights[:0], initial=5.0)))
        return np.zeros(6)

    with Master(load_scenario("paper", SHORT), FunctionLaw(law)) as master:
        master.step(0)
    assert seen == [(np.ndarray, np.ndarray, np.ndarray, 5.0)]


def test_a_failure_changes_the_parameter_of_its_thruster_alone():
    for fmi in (2, 3):
        changes = ["failures=[{thruster=1,time=0.02}]", f"plant.fmi={fmi}", "time.duration=0.05"]
        with Master(load_scenario("sitl", changes)) as master:
            for k in range(master.scenario.steps):
                if k == 1:
                    master.plant.set({"thrust_effectiveness[2]": 0.3})
                master.step(k)
            assert [master.plant[f"thrust_effectiveness[{i}]"] for i in (1, 2, 3)] == [0.0, 0.3, 1.0]


def test_an_interrupted_block_repeats_no_rows(monkeypatch):
    blocks, calls = Blocks(), []
    with Master(load_scenario("paper-limited", SHORT)) as master:
        advance = master._advance

        def interrupted(call, k, n):
            calls.append(k)
            if len(calls) == 4:
                raise KeyboardInterrupt
            advance(call, k, n)

        monkeypatch.setattr(master, "_advance", interrupted)
        with pytest.raises(KeyboardInterrupt):
            master.run([blocks])
    assert len(blocks.rows) == sum(blocks.sizes) == calls[-1]


def test_an_error_of_a_command_source_ends_the_step_before_missions():
    class Fails:
        exhausted = False

        def take(self, k):
            if k == 3:
                raise ZeroDivisionError
            return ()

    with Master(load_scenario("docking", ["commands.enabled=true", "time.duration=0.2"])) as master:
        updated, update = [], master.command_handler.update
        master.command_handler.update = lambda time, clearance: updated.append(time) or update(time, clearance)
        with pytest.raises(ZeroDivisionError):
            master.run(commands=Fails())
    assert len(updated) == 3


def test_law_and_arbiter_of_a_master_cannot_be_exchanged():
    with Master(load_scenario("paper", SHORT)) as master:
        for name in ("law", "arbiter"):
            with pytest.raises(AttributeError, match=name):
                setattr(master, name, None)
