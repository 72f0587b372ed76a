"""What happened, at the times at which it did."""

import dataclasses
import math

import numpy as np
import pytest

from cosim.replay.command_words import command_events, command_words
from cosim.replay.events import events_of
from cosim.results.record import Rows
from cosim.simulation.commands import commands as cmd
from cosim.simulation.signals import Column


def rows_of(names, time, **signals):
    """Return a record made of given signals, the others zero."""
    given = {"time": np.array(time), **{k.replace("__", "."): np.array(v) for k, v in signals.items()}}
    zero = np.zeros(len(time))
    return Rows([Column(name, "", "") for name in names], {name: given.get(name, zero) for name in names})


def made(paper, time, status="completed", failures=(), **signals):
    scenario = dataclasses.replace(paper.scenario, failures=failures)
    for name in ("SR1", "SR2", "SR3"):
        signals.setdefault(f"{name}__clearance", np.ones(len(time)))
    summary = paper.summary | {"status": status}
    record = rows_of(
        [*paper.record.units, *(k.replace("__", ".") for k in signals if k.startswith("law"))], time, **signals
    )
    return dataclasses.replace(paper, scenario=scenario, record=record, summary=summary)


def told(run, kind, log=()):
    return [(event.time, event.text) for event in events_of(run, log) if event.kind == kind]


@pytest.mark.medium
def test_events_of_the_papers_run_are_ordered(paper):
    events = events_of(paper, ())
    assert [event.time for event in events] == sorted(event.time for event in events)
    assert len(events) < 40
    time, record = paper.record["time"], paper.record
    assert next(t for t, _ in told(paper, "goal")) == paper.summary["reach_time"]
    assert [t for t, _ in told(paper, "goal")][-1] == paper.summary["settle_time"]
    first = int(np.argmax(record["SR1.clearance"] < 0.0))
    last = first + int(np.argmax(record["SR1.clearance"][first:] >= 0.0))
    depth = -record["SR1.clearance"].min()
    assert (time[first], f"Violates SR1 until {time[last]:.3f} s, by up to {depth:.3f} m") in told(paper, "violation")
    assert told(paper, "active")[1] == (0.169, "Gives way to SR1 (obstacle)")
    assert (events[-1].time, events[-1].kind, events[-1].text) == (time[-1], "end", "End of the run")


def test_goal_entry_and_exit_are_detected_across_gaps(paper):
    inside = [1.0, -1.0, np.nan, 1.0, np.nan, 1.0, -1.0, np.nan]
    run = made(paper, np.arange(8) * 0.5, goal__clearance=inside)
    assert told(run, "goal") == [
        (0.0, "Starts in the goal region"),
        (0.5, "Leaves the goal region"),
        (1.5, "Enters the goal region"),
        (3.0, "Leaves the goal region"),
    ]


def test_violation_lasting_to_the_end_is_marked(paper):
    run = made(paper, [0.0, 1.0, 2.0, 3.0], SR3__clearance=[1.0, -0.25, -0.5, -0.125])
    assert told(run, "violation") == [(1.0, "Violates SR3 (soft) to the end, by up to 0.500 m")]


@pytest.mark.slow
def test_chatter_is_summarized(paper):
    n = 20_000
    odd = np.arange(n) % 2
    signals = {f"{name}__clearance": odd - 0.5 for name in ("SR1", "SR2", "SR3", "goal")}
    run = made(
        paper, np.arange(n) * 0.01, **signals, membership__obstacle=odd * 1.0, weight__obstacle=odd * 1.0,
        wrench_saturated=odd * 1.0,
    )  # fmt: skip
    log = [(k, cmd.ChangeSetting("arbiter.ramp", 0.1 + k)) for k in range(0, n, 2)]
    events = events_of(run, log)
    assert len(events) <= 60
    assert told(run, "saturation")[0][0] == 0.01
    assert told(run, "violation")[0][0] == 0.0
    assert told(run, "active") == [(run.record["time"][-1], "Gives way to SR1 (obstacle)")]


def test_brief_return_is_no_event_but_brief_transition_is(paper):
    time = np.arange(0.0, 4.0, 0.05)
    who = np.zeros(len(time), int)
    who[20:40], who[25], who[40], who[41:] = 1, 0, 2, 3  # SR1, for a step the goal, SR1, for a step SR2, SR3
    weights = {f"weight__{name}": (who == i + 1) * 1.0 for i, name in enumerate(("obstacle", "shape", "depth"))}
    members = {name.replace("weight", "membership"): values for name, values in weights.items()}
    run = made(paper, time, **weights, **members)
    assert told(run, "active") == [
        (1.0, "Gives way to SR1 (obstacle)"),
        (2.0, "Gives way to SR2 (shape)"),
        (time[41], "Gives way to SR3 (depth)"),
    ]


