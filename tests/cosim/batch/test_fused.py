"""Flights without a record equal those of the master bit for bit, and their outcomes its summaries."""

import numpy as np
import pytest

from cosim.batch.fused import FusedFlyer
from cosim.batch.outcome import OUTCOME
from cosim.batch.variation import Variation
from cosim.errors import RunError
from cosim.results.record import load_record
from cosim.results.recorder import Recorder
from cosim.results.summary import summarize
from cosim.scenario.scenario import load_scenario
from cosim.simulation.master import Master
from tests.cosim.simulation.keep import kept_rows

CLOSED = 'arbiter.engine="closed"'
BRISK = [CLOSED, "time.duration=12.0", "time.step=0.01", "time.control=0.02", "time.arbiter=0.01"]


def scenario_of(law, *more):
    return load_scenario("paper", [CLOSED, f"law.name={law}", *more])


def assert_same_flight(scenario):
    kept = kept_rows(scenario)
    with FusedFlyer(Variation(scenario, [])) as flyer:
        _, trace = flyer.fly_one(scenario, trace=True)
    assert_same_signals(trace, kept, scenario)


def assert_same_signals(trace, kept, scenario):
    """Compare all signals bit for bit."""
    for name in trace.units:
        if not name.startswith("actuator.wrench."):  # a record has none
            np.testing.assert_array_equal(trace[name], kept[name][:-1][:: scenario.control_every], name)
    inputs = "wrench.X" if scenario.actuation.through == "wrench" else "thrust[1]"
    assert np.abs(trace[inputs]).max() > 1.0


@pytest.mark.medium
def test_short_run_of_the_papers_law_equals_the_master_bit_for_bit():
    assert_same_flight(scenario_of("ismail_dunnigan", *BRISK, "limit.force=150.0", "limit.time_constant=0.1"))


NOISY = [
    "sensing.position_noise=0.05", "sensing.velocity_noise=0.02", "sensing.seed=3", "sensing.dead_from=3.0",
    "sensing.dead_for=1.0",
]  # fmt: skip


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("frozen", ["true", "false"])
def test_noise_and_sensor_gaps_equal_the_master(frozen):
    # the paper's law commands NaN without measurements: it gets the last values here, or is not used
    law = "ismail_dunnigan" if frozen == "true" else "pd"
    gap = [] if frozen == "true" else ["sensing.dead_for=0.0"]
    assert_same_flight(scenario_of(law, *BRISK, *NOISY, f"sensing.frozen={frozen}", "limit.force=150.0", *gap))


@pytest.mark.medium
def test_runs_on_sensors_equal_the_master():
    """With noise, delays, lost samples and outliers of the data sheets, and two outages."""
    outages = "outages=[{sensor='dvl', time=3.0, duration=1.5}, {sensor='usbl', time=2.015, duration=9.0}]"
    sensors = ["sensing.through=sensors", "sensing.seed=4", outages, "time.step=0.005", "time.control=0.02"]
    assert_same_flight(scenario_of("pd", *BRISK, *sensors, "limit.force=150.0"))


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize("told", ["true", "false"])
@pytest.mark.parametrize(
    "failures",
    [
        "failures=[{thruster=3, time=2.0}, {thruster=6, time=4.005}]",
        "failures=[{thruster=3, time=2.0, effectiveness=0.3}, {thruster=6, time=4.005, stuck=true}]",
    ],
)
def test_thruster_failures_equal_the_master(told, failures):
    given = [*BRISK, "actuation.through=thrusters", failures, f"report_failures={told}"]
    assert_same_flight(load_scenario("paper", [*given, "law.name=pd"]))


SHIPPED = ("dense-field", "depth-transit", "docking", "moving-obstacle", "pipe-inspection", "paper-limited")


@pytest.mark.parametrize(
    "name", [SHIPPED[3], *(pytest.param(n, marks=pytest.mark.slow) for n in SHIPPED if n != SHIPPED[3])]
)
def test_outcome_equals_the_summary_of_a_recorded_run(name, tmp_path):
    scenario = load_scenario(name, [CLOSED, "time.duration=20.0"])
    with Master(scenario) as master:
        recorder = Recorder(tmp_path, master.signals.columns)
        master.run([recorder])
        recorder.close()
    summary = summarize(scenario, load_record(tmp_path), "completed", None)
    with FusedFlyer(Variation(scenario, [])) as flyer:
        outcome, _ = flyer.fly_one(scenario)

    def same(field, expected):
        expected = np.nan if expected is None else expected
        assert outcome[field] == pytest.approx(expected, rel=1e-9, abs=1e-12, nan_ok=True), field

    for field in ("reached", "reach_time", "settled", "settle_time", "closest_to_goal", "effort", "max_force"):
        same(field, summary[field])
    same("max_speed", summary["max_speed"])
    hard = [summary["min_clearance"][r] for r in summary["hard"] if summary["clearance_unit"][r] == "m"]
    same("min_clearance", min(hard, default=np.inf))
    assert outcome["violated"] == bool(summary["hard_violated"])
    for i, axis in enumerate("xyz"):
        same(f"final_{axis}", summary["final_position"][i])
    for i in range(4):
        same(f"phi{i + 1}", summary["estimate_final"][i])
    assert np.isnan(outcome["stopped_at"])


def test_batch_rows_equal_single_rows_and_rejected_rows_are_named():
    scenario = scenario_of("ismail_dunnigan", *BRISK, "limit.force=150.0")
    variation = Variation(scenario, ["initial.position.1", "plant.parameters.mass"])
    mass = variation.number("plant.parameters.mass")
    values = np.array([[0.0, mass], [0.3, 1e9], [0.3, -1.0], [0.3, 1.1 * mass], [np.nan, mass]])
    with FusedFlyer(variation) as flyer:
        flown = flyer.fly(values, np.arange(5))
        alone = flyer.fly(values[3:4], np.array([3]))
    assert sorted(flown.refused) == [1, 2, 4] and "mass" in flown.refused[2] and "position" in flown.refused[4]
    assert flown.outcomes[3].tobytes() == alone.outcomes[0].tobytes() != flown.outcomes[0].tobytes()
    assert np.isnan(flown.outcomes[2]["effort"]) and not flown.outcomes[2]["reached"]
    assert flown.outcomes.dtype == OUTCOME


def test_plant_step_error_stops_the_run():
    given = [
        *BRISK,
        "plant.substep=0.01",
        "plant.parameters.quadratic_damping[1]=1e9",
        "initial.velocity=[1,0,0,0,0,0]",
    ]
    scenario = scenario_of("ismail_dunnigan", *given)
    with FusedFlyer(Variation(scenario, [])) as flyer:
        (outcome,) = flyer.fly(np.zeros((1, 0)), np.zeros(1, int)).outcomes
    assert outcome["stopped_at"] == 0.0 and not outcome["reached"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ('arbiter.engine="grid"', "arbiter.engine is 'grid', expected 'closed' .*--set arbiter.engine=closed"),
        ("plant.fmi=2", "plant.fmi is 2, expected 3"),
        ('master.order="jacobi"', "master.order is 'jacobi'"),
        ("commands.enabled=true", "commands.enabled is True"),
    ],
)
def test_unsupported_scenarios_are_rejected(change, words):
    with pytest.raises(RunError, match=words):
        FusedFlyer(Variation(load_scenario("paper", [CLOSED, change]), []))


def test_fmi_version_cannot_vary_between_rows():
    with pytest.raises(RunError, match=r"plant\.fmi varies, expected 3"):
        FusedFlyer(Variation(load_scenario("paper", [CLOSED]), ["plant.fmi"]))
