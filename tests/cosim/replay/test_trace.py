"""The rows of a page are rows of the record, few, and those that tell the story."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cosim.replay.activity import active_regions, is_resting
from cosim.replay.sampling import sampled_rows
from cosim.replay.trace import nan_to_none, trace_of
from cosim.replay.view_columns import ViewColumns
from cosim.results.record import Rows
from cosim.results.run_result import load_run
from cosim.simulation.signals import Column
from fuzzy_arbiter import Arbiter
from tests.cosim.replay.decoding import active_of


def test_trace_has_the_records_signals_with_their_units(docking):
    signals = {signal["name"]: signal["unit"] for signal in trace_of(docking).header["signals"]}
    added = {"active", *(f"rule.R{i}" for i in range(1, 9))}
    assert {name: unit for name, unit in signals.items() if name not in added}.items() <= docking.record.units.items()
    assert added < signals.keys()


def test_first_last_and_extreme_rows_are_kept(docking):
    trace, record = trace_of(docking), docking.record
    assert trace.steps[0] == 0 and trace.steps[-1] == len(record["time"]) - 1
    assert (np.diff(trace.steps) > 0).all()
    least = np.min([record[f"{r.region.name}.clearance"] for r in docking.scenario.regions], axis=0)
    force = np.linalg.norm(record.stack([f"command.{axis}" for axis in "XYZ"]), axis=1)
    for signal in (least, force, record["goal.clearance"]):
        assert {int(np.argmin(signal)), int(np.argmax(signal))} <= set(trace.steps.tolist())


@given(st.integers(1, 3000), st.integers(1, 400), st.data())
def test_sampling_keeps_its_budget_and_all_spikes(n, columns, data):
    time = np.arange(n) * 1.0
    telling = np.zeros((n, 2))
    spike = data.draw(st.integers(0, n - 1))
    telling[spike, 1] = -1.0
    moment = data.draw(st.integers(0, n - 1))
    rows = Rows([Column("time", "s", "Time")], {"time": time})
    telling = np.array_split(telling.T, data.draw(st.integers(1, n)), axis=1)
    steps = sampled_rows(rows, columns, telling, 2, np.array([moment]))
    assert steps[0] == 0 and steps[-1] == n - 1 and (np.diff(steps) > 0).all()
    assert {spike, moment, max(moment - 1, 0)} <= set(steps.tolist())
    assert len(steps) <= 400_000 / (8 * columns) + 150_000 * n / 60 / (8 * columns) + 402


@pytest.mark.parametrize(("run", "active"), [("docking", {0.0, 1.0, 2.0}), ("paper", {0.0, 1.0, 2.0, 3.0})])
def test_active_region_matches_row_by_row_evaluation(run, active, request):
    trace = trace_of(request.getfixturevalue(run))
    names = [signal["name"] for signal in trace.header["signals"]]
    columns = {name: column.tolist() for name, column in zip(names, trace.rows.T, strict=True)}
    expected = [active_of(trace.header, columns, row) for row in range(len(trace.rows))]
    assert columns["active"] == expected
    assert set(columns["active"]) >= active


def test_no_region_is_active_without_membership_or_pose():
    nan, zero = np.nan, np.zeros((1, 3))
    one, moving = np.array([[1.0, 0.0, 0.0]]), np.array([False])
    assert active_regions([0], zero, zero, np.array([[-1.0]]), moving).tolist() == [0.0]
    assert active_regions([], one, one, np.empty((1, 0)), moving).tolist() == [0.0]
    assert active_regions([2], one, one, np.array([[-1.0]]), moving).tolist() == [0.0]
    assert active_regions([0, 0], one, one, np.array([[nan, 3.0]]), moving).tolist() == [2.0]
    assert active_regions([0], one, one, np.array([[nan]]), moving).tolist() == [0.0]
    assert active_regions([0], one * nan, one * nan, np.array([[1.0]]), moving).tolist() == [0.0]


@pytest.mark.parametrize(
    ("weight", "clearance", "goal", "speed", "active"),
    [
        (0.05, 0.2, 0.0, 0.0199, 0.0),
        (0.05, 0.2, 0.0, 0.0201, 1.0),
        (0.05, 0.2, -1e-9, 0.0, 1.0),
        (0.05, 0.2, np.nan, 0.0, 1.0),
        (0.05, 0.2, 0.1, np.nan, 1.0),
        (0.05, -0.2, 0.1, 0.0, 1.0),
        (0.5, 0.2, 0.1, 0.0, 1.0),
    ],
)
def test_at_rest_a_region_is_active_at_half_weight_or_violation(weight, clearance, goal, speed, active):
    resting = is_resting(np.array([goal]), np.array([[0.0, speed, 0.0]]))
    asked, weights = np.array([[0.3, 0.0, 0.0]]), np.array([[weight, 0.0, 0.0]])
    assert active_regions([0], asked, weights, np.array([[clearance]]), resting).tolist() == [active]


def test_rule_strengths_are_minima_and_maxima_of_degrees(docking):
    view_columns = ViewColumns(docking.scenario, docking.record.columns)
    names = [docking.record.columns[i].name for i in view_columns.picked]
    samples = np.random.default_rng(7).uniform(size=(50, 3))
    samples[:4] = [[0, 0, 0], [1, 1, 1], [0, 1, 1], [0, 0, 1]]
    rows = np.zeros((50, len(names)))
    rows[:, [names.index(f"membership.{name}") for name in docking.scenario.criterion_names]] = samples
    strengths = view_columns.compute_rows(rows)[:, -8:]
    arbiter = Arbiter(engine="closed")
    for (o, s, d), got in zip(samples.tolist(), strengths.tolist(), strict=True):
        by_hand = [o, 1 - o, o, 1 - s, min(1 - o, s), max(o, s), 1 - d, min(1 - o, 1 - s, d)]
        assert got == pytest.approx(by_hand, abs=1e-15)
        assert got == pytest.approx([rule.strength for rule in arbiter.explain((o, s, d)).rules], abs=1e-15)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("paper", ["law.name=antonelli"]),
        ("paper", ["law.name=pd", "time.duration=0.5"]),
        ("paper", ["intersection=[]", "regions=[]"]),
        ("paper", ["goal.velocity=[0.1,0,0]"]),
        ("harbour", ["time.duration=2"]),
        ("sitl", ["time.duration=1"]),
    ],
)
def test_runs_of_all_kinds_have_a_trace(name, overrides, shipped_run):
    duration = [] if any("duration" in o for o in overrides) else ["time.duration=0.3"]
    run = load_run(shipped_run(name, *overrides, *duration).folder)
    trace = trace_of(run)
    assert len(trace.header["regions"]) == len(run.scenario.regions) + 1
    assert trace.rows.shape == (len(trace.steps), len(trace.header["signals"]))
    assert trace.header["law"] == run.scenario.law.name
    assert trace.header["events"][-1]["text"] == "End of the run"


def test_nan_and_infinity_become_none():
    mixed = {"a": (1.0, float("nan")), "b": [float("-inf"), {"c": True}], "d": "nan", "e": None, "f": 7}
    assert nan_to_none(mixed) == {"a": [1.0, None], "b": [None, {"c": True}], "d": "nan", "e": None, "f": 7}


@pytest.mark.medium
def test_trace_uses_the_scenario_as_flown(docking):
    slower = dataclasses.replace(docking.scenario, table=docking.scenario.table | {"title": "elsewhere"})
    assert trace_of(dataclasses.replace(docking, scenario=slower)).header["title"] == "elsewhere"


@pytest.mark.medium
def test_papers_overlap_instants_are_in_the_trace(paper):
    """The overlap of the paper's regions lasts 48 ms of 60 s: it is in the page to the step."""
    trace = trace_of(paper)
    first, last = paper.summary["intersection_windows"][0]
    time = [signal["name"] for signal in trace.header["signals"]].index("time")
    assert {first, last} <= set(trace.rows[:, time].tolist())