def test_failures_are_listed_if_the_run_reached_them(paper):
    from cosim.scenario.tables import Failure

    failed = Failure(3, 1.5), Failure(1, 2.5), Failure(2, 1.6, effectiveness=0.4), Failure(4, 1.7, stuck=True)
    run = made(paper, [0.0, 1.0, 2.0], failures=failed)
    assert told(run, "failure") == [
        (1.5, "Thruster 3 fails"),
        (1.6, "Thruster 2 keeps 40% of its force"),
        (1.7, "Thruster 4 gets stuck"),
    ]


def test_rejected_samples_close_to_each_other_are_one_event(paper):
    """From 2 s to 5 s, with a gap of 0.5 s; a single one at 8 s is none."""
    time = np.arange(100) / 10.0
    rejected = ((time >= 2.0) & (time < 3.0)) | ((time >= 3.5) & (time < 5.0)) | (time == 8.0)
    run = made(paper, time, law__rejected=np.cumsum(rejected) / np.arange(1, 101))
    assert told(run, "failure") == [(2.0, "The law rejects samples of position or velocity until 5.000 s")]


@pytest.mark.parametrize(
    ("status", "text"),
    [
        ("interrupted", "The run was interrupted"),
        ("killed", "The run was killed: its record ends here"),
        ("reset", "The run was reset"),
        ("failed: t = 1", "The run failed: t = 1"),
    ],
)
def test_end_event_states_the_status(paper, status, text):
    assert told(made(paper, [0.0, 1.0], status=status), "end") == [(1.0, text)]


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (cmd.Arm(True), "Armed"),
        (cmd.Arm(False), "Disarmed"),
        (cmd.SetMode("hold"), "Holds its place"),
        (cmd.SetTarget((7.0, 0.0, 4.5)), "Target at (7, 0, 4.5) m"),
        (cmd.SetTarget((7.0, 0.0, 4.5), 0.3), "Target at (7, 0, 4.5) m, radius 0.3 m"),
        (cmd.SetHeading(-math.pi / 2), "Heading 270°"),
        (cmd.SetDepth(2.5), "Depth 2.5 m"),
        (cmd.ManualControl((0.0,) * 6), "Sticks moved"),
        (cmd.AddObstacle(4, (1.0, 2.0, 3.0), 0.5), "Obstacle 4 at (1, 2, 3) m, radius 0.5 m"),
        (cmd.RemoveObstacle(4), "Obstacle 4 gone"),
        (cmd.ChangeSetting("law.gains.k_p1", 1500.0), "law.gains.k_p1 is 1500"),
        (cmd.SetMission((cmd.MissionItem(None),) * 3), "Mission of 3 items"),
        (cmd.SetCurrentItem(2), "Mission goes on with item 2"),
        (cmd.Reset(), "Reset"),
    ],
)
def test_every_command_has_a_description(command, words):
    assert command_words(command) == words


def test_simultaneous_commands_are_one_event():
    log = [
        (0, cmd.Arm(True)),
        (0, cmd.SetMode("hold")),
        *((k, cmd.ManualControl((0.1,) * 6)) for k in range(100, 300)),
        (900, cmd.Reset()),
    ]
    assert command_events(log, 0.01, 3) == [
        (0.0, "Commanded: Armed; Holds its place"),
        (1.0, "Commanded: Sticks moved"),
        (9.0, "Commanded: Reset"),
    ]
    many = [(0, cmd.ChangeSetting(f"key.{i}", 1.0)) for i in range(9)]
    assert command_events(many, 0.01, 3) == [(0.0, "Commanded: key.0 is 1; key.1 is 1; key.2 is 1; 6 more commands")]


def test_commands_after_the_last_row_are_omitted(paper):
    run = made(paper, [0.0, 0.001, 0.002], status="killed")
    log = [(1, cmd.Arm(True)), (3, cmd.Reset()), (900, cmd.Arm(False))]
    assert told(run, "command", log) == [(0.001, "Commanded: Armed"), (0.002, "Commanded: Reset")]
    assert events_of(run, log)[-1].kind == "end"
